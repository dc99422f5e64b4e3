//! The coordinates of a search, and the places next to one.

use super::candidate::LightPlace;
use super::cma::SearchPoint;
use domecast_design::Design;

/// Places one step away along each axis.
pub fn neighbours(at: LightPlace, has_arc: bool, [step_mm, step_deg]: [f64; 2]) -> Vec<LightPlace> {
    let mut found = Vec::new();
    for sign in [1.0, -1.0] {
        let (mm, deg) = (sign * step_mm, sign * step_deg);
        found.push(LightPlace { center_radius_mm: at.center_radius_mm + mm, ..at });
        found.push(LightPlace { center_z_mm: at.center_z_mm + mm, ..at });
        found.push(LightPlace { tilt_deg: (at.tilt_deg + deg).clamp(MIN_TILT_DEG, MAX_TILT_DEG), ..at });
        // along the wall of the view and along the sheet's underside, where the best mostly lies
        found.push(LightPlace {
            center_radius_mm: at.center_radius_mm + mm,
            center_z_mm: at.center_z_mm + mm,
            ..at
        });
        found.push(LightPlace {
            center_radius_mm: at.center_radius_mm + mm,
            center_z_mm: at.center_z_mm - mm,
            ..at
        });
        if has_arc {
            found.push(LightPlace { half_arc_deg: (at.half_arc_deg + deg).max(0.0), ..at });
        }
    }
    found.into_iter().map(LightPlace::rounded).filter(|place| *place != at.rounded()).collect()
}

/// What the schema allows of `leds.tilt_deg`.
pub const MIN_TILT_DEG: f64 = 30.0;
const MAX_TILT_DEG: f64 = 90.0;
const MAX_ARC_DEG: f64 = 55.0;

/// The coordinates of a search: place over a length of the sensor, angles over some degrees, about where it begins.
pub struct Axes {
    from: [f64; 4],
    scale: [f64; 4],
    low: [f64; 4],
    high: [f64; 4],
    has_arc: bool,
}

impl Axes {
    /// About a place in a design.
    pub fn of(design: &Design, has_arc: bool, from: LightPlace) -> Self {
        let sections = design.sections();
        let rim_mm = sections.dome.shape().rim_radius_mm();
        let [x, y] = sections.platforms.outer_mm;
        let sheet_mm = design.sheet_underside_z_mm();
        Self {
            from: [from.center_radius_mm, from.center_z_mm, from.tilt_deg, from.half_arc_deg],
            scale: [0.05 * rim_mm, 0.05 * rim_mm, 8.0, 6.0],
            low: [0.3 * rim_mm, sheet_mm - 2.0 * rim_mm, MIN_TILT_DEG, 0.0],
            high: [0.5 * x.max(y), sheet_mm, MAX_TILT_DEG, MAX_ARC_DEG],
            has_arc,
        }
    }

    /// How many they are.
    pub fn count(&self) -> usize {
        if self.has_arc { 4 } else { 3 }
    }

    /// The place of a point within the bounds, and how far outside it lay.
    pub fn place(&self, point: &SearchPoint) -> (LightPlace, f64) {
        let mut outside = 0.0_f64;
        let value: [f64; 4] = std::array::from_fn(|i| {
            let wanted = self.from[i] + self.scale[i] * point.get(i).copied().unwrap_or(0.0);
            let kept = wanted.clamp(self.low[i].min(self.from[i]), self.high[i].max(self.from[i]));
            outside = outside.hypot((wanted - kept) / self.scale[i]);
            kept
        });
        let [center_radius_mm, center_z_mm, tilt_deg, half_arc_deg] = value;
        (LightPlace { center_radius_mm, center_z_mm, tilt_deg, half_arc_deg }.rounded(), outside)
    }
}
