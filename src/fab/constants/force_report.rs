//! What the sensor carries and what it resolves, as a table, a picture and a file for programs.

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;
use serde_json::json;

use super::envelope_picture::envelope_chart;
use super::resolution::{design_choices, frames_to_average, resolution_at};
use super::sight::markers_of;
use super::springs::DesignSprings;
use crate::chart::Chart;
use domecast_design::sections::LoadClaim;
use domecast_design::{Design, DesignError};
use domecast_design::{limits_of, suspension_of};
use domecast_optics::numeric::Rigid;
use domecast_springs::{
    Check, Choice, Direction, Limit, Limits, MoreChecks, Reach, Suspension, Wrench, choices,
    push_press_border, reach, standard_directions, try_all,
};

/// Directions around the axis that the table has.
const AZIMUTHS: u32 = 8;
/// Mixes of push and press along the border in the picture.
const BORDER_POINTS: u32 = 31;

/// What is said of forces where nothing moves.
pub const RIGID: &str = "rigid mount: no net wrench";

/// One line of the load table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EnvelopeLine {
    /// The load at factor 1, in words.
    pub load: String,
    /// Wrench at the end, about the reference point: N, N*mm.
    pub wrench: [f64; 6],
    /// Newtons (or newton-millimetres, for tilts and twists) of the load at the end.
    pub size: f64,
    /// What ends it.
    pub ended_by: String,
    /// The part that ends it.
    pub part: String,
}

/// The load envelope, the claims, the choices of spring, and the resolution.
#[derive(Debug, Clone)]
pub struct ForceReport {
    /// The load table.
    pub lines: Vec<EnvelopeLine>,
    /// Border of pushes (N, along x) and presses (N) at the pole, with what ends each.
    pub border: Vec<([f64; 2], Option<Limit>)>,
    /// Push and press (N) of each claimed load without a moment.
    pub claimed_n: Vec<[f64; 2]>,
    /// Frames to average for the design's `accuracy.force_n`, where it gives one.
    pub frames_to_average: Option<u32>,
    /// All of it, for programs.
    pub json: serde_json::Value,
}

fn line(reached: &Reach) -> EnvelopeLine {
    let (ended_by, part) = reached
        .ended_by
        .as_ref()
        .map_or(("nothing".to_owned(), String::new()), |c| (c.limit.as_str().to_owned(), c.part.clone()));
    let wrench = reached.direction.wrench.scaled(reached.factor);
    EnvelopeLine {
        load: reached.direction.name.clone(),
        wrench: wrench.to_array(),
        size: reached.factor,
        ended_by,
        part,
    }
}

fn check_json(check: &Check) -> serde_json::Value {
    json!({
        "limit": check.limit.as_str(), "part": check.part, "value": check.value, "bound": check.bound,
        "unit": check.unit, "used": check.used(),
    })
}

/// The claimed loads on the springs.
struct Claims {
    json: Vec<serde_json::Value>,
    /// Where they put the platform, those that the springs carry.
    poses: Vec<Rigid>,
    /// Name and wrench of the one that presses hardest, if one presses.
    hardest: Option<(String, Wrench)>,
}

fn claims(design: &Design, suspension: &Suspension, limits: &Limits, more: MoreChecks<'_>) -> Claims {
    let mut found = Claims { json: Vec::new(), poses: Vec::new(), hardest: None };
    for claim in &design.sections().loads.claims {
        let [force, moment, point] = [claim.force_n, claim.moment_nmm, claim.point_mm].map(DVec3::from_array);
        let wrench = Wrench::of_load(force, moment, point, suspension.at_mm());
        let case = try_all(suspension, limits, more, &wrench);
        let held = case.equilibrium.as_ref().ok();
        found.poses.extend(held.map(|e| e.pose));
        let reached = reach(suspension, limits, more, &Direction { name: claim.name.clone(), wrench });
        let hardest_n = found.hardest.as_ref().map_or(0.0, |(_, hardest)| hardest.force_n.z);
        if wrench.force_n.z < hardest_n {
            found.hardest = Some((claim.name.clone(), wrench));
        }
        found.json.push(json!({
            "name": claim.name,
            "wrench": wrench.to_array(),
            "held": case.passed().next().is_none() && held.is_some(),
            "pose": held.map(|e| e.pose.to_rows_4x4()),
            "displacement": held.map(|e| e.displacement.to_array()),
            "checks": case.checks.iter().map(check_json).collect::<Vec<_>>(),
            "factor_to_first_limit": reached.factor,
            "first_limit": reached.ended_by.as_ref().map(check_json),
        }));
    }
    found
}

/// Other springs of the same outer size under the hardest press.
fn spring_choices(
    suspension: &Suspension,
    limits: &Limits,
    more: MoreChecks<'_>,
    press: &Wrench,
) -> Vec<serde_json::Value> {
    let json = |choice: &Choice| {
        json!({
            "wire_diameter_mm": choice.spring.wire_diameter_mm,
            "active_coils": choice.spring.active_coils,
            "axial_n_per_mm": choice.axial_n_per_mm,
            "held": !choice.worst.is_passed(),
            "worst": check_json(&choice.worst),
        })
    };
    choices(suspension.spec(), limits, more, press).iter().map(json).collect()
}

/// Computes the report of a design; `springs` is what went into its constants, `noise_px` the standard deviation of each
/// white marker's centroid.
///
/// # Errors
/// [`DesignError`] where the springs cannot be.
pub fn force_report(
    design: &Design,
    springs: &DesignSprings,
    noise_px: &[f64],
) -> Result<ForceReport, DesignError> {
    if design.is_rigid() {
        let json = json!({ "mount": "rigid", "status": RIGID });
        return Ok(ForceReport {
            lines: Vec::new(),
            border: Vec::new(),
            claimed_n: Vec::new(),
            frames_to_average: None,
            json,
        });
    }
    let suspension = suspension_of(design)?;
    let limits = limits_of(design);
    let sight = &springs.sight;
    let more = |pose: &Rigid| sight.checks(pose);
    let dome = design.sections().dome.shape();
    let directions = standard_directions(suspension.at_mm(), &dome, AZIMUTHS);
    let lines: Vec<EnvelopeLine> =
        directions.par_iter().map(|d| line(&reach(&suspension, &limits, &more, d))).collect();
    let border = push_press_border(&suspension, &limits, &more, dome.height_mm(), 0.0, BORDER_POINTS);

    let Claims { json: claims, poses, hardest } = claims(design, &suspension, &limits, &more);
    let springs_that_hold = hardest
        .as_ref()
        .map_or_else(Vec::new, |(_, press)| spring_choices(&suspension, &limits, &more, press));
    let markers = markers_of(design);
    let at_rest = resolution_at(design.optics(), &markers, noise_px, &suspension, &Rigid::identity());
    let pressed = hardest.as_ref().and_then(|(name, press)| {
        let held = try_all(&suspension, &limits, &more, press).equilibrium.ok()?;
        let found = resolution_at(design.optics(), &markers, noise_px, &suspension, &held.pose)?;
        Some(json!({ "name": name, "press_n": -press.force_n.z, "resolution": found }))
    });
    let frames_to_average = frames_to_average(design, noise_px, &suspension, &poses);
    let plain = springs.plain.as_ref().map(|fit| {
        json!({
            "left": fit.left, "naive": fit.naive,
            "under_the_springs_own_law": {
                "left": fit.left_of_load, "left_by_table": fit.left_of_load_by_table, "naive": fit.naive_of_load,
            },
            "naive_at_rest_pose": fit.naive_at_rest_pose, "naive_at_rest_wrench": fit.naive_at_rest_wrench,
        })
    });
    let spring = &suspension.spec().spring;
    let json = json!({
        "at_mm": suspension.at_mm().to_array(),
        "spring": {
            "axial_n_per_mm": spring.axial_n_per_mm(),
            "lateral_n_per_mm": spring.lateral_n_per_mm(0.0),
            "torsion_nmm_per_rad": spring.torsion_nmm_per_rad(),
            "index": spring.index(),
            "wahl_factor": spring.wahl_factor(),
            "solid_height_mm": spring.solid_height_mm(),
            "rest_compression_mm": suspension.rest_compression_mm(),
        },
        "stiffness": springs.constants.as_ref().map(|constants| constants.stiffness),
        "envelope": lines,
        "border_push_press_n": border.iter().map(|(p, l)| json!({
            "push_n": p[0], "press_n": p[1], "ended_by": l.map(Limit::as_str),
        })).collect::<Vec<_>>(),
        "claims": claims,
        "spring_choices": springs_that_hold,
        "centroid_noise_px": noise_px.iter().copied().fold(0.0, f64::max),
        "centroid_noise_px_by_marker": noise_px,
        "resolution_at_rest": at_rest,
        "resolution_under_press": pressed,
        "frames_to_average": frames_to_average,
        "design_choices": design_choices(design.optics(), &markers, noise_px, &suspension),
        "plain_runtime_bias": plain,
    });
    let at_pole = |claim: &&LoadClaim| {
        claim.moment_nmm == [0.0; 3] && DVec3::from_array(claim.point_mm).distance(dome.pole_mm()) < 1e-6
    };
    let claimed = design.sections().loads.claims.iter().filter(at_pole);
    let claimed_n = claimed.map(|c| [c.force_n[0].hypot(c.force_n[1]), -c.force_n[2]]).collect();
    Ok(ForceReport { lines, border, claimed_n, frames_to_average, json })
}

impl ForceReport {
    /// The load table as CSV.
    pub fn csv(&self) -> String {
        let mut text = String::from("load,size,Fx_n,Fy_n,Fz_n,Mx_nmm,My_nmm,Mz_nmm,ended_by,part\n");
        for l in &self.lines {
            let w: Vec<String> = l.wrench.iter().map(|v| format!("{v:.4}")).collect();
            let name = l.load.replace(',', "");
            text += &format!("{name},{:.4},{},{},{}\n", l.size, w.join(","), l.ended_by, l.part);
        }
        text
    }

    /// The picture of the load envelope.
    pub fn envelope(&self) -> Chart {
        envelope_chart(&self.border, &self.claimed_n)
    }

    /// The report's files: path in the build's tree, and content.
    pub fn files(&self) -> Vec<(String, String)> {
        let json = serde_json::to_string_pretty(&self.json).unwrap_or_default() + "\n";
        if self.lines.is_empty() && self.border.is_empty() {
            return vec![("report/force.json".into(), json)];
        }
        vec![
            ("report/force.json".into(), json),
            ("report/load_envelope.csv".into(), self.csv()),
            ("report/load_envelope.svg".into(), self.envelope().to_svg()),
        ]
    }
}
