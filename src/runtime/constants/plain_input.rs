//! What the constants of a plain runtime are fitted to, and why there may be none.

use glam::DVec3;
use nalgebra::Matrix6;

use super::model::StiffnessAt;
use domecast_optics::pose::{Marker, PoseError};
use domecast_optics::{OpticsError, RayLimit, SensorOptics};

/// Why there is no fit.
#[derive(Debug, Clone, PartialEq)]
pub enum PlainError {
    /// A marker cannot be seen at one of the loads.
    NotVisible {
        /// The marker.
        id: u32,
        /// The limit that it is past.
        limit: RayLimit,
    },
    /// A load's pose puts the camera into the sheet.
    Optics(OpticsError),
    /// Plain PnP found no pose.
    Pose(PoseError),
    /// The loads do not span what is fitted.
    Undetermined,
}

impl std::fmt::Display for PlainError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotVisible { id, limit } => {
                write!(f, "white marker {id} is not seen under a claimed load ({limit})")
            }
            Self::Optics(error) => error.fmt(f),
            Self::Pose(error) => error.fmt(f),
            Self::Undetermined => write!(f, "the loads do not span what is fitted"),
        }
    }
}

impl std::error::Error for PlainError {}

/// The sensor as the plain runtime's constants are made for it.
#[derive(Debug, Clone, Copy)]
pub struct PlainInput<'a> {
    /// Lens, layers and dome at rest.
    pub optics: &'a SensorOptics,
    /// The white markers as they are.
    pub markers: &'a [Marker],
    /// Camera matrix of the undistorted frame.
    pub undistorted_matrix: [[f64; 3]; 3],
    /// Point that stiffness and moments are stated about, rest frame, mm.
    pub at_mm: DVec3,
    /// The 6x6 at rest that a geometry or a calibration gives.
    pub stiffness: Matrix6<f64>,
    /// The 6x6 under compression; empty where there is only the one at rest.
    pub stiffness_at: &'a [StiffnessAt],
}
