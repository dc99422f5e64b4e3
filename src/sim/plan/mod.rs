//! Which effects are used, and what leaving the others out can cost.

mod entry;
pub(crate) mod fill;
mod growth;
#[cfg(test)]
mod honesty;
mod pictures;
#[cfg(test)]
mod random_scenes;
mod search;
#[cfg(test)]
mod sizes;

pub use entry::Entry;

use serde::Serialize;

use crate::bound::Bound;
use crate::contact::level::level_named;
use crate::effect_name::{EffectChoice, EffectName};
use crate::effects;
use crate::effects::geometry_bound::shift_px;
use crate::effects::light_bound;
use crate::plan::fill::{fill_grey, fill_tolerance};
use crate::plan::growth::{grown, growth};
use crate::plan::pictures::Pictures;
use crate::plan::search::{Candidate, best_set, closed, drop_orphans, effect_of};
use crate::raster::settings::Geometry;
use crate::scene::Scene;
use crate::scene::file::{LevelName, ToleranceSection};
use crate::{Pipeline, SimError, Work, light};

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
        let pictures = Pictures::of(scene);
        for name in EffectName::ALL {
            let effect = effect_of(name);
            let reason = effect.and_then(|effect| effect.calls_for(scene));
            let entry = match (effect, reason) {
                (Some(effect), Some(why)) => Entry {
                    effect: name,
                    used: scene.choice(name) != EffectChoice::Never,
                    called_for: true,
                    why,
                    bound: Some(pictures.bound(effect)?),
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
            plan.leave_out(scene, &pictures)?;
        }
        Ok(plan)
    }

    /// What leaving out a set can do to a pixel of the coded picture, grey levels: the sum of the bounds, and what
    /// the steps after it can make of the smallest difference: rounding to a code, and the converter's rounding. A
    /// lossy code comes after what the tolerance is about.
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
            // What is before the noise grows behind it as its rounding does.
            steps += step * growth(scene, EffectName::Defects);
        }
        sum + steps
    }

    /// What the light's effects among a set, left out together, change more than the sum of their bounds, grey levels.
    fn light_beyond_sum(&self, scene: &Scene, candidates: &[Candidate], set: u64) -> Result<f64, SimError> {
        let members = candidates.iter().enumerate().filter(|(place, _)| set & (1 << place) != 0);
        let light: Vec<(EffectName, f64)> = members
            .filter_map(|(_, candidate)| Some((self.entries.get(candidate.index)?.effect, candidate.grey)))
            .filter(|(name, _)| EffectName::OF_LIGHT.contains(name))
            .collect();
        if light.len() < 2 {
            return Ok(0.0);
        }
        let sum: f64 = light.iter().map(|(_, grey)| grey).sum();
        let together = light_bound::change(scene, &|name| light.iter().any(|(member, _)| *member == name))?;
        let grown = light.iter().map(|(name, _)| grown(scene, *name, together.grey)).fold(0.0, f64::max);
        Ok((grown - sum).max(0.0))
    }

    /// Whether the geometric effects of a set, and those of the light, left out together, stay within the tolerance: each
    /// one's bound is that of its absence alone, and two absences might add to more than their sum.
    fn holds_jointly(
        &self,
        (scene, pictures): (&Scene, &Pictures<'_>),
        (candidates, set): (&[Candidate], u64),
        tolerance: &ToleranceSection,
    ) -> Result<bool, SimError> {
        let out = |name: EffectName| {
            let chosen = candidates.iter().enumerate().filter(|(place, _)| set & (1 << place) != 0);
            chosen
                .into_iter()
                .any(|(_, candidate)| self.entries.get(candidate.index).is_some_and(|e| e.effect == name))
        };
        let light = self.light_beyond_sum(scene, candidates, set)?;
        if light > 0.0 && light + self.grey_of(scene, candidates, set) > tolerance.grey {
            return Ok(false);
        }
        let geometric = EffectName::GEOMETRIC.into_iter().filter(|name| out(*name)).count();
        if geometric < 2 {
            return Ok(true);
        }
        let uses = |name: EffectName| self.uses(name);
        let with = Geometry::of(&uses);
        let without = Geometry::of(&|name| uses(name) && !out(name));
        let shift = shift_px(scene, with, without)?;
        Ok(shift <= tolerance.px && pictures.shift_grey(shift)? <= tolerance.grey)
    }

    fn leave_out(&mut self, scene: &Scene, pictures: &Pictures<'_>) -> Result<(), SimError> {
        let mut tolerance = scene.file().tolerance;
        tolerance.grey -= self.filled_grey;
        let left = tolerance;
        let frames = u64::from(scene.frame_count());
        self.choose_level(scene, pictures, &mut tolerance)?;
        let mut candidates: Vec<Candidate> = Vec::new();
        for (index, entry) in self.entries.iter().enumerate() {
            let Some((bound, cost)) = entry.bound.filter(|_| entry.used).zip(entry.cost) else { continue };
            let own = grown(scene, entry.effect, bound.grey);
            if bound.px > tolerance.px || own > tolerance.grey {
                continue;
            }
            let whole = effect_of(entry.effect).is_some_and(|effect| effect.is_drawn());
            let at_edges = if whole { 0.0 } else { pictures.shift_grey(bound.px)? };
            let (cost, grey) = (cost.total(frames), own + at_edges);
            let free = scene.choice(entry.effect) == EffectChoice::Plan;
            if grey <= tolerance.grey && free && cost > 0 {
                candidates.push(Candidate { index, px: bound.px, grey, cost });
            }
        }
        let mut banned: Vec<u64> = Vec::new();
        let mut chosen = 0;
        for _ in 0..JOINT_TRIES {
            let allowed = |set: u64| {
                !banned.contains(&set)
                    && closed(&self.entries, &candidates, set)
                    && self.grey_of(scene, &candidates, set) <= tolerance.grey
            };
            chosen = best_set(&candidates, tolerance.px, tolerance.grey, &allowed);
            if self.holds_jointly((scene, pictures), (&candidates, chosen), &left)? {
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
    fn choose_level(
        &mut self,
        scene: &Scene,
        pictures: &Pictures<'_>,
        tolerance: &mut ToleranceSection,
    ) -> Result<(), SimError> {
        let free = scene.choice(EffectName::Contact) == EffectChoice::Plan;
        if !self.uses(EffectName::Contact) || !free {
            return Ok(());
        }
        for (name, px, _) in effects::contact::coarser_levels(scene) {
            // Under the design's lights a membrane of another shape may be lit quite otherwise.
            let lit = scene.draws() && scene.file().light.leds.is_some();
            let grey = if lit { 255.0 } else { pictures.shift_grey(px)? };
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
            return Ok(());
        }
        Ok(())
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
