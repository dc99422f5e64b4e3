//! The numbers that lights are compared by.

use serde::Serialize;

use super::super::numbers::Percentiles;
use crate::light::{lacking, normal_error_deg, percentile_of};
use domecast_design::Design;
use domecast_sim::light::illumination::{IlluminatedPlace, Illumination, PlaceGrid};
use domecast_sim::light::separation::condition_number;

/// Places at which lights are compared: so few cost some milliseconds; percentiles are within a few percent of
/// `illuminate`'s.
pub const GRID: PlaceGrid = PlaceGrid { rings: 24, places: 36 };

/// Polar angle within which crescents are looked for, degrees.
const CRESCENT_POLAR_DEG: f64 = 75.0;

/// How good lights are, by direct light alone, from the pole to the polar angle of the search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LightScore {
    /// Error of the normal for one grey level of noise, degrees, of the places that the camera sees: its 95th percentile is
    /// what the search makes small.
    pub normal_error_deg_per_level: Percentiles,
    /// Condition number of crosstalk times light.
    pub condition_number: Percentiles,
    /// Evenness: standard deviation over mean of the three colours' sum.
    pub sum_coefficient_of_variation: Option<f64>,
    /// Share of the area within 75 degrees where a colour is below a twentieth of its median.
    pub crescent_share_to_75_deg: f64,
    /// Exposure and gain that bring the brightest place in view to `exposure.brightest_level`, or the design's own.
    pub level_per_mw_mm2: f64,
    /// Whether that is the camera's largest.
    pub is_exposure_at_limit: bool,
}

impl LightScore {
    /// Of a light on the whole dome; the exposure is `design`'s.
    pub fn of(light: &Illumination, design: &Design, polar_angle_deg: f64) -> Self {
        let exposure = &design.sections().exposure;
        let brightest = light.places.iter().filter(|place| place.image_px.is_some());
        let brightest = brightest.map(|place| brightest_level(light, place)).fold(0.0, f64::max);
        let wanted = exposure.brightest_level / brightest.max(f64::MIN_POSITIVE);
        let largest = exposure.max_level_per_mw_mm2;
        let level_per_mw_mm2 = exposure.level_per_mw_mm2.unwrap_or(wanted).min(largest);
        let inside = || light.places.iter().filter(|place| place.polar_deg <= polar_angle_deg);
        let percentiles = |values: Vec<Option<f64>>| {
            let [p5, p50, p95] = [0.05, 0.5, 0.95].map(|part| percentile_of(values.clone(), part));
            Percentiles { p5, p50, p95 }
        };
        let seen = inside().filter(|place| place.image_px.is_some());
        let errors = seen.map(|place| normal_error_deg(light, place, level_per_mw_mm2)).collect();
        let sums: Vec<f64> = inside().map(|place| place.direct_mw_mm2().iter().sum()).collect();
        let lacks = lacking(light, CRESCENT_POLAR_DEG);
        let around = light.places.iter().filter(|place| place.polar_deg <= CRESCENT_POLAR_DEG).count();
        let dark = lacks.iter().filter(|colors| colors.contains(&true)).count();
        Self {
            normal_error_deg_per_level: percentiles(errors),
            condition_number: percentiles(inside().map(|place| condition_number(&light.seen(place))).collect()),
            sum_coefficient_of_variation: coefficient_of_variation(&sums),
            crescent_share_to_75_deg: dark as f64 / around.max(1) as f64,
            level_per_mw_mm2,
            is_exposure_at_limit: exposure.level_per_mw_mm2.is_none() && wanted > largest,
        }
    }

    /// What the search makes small, degrees for each grey level; infinite where one place in twenty has no normal.
    pub fn objective(&self) -> f64 {
        self.normal_error_deg_per_level.p95.unwrap_or(f64::INFINITY)
    }
}

/// Level of the brightest channel of a place at an exposure of 1, part of full scale.
fn brightest_level(light: &Illumination, place: &IlluminatedPlace) -> f64 {
    (light.seen_levels(place, 1.0) * place.normal).max_element() / 255.0
}

/// Standard deviation over mean; `None` where all is dark.
fn coefficient_of_variation(values: &[f64]) -> Option<f64> {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
    (mean > 0.0).then(|| variance.sqrt() / mean)
}
