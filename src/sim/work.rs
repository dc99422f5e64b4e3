//! Work, counted: what each effect did, in units that are the same on every machine.

use serde::Serialize;

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
    rays: FollowedRays,
}

/// Rays followed to the lit membrane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct FollowedRays {
    /// All of them.
    pub followed: u64,
    /// Those whose search ended beside the displaced membrane: what they show is that of the nearest place found.
    pub beside: u64,
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

    /// Counts rays that were followed to the lit membrane, and those of them that ended beside it.
    pub fn add_rays(&mut self, followed: u64, beside: u64) {
        self.rays.followed = self.rays.followed.saturating_add(followed);
        self.rays.beside = self.rays.beside.saturating_add(beside);
    }

    /// The rays that were followed to the lit membrane.
    pub fn rays(&self) -> FollowedRays {
        self.rays
    }

    /// Counts all work of another part as an effect's.
    pub fn add_all(&mut self, effect: EffectName, other: &Self) {
        self.add(effect, other.total());
        self.add_rays(other.rays.followed, other.rays.beside);
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
        self.add_rays(other.rays.followed, other.rays.beside);
        for (sum, units) in self.by_effect.iter_mut().zip(other.by_effect) {
            *sum = sum.saturating_add(units);
        }
    }
}
