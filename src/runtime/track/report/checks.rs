//! Whether the dots as a whole are as they should be.

use crate::track::identities::DotTrack;
use crate::track::model::DotModel;

/// A spread wider than expected by this factor is blur.
const BLURRED: f64 = 1.7;
/// Fewest dots that blur is judged by.
const MIN_BLUR_DOTS: usize = 8;

/// Judges dots; keeps its buffer.
#[derive(Debug, Clone)]
pub(super) struct DotChecks {
    values: Vec<f64>,
}

impl DotChecks {
    /// For so many dots.
    pub fn new(count: usize) -> Self {
        Self { values: Vec::with_capacity(count) }
    }

    /// Whether half of the dots are much wider than they should be.
    pub fn are_blurred(&mut self, tracks: &[DotTrack]) -> bool {
        self.values.clear();
        let found = tracks.iter().filter_map(|t| Some((t.spot?, t.outline)));
        self.values.extend(found.map(|(spot, outline)| spot.spread_px2 / outline.spread_px2.max(1e-9)));
        let count = self.values.len();
        quantile(&mut self.values, 0.5).is_some_and(|wide| count >= MIN_BLUR_DOTS && wide > BLURRED)
    }

    /// Whether three quarters of the dots are farther from where the pose puts them than this part of their spacing: a
    /// finger moves some of the dots; foreign constants misplace nearly all.
    pub fn are_misplaced(&mut self, tracks: &[DotTrack], models: &[DotModel], max_misplaced: f64) -> bool {
        self.values.clear();
        for (track, model) in tracks.iter().zip(models) {
            if let (Some(now), Some(expected)) = (track.now_px(), track.expected_px) {
                self.values.push(now.distance(expected) / model.spacing_px);
            }
        }
        quantile(&mut self.values, 0.25).is_some_and(|quarter| quarter > max_misplaced)
    }
}

/// The value that a part of the list is below; the list is reordered.
fn quantile(values: &mut [f64], part: f64) -> Option<f64> {
    let at = ((values.len() as f64 * part) as usize).min(values.len().checked_sub(1)?);
    Some(*values.select_nth_unstable_by(at, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_short_lists() {
        assert_eq!(quantile(&mut [], 0.5), None);
        assert_eq!(quantile(&mut [3.0], 0.25), Some(3.0));
        assert_eq!(quantile(&mut [4.0, 1.0, 3.0, 2.0], 0.25), Some(2.0));
        assert_eq!(quantile(&mut [4.0, 1.0, 3.0, 2.0], 1.0), Some(4.0));
    }
}
