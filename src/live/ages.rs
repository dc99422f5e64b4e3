//! How old readings are when they are out.

use std::time::Duration;

/// Width of a bin, us, and how many there are: to 100 ms, in 8 kB whatever the number of frames.
const BIN_US: u128 = 50;
const BINS: usize = 2000;

/// Ages of readings, from the frame's last byte to the number's: counted in bins of 0.05 ms.
#[derive(Debug, Clone)]
pub struct AgeStatistics {
    bins: Vec<u64>,
    count: u64,
    max: Duration,
}

impl Default for AgeStatistics {
    fn default() -> Self {
        Self { bins: vec![0; BINS + 1], count: 0, max: Duration::ZERO }
    }
}

impl AgeStatistics {
    /// Adds an age.
    pub fn add(&mut self, age: Duration) {
        let bin = usize::try_from(age.as_micros() / BIN_US).unwrap_or(BINS).min(BINS);
        self.bins[bin] += 1;
        self.count += 1;
        self.max = self.max.max(age);
    }

    /// The age, ms, that a share of the readings has at most: the upper end of its bin, never less than the age was; the
    /// largest one beyond 100 ms. `None` where there is no reading.
    pub fn quantile_ms(&self, share: f64) -> Option<f64> {
        if self.count == 0 {
            return None;
        }
        let rank = ((self.count as f64 * share).ceil() as u64).clamp(1, self.count);
        let mut seen = 0;
        let bin = self.bins.iter().position(|count| {
            seen += count;
            seen >= rank
        });
        let max_ms = 1e3 * self.max.as_secs_f64();
        Some(match bin {
            Some(bin) if bin < BINS => (1e-3 * BIN_US as f64 * (bin + 1) as f64).min(max_ms),
            _ => max_ms,
        })
    }

    /// How many there are.
    pub fn count(&self) -> u64 {
        self.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_never_too_young() {
        let mut ages = AgeStatistics::default();
        assert_eq!(ages.quantile_ms(0.5), None);
        for us in 1..=1000_u64 {
            ages.add(Duration::from_micros(10 * us));
        }
        ages.add(Duration::from_secs(3));
        for share in [0.0, 0.1, 0.5, 0.99] {
            let exact_ms = share * 10.01;
            let found_ms = ages.quantile_ms(share).unwrap();
            assert!(found_ms >= exact_ms && found_ms <= exact_ms + 0.07, "{share} {found_ms}");
        }
        assert_eq!(ages.quantile_ms(1.0), Some(3000.0));
        assert_eq!(ages.count(), 1001);
    }
}
