//! The numbers of `optimize.json`: where the search began and ended, what it weighs against each other, and what being off
//! by a little costs.

use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Value, json};

use super::candidate::{Given, LightChoice, LightPlace, height_mm, score_of};
use super::choices::{Arrangement, diffuser_fields, diffusers};
use super::options::SearchOptions;
use super::score::LightScore;
use super::search::{FoundLights, Looked, SearchStatus};
use crate::build::verify;
use domecast_design::sections::{DiffuserSection, LedSection};
use domecast_design::{Cure, Design, DesignError};

/// The lights of a design.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LightsSummary {
    /// Where they stand.
    pub place: LightPlace,
    /// Height of the lip's top, mm.
    pub lip_top_z_mm: f64,
    /// Underside of the upper platform, mm.
    pub underside_z_mm: f64,
    /// Colour and azimuth of each.
    pub list: Vec<LedSection>,
    /// The diffuser; null for none.
    pub diffuser: Option<DiffuserSection>,
    /// Height of the whole sensor, mm.
    pub height_mm: f64,
    /// How good they are at the search's grid, by direct light.
    pub score: LightScore,
    /// The same 95th percentile of the normal's error as `illuminate` has it: at its grid, with the exposure of the whole
    /// light; degrees a grey level.
    pub illuminate_normal_error_p95_deg_per_level: Option<f64>,
}

/// A change of the design file; null leaves the field to its rule.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FieldChange {
    /// The field, as a path.
    pub field: String,
    /// Its value.
    pub value: Value,
}

/// The best of an arrangement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ArrangementResult {
    /// Lights of each colour, and how they stand.
    pub arrangement: Arrangement,
    /// Whether a hood was added.
    pub adds_hood: bool,
    /// The least error of normals found with it, degrees a grey level, by the search's own tests of room: the build, which judges
    /// what is proposed, may still refuse it. Null where boards, springs and walls leave room at none of the first places.
    pub normal_error_p95_deg_per_level: Option<f64>,
}

/// Lights that no others found beat in all four: noise, evenness, count and height.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrontPoint {
    /// Where they stand.
    pub place: LightPlace,
    /// Their arrangement.
    pub arrangement: Arrangement,
    /// Name of the diffuser.
    pub diffuser: &'static str,
    /// Whether a hood was added.
    pub adds_hood: bool,
    /// Error of normals, 95th percentile, degrees a grey level.
    pub normal_error_p95_deg_per_level: f64,
    /// Standard deviation over mean of the three colours' sum.
    pub sum_coefficient_of_variation: f64,
    /// Lights in all.
    pub lights: usize,
    /// Height of the whole sensor, mm.
    pub height_mm: f64,
}

/// What a change of the best does to it; the parts are not asked whether they allow it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sensitivity {
    /// The change, in words.
    pub change: String,
    /// Error of normals with it, 95th percentile, degrees a grey level; null where that place has no normal.
    pub normal_error_p95_deg_per_level: Option<f64>,
    /// That over the unchanged one.
    pub ratio: Option<f64>,
}

/// Everything that a search came to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OptimizationReport {
    /// Version of this file's form.
    pub version: u32,
    /// Name of the design.
    pub design: String,
    /// domecast's version.
    pub domecast: &'static str,
    /// Polar angle to which the error of normals counts, degrees.
    pub polar_angle_deg: f64,
    /// Seed of the search.
    pub seed: u64,
    /// How the search ended.
    pub status: SearchStatus,
    /// Lights that it was allowed to look at.
    pub evaluations_allowed: usize,
    /// Lights that it looked at.
    pub evaluations: usize,
    /// Lights that went through the build's checks.
    pub verified: usize,
    /// The given design.
    pub start: LightsSummary,
    /// The proposal; null where nothing better can be made.
    pub best: Option<LightsSummary>,
    /// The changes that make the proposal of the given design.
    pub changes: Vec<FieldChange>,
    /// Error of normals of the best over that of the start, both as `illuminate` has them.
    pub ratio: Option<f64>,
    /// What each arrangement came to; of those that the search did not get to nothing is said.
    pub arrangements: Vec<ArrangementResult>,
    /// Lights of which none is worse than another in everything; each went through the build's checks. Empty where the search was stopped.
    pub front: Vec<FrontPoint>,
    /// What being off by a little does to the proposal. Empty where the search was stopped.
    pub sensitivities: Vec<Sensitivity>,
}

/// Both ends of a search.
pub(super) struct Ends<'a> {
    pub start: LightScore,
    pub start_p95: Option<f64>,
    pub best: Option<Looked>,
    pub proposal: Option<&'a Design>,
    pub best_p95: Option<f64>,
}

/// Gathers what was found.
pub(super) fn report(
    given: &Given<'_>,
    options: &SearchOptions,
    found: &FoundLights,
    ends: Ends<'_>,
) -> Result<OptimizationReport, DesignError> {
    let best = match (ends.proposal, &ends.best) {
        (Some(proposal), Some(best)) => {
            let score = score_of(proposal, options.polar_angle_deg)?;
            Some(lights(proposal, best.place, score, ends.best_p95))
        }
        _ => None,
    };
    let changes = ends.best.iter().filter_map(|best| given.candidate(&best.choice, best.place).ok());
    let changes = changes.flat_map(|made| made.changes).fold(
        Vec::new(),
        |mut all: Vec<FieldChange>, Cure { field, value }| {
            all.retain(|change| change.field != field);
            all.push(FieldChange { field, value });
            all
        },
    );
    let ratio = ends.best_p95.zip(ends.start_p95).map(|(best, start)| best / start);
    let arrangement = |(choice, best): &(LightChoice, Option<Looked>)| ArrangementResult {
        arrangement: choice.arrangement,
        adds_hood: choice.adds_hood,
        normal_error_p95_deg_per_level: best
            .as_ref()
            .and_then(|one| one.score.as_ref())
            .map(LightScore::objective),
    };
    // whoever stops a search does not wait for what is beside the proposal
    let is_whole = found.status != SearchStatus::Interrupted;
    let sensitivities = match (ends.proposal, &best) {
        (Some(proposal), Some(best)) if is_whole => {
            sensitivities(proposal, &best.score, options.polar_angle_deg)
        }
        _ => Vec::new(),
    };
    Ok(OptimizationReport {
        version: 1,
        design: given.design.name().to_owned(),
        domecast: env!("CARGO_PKG_VERSION"),
        polar_angle_deg: options.polar_angle_deg,
        seed: options.seed,
        status: found.status,
        evaluations_allowed: options.evaluations,
        evaluations: found.evaluations,
        verified: found.verified,
        start: lights(given.design, LightPlace::of(given.design), ends.start, ends.start_p95),
        best,
        changes,
        ratio,
        arrangements: found.arrangements.iter().map(arrangement).collect(),
        front: if is_whole { front(given, found) } else { Vec::new() },
        sensitivities,
    })
}

fn lights(design: &Design, place: LightPlace, score: LightScore, p95: Option<f64>) -> LightsSummary {
    let sections = design.sections();
    LightsSummary {
        place,
        lip_top_z_mm: sections.leds.lip_top_z_mm,
        underside_z_mm: sections.platforms.upper.underside_z_mm,
        list: sections.leds.list.clone(),
        diffuser: sections.leds.diffuser,
        height_mm: height_mm(design),
        score,
        illuminate_normal_error_p95_deg_per_level: p95,
    }
}

/// Points of the front at most: each costs a run of the build's checks.
const MAX_FRONT: usize = 5;
/// Points of the front differ by this part in noise or evenness at least.
const APART: f64 = 0.02;

/// The lights that no others beat in everything, thinned, as far as the build's checks let them pass; the least noise first.
fn front(given: &Given<'_>, found: &FoundLights) -> Vec<FrontPoint> {
    let point = |one: &Looked| -> Option<(FrontPoint, LightChoice)> {
        let score = one.score.as_ref()?;
        Some((
            FrontPoint {
                place: one.place,
                arrangement: one.choice.arrangement,
                diffuser: one.choice.diffuser.name,
                adds_hood: one.choice.adds_hood,
                normal_error_p95_deg_per_level: score.objective(),
                sum_coefficient_of_variation: score.sum_coefficient_of_variation?,
                lights: one.lights,
                height_mm: one.height_mm,
            },
            one.choice,
        ))
    };
    let all: Vec<(FrontPoint, LightChoice)> =
        found.feasible.iter().chain(&found.best).filter_map(point).collect();
    let mut kept: Vec<(FrontPoint, LightChoice)> = Vec::new();
    let mut free: Vec<&(FrontPoint, LightChoice)> =
        all.iter().filter(|one| !all.iter().any(|other| other.0.dominates(&one.0))).collect();
    free.sort_by(|a, b| a.0.normal_error_p95_deg_per_level.total_cmp(&b.0.normal_error_p95_deg_per_level));
    for one in free {
        if !kept.iter().any(|known| known.0.is_near(&one.0)) {
            kept.push(one.clone());
        }
    }
    // evenly thinned, the first and the last kept
    let last = kept.len().saturating_sub(1);
    let step = (last as f64 / (MAX_FRONT - 1) as f64).max(1.0);
    let thinned: Vec<(FrontPoint, LightChoice)> = (0..MAX_FRONT)
        .map(|k| (step * k as f64).round() as usize)
        .filter_map(|index| kept.get(index).cloned())
        .collect();
    let passes = |(point, choice): &(FrontPoint, LightChoice)| {
        given.design_of(choice, point.place).is_ok_and(|design| verify(&design).is_ok())
    };
    let checked: Vec<bool> = thinned.par_iter().map(passes).collect();
    thinned.into_iter().zip(checked).filter(|(_, passes)| *passes).map(|((point, _), _)| point).collect()
}

impl FrontPoint {
    fn values(&self) -> [f64; 4] {
        [
            self.normal_error_p95_deg_per_level,
            self.sum_coefficient_of_variation,
            self.lights as f64,
            self.height_mm,
        ]
    }

    fn dominates(&self, other: &Self) -> bool {
        let pairs = || self.values().into_iter().zip(other.values());
        pairs().all(|(a, b)| a <= b) && pairs().any(|(a, b)| a < b)
    }

    fn is_near(&self, other: &Self) -> bool {
        let close = |a: f64, b: f64| (a - b).abs() <= APART * a.abs().max(b.abs());
        self.lights == other.lights && self.values().into_iter().zip(other.values()).all(|(a, b)| close(a, b))
    }
}

/// Flux of a colour, place and tilt of all lights, and the diffuser, each changed by itself.
fn sensitivities(best: &Design, score: &LightScore, polar_angle_deg: f64) -> Vec<Sensitivity> {
    let leds = &best.sections().leds;
    let change = |field: &str, value: Value| Cure { field: field.to_owned(), value };
    let mut tried: Vec<(String, Vec<Cure>)> = Vec::new();
    let fluxes = leds.radiant_flux_mw.to_array();
    for ((name, field), flux_mw) in [("red", "r"), ("green", "g"), ("blue", "b")].into_iter().zip(fluxes) {
        for factor in [0.8, 1.2] {
            let field = format!("leds.radiant_flux_mw.{field}");
            let percent = if factor < 1.0 { "−20" } else { "+20" };
            tried.push((format!("{name} {percent} %"), vec![change(&field, json!(factor * flux_mw))]));
        }
    }
    let numbers = [
        ("radius", "leds.center_radius_mm", leds.center_radius_mm, 0.2_f64, "mm"),
        ("height", "leds.center_z_mm", leds.center_z_mm, 0.2, "mm"),
        ("tilt", "leds.tilt_deg", leds.tilt_deg, 3.0, "°"),
    ];
    for (name, field, value, by, unit) in numbers {
        for (sign, turned) in [("−", -by), ("+", by)] {
            tried.push((format!("{name} {sign}{by} {unit}"), vec![change(field, json!(value + turned))]));
        }
    }
    for kind in diffusers(best).iter().skip(1) {
        // the pit stays as wide as it is
        let [_, (field, value)] = diffuser_fields(kind);
        tried.push((format!("diffuser: {}", kind.name), vec![change(field, value)]));
    }
    let unchanged = score.objective();
    tried
        .into_par_iter()
        .map(|(change, cures)| {
            let score = best.with_changes(&cures).and_then(|design| score_of(&design, polar_angle_deg));
            let p95 = score.ok().and_then(|score| score.normal_error_deg_per_level.p95);
            Sensitivity { change, normal_error_p95_deg_per_level: p95, ratio: p95.map(|p95| p95 / unchanged) }
        })
        .collect()
}
