//! An object taken to its pose in steps.

use std::sync::Arc;

use glam::DVec3;

use super::deformed::{Deformed, Step, Tried, Walked};
use super::newton::{Problem, Solved};
use super::touch::{Law, between};
use crate::error::ContactError;
use crate::object::Placed;
use domecast_optics::numeric::{Rigid, vector_from_rotation};

/// First, longest and shortest step of the object, as parts of the radius.
const STEPS: [f64; 3] = [0.03, 0.08, 2e-4];
/// How much longer than the longest step those of another try may become.
const MAX_STRETCH: f64 = 1.25;
/// A place this near another one, as a part of the way, may share that one's way up to its last step.
const NEAR: f64 = 0.25;

/// A solved way, and what Newton's method needed on it.
pub(crate) struct Way {
    pub deformed: Deformed,
    /// The last pose; `None` if there was no way to go.
    pub solved: Option<Solved>,
    /// Newton's steps in all.
    pub iterations: u32,
}

/// Distance between two poses, mm, turns counted over the radius.
fn distance_mm(from: &Rigid, to: &Rigid, radius_mm: f64) -> f64 {
    let turn = to.compose(&from.inverse());
    from.translation_mm.distance(to.translation_mm)
        + vector_from_rotation(&turn.rotation).length() * radius_mm
}

/// An object on its way.
struct Walk<'a> {
    problem: &'a Problem<'a>,
    from: &'a Rigid,
    /// Where it is tried.
    at: Placed,
    deformed: Deformed,
    part: f64,
    /// Displacement and length of the step before, for a start by extrapolation.
    trend: Option<(Vec<DVec3>, f64)>,
    walked: Walked,
    last: Option<Solved>,
    /// Newton's steps in all.
    iterations: u32,
}

impl Walk<'_> {
    /// Begins at the last step but one of a way to a place near by; the steps that are left of that.
    fn begin<'t>(&mut self, tried: Option<Tried<'t>>, way_mm: f64) -> std::slice::Iter<'t, Step> {
        let radius_mm = self.problem.body.mesh.grading.radius_mm;
        let Some((tried, way)) = tried.and_then(|tried| Some((tried, tried.deformed.walked.as_deref()?)))
        else {
            return [].iter();
        };
        if let [before @ .., last] = &way.steps[..]
            && let [.., near] = before
            && tried.shares_way
            && near.part * distance_mm(self.from, &way.sensor_from_object, radius_mm) < way_mm
            && distance_mm(&way.sensor_from_object, &self.walked.sensor_from_object, radius_mm)
                < NEAR * way_mm
        {
            self.walked = Walked { steps: before.to_vec(), ..*way };
            self.part = near.part;
            self.deformed.displaced_mm.clone_from(&near.displaced_mm);
            self.deformed.anchors.clone_from(&near.anchors);
            return std::slice::from_ref(last).iter();
        }
        way.steps.iter()
    }

    /// Tries a step, from where another way was there or from what is known of this one; false: it did not end.
    fn goes_on(&mut self, to: &Rigid, next: f64, known: Option<&Step>) -> bool {
        self.at.move_to(between(self.from, to, next));
        let own_mm = &self.deformed.displaced_mm;
        let solve = |start: Vec<DVec3>| self.problem.solve(&self.at, &self.deformed.anchors, start);
        let solved = match (known, &self.trend) {
            (Some(known), _) => solve(known.displaced_mm.clone()),
            (None, Some((past_mm, length))) => {
                let ratio = (next - self.part) / length;
                let along = own_mm.iter().zip(past_mm);
                solve(along.map(|(now, past)| *now + (*now - *past) * ratio).collect())
                    .or_else(|| solve(own_mm.clone()))
            }
            (None, None) => solve(own_mm.clone()),
        };
        let Some(solved) = solved else { return false };
        self.iterations += solved.residuals.len() as u32;
        let (law, spots) = (&self.problem.law, self.problem.spots);
        self.deformed.anchors = law.anchored(spots, &solved.bearings, &self.at, &self.deformed.anchors);
        let past_mm = std::mem::replace(&mut self.deformed.displaced_mm, solved.displaced_mm.clone());
        self.trend = (self.part > 0.0).then_some((past_mm, next - self.part));
        self.part = next;
        let (displaced_mm, anchors) = (self.deformed.displaced_mm.clone(), self.deformed.anchors.clone());
        self.walked.steps.push(Step { part: next, displaced_mm, anchors });
        self.last = Some(solved);
        true
    }
}

/// Takes an object from a pose to its own; a step that does not end is halved. On a way from the same start to a place near by Newton's
/// method begins where it ended there.
pub(crate) fn taken(
    deformed: Deformed,
    law: &Law,
    placed: &Placed,
    from: &Rigid,
    depth_mm: f64,
    tried: Option<Tried<'_>>,
) -> Result<Way, ContactError> {
    let (body, spots) = (Arc::clone(&deformed.body), Arc::clone(&deformed.spots));
    let problem = Problem { body: &body, spots: &spots, law: *law };
    let radius_mm = body.mesh.grading.radius_mm;
    let to = placed.sensor_from_object();
    let way_mm = distance_mm(from, &to, radius_mm).max(f64::MIN_POSITIVE);
    let [first, limit, shortest] = STEPS.map(|step| step * radius_mm / way_mm);
    let mut walk = Walk {
        problem: &problem,
        from,
        at: placed.clone(),
        deformed,
        part: 0.0,
        trend: None,
        walked: Walked { sensor_from_object: to, steps: Vec::new() },
        last: None,
        iterations: 0,
    };
    let mut known = walk.begin(tried, way_mm);
    // Shorter than a step that did not end, for some steps.
    let mut longest = limit;
    let mut step = first.min(1.0);
    while walk.part < 1.0 {
        let there = known.next().filter(|there| there.part - walk.part < MAX_STRETCH * longest);
        if there.is_none() {
            known = [].iter();
        }
        let next = match there {
            Some(there) => there.part,
            None if walk.part + MAX_STRETCH * step >= 1.0 => 1.0,
            None => walk.part + step,
        };
        let length = next - walk.part;
        match (walk.goes_on(&to, next, there), there) {
            (true, Some(_)) => {}
            (true, None) => {
                step = (1.5 * step).min(longest);
                longest = (1.1 * longest).min(limit);
            }
            (false, Some(_)) => known = [].iter(),
            (false, None) => {
                longest = 0.75 * length;
                step *= 0.5;
                if step < shortest {
                    return Err(ContactError::NotConverged { depth_mm, reached: walk.part });
                }
            }
        }
    }
    walk.deformed.walked = Some(Arc::new(walk.walked));
    Ok(Way { deformed: walk.deformed, solved: walk.last, iterations: walk.iterations })
}
