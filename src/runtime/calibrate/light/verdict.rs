//! Whether what was fitted can be: lights that are out, a frame at rest that is touched, another ball.

use glam::DVec3;

use super::model::{LightModel, Number};
use super::solve::Solved;
use super::types::{LightFitError, LightPair, LightParameter};
use crate::shape::SeenCell;

/// Part of nominal below which a light counts as out.
const OUT: f64 = 0.3;
/// Fitted numbers may be off by so many prior deviations.
const MAX_SDS: f64 = 5.0;
/// A ball's radius, a part, and deviations of what the presses say of it, from which on it is another one.
const MAX_RADIUS_PART: f64 = 0.06;
const MAX_RADIUS_SDS: f64 = 4.0;
/// Left of a tolerance, from which on a number was not seen.
const UNSEEN: f64 = 0.7;
/// Correlation of two numbers from which on only their combination is seen.
const ALIKE: f64 = 0.95;
/// By how much the colours of a place at rest may be off the light's, a part, and cells beyond it that are a touch.
const MAX_CHROMA: f64 = 0.1;
const MIN_TOUCHED: usize = 40;
/// How far from the pole touches at rest are looked for, degrees: beyond, lights have their shadows.
const LOOK_DEG: f64 = 60.0;

/// Whether a light is out, or far from its constants.
pub(super) fn lights(model: &LightModel, values: &[f64]) -> Result<(), LightFitError> {
    for ((number, sd), value) in model.numbers.iter().zip(&model.sds).zip(values) {
        if let Number::Flux(led) = number
            && (value * sd).exp() < OUT
        {
            let color = &model.nominal.leds[*led].color;
            let problem = format!(
                "has light.leds[{led}] ({color}) at {:.0} % of its flux: that light is out, or covered",
                100.0 * (value * sd).exp()
            );
            return Err(LightFitError::in_frame(0, problem, "mend the light, and take all frames again"));
        }
    }
    let is_prior = |number: &Number| !matches!(number, Number::Gain(_) | Number::Falloff);
    let all = model.numbers.iter().zip(&model.sds).zip(values).filter(|((number, _), _)| is_prior(number));
    let worst = all.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    match worst {
        Some(((number, sd), value)) if value.abs() > MAX_SDS => {
            let problem = format!(
                "{} would be {:.1} tolerances of {sd} off its nominal value, allowed are {MAX_SDS}",
                name(model, *number),
                value.abs()
            );
            let cure = "give frames of this sensor, the first untouched; or raise light.tolerances in the constants, if its \
                        lights were put in more loosely";
            Err(LightFitError::new(problem, cure))
        }
        _ => Ok(()),
    }
}

/// Whether the frame at rest has the colours of a touch anywhere: its bare cells, beside the light that was fitted to them.
pub(super) fn touched_at_rest(
    cells: &[SeenCell],
    dome_center_mm: DVec3,
    stray: f64,
) -> Result<(), LightFitError> {
    let brightest = cells.iter().map(|cell| cell.passed * cell.still).fold(DVec3::ZERO, DVec3::max);
    let seen = |cell: &&SeenCell| {
        let expected = cell.passed * cell.still;
        let is_near = cell.normal.z > LOOK_DEG.to_radians().cos();
        is_near && cell.is_known && expected.cmpgt(brightest * 0.1).all()
    };
    let ratio = |cell: &SeenCell| (cell.level - DVec3::splat(stray)) / (cell.passed * cell.still);
    let seen: Vec<(&SeenCell, DVec3)> = cells.iter().filter(seen).map(|cell| (cell, ratio(cell))).collect();
    let median = |c: usize| {
        let mut all: Vec<f64> = seen.iter().map(|(_, ratio)| ratio[c]).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(1.0).max(1e-12)
    };
    let medians = DVec3::new(median(0), median(1), median(2));
    // What all colours have in common is paint, or a speck.
    let chroma = |ratio: DVec3| {
        let own = ratio / medians;
        (own / (own.element_sum() / 3.0).max(1e-6) - DVec3::ONE).abs().max_element()
    };
    let off: Vec<&SeenCell> =
        seen.iter().filter(|(_, r)| chroma(*r) > MAX_CHROMA).map(|(cell, _)| *cell).collect();
    let near = |a: &SeenCell, b: &SeenCell| a.column.abs_diff(b.column) <= 8 && a.row.abs_diff(b.row) <= 8;
    let neighbors = off.iter().map(|cell| (off.iter().filter(|other| near(cell, other)).count(), *cell));
    match neighbors.max_by_key(|(count, _)| *count) {
        Some((count, cell)) if count >= MIN_TOUCHED => {
            let [polar, azimuth] = super::types::place_deg(cell.point_mm - dome_center_mm);
            let problem = format!(
                "has the colours of a dent at {polar:.0} degrees from the pole, azimuth {azimuth:.0}: it is touched, or stained there"
            );
            Err(LightFitError::in_frame(
                0,
                problem,
                "give a frame of the clean, untouched sensor as the one at rest",
            ))
        }
        _ => Ok(()),
    }
}

/// Whether the presses are those of the ball that was given; `free` is the radius' logarithm with its deviation, left free.
pub(super) fn radius(given_mm: f64, free: [f64; 2]) -> Result<(), LightFitError> {
    let [off, sd] = free;
    if off.abs() > MAX_RADIUS_PART.max(MAX_RADIUS_SDS * sd) {
        let fits = given_mm * off.exp();
        let problem =
            format!("a ball of {given_mm} mm radius does not fit the presses: one of some {fits:.2} mm does");
        return Err(LightFitError::new(
            problem,
            "give the radius (not the diameter) of the ball that was pressed",
        ));
    }
    Ok(())
}

/// What a number is called.
pub(super) fn name(model: &LightModel, number: Number) -> String {
    const COLORS: [&str; 3] = ["red", "green", "blue"];
    let first = |body: usize| model.bodies.get(body).and_then(|list| list.first()).copied().unwrap_or(0);
    let lobe = |i: usize| if model.lobes.len() == 1 { "lobe".to_owned() } else { format!("lobes[{i}]") };
    match number {
        Number::Place(body, axis) => {
            format!("leds[{}].{}", first(body), ["out_mm", "along_mm", "up_mm"][axis])
        }
        Number::Axis(body, axis) => format!("leds[{}].{}", first(body), ["tilt_rad", "turn_rad"][axis]),
        Number::Flux(led) => format!("leds[{led}].flux"),
        Number::Lambert(i) => format!("{}.lambert_fraction", lobe(i)),
        Number::Width(i) => format!("{}.lobe_width_rad", lobe(i)),
        Number::Exponent(i) => format!("{}.exponent", lobe(i)),
        Number::Reflectance(c) => format!("reflectance.{}", COLORS[c]),
        Number::Crosstalk(channel, color) => format!("crosstalk.{}_of_{}", COLORS[channel], COLORS[color]),
        Number::Stray => "stray".into(),
        Number::Gain(c) => format!("gain.{}", COLORS[c]),
        Number::Falloff => "falloff".into(),
    }
}

/// Nominal value of a number, and what a step of its own unit is worth: whether the value is a factor's logarithm.
fn nominal(model: &LightModel, number: Number) -> (f64, bool) {
    let light = &model.nominal;
    let lobe = |i: usize| model.lobes.get(i).and_then(|list| list.first()).map(|led| light.leds[*led].lobe);
    let tape = |i: usize| lobe(i).and_then(|lobe| lobe.diffuser);
    match number {
        Number::Place(..) | Number::Axis(..) | Number::Falloff => (0.0, false),
        Number::Flux(led) => (light.leds[led].flux, true),
        Number::Lambert(i) => (tape(i).map_or(0.0, |tape| tape.lambert_fraction), false),
        Number::Width(i) => (tape(i).map_or(0.0, |tape| tape.lobe_width_rad), true),
        Number::Exponent(i) => (lobe(i).map_or(0.0, |lobe| lobe.exponent), true),
        Number::Reflectance(c) => (light.reflectance[c], true),
        Number::Crosstalk(channel, color) => (light.crosstalk[channel][color], false),
        Number::Stray => (light.stray, false),
        Number::Gain(_) => (1.0, true),
    }
}

/// Every number with its deviations before and after.
pub(super) fn parameters(model: &LightModel, solved: &Solved) -> Vec<LightParameter> {
    let one = |(k, number): (usize, &Number)| {
        let (nominal, is_part) = nominal(model, *number);
        let (prior, left) = (model.sds[k], solved.covariance[(k, k)].max(0.0).sqrt());
        let step = solved.values.numbers[k] * prior;
        let value = if is_part { nominal * step.exp() } else { nominal + step };
        let unit = if is_part { value.abs() } else { 1.0 };
        let before = if is_part { nominal.abs() } else { 1.0 };
        LightParameter {
            name: name(model, *number),
            nominal,
            value,
            prior_sd: prior * before,
            sd: prior * left * unit,
            observed: left < UNSEEN,
        }
    };
    model.numbers.iter().enumerate().map(one).collect()
}

/// Pairs of numbers that the frames do not tell apart.
pub(super) fn pairs(model: &LightModel, solved: &Solved) -> Vec<LightPair> {
    let mut pairs = Vec::new();
    let whole = &solved.covariance;
    for a in 0..model.count() {
        for b in a + 1..model.count() {
            let correlation = whole[(a, b)] / (whole[(a, a)] * whole[(b, b)]).sqrt();
            if correlation.abs() > ALIKE {
                let names = [a, b].map(|k| name(model, model.numbers[k]));
                pairs.push(LightPair { names, correlation });
            }
        }
    }
    pairs
}
