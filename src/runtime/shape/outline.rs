//! The outline of a patch of pixels.

use glam::Vec2;

/// Corners of the edge of the patch that the pixel `from` belongs to, outside of it, in their order around it; pixels' centres are whole
/// numbers, so the corners lie on halves. Straight runs have their ends only. None where the pixel is none of the patch.
/// They are put behind those that are in `corners`.
pub(super) fn outline(
    is_in: impl Fn(i64, i64) -> bool,
    (x, y): (i64, i64),
    size: (i64, i64),
    corners: &mut Vec<Vec2>,
) {
    if !is_in(x, y) {
        return;
    }
    // Up from the pixel to a place above which there is none: its upper edge is one of an outline.
    let mut top = y;
    while is_in(x, top - 1) {
        top -= 1;
    }
    // The patch lies on the right of every step, seen along it; y points down.
    let start = (x, top, 0_usize);
    let steps = [(1, 0), (0, 1), (-1, 0), (0, -1)];
    // Of the four pixels about a corner, those ahead on the left and on the right of a step.
    let ahead = [[(0, -1), (0, 0)], [(0, 0), (-1, 0)], [(-1, 0), (-1, -1)], [(-1, -1), (0, -1)]];
    let (mut cx, mut cy, mut way) = start;
    for _ in 0..4 * size.0 * size.1 {
        let (dx, dy) = steps[way];
        (cx, cy) = (cx + dx, cy + dy);
        let [left, right] = ahead[way].map(|(ox, oy)| is_in(cx + ox, cy + oy));
        let turned = match (left, right) {
            (true, true) => (way + 3) % 4,
            (false, true) => way,
            // Patches that meet at a corner only are two.
            (_, false) => (way + 1) % 4,
        };
        if turned != way {
            corners.push(Vec2::new(cx as f32 - 0.5, cy as f32 - 0.5));
        }
        way = turned;
        if (cx, cy, way) == start {
            break;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outline_goes_round_its_patch_once() {
        // An L of five pixels.
        let pixels = [(2, 1), (2, 2), (2, 3), (3, 3), (4, 3)];
        let mut found = Vec::new();
        outline(|x, y| pixels.contains(&(x, y)), (3, 3), (8, 8), &mut found);
        let area: f32 = (0..found.len())
            .map(|i| {
                let (a, b) = (found[i], found[(i + 1) % found.len()]);
                0.5 * a.perp_dot(b)
            })
            .sum();
        assert_eq!(area, 5.0, "{found:?}");
        assert_eq!(found.len(), 6);
    }
}
