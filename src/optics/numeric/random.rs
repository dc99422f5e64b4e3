//! Random numbers from a seed, the same on every system.

use std::f64::consts::TAU;

use glam::DVec2;

/// A hash of 64 bits whose every bit depends on every bit of the input: the finaliser of SplitMix64 (G. Steele,
/// D. Lea, C. Flood, Fast splittable pseudorandom number generators, OOPSLA 2014).
#[inline]
pub fn mix64(input: u64) -> u64 {
    let mut z = input.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// SplitMix64 (S. Vigna, public domain): small, and good enough for a few million draws.
#[derive(Debug, Clone)]
pub struct SeededRandom(u64);

impl SeededRandom {
    /// The generator of a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A stream of its own for each pair of numbers.
    pub fn stream(seed: u64, stream: u64) -> Self {
        let mut mixed = Self(seed ^ stream.wrapping_mul(0xd134_2543_de82_ef95));
        mixed.next_u64();
        mixed
    }

    /// The next 64 random bits.
    pub fn next_u64(&mut self) -> u64 {
        let bits = mix64(self.0);
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        bits
    }

    /// Between 0 and 1, 1 excluded.
    pub fn uniform(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Between two bounds, the upper one excluded.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Two independent normal numbers with standard deviation 1 (Box and Muller).
    pub fn normal_pair(&mut self) -> DVec2 {
        let length = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        DVec2::from_angle(TAU * self.uniform()) * length
    }

    /// A normal number with standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        self.normal_pair().x
    }
}
