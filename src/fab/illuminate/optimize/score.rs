//! The numbers that lights are compared by.

use serde::Serialize;

use super::super::measure::{coefficient_of_variation, percentiles};
use super::super::numbers::Percentiles;
use crate::light::{lacking, normal_error_deg};
use domecast_design::sections::ExposureSection;
use domecast_sim::Scene;
use domecast_sim::light::direct::EmitterRule;
use domecast_sim::light::illumination::{IlluminatedPlace, Illumination, PlaceGrid};
use domecast_sim::light::separation::condition_number;
use domecast_sim::light::tables::Ways;

/// Places at which the normals' error is compared, as far as it counts, and coarser ones over the whole dome for exposure and
/// crescents: so few cost some hundredths of a second.
const FINE: PlaceGrid = PlaceGrid { rings: 20, places: 30 };
const COARSE: PlaceGrid = PlaceGrid { rings: 12, places: 24 };
/// Places across an emitter, each way: lights are compared to a part in a thousand.
const EMITTER_PLACES: usize = 2;

/// The light as far as it is compared.
#[derive(Debug, Clone)]
pub struct ComparedLight {
    fine: Illumination,
    coarse: Illumination,
}

impl ComparedLight {
    /// Along the ways of a scene, to a polar angle; `None` where the scene is not lit by lights.
    pub fn along(scene: &Scene, ways: &Ways, polar_angle_deg: f64) -> Option<Self> {
        let rule = EmitterRule::with_places(EMITTER_PLACES);
        let light = |grid, polar_deg| Illumination::along(scene, ways, grid, polar_deg, &rule);
        Some(Self { fine: light(FINE, polar_angle_deg)?, coarse: light(COARSE, 180.0)? })
    }
}

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
    /// Of a light; the exposure is as `exposure` says.
    pub fn of(light: &ComparedLight, exposure: &ExposureSection) -> Self {
        let ComparedLight { fine: light, coarse } = light;
        let brightest = coarse.places.iter().chain(&light.places).filter(|place| place.image_px.is_some());
        let brightest = brightest.map(|place| brightest_level(light, place)).fold(0.0, f64::max);
        let wanted = exposure.brightest_level / brightest.max(f64::MIN_POSITIVE);
        let largest = exposure.max_level_per_mw_mm2;
        let level_per_mw_mm2 = exposure.level_per_mw_mm2.unwrap_or(wanted).min(largest);
        let seen = light.places.iter().filter(|place| place.image_px.is_some());
        let errors = seen.map(|place| normal_error_deg(light, place, level_per_mw_mm2)).collect();
        let sums: Vec<f64> = light.places.iter().map(|place| place.direct_mw_mm2().iter().sum()).collect();
        let lacks = lacking(coarse, CRESCENT_POLAR_DEG);
        let around = coarse.places.iter().filter(|place| place.polar_deg <= CRESCENT_POLAR_DEG).count();
        let dark = lacks.iter().filter(|colors| colors.contains(&true)).count();
        Self {
            normal_error_deg_per_level: percentiles(errors),
            condition_number: percentiles(
                light.places.iter().map(|place| condition_number(&light.seen(place))).collect(),
            ),
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
