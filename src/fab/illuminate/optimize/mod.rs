//! A search for better lights of a design: where they stand, how they lean, how many they are, what diffuses them. What
//! follows from them (lip, underside of the platform) follows by the design's own rules, and the build's own checks judge.

mod axes;
mod candidate;
mod choices;
mod cma;
mod options;
mod outcome;
mod proposal;
mod score;
mod search;

use std::fmt;

use serde_json::json;

pub use candidate::LightPlace;
pub use choices::{ArcSpread, Arrangement};
pub(super) use choices::{DiffuserKind, diffusers};
pub use options::SearchOptions;
pub use outcome::{FieldChange, FrontPoint, LightsSummary, OptimizationReport, Sensitivity};
pub(super) use score::ComparedLight;
pub use score::LightScore;
pub use search::SearchStatus;

use super::measure::{measure, p95_to, require_colors};
use super::numbers::IlluminationReport;
use crate::build::{BuildError, build, verify};
use candidate::{Given, score_of};
use domecast_design::{Design, DesignError};
use search::{Looked, Search};

/// A proposal must be better by this part in `illuminate`'s own numbers.
const MIN_GAIN: f64 = 0.005;

/// What a search came to.
#[derive(Debug, Clone)]
pub struct Optimization {
    /// The numbers.
    pub report: OptimizationReport,
    /// The design with better lights, which builds; `None` where none was found.
    pub proposal: Option<Design>,
}

impl Optimization {
    /// Name of the proposed design's file; `None` where nothing is proposed.
    pub fn proposal_name(&self) -> Option<String> {
        self.proposal.as_ref().map(|_| format!("{}{}.json", self.report.design, proposal::SUFFIX))
    }

    /// `optimize.json`, and the proposed design.
    pub fn files(&self) -> Vec<(String, Vec<u8>)> {
        // numbers, strings and lists only: nothing here can fail to be written
        let numbers = serde_json::to_string_pretty(&self.report).unwrap_or_default() + "\n";
        let mut files = vec![("optimize.json".to_owned(), numbers.into_bytes())];
        if let (Some(name), Some(design)) = (self.proposal_name(), &self.proposal) {
            files.push((name, design.text().as_bytes().to_vec()));
        }
        files
    }
}

impl fmt::Display for SearchStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Converged => "converged",
            Self::EvaluationsUsedUp => "evaluations used up",
            Self::Interrupted => "interrupted",
        })
    }
}

/// Searches for lights that are better than those of `design`, of which `light` is what `illuminate` says; `step` gets what is being
/// done, and the search ends early, with the best so far, where `is_stopped`.
///
/// # Errors
/// Options that make no search, a design without a light of each colour, and one that does not build: the search begins at
/// what can be made.
pub fn optimize(
    design: &Design,
    light: &IlluminationReport,
    options: &SearchOptions,
    step: &mut dyn FnMut(&str),
    is_stopped: &dyn Fn() -> bool,
) -> Result<Optimization, DesignError> {
    options.check()?;
    require_colors(design)?;
    let start_p95 = p95_to(light, options.polar_angle_deg);
    if light.places.polar_deg.iter().all(|polar_deg| *polar_deg > options.polar_angle_deg) {
        return Err(DesignError::at(
            "--polar-angle-deg",
            options.polar_angle_deg,
            "no place of the dome lies within it",
            "a larger angle",
        ));
    }
    verify(design).map_err(|fault| {
        fault.with_help("the search begins at a design that builds: see what `domecast build` says of it")
    })?;
    let start = score_of(design, options.polar_angle_deg)?;
    let given = Given::new(design)?;
    let found = Search::new(&given, options, start.objective(), step, is_stopped).run();

    step("checking the best");
    let mut proposal = None;
    let mut best_p95 = None;
    let mut chosen = None;
    for one in candidates(&found.best, &found.feasible, start.objective()) {
        let Ok(made) = given.candidate(&one.choice, one.place) else { continue };
        let named = proposal::explained(design, &made, options, start.objective(), one.objective());
        let Ok(named) = named else { continue };
        match build(&named, &mut |_| {}) {
            Ok(_) => {}
            Err(ours @ BuildError::Ours(_)) => {
                return Err(DesignError::at("leds", json!(one.place), ours.to_string(), "lights that build"));
            }
            Err(BuildError::Design(_)) => continue,
        }
        let Ok((lit, _)) = measure(&named) else { continue };
        let p95 = p95_to(&lit, options.polar_angle_deg);
        let is_better = match (p95, start_p95) {
            (Some(found), Some(start)) => found <= (1.0 - MIN_GAIN) * start,
            (found, None) => found.is_some(),
            (None, Some(_)) => false,
        };
        if is_better {
            (proposal, best_p95, chosen) = (Some(named), p95, Some(one));
            break;
        }
    }
    step("trying what is off by a little");
    let report = outcome::report(
        &given,
        options,
        &found,
        outcome::Ends { start, start_p95, best: chosen, proposal: proposal.as_ref(), best_p95 },
    )?;
    Ok(Optimization { report, proposal })
}

/// Candidates tried at most where the build refuses the best, each clearly another.
const MAX_TRIED: usize = 6;

/// The best, then others from the best on, each worse than the one before by a part.
fn candidates(best: &Option<Looked>, feasible: &[Looked], start: f64) -> Vec<Looked> {
    const APART: f64 = 1.02;
    let mut sorted: Vec<&Looked> = feasible.iter().collect();
    sorted.sort_by(|a, b| a.objective().total_cmp(&b.objective()));
    let Some(best) = best else { return Vec::new() };
    let mut found = vec![best.clone()];
    for one in sorted {
        let last = found.last().map_or(0.0, Looked::objective);
        if one.objective() > APART * last && one.objective() < start && found.len() < MAX_TRIED {
            found.push(one.clone());
        }
    }
    found
}
