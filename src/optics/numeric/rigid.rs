//! Rigid motions, `target_from_source`.

use glam::{DMat3, DVec3};

/// How far a matrix may be from a rotation and still be taken for one.
///
/// The largest entry of `RᵀR - I` and the distance of the determinant from 1
/// are compared with it. It is a tolerance for what people and files write
/// (seven digits), not a rounding bound.
pub const ROTATION_TOLERANCE: f64 = 1e-6;

/// A rotation followed by a translation: `target = rotation * source + translation_mm`.
///
/// A value is named `target_from_source`, so that
/// `a_from_b.compose(&b_from_c)` reads as what it is: `a_from_c`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigid {
    /// Rotation part (columns are the source's axes seen in the target).
    pub rotation: DMat3,
    /// The source's origin in the target frame, in millimetres.
    pub translation_mm: DVec3,
}

/// Why a 4x4 matrix is not a rigid motion.
#[derive(Debug, Clone, PartialEq)]
pub enum RigidError {
    /// An entry is NaN or infinite.
    NotFinite,
    /// The last row is not `0 0 0 1`.
    LastRow([f64; 4]),
    /// The 3x3 block is not orthonormal; the value is the largest entry of `RᵀR - I`.
    NotOrthonormal(f64),
    /// The 3x3 block mirrors: its determinant is -1.
    Mirrored,
}

impl std::fmt::Display for RigidError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotFinite => write!(f, "a rigid motion needs 16 finite numbers"),
            Self::LastRow(row) => write!(f, "the last row is {row:?}, it must be [0, 0, 0, 1]"),
            Self::NotOrthonormal(error) => write!(
                f,
                "the rotation is off by {error:.3e} from an orthonormal matrix, at most {ROTATION_TOLERANCE:e} is allowed"
            ),
            Self::Mirrored => write!(f, "the rotation mirrors (determinant -1), it must turn (+1)"),
        }
    }
}

impl std::error::Error for RigidError {}

impl Default for Rigid {
    fn default() -> Self {
        Self::identity()
    }
}

impl Rigid {
    /// A motion from its parts, unchecked; see [`Rigid::check`].
    pub fn new(rotation: DMat3, translation_mm: DVec3) -> Self {
        Self { rotation, translation_mm }
    }

    /// The motion that changes nothing.
    pub fn identity() -> Self {
        Self::new(DMat3::IDENTITY, DVec3::ZERO)
    }

    /// A pure translation, in millimetres.
    pub fn from_translation(translation_mm: DVec3) -> Self {
        Self::new(DMat3::IDENTITY, translation_mm)
    }

    /// `source_from_target`, exact for an orthonormal rotation.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self::new(rotation, -(rotation * self.translation_mm))
    }

    /// `a_from_b.compose(&b_from_c)` is `a_from_c`.
    pub fn compose(&self, then: &Self) -> Self {
        Self::new(self.rotation * then.rotation, self.rotation * then.translation_mm + self.translation_mm)
    }

    /// A point of the source frame, in the target frame (millimetres).
    pub fn point(&self, point_mm: DVec3) -> DVec3 {
        self.rotation * point_mm + self.translation_mm
    }

    /// A direction of the source frame, in the target frame.
    pub fn vector(&self, vector: DVec3) -> DVec3 {
        self.rotation * vector
    }

    /// Whether all numbers are finite and the rotation is one, to
    /// [`ROTATION_TOLERANCE`].
    pub fn check(&self) -> Result<(), RigidError> {
        if !self.rotation.is_finite() || !self.translation_mm.is_finite() {
            return Err(RigidError::NotFinite);
        }
        let gram = self.rotation.transpose() * self.rotation - DMat3::IDENTITY;
        let error = gram.to_cols_array().iter().fold(0.0_f64, |worst, e| worst.max(e.abs()));
        // Written so that an overflow to NaN counts as wrong too.
        if error.is_nan() || error > ROTATION_TOLERANCE {
            return Err(RigidError::NotOrthonormal(error));
        }
        if self.rotation.determinant() < 0.0 {
            return Err(RigidError::Mirrored);
        }
        Ok(())
    }

    /// The nearest exact rotation to a nearly orthonormal one (the polar
    /// factor, by Newton's iteration `R <- (R + R^-T) / 2`, which squares the
    /// error in each step); the translation stays.
    ///
    /// Matrices from files have six or seven digits; this makes them as
    /// orthonormal as the arithmetic allows before a pixel is computed.
    pub fn orthonormalized(&self) -> Self {
        let mut rotation = self.rotation;
        for _ in 0..4 {
            rotation = (rotation + rotation.inverse().transpose()) * 0.5;
        }
        Self::new(rotation, self.translation_mm)
    }

    /// From a row-major 4x4 matrix `[R t; 0 0 0 1]`.
    ///
    /// # Errors
    /// [`RigidError`] when an entry is not finite, the last row is not
    /// `0 0 0 1`, or the rotation is not one.
    pub fn from_rows_4x4(rows: &[[f64; 4]; 4]) -> Result<Self, RigidError> {
        if rows.iter().flatten().any(|v| !v.is_finite()) {
            return Err(RigidError::NotFinite);
        }
        if rows[3] != [0.0, 0.0, 0.0, 1.0] {
            return Err(RigidError::LastRow(rows[3]));
        }
        let rotation = DMat3::from_cols_array_2d(&[
            [rows[0][0], rows[1][0], rows[2][0]],
            [rows[0][1], rows[1][1], rows[2][1]],
            [rows[0][2], rows[1][2], rows[2][2]],
        ]);
        let motion = Self::new(rotation, DVec3::new(rows[0][3], rows[1][3], rows[2][3]));
        motion.check()?;
        Ok(motion)
    }

    /// As a row-major 4x4 matrix `[R t; 0 0 0 1]`.
    pub fn to_rows_4x4(&self) -> [[f64; 4]; 4] {
        let r = self.rotation;
        let t = self.translation_mm;
        [
            [r.x_axis.x, r.y_axis.x, r.z_axis.x, t.x],
            [r.x_axis.y, r.y_axis.y, r.z_axis.y, t.y],
            [r.x_axis.z, r.y_axis.z, r.z_axis.z, t.z],
            [0.0, 0.0, 0.0, 1.0],
        ]
    }
}
