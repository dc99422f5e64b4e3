//! The parts that the used effects have put together, in the order in which light meets them.

use super::effect::EffectName;
use super::frame::{Frame, Image8};
use super::light::LightUse;
use super::shading::Shading;
use super::work::Work;
use domecast_contact::Level;

/// What the used effects have installed.
///
/// An effect that is not used leaves no trace here: no flag, no pass, no table.
#[derive(Default)]
pub struct Pipeline {
    /// The way of the chief rays.
    pub geometry: Geometry,
    /// Which effects of light take part; [`super::light::shading`] makes the shading of them.
    pub light: LightUse,
    /// How contact is worked out; `None`: nothing touches the dome.
    pub contact: Option<Level>,
    /// What the dots look like.
    pub ink: Ink,
    /// When the rows gather light.
    pub timing: Timing,
    /// Passes over the picture, run stage by stage, within a stage in the order of their installation.
    pub passes: Vec<Box<dyn Pass>>,
    /// Passes over the coded picture, in order.
    pub coded_passes: Vec<Box<dyn CodedPass>>,
    /// The brightness of the membrane; made from `light` after all effects are applied. `None`: evenly lit.
    pub shading: Option<Box<dyn Shading>>,
    /// How far pixels of a lit membrane that are filled in between rays may be off, full scales; 0: each has its own ray.
    pub fill_tolerance: f32,
}

/// Which geometric effects take part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct Geometry {
    /// The lens as it is; else a pinhole of the same camera matrix.
    pub lens_distortion: bool,
    /// The pupil moves with the field angle.
    pub pupil_shift: bool,
    /// Layers bend rays; else rays are straight.
    pub refraction: bool,
    /// Each colour has its index; else all have that of green.
    pub dispersion: bool,
    /// The platform moves; else it stays at rest.
    pub sheet_motion: bool,
    /// The bend is solved in each frame; else the apparent points at rest move with the platform.
    pub gap_change: bool,
}

impl Geometry {
    /// The geometric effects among those that are used.
    pub fn of(uses: &dyn Fn(EffectName) -> bool) -> Self {
        Self {
            lens_distortion: uses(EffectName::LensDistortion),
            pupil_shift: uses(EffectName::PupilShift),
            refraction: uses(EffectName::Refraction),
            dispersion: uses(EffectName::Dispersion),
            sheet_motion: uses(EffectName::SheetMotion),
            gap_change: uses(EffectName::GapChange),
        }
    }

    /// Whether each frame solves the bend of its rays; else apparent points at rest move with the platform.
    pub fn solves(self) -> bool {
        self.gap_change || !self.refraction || !self.sheet_motion
    }
}

/// How dots are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Ink {
    /// Whether dots are drawn.
    pub dots: bool,
    /// Whether they fade out at the edge.
    pub soft_edge: bool,
}

/// When the rows gather light.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Timing {
    /// Exposure of each row, in `samples` equal parts whose pictures are averaged; `None`: an instant.
    pub exposure: Option<Exposure>,
    /// Rows exposed one after the other; `None`: all rows at the frame's time.
    pub rolling: Option<Rolling>,
}

/// A finite exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exposure {
    /// How long, s, centred on the row's time.
    pub exposure_s: f64,
    /// Pictures that are averaged, at the middles of as many equal parts.
    pub samples: u32,
}

/// Rows one after the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rolling {
    /// From the first row to the last, s; the middle of the picture is at the frame's time.
    pub readout_s: f64,
    /// Slices of rows: the sensor is worked out at the time of each one's middle row.
    pub slices: u32,
}

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
    /// Back to three planes.
    Demosaic,
}

/// Which picture a pass works on.
#[derive(Debug, Clone)]
pub struct PassContext {
    /// Number of the frame.
    pub frame: u32,
    /// Seed of the run; random numbers depend on seed, frame and place only, never on threads.
    pub seed: u64,
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
    /// Changes the picture.
    fn run(&self, image: &mut Image8, context: &PassContext, work: &mut Work);
}
