//! What the frames show of the light: places of the untouched dome, and of the caps that a ball presses into it.

use glam::DVec3;

use crate::shape::SeenCell;

/// A place of the untouched dome in the frame at rest.
#[derive(Debug, Clone, Copy)]
pub(super) struct StillPlace {
    pub point_mm: DVec3,
    pub normal: DVec3,
    /// Linear light of the channels, full scale 1.
    pub level: DVec3,
    pub passed: DVec3,
    pub cosine: f64,
}

/// A place of a cap.
#[derive(Debug, Clone, Copy)]
pub(super) struct CapPlace {
    /// Number of the press that it belongs to.
    pub press: usize,
    /// Where its ray meets the undeformed dome, and the normal there.
    pub point_mm: DVec3,
    pub normal: DVec3,
    pub ray: DVec3,
    /// Linear light, at the exposure of the frame at rest.
    pub level: DVec3,
    /// What the untouched dome has there, without stray light.
    pub at_rest: DVec3,
}

/// A press as it was seen.
#[derive(Debug, Clone)]
pub(super) struct SeenPress {
    /// Number of its frame.
    pub frame: usize,
    /// First estimate of the ball's centre, mm.
    pub center_mm: DVec3,
    /// Deviation of that along the dome's normal, mm.
    pub depth_sd_mm: f64,
    pub gain: [f64; 3],
}

/// All that is fitted.
#[derive(Debug, Clone, Default)]
pub(super) struct Observed {
    pub still: Vec<StillPlace>,
    pub caps: Vec<CapPlace>,
    pub presses: Vec<SeenPress>,
    /// Deviation of a place's level by noise, full scale 1.
    pub noise: f64,
    /// By how much levels may be off beside noise, a part of themselves and the brightest channel beside them: places at rest,
    /// caps.
    pub parts: [f64; 2],
}

/// Rows and columns of the dome's image in which places are taken.
const LINES: usize = 26;

/// Places of the dome at rest, evenly over its image: each the mean over the bare cells about it.
pub(super) fn still_places(cells: &[SeenCell], is_taken: impl Fn(&SeenCell) -> bool) -> Vec<StillPlace> {
    let bounds = |of: fn(&SeenCell) -> usize| {
        let (low, high) = cells.iter().map(of).fold((usize::MAX, 0), |(a, b), v| (a.min(v), b.max(v)));
        (low, (high.saturating_sub(low) + 1).div_ceil(LINES).max(1))
    };
    let ((left, wide), (top, high)) = (bounds(|cell| cell.column), bounds(|cell| cell.row));
    let mut blocks: Vec<Vec<&SeenCell>> = vec![Vec::new(); LINES * LINES];
    for cell in cells.iter().filter(|cell| is_taken(cell)) {
        let block = (cell.row - top) / high * LINES + (cell.column - left) / wide;
        if let Some(block) = blocks.get_mut(block) {
            block.push(cell);
        }
    }
    blocks.iter().filter_map(|block| mean_place(block)).collect()
}

/// Cells at least that a place is the mean of.
const MIN_CELLS: usize = 4;

/// The cell nearest to the middle of some, with the mean of their ratio to the light that is expected there.
fn mean_place(block: &[&SeenCell]) -> Option<StillPlace> {
    if block.len() < MIN_CELLS {
        return None;
    }
    let middle = block.iter().map(|cell| cell.point_mm).sum::<DVec3>() / block.len() as f64;
    let away = |cell: &SeenCell| (cell.point_mm - middle).length_squared();
    let own = block.iter().min_by(|a, b| away(a).total_cmp(&away(b)))?;
    let expected = |cell: &SeenCell| cell.passed * cell.still;
    let seen: DVec3 = block.iter().map(|cell| cell.level).sum();
    let sum: DVec3 = block.iter().map(|cell| expected(cell)).sum();
    let level = seen / sum.max(DVec3::splat(1e-12)) * expected(own);
    level.is_finite().then_some(StillPlace {
        point_mm: own.point_mm,
        normal: own.normal,
        level,
        passed: own.passed,
        cosine: own.cosine,
    })
}

/// Where a ray from a place of the undeformed dome meets the ball, first: mm along it.
pub(super) fn depth_on_ball(point_mm: DVec3, ray: DVec3, center_mm: DVec3, radius_mm: f64) -> Option<f64> {
    let from = point_mm - center_mm;
    let along = from.dot(ray);
    let root = along * along - from.length_squared() + radius_mm * radius_mm;
    (root > 0.0).then(|| -along - root.sqrt())
}

/// Radius of the touch of a ball on the dome by Hertz's law, mm: `a^2 = d / (1/R + 1/R_dome)` for an approach d.
pub(super) fn touch_radius_mm(center_mm: DVec3, radius_mm: f64, dome_center_mm: DVec3, dome_mm: f64) -> f64 {
    let approach = radius_mm + dome_mm - center_mm.distance(dome_center_mm);
    (approach.max(0.0) / (1.0 / radius_mm + 1.0 / dome_mm)).sqrt()
}
