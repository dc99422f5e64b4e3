//! What a lossy code makes of a picture.

use serde::Serialize;

/// How far the values of coded pictures are from those that went into the code, grey levels of 8 bits.
#[derive(Debug, Clone, PartialEq)]
pub struct CodingDeviation {
    /// Values by the size of their change.
    counts: [u64; 256],
}

/// The same in three numbers, grey levels of 8 bits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CodingFigures {
    /// The largest change of a value.
    pub max_grey: u8,
    /// 999 of 1000 values change by no more.
    pub p999_grey: u8,
    /// Root mean square of the changes.
    pub rms_grey: f64,
}

impl CodingDeviation {
    /// Between the values before the code and after it.
    ///
    /// ```
    /// use domecast_sim::electronics::deviation::CodingDeviation;
    ///
    /// let figures = CodingDeviation::between(&[10, 20, 30, 40], &[10, 23, 30, 40]).figures();
    /// assert_eq!((figures.max_grey, figures.rms_grey), (3, 1.5));
    /// ```
    pub fn between(before: &[u8], after: &[u8]) -> Self {
        let mut counts = [0; 256];
        for (a, b) in before.iter().zip(after) {
            counts[usize::from(a.abs_diff(*b))] += 1;
        }
        Self { counts }
    }

    /// Adds the values of other pictures.
    pub fn merge(&mut self, other: &Self) {
        for (sum, count) in self.counts.iter_mut().zip(other.counts) {
            *sum += count;
        }
    }

    /// The numbers; all 0 of no values.
    pub fn figures(&self) -> CodingFigures {
        let total: u64 = self.counts.iter().sum();
        let sizes = || (0_u8..=255).zip(self.counts);
        let mut beyond = total / 1000;
        let mut p999_grey = 0;
        for (size, count) in sizes().rev() {
            if count > beyond {
                p999_grey = size;
                break;
            }
            beyond -= count;
        }
        let squares: f64 = sizes().map(|(size, count)| f64::from(size).powi(2) * count as f64).sum();
        let largest = sizes().filter(|(_, count)| *count > 0).map(|(size, _)| size).max();
        let rms_grey = (squares / total.max(1) as f64).sqrt();
        CodingFigures { max_grey: largest.unwrap_or(0), p999_grey, rms_grey }
    }
}
