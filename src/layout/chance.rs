//! Random numbers that are the same on every system.

use std::f64::consts::TAU;

use glam::DVec2;

/// Splitmix64 (S. Vigna, public domain; G. Steele et al., OOPSLA 2014): small, and good enough for a few
/// million draws.
#[derive(Debug, Clone)]
pub(super) struct Chance(u64);

impl Chance {
    /// A stream of its own for each pair of numbers.
    pub(super) fn new(seed: u64, stream: u64) -> Self {
        let mut mixed = Self(seed ^ stream.wrapping_mul(0xd134_2543_de82_ef95));
        mixed.next();
        mixed
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Between 0 and 1, 1 excluded.
    fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Two normal numbers with standard deviation 1 (Box and Muller).
    pub(super) fn normal_pair(&mut self) -> DVec2 {
        let length = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        DVec2::from_angle(TAU * self.uniform()) * length
    }

    /// A normal number with standard deviation 1.
    pub(super) fn normal(&mut self) -> f64 {
        self.normal_pair().x
    }
}
