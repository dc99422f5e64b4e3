//! Which effects are used, and what leaving the others out can cost.

pub(crate) mod fill;
mod growth;
#[cfg(test)]
mod honesty;

use serde::Serialize;

use crate::bound::Bound;
use crate::contact::level::level_named;
use crate::effect_name::{EffectChoice, EffectName};
use crate::effects;
use crate::effects::effect::{Cost, Effect};
use crate::effects::geometry_bound::shift_px;
use crate::plan::fill::{fill_grey, fill_tolerance};
use crate::plan::growth::growth;
use crate::raster::settings::Geometry;
use crate::scene::Scene;
use crate::scene::file::{LevelName, ToleranceSection};
use crate::{Pipeline, SimError, Work, light};

/// What the plan says of one effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Entry {
    /// Which effect.
    #[serde(rename = "id")]
    pub effect: EffectName,
    /// Whether it is used.
    pub used: bool,
    /// Whether the scene calls for it.
    pub called_for: bool,
    /// Why the scene calls for it and why it is used or left out, in words.
    pub why: String,
    /// How large it can be; `None` where the scene does not call for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bound: Option<Bound>,
    /// What it costs; `None` where the scene does not call for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cost: Option<Cost>,
}

/// The effects of a scene: used, or left out within its tolerance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// One entry for each effect, in order.
    pub entries: Vec<Entry>,
    /// Sum of the bounds of what the plan leaves out although the scene calls for it (not counting what the
    /// scene forbids); within the scene's tolerance.
    pub left_out: Bound,
    /// How far pixels of a lit membrane that are filled in between rays may be from what their own rays show, grey levels; 0
    /// where each has its own. That and what is left out are within the scene's tolerance.
    #[serde(skip_serializing_if = "is_none")]
    pub filled_grey: f64,
    /// The level of contact where it is coarser than the scene's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_level: Option<LevelName>,
}

/// An effect that the plan may leave out.
struct Candidate {
    index: usize,
    px: f64,
    grey: f64,
    cost: u64,
}

impl Plan {
    /// The cheapest set of effects whose frames stay within the scene's tolerance.
    ///
    /// Of what the scene calls for, the plan leaves out the set that saves most counted work while the sum of its
    /// bounds stays within the tolerance, in px and in grey alike; a shift of places is counted in grey too,
    /// by what it can do to a pixel at an edge. An effect that needs one that is left out goes with it.
    ///
    /// # Errors
    /// A scene on which a bound cannot be computed.
    pub fn of(scene: &Scene) -> Result<Self, SimError> {
        Self::made(scene, true)
    }

    /// Every effect that the scene calls for and does not forbid.
    ///
    /// # Errors
    /// As [`Plan::of`].
    pub fn everything(scene: &Scene) -> Result<Self, SimError> {
        Self::made(scene, false)
    }

    /// The same with a ray of its own for each pixel of a lit membrane: what the other plans may be compared with.
    ///
    /// # Errors
    /// As [`Plan::of`].
    pub fn exact(scene: &Scene) -> Result<Self, SimError> {
        Ok(Self { filled_grey: 0.0, ..Self::made(scene, false)? })
    }

    fn made(scene: &Scene, candidate: bool) -> Result<Self, SimError> {
        let mut entries: Vec<Entry> = Vec::new();
        for name in EffectName::ALL {
            let effect = effect_of(name);
            let reason = effect.and_then(|effect| effect.calls_for(scene));
            let entry = match (effect, reason) {
                (Some(effect), Some(why)) => Entry {
                    effect: name,
                    used: scene.choice(name) != EffectChoice::Never,
                    called_for: true,
                    why,
                    bound: Some(effect.bound(scene)?),
                    cost: Some(effect.cost(scene)),
                },
                _ => Entry {
                    effect: name,
                    used: false,
                    called_for: false,
                    why: "the scene does not call for it".into(),
                    bound: None,
                    cost: None,
                },
            };
            entries.push(entry);
        }
        // What a scene forbids takes with it what needs it.
        drop_orphans(&mut entries);
        let mut plan = Self { entries, left_out: Bound::default(), filled_grey: 0.0, contact_level: None };
        let lit = light::is_lit_by_leds(scene) && plan.uses(EffectName::DirectLight);
        if lit || plan.uses(EffectName::UnevenMembrane) {
            plan.filled_grey = fill_grey(scene);
        }
        if candidate {
            plan.leave_out(scene)?;
        }
        Ok(plan)
    }

    /// What leaving out a set can do to a pixel of the coded picture, grey levels: the sum of the bounds, and what
    /// the steps after it can make of the smallest difference: rounding to a code, the converter's rounding, and
    /// a lossy code, whose own error both pictures have.
    fn grey_of(&self, scene: &Scene, candidates: &[Candidate], set: u64) -> f64 {
        let members =
            || candidates.iter().enumerate().filter(|(place, _)| set & (1 << place) != 0).map(|(_, s)| s);
        let sum: f64 = members().map(|candidate| candidate.grey).sum();
        if sum == 0.0 || !scene.draws() {
            return 0.0;
        }
        let kept = |name: EffectName| {
            let entry = self.entries.iter().enumerate().find(|(_, e)| e.effect == name && e.used);
            entry.filter(|(at, _)| !members().any(|candidate| candidate.index == *at)).map(|(_, entry)| entry)
        };
        let mut steps = 1.0;
        if let (Some(_), Some(noise)) = (kept(EffectName::Noise), &scene.file().electronics.noise) {
            let step = 255.0 / f64::from((1_u32 << noise.bits.min(31)) - 1);
            steps += step * growth(scene, EffectName::Noise);
        }
        if let Some(entry) = kept(EffectName::Compression) {
            steps += 2.0 * entry.bound.map_or(0.0, |bound| bound.grey);
        }
        sum + steps
    }

    /// Whether the geometric effects of a set, left out together, stay within the tolerance: each one's bound is
    /// that of its absence alone, and two absences might add to more than their sum.
    fn holds_jointly(
        &self,
        scene: &Scene,
        (candidates, set): (&[Candidate], u64),
        per_px: f64,
        tolerance: &ToleranceSection,
    ) -> Result<bool, SimError> {
        let out = |name: EffectName| {
            let chosen = candidates.iter().enumerate().filter(|(place, _)| set & (1 << place) != 0);
            chosen
                .into_iter()
                .any(|(_, candidate)| self.entries.get(candidate.index).is_some_and(|e| e.effect == name))
        };
        let geometric = EffectName::GEOMETRIC.into_iter().filter(|name| out(*name)).count();
        if geometric < 2 {
            return Ok(true);
        }
        let uses = |name: EffectName| self.uses(name);
        let with = Geometry::of(&uses);
        let without = Geometry::of(&|name| uses(name) && !out(name));
        let shift = shift_px(scene, with, without)?;
        Ok(shift <= tolerance.px && shift * per_px <= tolerance.grey)
    }

    fn leave_out(&mut self, scene: &Scene) -> Result<(), SimError> {
        let mut tolerance = scene.file().tolerance;
        tolerance.grey -= self.filled_grey;
        let left = tolerance;
        let frames = u64::from(scene.frame_count());
        let per_px = grey_per_px(scene);
        self.choose_level(scene, per_px, &mut tolerance);
        let candidates: Vec<Candidate> = self
            .entries
            .iter()
            .enumerate()
            .filter_map(|(index, entry)| {
                let bound = entry.bound.filter(|_| entry.used)?;
                let cost = entry.cost?.total(frames);
                let shifted = if bound.px > 0.0 { bound.px * per_px } else { 0.0 };
                let own = if bound.grey > 0.0 { bound.grey * growth(scene, entry.effect) } else { 0.0 };
                let grey = own + shifted;
                let small = bound.px <= tolerance.px && grey <= tolerance.grey;
                let free = scene.choice(entry.effect) == EffectChoice::Plan;
                (small && free && cost > 0).then_some(Candidate { index, px: bound.px, grey, cost })
            })
            .collect();
        let mut banned: Vec<u64> = Vec::new();
        let mut chosen = 0;
        for _ in 0..JOINT_TRIES {
            let allowed = |set: u64| {
                !banned.contains(&set)
                    && closed(&self.entries, &candidates, set)
                    && self.grey_of(scene, &candidates, set) <= tolerance.grey
            };
            chosen = best_set(&candidates, tolerance.px, tolerance.grey, &allowed);
            if self.holds_jointly(scene, (&candidates, chosen), per_px, &left)? {
                break;
            }
            banned.push(chosen);
            chosen = 0;
        }
        for (place, candidate) in candidates.iter().enumerate() {
            let Some(entry) = self.entries.get_mut(candidate.index) else { continue };
            if chosen & (1 << place) != 0 {
                entry.used = false;
                entry.why = format!(
                    "{}; left out: at most {:.2e} px and {:.2e} grey levels, within the tolerance",
                    entry.why, candidate.px, candidate.grey
                );
                self.left_out.px += candidate.px;
                self.left_out.grey += candidate.grey;
            }
        }
        Ok(())
    }

    /// Takes the coarsest level of contact that the tolerance allows; what it uses up is taken off.
    fn choose_level(&mut self, scene: &Scene, per_px: f64, tolerance: &mut ToleranceSection) {
        let free = scene.choice(EffectName::Contact) == EffectChoice::Plan;
        if !self.uses(EffectName::Contact) || !free {
            return;
        }
        for (name, px, _) in effects::contact::coarser_levels(scene) {
            // Under the design's lights a membrane of another shape may be lit quite otherwise.
            let lit = scene.draws() && scene.file().light.leds.is_some();
            let grey = if lit { 255.0 } else { px * per_px };
            let steps = if grey > 0.0 { 1.0 } else { 0.0 };
            if px > tolerance.px || grey + steps > tolerance.grey {
                continue;
            }
            tolerance.px -= px;
            tolerance.grey -= grey;
            self.left_out = Bound { px, grey };
            self.contact_level = Some(name);
            if let Some(entry) = self.entries.iter_mut().find(|entry| entry.effect == EffectName::Contact) {
                entry.why = format!(
                    "{}; the {} level instead: at most {px:.2e} px and {grey:.2e} grey levels off",
                    entry.why,
                    name.as_str()
                );
            }
            return;
        }
    }

    /// Whether an effect is used.
    pub fn uses(&self, effect: EffectName) -> bool {
        self.entries.iter().any(|entry| entry.effect == effect && entry.used)
    }

    /// Predicted work of the used effects for a number of frames.
    pub fn cost(&self, frames: u64) -> u64 {
        let used = self.entries.iter().filter(|entry| entry.used).filter_map(|entry| entry.cost);
        used.fold(0, |sum, cost| sum.saturating_add(cost.total(frames)))
    }

    /// Lets the used effects, and no others, put their parts together.
    ///
    /// # Errors
    /// What a used effect cannot be computed for.
    pub fn pipeline(&self, scene: &Scene, work: &mut Work) -> Result<Pipeline, SimError> {
        let mut pipeline = Pipeline::default();
        for entry in self.entries.iter().filter(|entry| entry.used) {
            if let Some(effect) = effect_of(entry.effect) {
                effect.apply(scene, &mut pipeline)?;
            }
        }
        if let Some(name) = self.contact_level {
            pipeline.contact = Some(level_named(scene, name));
        }
        pipeline.passes.sort_by_key(|pass| pass.stage());
        pipeline.fill_tolerance = fill_tolerance(scene, self.filled_grey);
        pipeline.shading = light::shading_of(scene, &pipeline.light, work)?;
        if let Some(uneven) = pipeline.unevenness.take() {
            pipeline.shading = Some(uneven.over(pipeline.shading.take()));
        }
        Ok(pipeline)
    }
}

fn is_none(grey: &f64) -> bool {
    *grey == 0.0
}

/// Sets that are tried before the plan gives up leaving anything out.
const JOINT_TRIES: u32 = 16;

fn effect_of(name: EffectName) -> Option<&'static dyn Effect> {
    effects::all().iter().copied().find(|effect| effect.name() == name)
}

/// Takes out effects that need one that is not used.
fn drop_orphans(entries: &mut [Entry]) {
    loop {
        let orphan = entries.iter().position(|entry| {
            entry.used
                && effect_of(entry.effect).is_some_and(|effect| {
                    effect.needs().iter().any(|need| !entries.iter().any(|e| e.effect == *need && e.used))
                })
        });
        let Some(entry) = orphan.and_then(|at| entries.get_mut(at)) else { return };
        entry.used = false;
        entry.why = format!("{}; left out with what it needs", entry.why);
    }
}

/// Whether a set to leave out takes with it everything that needs its members.
fn closed(entries: &[Entry], candidates: &[Candidate], set: u64) -> bool {
    let out = |index: usize| {
        candidates
            .iter()
            .enumerate()
            .any(|(place, candidate)| candidate.index == index && set & (1 << place) != 0)
    };
    entries.iter().enumerate().filter(|(index, entry)| entry.used && !out(*index)).all(|(_, entry)| {
        let needs = effect_of(entry.effect).map_or(&[][..], |effect| effect.needs());
        needs.iter().all(|need| {
            !entries.iter().enumerate().any(|(at, other)| other.effect == *need && other.used && out(at))
        })
    })
}

/// The set, as bits, that saves most within both tolerances; of equal savings the first found, which leaves out
/// the earlier effects.
fn best_set(candidates: &[Candidate], px: f64, grey: f64, allowed: &dyn Fn(u64) -> bool) -> u64 {
    struct Search<'a> {
        candidates: &'a [Candidate],
        allowed: &'a dyn Fn(u64) -> bool,
        best: (u64, u64),
    }
    impl Search<'_> {
        fn visit(&mut self, at: usize, set: u64, saved: u64, px: f64, grey: f64) {
            let Some(candidate) = self.candidates.get(at) else {
                if saved > self.best.0 && (self.allowed)(set) {
                    self.best = (saved, set);
                }
                return;
            };
            let rest = self
                .candidates
                .iter()
                .skip(at)
                .fold(0_u64, |sum, candidate| sum.saturating_add(candidate.cost));
            if saved.saturating_add(rest) <= self.best.0 {
                return;
            }
            if candidate.px <= px && candidate.grey <= grey {
                let saved = saved.saturating_add(candidate.cost);
                self.visit(at + 1, set | 1 << at, saved, px - candidate.px, grey - candidate.grey);
            }
            self.visit(at + 1, set, saved, px, grey);
        }
    }
    let mut search = Search { candidates, allowed, best: (0, 0) };
    search.visit(0, 0, 0, px, grey);
    search.best.1
}

/// What a shift of one pixel can do to the value of a pixel, grey levels: zero where no images are drawn.
fn grey_per_px(scene: &Scene) -> f64 {
    if !scene.draws() {
        return 0.0;
    }
    let light = &scene.file().light;
    let brightest = light.brightest_level();
    // Under the design's lights parts of the dome may be dark.
    let dark = (light.membrane_level * scene.file().ink.reflectance).min(light.surround_level);
    let darkest = if light.leds.is_some() { 0.0 } else { dark };
    // A straight or convex edge that moves by d changes the covered part of a pixel by at most d times the
    // pixel's width across the motion, sqrt(2); two edges in one pixel may move apart.
    let edges = 2.0 * std::f64::consts::SQRT_2;
    let slope = scene.file().electronics.steepest_code(darkest);
    // What any geometric effect moves, all others may enlarge.
    255.0 * slope * edges * (brightest - darkest).max(0.0) * growth(scene, EffectName::LensDistortion)
}
