//! How much more the white markers scatter than their own deviations say.

use glam::DVec2;

/// By how much the markers' residuals scatter more than their own deviations say, as a factor of the variance: the
/// usual a posteriori variance of unit weight, here over many frames, for one frame has few redundant equations. Colour
/// filters, compression and blur make edges rougher than flats, where a marker's own deviation comes from. What a
/// marker is off by in every frame is no scatter.
#[derive(Debug, Clone, Default)]
pub(super) struct ResidualScale {
    frames: f64,
    means_px: Vec<DVec2>,
    factor: f64,
}

/// Frames over which the scatter is taken.
const AVERAGED_FRAMES: f64 = 60.0;

impl ResidualScale {
    /// Of so many markers, before the first frame.
    pub fn new(markers: usize) -> Self {
        Self { means_px: vec![DVec2::ZERO; markers], ..Self::default() }
    }

    /// The residuals of a frame; frames in which a marker is not seen do not count.
    pub fn add(&mut self, residuals: impl Iterator<Item = Option<(DVec2, f64)>>) {
        let frames = (self.frames + 1.0).min(AVERAGED_FRAMES);
        let (mut square, mut variance, mut count) = (0.0, 0.0, 0.0);
        for (mean, residual) in self.means_px.iter_mut().zip(residuals) {
            let Some((residual, sd_px)) = residual else { return };
            let before = residual - *mean;
            *mean += before / frames;
            square += before.dot(residual - *mean);
            variance += 2.0 * sd_px * sd_px;
            count += 2.0;
        }
        let redundancy = (count - 6.0) / count;
        let here = square / (variance * redundancy);
        if count > 6.0 && here.is_finite() {
            self.frames = frames;
            self.factor += (here - self.factor) / frames;
        }
    }

    /// Factor of the variance, at least one: the markers' own deviations are never made smaller.
    pub fn variance_factor(&self) -> f64 {
        self.factor.max(1.0)
    }

    /// Forgets all frames.
    pub fn restart(&mut self) {
        (self.frames, self.factor) = (0.0, 0.0);
        self.means_px.fill(DVec2::ZERO);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use domecast_optics::numeric::SeededRandom;

    fn after(frames: usize, noise_px: f64, bias_px: f64) -> f64 {
        let mut random = SeededRandom::new(3);
        let mut scale = ResidualScale::new(4);
        for _ in 0..frames {
            let residuals: Vec<_> = (0..4)
                .map(|_| DVec2::new(random.normal(), random.normal()) * noise_px + DVec2::splat(bias_px))
                .collect();
            scale.add(residuals.into_iter().map(|residual| Some((residual, 0.1))));
        }
        scale.variance_factor()
    }

    #[test]
    fn scatter_beyond_the_deviations_counts_and_bias_does_not() {
        // Six of eight equations go to the pose: here, where none do, all of the scatter is left.
        let scale = after(2000, 0.2, 0.0);
        assert!((scale / (4.0 * 4.0) - 1.0).abs() < 0.4, "{scale}");
        assert_eq!(after(2000, 0.0, 5.0), 1.0);
        assert_eq!(after(200, 0.01, 0.0), 1.0);
    }

    #[test]
    fn frames_without_a_marker_do_not_count() {
        let mut scale = ResidualScale::new(4);
        scale.add([Some((DVec2::splat(9.0), 0.1)), None, None, None].into_iter());
        assert_eq!(scale.variance_factor(), 1.0);
    }
}
