//! What the optics are made from, and what is wrong with it.

use super::dome::DomeShape;
use crate::camera::{LensError, LensSpec};
use crate::numeric::Rigid;

/// Colour channel of the camera; an index of refraction belongs to each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ColorChannel {
    /// Index 0 of [`FlatLayer::index`].
    Red,
    /// Index 1 of [`FlatLayer::index`]; the reference.
    #[default]
    Green,
    /// Index 2 of [`FlatLayer::index`].
    Blue,
}

impl ColorChannel {
    /// All channels, in the order of [`FlatLayer::index`].
    pub const ALL: [Self; 3] = [Self::Red, Self::Green, Self::Blue];
}

/// A flat layer of clear material.
#[derive(Debug, Clone, PartialEq)]
pub struct FlatLayer {
    /// What it is called.
    pub name: String,
    /// Index of refraction against air for red, green and blue, at least 1.
    pub index: [f64; 3],
    /// Thickness in millimetres, zero or more; `None` for the medium that fills
    /// the dome.
    pub thickness_mm: Option<f64>,
}

impl FlatLayer {
    /// The index for one channel.
    pub fn index_for(&self, channel: ColorChannel) -> f64 {
        self.index[channel as usize]
    }
}

/// Lens, layers and dome at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct OpticsSpec {
    /// The lens.
    pub lens: LensSpec,
    /// Camera frame to sensor frame without load; its origin is the entrance
    /// pupil on the axis.
    pub sensor_from_camera: Rigid,
    /// From the camera outwards, without the air; the last one fills the dome
    /// and has no thickness of its own, all others have one.
    pub layers: Vec<FlatLayer>,
    /// The dome's outer face.
    pub dome: DomeShape,
}

/// Optics that cannot be: the field, its value and what is allowed there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OpticsError {
    /// Path of the field (`lens.matrix[0][0]`, `layers[1].index`, ...).
    pub field: String,
    /// The value as given.
    pub value: String,
    /// What would be right.
    pub allowed: String,
}

impl OpticsError {
    pub(super) fn new(field: impl Into<String>, value: impl ToString, allowed: impl Into<String>) -> Self {
        Self { field: field.into(), value: value.to_string(), allowed: allowed.into() }
    }
}

impl From<LensError> for OpticsError {
    fn from(error: LensError) -> Self {
        Self::new(format!("lens.{}", error.field), error.value, error.allowed)
    }
}

impl std::fmt::Display for OpticsError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} is {}: {}", self.field, self.value, self.allowed)
    }
}

impl std::error::Error for OpticsError {}

/// Lengths outside this range (in mm) would leave the range of the numbers when
/// squared and compared.
const LENGTHS_MM: std::ops::RangeInclusive<f64> = 1e-9..=1e9;

/// Least height of a cap over its sphere's radius: a rim angle of 0.8 degrees.
const MIN_CAP: f64 = 1e-4;

/// Largest index of refraction; no clear material comes near it.
const MAX_INDEX: f64 = 100.0;

impl OpticsSpec {
    /// Whether layers and dome can be used; the lens is checked when it is
    /// built, the place of the camera by [`super::SensorOptics::new`].
    ///
    /// # Errors
    /// The first field at fault.
    pub fn check(&self) -> Result<(), OpticsError> {
        let (radius_mm, center_z_mm) = (self.dome.radius_mm(), self.dome.center_z_mm());
        if !LENGTHS_MM.contains(&radius_mm) {
            return Err(OpticsError::new("dome_radius_mm", radius_mm, "a positive length in mm"));
        }
        // below that the cap is thinner than rounding can tell
        let lowest_mm = -(1.0 - MIN_CAP) * radius_mm;
        if !(lowest_mm..=*LENGTHS_MM.end()).contains(&center_z_mm) {
            return Err(OpticsError::new(
                "dome_center_z_mm",
                center_z_mm,
                format!("more than {lowest_mm} mm: the pole is above the sheet"),
            ));
        }
        if self.layers.is_empty() {
            return Err(OpticsError::new("layers", "empty", "at least the medium that fills the dome"));
        }
        let last = self.layers.len() - 1;
        for (i, layer) in self.layers.iter().enumerate() {
            for index in layer.index {
                if !(1.0..=MAX_INDEX).contains(&index) {
                    return Err(OpticsError::new(
                        format!("layers[{i}].index"),
                        index,
                        "an index of refraction, 1 to 100",
                    ));
                }
            }
            let field = format!("layers[{i}].thickness_mm");
            match layer.thickness_mm {
                None if i < last => {
                    return Err(OpticsError::new(
                        field,
                        "missing",
                        "only the last layer, which fills the dome, has no thickness",
                    ));
                }
                Some(thickness) if i == last => {
                    return Err(OpticsError::new(
                        field,
                        thickness,
                        "the last layer fills the dome and takes no thickness",
                    ));
                }
                Some(thickness) if !(0.0..=*LENGTHS_MM.end()).contains(&thickness) => {
                    return Err(OpticsError::new(field, thickness, "a length in mm, zero or more"));
                }
                _ => {}
            }
        }
        self.sensor_from_camera
            .check()
            .map_err(|error| OpticsError::new("sensor_from_camera", "not rigid", error.to_string()))
    }
}
