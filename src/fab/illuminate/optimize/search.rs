//! The search itself: choices outside, CMA-ES over the lights' place inside, the design's own checks as the judge.

use std::cmp::Ordering;

use nalgebra::DVector;
use rayon::prelude::*;
use serde::Serialize;

use super::axes::{Axes, MIN_TILT_DEG, neighbours};
use super::candidate::{Given, LightChoice, LightPlace, Violation};
use super::choices::{Arrangement, DiffuserKind, diffusers};
use super::cma::{Cma, SearchPoint};
use super::options::SearchOptions;
use super::score::LightScore;
use crate::build::verify;
use domecast_optics::numeric::SeededRandom;
use domecast_sim::light::lobe::Lobe;
use domecast_sim::light::setup;

/// Points of a generation: an even number shares well between two cores.
const POPULATION: usize = 8;
/// A search whose distribution is narrower than this, in the units of its coordinates, has converged: below what a file says.
const NARROW: f64 = 0.02;
/// A candidate must be better than the best by this part to be worth the build's checks: while the search is broad, and when
/// it refines.
const WORTH_BROAD: f64 = 0.05;
const WORTH_NARROW: f64 = 1e-3;
/// Half arcs at which an arrangement is first tried, degrees.
const FIRST_ARCS_DEG: [f64; 3] = [15.0, 30.0, 40.0];
/// Depths below the given lights at which a hood is first tried, over the radius of the dome's rim.
const FIRST_DEPTHS: [f64; 2] = [0.0, 0.2];
/// Ways outwards at which an arrangement is first tried, over the same radius, and by how much less its lights are tilted,
/// degrees: between them lies the valley along the wall of the view.
const FIRST_RADII: [f64; 2] = [0.0, 0.08];
const FIRST_LEANS_DEG: [f64; 2] = [0.0, 15.0];
/// Arrangements from which the search goes down, the best of the first tries.
const MAX_DESCENTS: usize = 4;
/// Share of the evaluations that the arrangements get together; the rest refines the best.
const BROAD_SHARE: f64 = 0.7;
/// Lights that the build may refuse, one after another, before a search goes on.
const MAX_REFUSED: usize = 4;
/// Step of a place and an angle at which the last refinement begins, and ends: what a file says.
const STEPS: [[f64; 2]; 4] = [[0.16, 1.6], [0.08, 0.8], [0.04, 0.4], [0.02, 0.2]];

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SearchStatus {
    /// No step that a file can say makes the best better.
    Converged,
    /// As many lights as allowed were looked at.
    EvaluationsUsedUp,
    /// Someone asked it to stop.
    Interrupted,
}

/// Lights that were looked at.
#[derive(Debug, Clone)]
pub struct Looked {
    /// What they were made of.
    pub choice: LightChoice,
    /// Where they stand.
    pub place: LightPlace,
    /// How good they are; `None` where that was not found out.
    pub score: Option<LightScore>,
    /// Why they cannot be; `None` where nothing is known against them.
    pub violation: Option<Violation>,
    /// How many they are.
    pub lights: usize,
    /// Height of the whole sensor, mm; 0 where that was not found out.
    pub height_mm: f64,
    /// Distance from the bounds in coordinates, where the point lay outside.
    outside: f64,
}

impl Looked {
    /// What is made small: worse for a point that lay outside the bounds.
    pub fn objective(&self) -> f64 {
        self.score.as_ref().map_or(f64::INFINITY, LightScore::objective) * (1.0 + self.outside * self.outside)
    }

    /// The better first: what can be before what cannot, then by the objective or by what is missing.
    fn order(&self, other: &Self) -> Ordering {
        match (&self.violation, &other.violation) {
            (None, None) => self.objective().total_cmp(&other.objective()),
            (None, Some(_)) => Ordering::Less,
            (Some(_), None) => Ordering::Greater,
            (Some(one), Some(two)) => one
                .stage
                .cmp(&two.stage)
                .then(one.missing.total_cmp(&two.missing))
                .then(self.outside.total_cmp(&other.outside)),
        }
    }
}

/// What a search found.
#[derive(Debug, Clone)]
pub struct FoundLights {
    /// The best that the build's checks let pass.
    pub best: Option<Looked>,
    /// All that nothing is known against, in the order in which they were looked at.
    pub feasible: Vec<Looked>,
    /// The best of each arrangement that was looked at, with and without a hood; `None` where no first try fits.
    pub arrangements: Vec<(LightChoice, Option<Looked>)>,
    /// How many lights were looked at.
    pub evaluations: usize,
    /// How many of them went through the build's checks.
    pub verified: usize,
    /// How it ended.
    pub status: SearchStatus,
}

/// A search in progress.
pub struct Search<'a> {
    given: &'a Given<'a>,
    options: &'a SearchOptions,
    step: &'a mut dyn FnMut(&str),
    is_stopped: &'a dyn Fn() -> bool,
    start_objective: f64,
    lobes: Vec<(DiffuserKind, Lobe)>,
    found: FoundLights,
}

impl<'a> Search<'a> {
    /// A search for lights that are better than those of objective `start_objective`.
    pub fn new(
        given: &'a Given<'a>,
        options: &'a SearchOptions,
        start_objective: f64,
        step: &'a mut dyn FnMut(&str),
        is_stopped: &'a dyn Fn() -> bool,
    ) -> Self {
        let leds = &given.design.sections().leds;
        let lobe = |kind: DiffuserKind| {
            let mut leds = leds.clone();
            leds.diffuser = kind.diffuser;
            (kind, setup::lobe(&leds, None))
        };
        let found = FoundLights {
            best: None,
            feasible: Vec::new(),
            arrangements: Vec::new(),
            evaluations: 0,
            verified: 0,
            status: SearchStatus::EvaluationsUsedUp,
        };
        let lobes = diffusers(given.design).into_iter().map(lobe).collect();
        Self { given, options, step, is_stopped, start_objective, lobes, found }
    }

    /// Searches until it converges, the evaluations are used up, or it is stopped.
    pub fn run(mut self) -> FoundLights {
        let start = LightPlace::of(self.given.design);
        let arrangements = Arrangement::all(self.given.design);
        let own = LightChoice { arrangement: arrangements[0], diffuser: self.lobes[0].0, adds_hood: false };
        let diffuser = self.best_diffuser(own, start).unwrap_or(own.diffuser);
        let mut starts = Vec::new();
        for adds_hood in [false, true].into_iter().filter(|adds| !adds || self.given.takes_hood()) {
            for arrangement in arrangements.iter().copied() {
                if self.is_interrupted() {
                    break;
                }
                let choice = LightChoice { arrangement, diffuser, adds_hood };
                let tries = self.first_tries(choice, start);
                let looked = self.look(&tries, f64::INFINITY);
                // of what the evaluations did not reach nothing is said
                let is_whole = looked.len() == tries.len();
                match looked.into_iter().min_by(Looked::order).filter(|one| one.violation.is_none()) {
                    Some(first) => starts.push(first),
                    None if is_whole => self.found.arrangements.push((choice, None)),
                    None => {}
                }
            }
        }
        starts.sort_by(Looked::order);
        let broad = (BROAD_SHARE * self.options.evaluations as f64) as usize;
        let share = broad.saturating_sub(self.found.evaluations) / starts.len().clamp(1, MAX_DESCENTS);
        for (index, Looked { choice, place, .. }) in starts.into_iter().enumerate() {
            if index < MAX_DESCENTS && !self.is_interrupted() {
                self.descend(choice, place, 1.0, share, index as u64);
            }
            let is_own = |one: &&Looked| {
                let of = one.choice;
                (of.arrangement, of.adds_hood) == (choice.arrangement, choice.adds_hood)
            };
            let best = self.found.feasible.iter().filter(is_own).min_by(|a, b| a.order(b)).cloned();
            self.found.arrangements.push((choice, best));
        }
        if !self.is_interrupted() {
            self.refine();
        }
        // whoever stops it gets the best of what was looked at
        if self.is_interrupted() {
            self.verify_known();
        }
        self.found
    }

    /// Places of a coarse grid about the given one, in the order in which they are looked at: the search begins at the best of
    /// them, which no random number moves.
    fn first_tries(&self, choice: LightChoice, start: LightPlace) -> Vec<(LightChoice, LightPlace)> {
        let rim_mm = self.given.design.sections().dome.shape().rim_radius_mm();
        // behind a hood lights may stand deeper
        let depths: &[f64] = if choice.adds_hood { &FIRST_DEPTHS } else { &[0.0] };
        let arcs: &[f64] = if choice.arrangement.has_arc() { &FIRST_ARCS_DEG } else { &[0.0] };
        let mut tries = Vec::new();
        for (depth, half_arc_deg) in depths.iter().flat_map(|depth| arcs.iter().map(move |arc| (depth, *arc)))
        {
            for (out, lean_deg) in
                FIRST_RADII.iter().flat_map(|out| FIRST_LEANS_DEG.iter().map(move |lean| (out, lean)))
            {
                let place = LightPlace {
                    center_radius_mm: start.center_radius_mm + out * rim_mm,
                    center_z_mm: start.center_z_mm - depth * rim_mm,
                    tilt_deg: (start.tilt_deg - lean_deg).max(MIN_TILT_DEG),
                    half_arc_deg,
                };
                tries.push((choice, place.rounded()));
            }
        }
        tries
    }

    /// The diffuser that is best at a place.
    fn best_diffuser(&mut self, choice: LightChoice, place: LightPlace) -> Option<DiffuserKind> {
        let tried: Vec<(LightChoice, LightPlace)> = self
            .lobes
            .iter()
            .map(|(diffuser, _)| (LightChoice { diffuser: *diffuser, ..choice }, place))
            .collect();
        let looked = self.look(&tried, WORTH_BROAD);
        let can_be = looked.into_iter().filter(|one| one.violation.is_none());
        can_be.min_by(Looked::order).map(|one| one.choice.diffuser)
    }

    /// From the best: its diffuser again, a narrower search, then single steps until none helps.
    fn refine(&mut self) {
        let Some(best) = self.found.best.clone() else { return };
        let diffuser = self.best_diffuser(best.choice, best.place).unwrap_or(best.choice.diffuser);
        let choice = LightChoice { diffuser, ..best.choice };
        let left = self.options.evaluations.saturating_sub(self.found.evaluations);
        self.descend(choice, best.place, 0.3, left / 2, 100);
        let mut level = 0;
        while let (Some(best), Some(steps)) = (self.found.best.clone(), STEPS.get(level)) {
            if self.is_over() {
                return;
            }
            let tried: Vec<(LightChoice, LightPlace)> =
                neighbours(best.place, best.choice.arrangement.has_arc(), *steps)
                    .into_iter()
                    .map(|place| (best.choice, place))
                    .collect();
            self.look(&tried, WORTH_NARROW);
            let is_better = self.found.best.as_ref().is_some_and(|now| now.objective() < best.objective());
            if !is_better {
                level += 1;
            }
        }
        self.found.status = SearchStatus::Converged;
    }

    /// Whether someone asked it to stop.
    fn is_interrupted(&mut self) -> bool {
        if (self.is_stopped)() {
            self.found.status = SearchStatus::Interrupted;
        }
        self.found.status == SearchStatus::Interrupted
    }

    /// Whether it must end.
    fn is_over(&mut self) -> bool {
        self.is_interrupted() || self.found.evaluations >= self.options.evaluations
    }

    /// CMA-ES from a place, with so many evaluations at most.
    fn descend(
        &mut self,
        choice: LightChoice,
        from: LightPlace,
        sigma: f64,
        evaluations: usize,
        stream: u64,
    ) {
        let axes = Axes::of(self.given.design, choice.arrangement.has_arc(), from);
        let random = SeededRandom::stream(self.options.seed, stream);
        let mut cma = Cma::new(DVector::zeros(axes.count()), sigma, POPULATION, random);
        let until = self.found.evaluations + evaluations;
        while self.found.evaluations + POPULATION <= until && cma.width() > NARROW && !self.is_over() {
            let points = cma.ask();
            let places: Vec<(LightPlace, f64)> = points.iter().map(|point| axes.place(point)).collect();
            let tried: Vec<(LightChoice, LightPlace)> =
                places.iter().map(|(place, _)| (choice, *place)).collect();
            let mut looked = self.look(&tried, WORTH_BROAD);
            for (one, (_, outside)) in looked.iter_mut().zip(places) {
                one.outside = outside;
            }
            let mut ordered: Vec<(&Looked, &SearchPoint)> = looked.iter().zip(&points).collect();
            ordered.sort_by(|a, b| a.0.order(b.0));
            cma.tell(&ordered.into_iter().map(|(_, point)| point).collect::<Vec<_>>());
        }
        if !self.is_interrupted() {
            self.verify_known();
        }
    }

    /// Looks at lights, in parallel; the best of those that are better than the best by a part of `worth` is verified: none where
    /// that is infinite.
    fn look(&mut self, tried: &[(LightChoice, LightPlace)], worth: f64) -> Vec<Looked> {
        let room = self.options.evaluations.saturating_sub(self.found.evaluations);
        let tried = tried.get(..tried.len().min(room)).unwrap_or_default();
        let (given, options, lobes) = (self.given, self.options, &self.lobes);
        let mut looked: Vec<Looked> = tried
            .par_iter()
            .map(|(choice, place)| {
                let lobe = lobes.iter().find(|(kind, _)| *kind == choice.diffuser);
                look_at(given, options, (*choice, *place), lobe.map(|(_, lobe)| lobe))
            })
            .collect();
        self.found.evaluations += looked.len();
        let mut order: Vec<usize> = (0..looked.len()).collect();
        order.sort_by(|a, b| looked[*a].order(&looked[*b]));
        if let Some(one) = order.first().and_then(|index| looked.get_mut(*index))
            && one.violation.is_none()
            && one.objective() < self.goal(worth)
        {
            self.verify(one);
        }
        self.found.feasible.extend(looked.iter().filter(|one| one.violation.is_none()).cloned());
        self.tell();
        looked
    }

    /// Puts lights through the build's checks: those that pass become the best, others cannot be.
    fn verify(&mut self, one: &mut Looked) -> bool {
        self.found.verified += 1;
        let design = self.given.design_of(&one.choice, one.place);
        let passes = design.is_ok_and(|design| verify(&design).is_ok());
        if passes {
            self.found.best = Some(one.clone());
        } else {
            one.violation = Some(Violation { stage: Violation::BUILD, missing: 0.0 });
        }
        passes
    }

    /// Verifies the best that is known, and where it does not pass the next ones.
    fn verify_known(&mut self) {
        for _ in 0..MAX_REFUSED {
            let goal = self.goal(WORTH_NARROW);
            let better =
                (0..self.found.feasible.len()).filter(|i| self.found.feasible[*i].objective() < goal);
            let best = better.min_by(|a, b| self.found.feasible[*a].order(&self.found.feasible[*b]));
            let Some(index) = best else { return };
            let mut one = self.found.feasible[index].clone();
            if self.verify(&mut one) {
                return;
            }
            self.found.feasible.remove(index);
        }
    }

    /// What is better than the best by a part.
    fn goal(&self, worth: f64) -> f64 {
        let best = self.found.best.as_ref().map_or(f64::INFINITY, Looked::objective);
        (1.0 - worth) * best.min(self.start_objective)
    }

    fn tell(&mut self) {
        let best = self.found.best.as_ref().map_or(self.start_objective, Looked::objective);
        (self.step)(&format!(
            "searching lights: {} of {}, {} degrees a grey level ({} as given)",
            self.found.evaluations,
            self.options.evaluations,
            crate::numbers::significant(best),
            crate::numbers::significant(self.start_objective),
        ));
    }
}

/// One look: the design that follows, room for it, and its light.
fn look_at(
    given: &Given<'_>,
    options: &SearchOptions,
    (choice, place): (LightChoice, LightPlace),
    lobe: Option<&Lobe>,
) -> Looked {
    let mut looked =
        Looked { choice, place, score: None, violation: None, lights: 0, height_mm: 0.0, outside: 0.0 };
    let mut judge = || -> Result<(), Violation> {
        let candidate = given.candidate(&choice, place)?;
        (looked.lights, looked.height_mm) = candidate.count_and_height_mm();
        let Some(lobe) = lobe else { return Ok(()) };
        let score = given.score(&candidate, lobe, options.polar_angle_deg)?;
        looked.score = Some(score);
        Ok(())
    };
    looked.violation = judge().err();
    looked
}
