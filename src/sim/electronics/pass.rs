//! Passes over the picture, between light and bytes.

use crate::effect_name::EffectName;
use crate::electronics::deviation::CodingDeviation;
use crate::raster::frame::{Frame, Image8};
use crate::work::Work;

/// Where on the way from light to bytes a pass stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Brightness of the image on the image plane, before any blur: vignetting.
    Vignetting,
    /// Sharpness: defocus. Runs on each of the averaged pictures, whose scene stands still.
    Focus,
    /// From here on once a frame, after averaging: the colour filters. May leave one plane.
    Mosaic,
    /// Electrons: shot and read noise, the converter.
    Sensor,
    /// What no light changes any more: dead pixels.
    Readout,
    /// Back to three planes.
    Demosaic,
    /// The gains of the colours.
    Balance,
    /// The camera's processor sharpens.
    Sharpening,
}

/// The gains of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains {
    /// Before the converter, for all colours.
    pub exposure: f64,
    /// After it, for red, green and blue.
    pub balance: [f64; 3],
}

impl Default for Gains {
    fn default() -> Self {
        Self { exposure: 1.0, balance: [1.0; 3] }
    }
}

/// Which picture a pass works on.
#[derive(Debug, Clone, Default)]
pub struct PassContext {
    /// Number of the frame.
    pub frame: u32,
    /// Seed of the run; random numbers depend on seed, frame and place only, never on threads.
    pub seed: u64,
    /// The gains that the camera has set.
    pub gains: Gains,
}

/// A pass over the picture.
pub trait Pass: Send + Sync {
    /// The effect that installed it, to which its work is counted.
    fn effect(&self) -> EffectName;
    /// When it runs.
    fn stage(&self) -> Stage;
    /// Changes the picture.
    fn run(&self, frame: &mut Frame, context: &PassContext, work: &mut Work);
}

/// A pass over the coded picture.
pub trait CodedPass: Send + Sync {
    /// The effect that installed it.
    fn effect(&self) -> EffectName;
    /// Whether it is a code that loses something, after which no tolerance holds.
    fn is_lossy(&self) -> bool;
    /// Changes the picture.
    fn run(&self, image: &mut Image8, context: &PassContext, work: &mut Work);
}

/// Runs the passes over the coded picture, and tells what a lossy code among them makes of it; `None` without one.
pub fn run_coded(
    passes: &[Box<dyn CodedPass>],
    image: &mut Image8,
    context: &PassContext,
    work: &mut Work,
) -> Option<CodingDeviation> {
    let mut found = None;
    for pass in passes {
        let before = pass.is_lossy().then(|| image.bytes.clone());
        pass.run(image, context, work);
        found = before.map(|before| CodingDeviation::between(&before, &image.bytes)).or(found);
    }
    found
}
