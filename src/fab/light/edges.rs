//! Edges of shadows on the dome: where the light changes so fast that a dot there is measured off its place.

use glam::DVec2;
use serde::Serialize;

use super::rest::{STEP_PX, luma};
use domecast_design::Design;
use domecast_sim::light::RestLight;

/// Levels round a dot that differ by more than this part of their mean lie on an edge: under the lights of a dome of 20 mm
/// `track` puts dots beyond it 0.15 to 0.75 px off, those below it 0.03 px.
const MAX_CONTRAST: f64 = 0.35;
/// Distance from a dot's middle at which its surroundings are looked at, in its radii: what its level is measured against.
const AROUND: f64 = 1.35;
/// Directions that are looked at, and how many of them must lie on the dome.
const DIRECTIONS: u32 = 16;
const MIN_SEEN: usize = 12;

/// The dots on edges of shadows, and how far out there are none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ShadowEdges {
    /// Number of dots on an edge.
    pub dots: usize,
    /// Whether the place of the dot that is left out as the key lies on an edge: then the gap is not seen.
    pub is_key_hidden: bool,
    /// Polar angle, about the sphere's centre, within which no place of the dome in view lies on an edge, degrees; `None`
    /// where none does at all.
    pub from_polar_deg: Option<f64>,
}

/// Grey levels of the dome at the places that were looked at, by column and row.
struct Grid {
    across: usize,
    levels: Vec<f64>,
}

impl Grid {
    fn of(design: &Design, light: &RestLight) -> Self {
        let lens = design.optics().lens().spec();
        let [across, down] = [lens.width, lens.height].map(|side| side.div_ceil(STEP_PX) as usize);
        let mut grid = Self { across, levels: vec![f64::NAN; across * down] };
        for place in &light.dome {
            if let Some(level) = grid.index(place.image_px).and_then(|index| grid.levels.get_mut(index)) {
                *level = luma(place.level);
            }
        }
        grid
    }

    fn index(&self, pixel: DVec2) -> Option<usize> {
        let cell = (pixel / f64::from(STEP_PX)).round();
        let is_inside = cell.cmpge(DVec2::ZERO).all() && cell.x < self.across as f64;
        is_inside.then(|| cell.y as usize * self.across + cell.x as usize)
    }

    /// By what part of their mean the levels round a place differ; `None` where too little of it is seen.
    fn contrast(&self, at_px: DVec2, reach_px: f64) -> Option<f64> {
        let (mut low, mut high, mut sum, mut seen) = (f64::INFINITY, 0.0_f64, 0.0, 0);
        for k in 0..DIRECTIONS {
            let way = DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / f64::from(DIRECTIONS));
            let level = self.index(at_px + reach_px * way).and_then(|index| self.levels.get(index).copied());
            if let Some(level) = level.filter(|level| level.is_finite()) {
                (low, high) = (low.min(level), high.max(level));
                sum += level;
                seen += 1;
            }
        }
        (seen >= MIN_SEEN && sum > 0.0).then(|| (high - low) * seen as f64 / sum)
    }
}

impl ShadowEdges {
    /// Of a design whose light is known.
    pub(super) fn of(design: &Design, light: &RestLight) -> Option<Self> {
        let layout = design.layout().ok()?;
        let grid = Grid::of(design, light);
        let mut wide: Vec<f64> =
            layout.dots.iter().map(|dot| dot.image_outline.equivalent_diameter()).collect();
        wide.sort_unstable_by(f64::total_cmp);
        // Closer than the places are apart nothing is seen of an edge.
        let reach_px = (0.5 * AROUND * wide.get(wide.len() / 2)?).max(f64::from(STEP_PX));
        let is_edge = |at_px: DVec2| grid.contrast(at_px, reach_px).is_some_and(|part| part > MAX_CONTRAST);
        let dots = layout.dots.iter().filter(|dot| is_edge(dot.image_px)).count();
        let is_key_hidden = layout.key.as_ref().is_some_and(|key| is_edge(key.dot.image_px));
        let center_z_mm = design.optics().dome().center_z_mm();
        let on_edge = light.dome.iter().filter(|place| is_edge(place.image_px));
        let polar_deg = on_edge.map(|place| {
            let at = place.surface_mm;
            at.truncate().length().atan2(at.z - center_z_mm).to_degrees()
        });
        Some(Self { dots, is_key_hidden, from_polar_deg: polar_deg.min_by(f64::total_cmp) })
    }
}
