//! The search for the set of effects whose absence saves most within a scene's tolerance.

use super::entry::Entry;
use crate::effect_name::EffectName;
use crate::effects;
use crate::effects::effect::Effect;

/// An effect that the plan may leave out.
pub(super) struct Candidate {
    pub index: usize,
    pub px: f64,
    pub grey: f64,
    pub cost: u64,
}

/// The effect of a name.
pub(super) fn effect_of(name: EffectName) -> Option<&'static dyn Effect> {
    effects::all().iter().copied().find(|effect| effect.name() == name)
}

/// Takes out effects that need one that is not used.
pub(super) fn drop_orphans(entries: &mut [Entry]) {
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
pub(super) fn closed(entries: &[Entry], candidates: &[Candidate], set: u64) -> bool {
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
pub(super) fn best_set(candidates: &[Candidate], px: f64, grey: f64, allowed: &dyn Fn(u64) -> bool) -> u64 {
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
