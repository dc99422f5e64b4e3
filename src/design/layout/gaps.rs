//! Gaps between dots on the plate.

use std::collections::HashMap;

use glam::DVec2;

use super::dot::Dot;
use super::lost::{LostDot, Reason};
use super::zones::gap;

/// Chord error of the polygons between which gaps are measured, as a share of the least gap.
const POLYGON_SHARE: f64 = 0.01;

/// Drops the later of two dots of one print pass whose gap on the plate is too small.
///
/// Dots are sorted into square cells as wide as the widest reach, so that only neighbouring cells are looked
/// at and the time grows with the number of dots. The map is only asked, never walked through: its order
/// does not matter.
pub(super) fn keep_apart(dots: Vec<Result<Dot, LostDot>>, min_mm: f64) -> Vec<Result<Dot, LostDot>> {
    let widest = dots.iter().flatten().map(|dot| reach_mm(dot) * 2.0).fold(0.0, f64::max);
    let cell_mm = widest + min_mm;
    if cell_mm <= 0.0 {
        return dots;
    }
    let tolerance = (POLYGON_SHARE * min_mm).max(1e-6 * cell_mm);
    let mut cells: HashMap<(usize, i64, i64), Vec<Kept>> = HashMap::new();
    dots.into_iter()
        .map(|result| {
            let dot = result?;
            let center = 0.5 * (dot.plate_outline.bounds().0 + dot.plate_outline.bounds().1);
            let (i, j) = ((center.x / cell_mm).floor() as i64, (center.y / cell_mm).floor() as i64);
            let reach = reach_mm(&dot);
            let near = (-1..=1).flat_map(|di| (-1..=1).map(move |dj| (di, dj)));
            let mut polygon = Vec::new();
            for (di, dj) in near {
                for other in cells.get(&(dot.pass, i + di, j + dj)).into_iter().flatten() {
                    if center.distance(other.center) - reach - other.reach >= min_mm {
                        continue;
                    }
                    if polygon.is_empty() {
                        polygon = dot.plate_outline.polygon_within(tolerance);
                    }
                    let gap_mm = gap(&polygon, &other.outline.polygon_within(tolerance));
                    // The chords cut corners on both sides.
                    if gap_mm + 1e-9 * cell_mm < min_mm {
                        let reason = Reason::TooClose { gap_mm, min_mm };
                        let (even_px, image_px) = (dot.even_px, Some(dot.image_px));
                        return Err(LostDot { id: 0, even_px, image_px, reason });
                    }
                }
            }
            let kept = Kept { center, reach, outline: dot.plate_outline.clone() };
            cells.entry((dot.pass, i, j)).or_default().push(kept);
            Ok(dot)
        })
        .collect()
}

struct Kept {
    center: DVec2,
    reach: f64,
    outline: super::outline::Outline,
}

/// Radius of the circle around the middle of the box that holds the outline, mm.
fn reach_mm(dot: &Dot) -> f64 {
    let (low, high) = dot.plate_outline.bounds();
    0.5 * low.distance(high)
}
