//! Heights of the skin as rows of the least squares.

use super::forces::ForceDistribution;
use super::result::HeightSample;

/// A height counts for a node when it is measured nearer to it than this part of the nodes' distance.
const HEIGHT_REACH: f64 = 0.15;
/// Least deviation of a height, mm.
const MIN_HEIGHT_SD_MM: f64 = 0.002;

impl ForceDistribution {
    /// Means of the heights that lie about each node, with their deviations.
    pub(super) fn take_heights(&mut self, samples: &[HeightSample]) {
        self.measured.clear();
        if samples.is_empty() {
            return;
        }
        self.heights.fill((0.0, 0.0));
        let reach_mm = HEIGHT_REACH * self.model.compliance.grid.spacing_mm();
        for sample in samples {
            let sd_mm = sample.sd_mm.max(MIN_HEIGHT_SD_MM);
            if !(sample.height_mm.is_finite() && sd_mm.is_finite() && sample.surface_mm.is_finite()) {
                continue;
            }
            let near = self.model.about(sample.surface_mm).max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((node, _)) = near else { continue };
            if self.model.nodes[node].at_mm.distance(sample.surface_mm) > reach_mm {
                continue;
            }
            // Neighbouring pixels err alike: more of them make a mean no better than one.
            let (sum, weight) = &mut self.heights[node];
            let own = 1.0 / (sd_mm * sd_mm);
            *sum += own * sample.height_mm;
            *weight += own;
            if own == *weight {
                self.measured.push(node);
            }
        }
        for &node in &self.measured {
            let (sum, weight) = self.heights[node];
            self.heights[node] = (sum / weight, weight.sqrt().min(1.0 / MIN_HEIGHT_SD_MM));
        }
    }
}
