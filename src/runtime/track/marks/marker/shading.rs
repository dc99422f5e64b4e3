//! How the light falls off across a marker, over the frames.

use glam::DVec2;

/// How the light falls off across a marker, over the frames in which it was seen.
///
/// A lens darkens its corners and a lamp one side: a disc that is brighter on one side is fitted too far there. One
/// frame's slope is noisy; but it stays, and the mean over some frames is not.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::track) struct ShadingSlope {
    mean: DVec2,
    frames: f64,
}

/// Frames that a slope is averaged over.
const AVERAGED_FRAMES: f64 = 100.0;
/// Weight of the prior slope of zero, frames.
const PRIOR_FRAMES: f64 = 1.0;
/// Steeper than this in a px, a disc is lit by something else than a lens's or a lamp's fall-off.
const MAX_SLOPE: f64 = 0.05;

/// A slope that a lens or a lamp makes; `None` of a steeper one.
pub(super) fn usable_slope(slope: Option<DVec2>) -> Option<DVec2> {
    slope.filter(|slope| slope.length() < MAX_SLOPE)
}

impl ShadingSlope {
    /// The best estimate so far, parts of the disc's level a px.
    pub fn estimate(&self) -> DVec2 {
        self.mean * (self.frames / (self.frames + PRIOR_FRAMES))
    }

    /// Takes in the slope that one frame shows.
    pub fn add(&mut self, slope: Option<DVec2>) {
        if let Some(slope) = usable_slope(slope) {
            self.frames = (self.frames + 1.0).min(AVERAGED_FRAMES);
            self.mean += (slope - self.mean) / self.frames;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_averaged_and_wild_ones_left_out() {
        let mut shading = ShadingSlope::default();
        assert_eq!(shading.estimate(), DVec2::ZERO);
        for k in 0..200 {
            let noise = if k % 2 == 0 { 0.01 } else { -0.01 };
            shading.add(Some(DVec2::new(0.02 + noise, 0.0)));
            shading.add(Some(DVec2::new(0.0, 0.4)));
            shading.add(None);
        }
        assert!(shading.estimate().distance(DVec2::new(0.02, 0.0)) < 1e-3, "{}", shading.estimate());
    }
}
