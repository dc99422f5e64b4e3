//! From a pattern in the image to dots on the dome and on the plate.
//!
//! The pattern is laid out where it has to look even: in the raw image, or in the runtime's undistorted
//! frame. Each dot is carried back along the camera's rays through the layers to the dome, and from there by
//! the pad's map to the plate. What cannot be seen or printed is left out with its reason, or refused, as the
//! design says.

pub mod boundary;
pub mod calibrate;
mod carry;
mod check;
pub mod coverage;
pub mod dot;
mod edge;
pub mod evenness;
mod fill;
pub mod frame;
mod gaps;
mod hits;
pub mod lost;
pub mod neighbors;
pub mod outline;
pub mod pattern;
pub mod region;
pub mod report;
mod spec;
pub mod target;
#[cfg(test)]
mod tests;
pub mod tolerances;
pub mod window;
mod zones;

use std::fmt;

use glam::{DMat3, DVec2};

use boundary::Boundary;
pub use dot::{Dot, DotSize};
pub use lost::{LostDot, Reason, Rule, Zone};
pub use spec::{LayoutSpec, Mask, WhiteMarker};

use crate::spec::{Design, DesignError};
use crate::transfer::TransferMap;

/// The dots of a design.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// The dots; the index is the id.
    pub dots: Vec<Dot>,
    /// The dots of the pattern that are left out, with their reasons.
    pub lost: Vec<LostDot>,
    /// The pad's hits.
    pub hits: Vec<Hit>,
    /// Distance of neighbours in the even frame, px; solved if the design gives a number of dots.
    pub pitch_px: f64,
    /// Size of the dots.
    pub size: DotSize,
    /// Centre of the pattern in the even frame, px.
    pub center_px: DVec2,
    /// Edge of the pattern in the even frame, around its centre.
    pub edge: Boundary,
    /// The pad's map, the same for each hit.
    pub transfer: TransferMap,
    /// What a person should know, in words.
    pub warnings: Vec<String>,
}

/// One hit of the pad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Angle between the dome's axis and the stroke, rad.
    pub tilt_rad: f64,
    /// Azimuth towards which the stroke's contact moves from the pole, rad from +x.
    pub azimuth_rad: f64,
    /// Turns a direction of the sensor frame into the hit's frame, whose +z is the stroke reversed. Zero tilt
    /// is the identity; else the meridian towards the hit stays where it is.
    pub hit_from_sensor: DMat3,
}

impl Hit {
    /// The hit whose pad comes down along the normal at this polar angle and azimuth.
    pub fn new(tilt_rad: f64, azimuth_rad: f64) -> Self {
        let turn = DMat3::from_rotation_z(azimuth_rad);
        let hit_from_sensor = turn * DMat3::from_rotation_y(-tilt_rad) * turn.transpose();
        Self { tilt_rad, azimuth_rad, hit_from_sensor }
    }
}

/// A pattern that cannot be laid out as the design asks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LayoutError {
    /// The field at fault, as a path in the design file.
    pub field: String,
    /// Its value, or what it led to.
    pub value: String,
    /// What is wrong.
    pub problem: String,
    /// What is allowed.
    pub allowed: String,
}

impl LayoutError {
    fn new(
        field: impl Into<String>,
        value: impl ToString,
        problem: impl Into<String>,
        allowed: impl Into<String>,
    ) -> Self {
        Self {
            field: field.into(),
            value: value.to_string(),
            problem: problem.into(),
            allowed: allowed.into(),
        }
    }
}

impl fmt::Display for LayoutError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` is {}: {}; allowed: {}", self.field, self.value, self.problem, self.allowed)
    }
}

impl std::error::Error for LayoutError {}

impl From<LayoutError> for DesignError {
    fn from(error: LayoutError) -> Self {
        Self::at(error.field, error.value, error.problem, error.allowed)
    }
}

impl Design {
    /// The dots of the design.
    ///
    /// # Errors
    /// As for [`Layout::new`].
    pub fn layout(&self) -> Result<Layout, LayoutError> {
        Layout::of_design(self)
    }
}

impl Layout {
    /// Lays out the dots of a design.
    ///
    /// # Errors
    /// As for [`Self::new`].
    pub fn of_design(design: &Design) -> Result<Self, LayoutError> {
        Self::new(&LayoutSpec::of_design(design)?)
    }

    /// Lays out the dots.
    ///
    /// # Errors
    /// The pattern has no place, its dots are larger than its pitch, or a dot that the design requires cannot
    /// be seen or printed.
    pub fn new(spec: &LayoutSpec) -> Result<Self, LayoutError> {
        carry::lay_out(spec)
    }
}
