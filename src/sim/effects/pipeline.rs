//! The parts that the used effects have put together, in the order in which light meets them.

use crate::electronics::exposure::Metering;
use crate::electronics::pass::{CodedPass, Pass};
use crate::light::LightUse;
use crate::light::gloss::Gloss;
use crate::light::shading::Shading;
use crate::light::uneven::Unevenness;
use crate::raster::settings::{Geometry, Ink, Timing};
use crate::raster::specks::Specks;
use domecast_contact::{Level, Relaxation};

/// What the used effects have installed.
///
/// An effect that is not used leaves no trace here: no flag, no pass, no table.
#[derive(Default)]
pub struct Pipeline {
    /// The way of the chief rays.
    pub geometry: Geometry,
    /// Which effects of light take part; [`crate::light::shading`] makes the shading of them.
    pub light: LightUse,
    /// How contact is computed; `None`: nothing touches the dome.
    pub contact: Option<Level>,
    /// How the elastomer's modulus relaxes, and its instant value, MPa; `None`: it is elastic.
    pub slow_gel: Option<(Relaxation, f64)>,
    /// What the dots look like.
    pub ink: Ink,
    /// The lights mirrored in the sheet's faces.
    pub gloss: Option<Gloss>,
    /// Dust and scratches before the sensor.
    pub dust: Option<Specks>,
    /// How uneven the membrane is; taken into `shading` after all effects are applied.
    pub unevenness: Option<Unevenness>,
    /// When the rows gather light.
    pub timing: Timing,
    /// The gains that follow the frames before.
    pub metering: Metering,
    /// Passes over the picture, run stage by stage, within a stage in the order of their installation.
    pub passes: Vec<Box<dyn Pass>>,
    /// Passes over the coded picture, in order.
    pub coded_passes: Vec<Box<dyn CodedPass>>,
    /// The brightness of the membrane; made from `light` after all effects are applied. `None`: evenly lit.
    pub shading: Option<Box<dyn Shading>>,
    /// How far pixels of a lit membrane that are filled in between rays may be off, full scales; 0: each has its own ray.
    pub fill_tolerance: f32,
}
