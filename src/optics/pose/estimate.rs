//! What goes into a pose and what comes out of it.

use glam::{DMat3, DVec2, DVec3};
use nalgebra::Matrix6;

use crate::numeric::{Rigid, cross_matrix, vector_from_rotation};

/// What the solver takes for granted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseOptions {
    /// Standard deviation of a centroid on each image axis, px.
    pub noise_px: f64,
    /// Farthest that the platform can be from rest, mm.
    pub max_shift_mm: f64,
    /// Farthest that the platform can turn from rest, rad; below half the markers' symmetry, so that markers
    /// counted one further do not pass for a turned platform.
    pub max_turn_rad: f64,
}

impl PoseOptions {
    /// The reach of a platform on springs: a turn of 40 degrees, a shift as given.
    pub fn new(noise_px: f64, max_shift_mm: f64) -> Self {
        Self { noise_px, max_shift_mm, max_turn_rad: 0.7 }
    }
}

/// A marker as the image processing found it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// Number of the marker.
    pub id: u32,
    /// Centroid in the raw image, px.
    pub centroid_px: DVec2,
}

/// A pose with what is known of its errors.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseEstimate {
    /// `rest_from_platform`.
    pub pose: Rigid,
    /// Inverse of the covariance: what the pixels and their noise say of a small motion after the pose,
    /// `exp(v, w) pose`, v mm, w rad about the rest frame's origin.
    pub information: Matrix6<f64>,
    /// Root mean square of the residuals over both axes of all markers, px.
    pub rms_px: f64,
    /// Steps of the refinement.
    pub iterations: u32,
    /// A second pose that explains the pixels as well as noise allows: then the answer is ambiguous.
    pub other: Option<Rigid>,
}

impl PoseEstimate {
    /// Whether two poses explain the pixels.
    pub fn is_ambiguous(&self) -> bool {
        self.other.is_some()
    }

    /// Covariance of a small motion after the pose, `exp(v, w) pose`: v mm, w rad about the rest frame's origin.
    /// Infinite variance on every axis where the pixels leave a direction open.
    pub fn covariance(&self) -> Matrix6<f64> {
        let open = || Matrix6::from_diagonal_element(f64::MAX);
        self.information.cholesky().map_or_else(open, |c| c.inverse())
    }

    /// Covariance of the displacement about a point of the rest frame: translation (mm) of the platform's point
    /// that is there at rest, and rotation vector (rad).
    pub fn displacement_covariance(&self, at_mm: DVec3) -> Matrix6<f64> {
        let transfer = displacement_from_motion(&self.pose, at_mm);
        transfer * self.covariance() * transfer.transpose()
    }
}

/// Derivative of the displacement (translation of the platform's point that is at `at_mm` at rest, rotation
/// vector) by a motion `exp(v, w)` after the pose.
pub fn displacement_from_motion(pose: &Rigid, at_mm: DVec3) -> Matrix6<f64> {
    let place = pose.point(at_mm);
    let rotation = vector_from_rotation(&pose.rotation);
    let square = rotation.length_squared();
    // Inverse left Jacobian: I - [r]/2 + e [r]^2, e = (1 - (a/2) cot(a/2)) / a^2.
    let e = if square < 1e-4 {
        1.0 / 12.0 + square / 720.0
    } else {
        let half = 0.5 * square.sqrt();
        (1.0 - half / half.tan()) / square
    };
    let cross = cross_matrix(rotation);
    let turn = DMat3::IDENTITY - cross * 0.5 + cross * cross * e;
    let swing = cross_matrix(-place);
    Matrix6::from_fn(|i, j| match (i < 3, j < 3) {
        (true, true) => f64::from(u8::from(i == j)),
        (true, false) => swing.col(j - 3)[i],
        (false, true) => 0.0,
        (false, false) => turn.col(j - 3)[i - 3],
    })
}
