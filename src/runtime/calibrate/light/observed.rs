//! What the frames show of the light: places of the untouched dome, and of the caps that a ball presses into it.

use glam::{DVec3, Vec3A};

use crate::shape::{ChannelRay, SeenCell};

/// Rows and columns of the dome's image in which places are taken.
const LINES: usize = 16;
/// Cells at least that a place is the mean of.
const MIN_CELLS: usize = 10;
/// Angle of the dome's normal with the axis beyond which nothing is used, degrees: about the outline the picture blurs, and the
/// light's tables end.
const MAX_SLOPE_DEG: f64 = 75.0;
/// By how much a cell's ratio to the light may be off the middle of its place, a part: beyond stands a speck or a dot's rim.
const MAX_SPECK: f64 = 0.1;

/// A cell of a place.
#[derive(Debug, Clone, Copy)]
pub(super) struct RestCell {
    /// Where each channel's ray meets the dome.
    pub places: [Vec3A; 3],
    pub passed: DVec3,
    pub cosine: f64,
}

/// A place of the untouched dome in the frame at rest: the mean of its cells.
#[derive(Debug, Clone)]
pub(super) struct RestPlace {
    pub cells: Vec<RestCell>,
    /// The middle of them.
    pub point_mm: DVec3,
    /// Linear light of the channels, full scale 1.
    pub level: DVec3,
}

/// A place of a cap: a cell.
#[derive(Debug, Clone, Copy)]
pub(super) struct CapPlace {
    /// Number of the press that it belongs to.
    pub press: usize,
    pub channels: [ChannelRay; 3],
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

/// All that is fitted; places of a press lie together, in the order of the presses.
#[derive(Debug, Clone, Default)]
pub(super) struct Observed {
    pub rest: Vec<RestPlace>,
    pub caps: Vec<CapPlace>,
    pub presses: Vec<SeenPress>,
    /// Deviation of a cell's level by noise, full scale 1.
    pub noise: DVec3,
}

/// Places of the dome at rest, evenly over its image.
pub(super) fn rest_places(cells: &[SeenCell]) -> Vec<RestPlace> {
    let bounds = |of: fn(&SeenCell) -> usize| {
        let (low, high) = cells.iter().map(of).fold((usize::MAX, 0), |(a, b), v| (a.min(v), b.max(v)));
        (low, (high.saturating_sub(low) + 1).div_ceil(LINES).max(1))
    };
    let ((left, wide), (top, high)) = (bounds(|cell| cell.column), bounds(|cell| cell.row));
    let mut blocks: Vec<Vec<&SeenCell>> = vec![Vec::new(); LINES * LINES];
    let lowest = MAX_SLOPE_DEG.to_radians().cos();
    for cell in cells.iter().filter(|cell| cell.is_known && cell.normal.z > lowest) {
        let block = (cell.row - top) / high * LINES + (cell.column - left) / wide;
        if let Some(block) = blocks.get_mut(block) {
            block.push(cell);
        }
    }
    blocks.iter().filter_map(|block| place_of(block)).collect()
}

fn place_of(block: &[&SeenCell]) -> Option<RestPlace> {
    // The sum of the channels: noise is small beside the part that is asked for.
    let ratio =
        |cell: &SeenCell| cell.level.element_sum() / (cell.passed * cell.still).element_sum().max(1e-12);
    let mut ratios: Vec<f64> = block.iter().map(|cell| ratio(cell)).collect();
    ratios.sort_by(f64::total_cmp);
    let middle = *ratios.get(ratios.len() / 2)?;
    let is_clean = |cell: &&&SeenCell| (ratio(cell) - middle).abs() <= MAX_SPECK * middle;
    let clean: Vec<&SeenCell> = block.iter().filter(is_clean).copied().collect();
    if clean.len() < MIN_CELLS {
        return None;
    }
    let count = clean.len() as f64;
    let cell = |cell: &&SeenCell| RestCell {
        places: cell.channels.map(|channel| channel.place),
        passed: cell.passed,
        cosine: cell.cosine,
    };
    Some(RestPlace {
        cells: clean.iter().map(cell).collect(),
        point_mm: clean.iter().map(|cell| cell.point_mm).sum::<DVec3>() / count,
        level: clean.iter().map(|cell| cell.level).sum::<DVec3>() / count,
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
