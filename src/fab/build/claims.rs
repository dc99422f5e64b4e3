//! The claimed loads: each within every limit, or with the smaller load that is.

use domecast_optics::numeric::Rigid;
use domecast_springs::{Check, Direction, Limits, Suspension, Wrench, reach};
use glam::DVec3;
use serde_json::json;

use crate::constants::MarkerSight;
use domecast_design::sections::LoadClaim;
use domecast_design::{Cure, Design, DesignError, claims_of, limits_of, suspension_of};

/// Of the load that meets the first limit, so much stays, so that rounding never passes it.
const BELOW_LIMIT: f64 = 0.98;
/// A smaller load than this share of the claim is none.
const MIN_SHARE: f64 = 1e-3;

/// Puts every claimed load on the springs: none may pass a limit, and every white marker must stay visible. Returns the
/// check of the markers; a load that does not hold comes with the smaller one that does.
pub(super) fn try_claims(design: &Design) -> Result<MarkerSight, DesignError> {
    judge_claims(design, true)
}

/// [`try_claims`] without a search for smaller loads.
pub(super) fn check_claims(design: &Design) -> Result<MarkerSight, DesignError> {
    judge_claims(design, false)
}

fn judge_claims(design: &Design, seeks_smaller: bool) -> Result<MarkerSight, DesignError> {
    let sight = MarkerSight::of(design);
    sight.require(design, &Rigid::identity(), "at rest")?;
    if design.is_rigid() {
        return Ok(sight);
    }
    let suspension = suspension_of(design)?;
    let limits = limits_of(design);
    let mut faults = Vec::new();
    for (index, (claim, case)) in
        design.sections().loads.claims.iter().zip(claims_of(design, &suspension)).enumerate()
    {
        let field = format!("loads.claims[{index}]");
        let smaller = || {
            let first = seeks_smaller.then(|| smaller_load(&suspension, &limits, &sight, claim))??;
            // springs that a rule chooses for the load change with it: then less still
            [1.0, 0.9, 0.75, 0.5, 0.3]
                .map(|factor| scaled(&first, factor))
                .into_iter()
                .find(|smaller| is_carried(design, index, smaller))
        };
        let passed = case.passed().next().map(|check| {
            let Check { limit, part, value, bound, unit } = check;
            let unit = if *unit == "1" { String::new() } else { format!(" {unit}") };
            let problem = format!(
                "the load \"{}\" passes a limit: {} at {part}, {value:.3}{unit}",
                claim.name,
                limit.as_str()
            );
            DesignError::at(field.clone(), json!(claim), problem, format!("at most {bound:.3}{unit}"))
        });
        let fault = match (passed, case.equilibrium) {
            (Some(passed), _) => Some(passed),
            (None, Err(error)) => {
                let allowed = "a load that the springs carry";
                Some(DesignError::at(field.clone(), json!(claim), error.to_string(), allowed))
            }
            (None, Ok(balance)) => {
                let pose = balance.displacement.to_pose(suspension.at_mm());
                sight.require(design, &pose, &format!("under the load \"{}\"", claim.name)).err()
            }
        };
        faults.extend(fault.map(|fault| with_smaller_load(fault, &field, smaller())));
    }
    DesignError::all(faults)?;
    Ok(sight)
}

/// The fault with the load that would do, beside what else would.
fn with_smaller_load(fault: DesignError, field: &str, smaller: Option<LoadClaim>) -> DesignError {
    const ELSE: &str =
        "claim less, or change `springs`, `magnets.grip_force_n` or the heights of the platforms";
    match smaller {
        None => fault.with_help(ELSE),
        Some(claim) => {
            let [force, moment] = [claim.force_n, claim.moment_nmm];
            let text = format!(
                "a load of the same kind of {} N and {} N*mm would do; or {ELSE}",
                json!(force),
                json!(moment)
            );
            fault.with_cure(Cure { field: field.to_owned(), value: json!(claim) }).with_help(text)
        }
    }
}

/// The claim as far as it goes before the first limit, by [`reach`]; none if that is nothing.
fn smaller_load(
    suspension: &Suspension,
    limits: &Limits,
    sight: &MarkerSight,
    claim: &LoadClaim,
) -> Option<LoadClaim> {
    let [force, moment, point] = [claim.force_n, claim.moment_nmm, claim.point_mm].map(DVec3::from_array);
    let wrench = Wrench::of_load(force, moment, point, suspension.at_mm());
    let direction = Direction { name: claim.name.clone(), wrench };
    let reached = reach(suspension, limits, &|pose: &Rigid| sight.checks(pose), &direction);
    let factor = BELOW_LIMIT * reached.factor;
    if !(MIN_SHARE..1.0).contains(&factor) {
        return None;
    }
    Some(scaled(claim, factor))
}

/// The same load times a factor.
fn scaled(claim: &LoadClaim, factor: f64) -> LoadClaim {
    let [force_n, moment_nmm] =
        [claim.force_n, claim.moment_nmm].map(|value| value.map(|side| down(factor * side)));
    LoadClaim { force_n, moment_nmm, ..claim.clone() }
}

/// Whether the design with this claim carries it.
fn is_carried(design: &Design, index: usize, claim: &LoadClaim) -> bool {
    let change = Cure { field: format!("loads.claims[{index}]"), value: json!(claim) };
    let Ok(changed) = design.changed(&change) else { return false };
    let Ok(suspension) = suspension_of(&changed) else { return false };
    let Some(case) = claims_of(&changed, &suspension).into_iter().nth(index) else { return false };
    if case.passed().next().is_some() {
        return false;
    }
    let Ok(balance) = case.equilibrium else { return false };
    let pose = balance.displacement.to_pose(suspension.at_mm());
    MarkerSight::of(&changed).require(&changed, &pose, "").is_ok()
}

/// Three digits, towards zero.
fn down(value: f64) -> f64 {
    if value == 0.0 {
        return 0.0;
    }
    let unit = 10_f64.powf(value.abs().log10().floor() - 2.0);
    let rounded = (value / unit).trunc() * unit;
    // no digits that only the product with the unit has
    (rounded * 1e9).round() / 1e9
}
