//! How much more the white markers scatter than each of them says.

use glam::DVec2;

/// By how much the markers' residuals scatter more than their own deviations say, as a factor of the variance: the
/// usual a posteriori variance of unit weight, here over many frames, for one frame has few spare equations. Colour
/// filters, compression and blur make edges rougher than flats, where a marker's own deviation comes from. What a
/// marker is off by in every frame is no scatter.
#[derive(Debug, Clone, Default)]
pub(super) struct Surplus {
    frames: f64,
    means_px: Vec<DVec2>,
    factor: f64,
}

/// Frames over which the scatter is taken.
const SURPLUS_FRAMES: f64 = 60.0;

impl Surplus {
    /// Of so many markers, before the first frame.
    pub fn new(markers: usize) -> Self {
        Self { means_px: vec![DVec2::ZERO; markers], ..Self::default() }
    }

    /// The residuals of a frame; frames in which a marker is not seen do not count.
    pub fn add(&mut self, residuals: impl Iterator<Item = Option<(DVec2, f64)>>) {
        let frames = (self.frames + 1.0).min(SURPLUS_FRAMES);
        let (mut square, mut variance, mut count) = (0.0, 0.0, 0.0);
        for (mean, residual) in self.means_px.iter_mut().zip(residuals) {
            let Some((residual, sd_px)) = residual else { return };
            let before = residual - *mean;
            *mean += before / frames;
            square += before.dot(residual - *mean);
            variance += 2.0 * sd_px * sd_px;
            count += 2.0;
        }
        let spare = (count - 6.0) / count;
        let here = square / (variance * spare);
        if count > 6.0 && here.is_finite() {
            self.frames = frames;
            self.factor += (here - self.factor) / frames;
        }
    }

    /// At least one: what the markers' own deviations say is never made smaller.
    pub fn factor(&self) -> f64 {
        self.factor.max(1.0)
    }

    pub fn forget(&mut self) {
        (self.frames, self.factor) = (0.0, 0.0);
        self.means_px.fill(DVec2::ZERO);
    }
}
