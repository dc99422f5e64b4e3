//! Work, counted: what each effect did, in units that are the same on every machine.

use crate::effect_name::EffectName;

/// Counted work, by effect.
///
/// A unit is about one nanosecond of one core; what matters is that it is *counted*, not timed: the same scene has
/// the same work on every machine and for any number of threads. What no effect asked for (drawing the bare
/// picture) is counted as the base.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Work {
    base: u64,
    by_effect: [u64; EffectName::COUNT],
}

impl Work {
    /// Counts work of an effect.
    pub fn add(&mut self, effect: EffectName, units: u64) {
        if let Some(sum) = self.by_effect.get_mut(effect as usize) {
            *sum = sum.saturating_add(units);
        }
    }

    /// Counts work that every scene has.
    pub fn add_base(&mut self, units: u64) {
        self.base = self.base.saturating_add(units);
    }

    /// What an effect did.
    pub fn of(&self, effect: EffectName) -> u64 {
        self.by_effect.get(effect as usize).copied().unwrap_or(0)
    }

    /// What every scene has to do.
    pub fn base(&self) -> u64 {
        self.base
    }

    /// All of it.
    pub fn total(&self) -> u64 {
        self.by_effect.iter().fold(self.base, |sum, units| sum.saturating_add(*units))
    }

    /// Adds the work of another part; the order does not matter.
    pub fn merge(&mut self, other: &Self) {
        self.base = self.base.saturating_add(other.base);
        for (sum, units) in self.by_effect.iter_mut().zip(other.by_effect) {
            *sum = sum.saturating_add(units);
        }
    }
}
