//! An object taken to its pose in steps.

use std::sync::Arc;

use glam::DVec3;

use super::deformed::Deformed;
use super::newton::{Problem, Solved};
use super::touch::{Law, between};
use crate::error::ContactError;
use crate::object::Placed;
use domecast_optics::numeric::{Rigid, vector_from_rotation};

/// First, longest and shortest step of the object, as parts of the radius.
const STEPS: [f64; 3] = [0.03, 0.08, 2e-4];

/// A solved way, and what Newton's method needed on it.
pub(crate) struct Way {
    pub deformed: Deformed,
    /// The last pose; `None` if there was no way to go.
    pub solved: Option<Solved>,
    /// Newton's steps in all.
    pub iterations: u32,
}

/// Takes an object from a pose to its own; a step that does not end is halved.
pub(crate) fn taken(
    mut deformed: Deformed,
    law: &Law,
    placed: &Placed,
    from: &Rigid,
    depth_mm: f64,
) -> Result<Way, ContactError> {
    let (body, spots) = (Arc::clone(&deformed.body), Arc::clone(&deformed.spots));
    let problem = Problem { body: &body, spots: &spots, law: *law };
    let radius_mm = body.mesh.grading.radius_mm;
    let to = placed.sensor_from_object();
    let turn = to.compose(&from.inverse());
    let way_mm = from.translation_mm.distance(to.translation_mm)
        + vector_from_rotation(&turn.rotation).length() * radius_mm;
    let (mut part, mut step) = (0.0, (STEPS[0] * radius_mm / way_mm.max(f64::MIN_POSITIVE)).min(1.0));
    let (mut last, mut iterations) = (None, 0);
    // Displacement and length of the step before, for a start by extrapolation.
    let mut trend: Option<(Vec<DVec3>, f64)> = None;
    let mut at = placed.clone();
    while part < 1.0 {
        let next = if part + 1.001 * step >= 1.0 { 1.0 } else { part + step };
        at.move_to(between(from, &to, next));
        let start = match &trend {
            Some((past, length)) => {
                let ratio = (next - part) / length;
                deformed
                    .displaced_mm
                    .iter()
                    .zip(past)
                    .map(|(now, past)| *now + (*now - *past) * ratio)
                    .collect()
            }
            None => deformed.displaced_mm.clone(),
        };
        let solved = problem.solve(&at, &deformed.anchors, start).or_else(|| {
            trend.as_ref().and_then(|_| problem.solve(&at, &deformed.anchors, deformed.displaced_mm.clone()))
        });
        let Some(solved) = solved else {
            step *= 0.5;
            if step * way_mm < STEPS[2] * radius_mm {
                return Err(ContactError::NotConverged { depth_mm, reached: part });
            }
            continue;
        };
        iterations += solved.residuals.len() as u32;
        deformed.anchors = law.anchored(&spots, &solved.bearings, &at, &deformed.anchors);
        let past = std::mem::replace(&mut deformed.displaced_mm, solved.displaced_mm.clone());
        trend = (part > 0.0).then_some((past, next - part));
        part = next;
        step = (1.5 * step).min(STEPS[1] * radius_mm / way_mm.max(f64::MIN_POSITIVE));
        last = Some(solved);
    }
    Ok(Way { deformed, solved: last, iterations })
}
