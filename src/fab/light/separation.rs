//! How well the lights' colours tell the dome's normals: condition number, error of a normal, and where a colour is
//! missing.

use serde::Serialize;

use super::rest::fault;
use domecast_design::DesignError;
use domecast_sim::Scene;
use domecast_sim::light::illumination::{IlluminatedPlace, Illumination, PlaceGrid};
use domecast_sim::light::separation::{condition_number, normal_error_rad, percentile, slope_error_rad};

/// A colour below this part of its median leaves a crescent: the camera's noise is as large as what it sees of the colour.
pub const CRESCENT_PART: f64 = 0.05;

/// Polar angle to which the summary of a build looks, degrees, and that for crescents.
const SUMMARY_POLAR_DEG: f64 = 60.0;
const CRESCENT_POLAR_DEG: f64 = 75.0;
/// Where slopes are asked that colors hardly show, and the error of one by a grey level from which on they do, degrees: as much as slopes
/// differ over a touch, so that they can as well be filled in from around.
const BLIND_POLAR_DEG: f64 = 45.0;
const BLIND_ERROR_DEG: f64 = 5.0;
/// Places for that, narrow rings: between opposite lights it may be a few degrees about the pole only.
const BLIND_GRID: PlaceGrid = PlaceGrid { rings: 256, places: 7 };
/// Places of that summary: so few cost a build little; its numbers are within a few percent of `illuminate`'s.
const SUMMARY_GRID: PlaceGrid = PlaceGrid { rings: 24, places: 36 };

/// What the lights tell of the dome's normals, in short; `domecast illuminate` has it place by place.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Separation {
    /// One place in twenty within 60 degrees of the pole has a larger condition number of crosstalk times direct light;
    /// `None` where that place lacks a colour.
    pub condition_number_p95_to_60_deg: Option<f64>,
    /// One place in twenty that the camera sees within 60 degrees of the pole has a larger error of its normal for one grey
    /// level of noise, degrees; `None` where that place lacks a colour.
    pub normal_error_deg_per_level_p95_to_60_deg: Option<f64>,
    /// Share of the area that the camera sees within 45 degrees of the pole where one grey level turns the slope that `track --shape` reads
    /// by more than 5 degrees: it is filled in from around there.
    pub blind_share_to_45_deg: f64,
    /// Share of the area within 75 degrees where the direct light of any colour is below a twentieth of its median.
    pub crescent_share_to_75_deg: f64,
}

impl Separation {
    /// Of a scene under its own lights; `None` where it has none.
    pub(super) fn of(scene: &Scene, level_per_mw_mm2: f64) -> Result<Option<Self>, DesignError> {
        let light = Illumination::direct(scene, SUMMARY_GRID, CRESCENT_POLAR_DEG).map_err(fault)?;
        let Some(light) = light else { return Ok(None) };
        let inner = Illumination::direct(scene, BLIND_GRID, BLIND_POLAR_DEG).map_err(fault)?;
        let inner = inner.map_or_else(Vec::new, |inner| inner.places);
        let seen: Vec<&IlluminatedPlace> = inner.iter().filter(|place| place.image_px.is_some()).collect();
        let is_blind = |place: &&&IlluminatedPlace| {
            let error = slope_error_rad(&light.seen_levels(place, level_per_mw_mm2), place.normal);
            error.is_none_or(|rad| rad.to_degrees() > BLIND_ERROR_DEG)
        };
        let p95 = |of: &dyn Fn(&IlluminatedPlace) -> Option<Option<f64>>| {
            let within = light.places.iter().filter(|place| place.polar_deg <= SUMMARY_POLAR_DEG);
            percentile_of(within.filter_map(of).collect(), 0.95)
        };
        let missing = lacking(&light, CRESCENT_POLAR_DEG);
        let all = light.places.iter().filter(|place| place.polar_deg <= CRESCENT_POLAR_DEG).count();
        let dark = missing.iter().filter(|colors| colors.contains(&true)).count();
        Ok(Some(Self {
            condition_number_p95_to_60_deg: p95(&|place| Some(condition_number(&light.seen(place)))),
            normal_error_deg_per_level_p95_to_60_deg: p95(&|place| {
                place.image_px.map(|_| normal_error_deg(&light, place, level_per_mw_mm2))
            }),
            blind_share_to_45_deg: seen.iter().filter(is_blind).count() as f64 / seen.len().max(1) as f64,
            crescent_share_to_75_deg: dark as f64 / all.max(1) as f64,
        }))
    }
}

/// Standard deviation of a normal in each tangential direction for one grey level of noise, degrees; `None` where a colour
/// is missing.
pub fn normal_error_deg(
    light: &Illumination,
    place: &IlluminatedPlace,
    level_per_mw_mm2: f64,
) -> Option<f64> {
    let levels = light.seen_levels(place, level_per_mw_mm2);
    normal_error_rad(&levels, place.normal).map(f64::to_degrees)
}

/// Percentile by area of values of which those without a number count as larger than any.
pub fn percentile_of(values: Vec<Option<f64>>, part: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().map(|value| value.unwrap_or(f64::INFINITY)).collect();
    values.sort_unstable_by(f64::total_cmp);
    percentile(&values, part).filter(|value| value.is_finite())
}

/// For each place, which colours have too little direct light; none beyond a polar angle, within which medians are taken.
pub fn lacking(light: &Illumination, polar_deg: f64) -> Vec<[bool; 3]> {
    let is_within = |place: &&IlluminatedPlace| place.polar_deg <= polar_deg;
    let median = |color: usize| {
        let values = light.places.iter().filter(is_within).map(|place| Some(place.direct_mw_mm2()[color]));
        percentile_of(values.collect(), 0.5).unwrap_or(0.0)
    };
    let medians: [f64; 3] = std::array::from_fn(median);
    let lacks = |place: &IlluminatedPlace| {
        let direct = place.direct_mw_mm2();
        // A colour of which half the places have nothing is missing wherever there is none of it.
        let is_lacking = |c: usize| direct[c] < CRESCENT_PART * medians[c] || direct[c] <= 0.0;
        std::array::from_fn(|c| place.polar_deg <= polar_deg && is_lacking(c))
    };
    light.places.iter().map(lacks).collect()
}
