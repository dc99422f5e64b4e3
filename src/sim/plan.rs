//! Which effects are used, and what leaving the others out can cost.

use serde::Serialize;

use super::effect::{Bound, Cost, Effect, EffectChoice, EffectName};
use super::effects;
use super::scene::Scene;
use super::{Pipeline, SimError, Work, light};

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
}

/// An effect that the plan may leave out.
struct Spare {
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

    fn made(scene: &Scene, spare: bool) -> Result<Self, SimError> {
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
        let mut plan = Self { entries, left_out: Bound::default() };
        if spare {
            plan.leave_out(scene);
        }
        Ok(plan)
    }

    fn leave_out(&mut self, scene: &Scene) {
        let tolerance = scene.file().tolerance;
        let frames = u64::from(scene.frame_count());
        let per_px = grey_per_px(scene);
        let spares: Vec<Spare> = self
            .entries
            .iter()
            .enumerate()
            .filter_map(|(index, entry)| {
                let bound = entry.bound.filter(|_| entry.used)?;
                let cost = entry.cost?.total(frames);
                let grey = bound.grey + if bound.px > 0.0 { bound.px * per_px } else { 0.0 };
                let small = bound.px <= tolerance.px && grey <= tolerance.grey;
                let free = scene.choice(entry.effect) == EffectChoice::Plan;
                (small && free && cost > 0).then_some(Spare { index, px: bound.px, grey, cost })
            })
            .collect();
        let chosen =
            best_set(&spares, tolerance.px, tolerance.grey, &|set| closed(&self.entries, &spares, set));
        for (place, spare) in spares.iter().enumerate() {
            let Some(entry) = self.entries.get_mut(spare.index) else { continue };
            if chosen & (1 << place) != 0 {
                entry.used = false;
                entry.why = format!(
                    "{}; left out: at most {:.2e} px and {:.2e} grey levels, within the tolerance",
                    entry.why, spare.px, spare.grey
                );
                self.left_out.px += spare.px;
                self.left_out.grey += spare.grey;
            }
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
        pipeline.passes.sort_by_key(|pass| pass.stage());
        pipeline.shading = light::shading(scene, &pipeline.light, work)?;
        Ok(pipeline)
    }
}

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
fn closed(entries: &[Entry], spares: &[Spare], set: u64) -> bool {
    let out = |index: usize| {
        spares.iter().enumerate().any(|(place, spare)| spare.index == index && set & (1 << place) != 0)
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
fn best_set(spares: &[Spare], px: f64, grey: f64, allowed: &dyn Fn(u64) -> bool) -> u64 {
    struct Search<'a> {
        spares: &'a [Spare],
        allowed: &'a dyn Fn(u64) -> bool,
        best: (u64, u64),
    }
    impl Search<'_> {
        fn visit(&mut self, at: usize, set: u64, saved: u64, px: f64, grey: f64) {
            let Some(spare) = self.spares.get(at) else {
                if saved > self.best.0 && (self.allowed)(set) {
                    self.best = (saved, set);
                }
                return;
            };
            let rest = self.spares.iter().skip(at).fold(0_u64, |sum, spare| sum.saturating_add(spare.cost));
            if saved.saturating_add(rest) <= self.best.0 {
                return;
            }
            if spare.px <= px && spare.grey <= grey {
                let saved = saved.saturating_add(spare.cost);
                self.visit(at + 1, set | 1 << at, saved, px - spare.px, grey - spare.grey);
            }
            self.visit(at + 1, set, saved, px, grey);
        }
    }
    let mut search = Search { spares, allowed, best: (0, 0) };
    search.visit(0, 0, 0, px, grey);
    search.best.1
}

/// What a shift of one pixel can do to the value of a pixel, grey levels: zero where no images are drawn.
fn grey_per_px(scene: &Scene) -> f64 {
    if !scene.draws() {
        return 0.0;
    }
    let light = &scene.file().light;
    let levels = [light.membrane_level, light.marker_level, light.surround_level];
    let brightest = levels.into_iter().fold(0.0, f64::max);
    let darkest = (light.membrane_level * scene.file().ink.reflectance).min(light.surround_level);
    // A straight or convex edge that moves by d changes the covered part of a pixel by at most d times the
    // pixel's width across the motion, sqrt(2); two edges in one pixel may move apart.
    let edges = 2.0 * std::f64::consts::SQRT_2;
    let slope = scene.file().electronics.steepest_code(darkest);
    255.0 * slope * edges * (brightest - darkest).max(0.0)
}
