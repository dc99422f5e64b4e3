//! How finely a circle is divided, and which of its measures the polygon keeps.

use std::f64::consts::PI;

use super::MeshError;

/// What the polygon that stands for a circle keeps exactly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Fit {
    /// The corners lie on the circle: never larger than stated. For pins and
    /// anything that must enter a hole.
    Inside,
    /// The sides touch the circle: never smaller than stated. For bores and
    /// pockets that must receive a part, and for windows that must not shade.
    Outside,
    /// The area (of a sphere's or cone's sections, too) is the circle's. For
    /// cavities whose volume matters and for outer contours.
    Area,
}

/// The user's chord tolerance: the largest distance allowed between a
/// triangulated surface and the exact one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chord {
    tolerance_mm: f64,
}

/// More divisions than this per circle are refused: with rings in both
/// directions they would not fit a 32-bit index.
const MAX_SEGMENTS: f64 = 20_000.0;

impl Chord {
    /// # Errors
    /// [`MeshError::Dimension`] unless `tolerance_mm` is finite and positive.
    pub fn new(tolerance_mm: f64) -> Result<Self, MeshError> {
        if tolerance_mm.is_finite() && tolerance_mm > 0.0 {
            Ok(Self { tolerance_mm })
        } else {
            Err(MeshError::Dimension {
                shape: "mesh".into(),
                dimension: "chord tolerance",
                value: tolerance_mm,
                allowed: "a positive, finite length",
            })
        }
    }

    /// The tolerance in mm.
    pub fn tolerance_mm(self) -> f64 {
        self.tolerance_mm
    }

    /// Half the tolerance: what each of the two directions of a doubly curved
    /// surface may use.
    pub fn halved(self) -> Self {
        Self { tolerance_mm: 0.5 * self.tolerance_mm }
    }

    /// Sides of the regular polygon that stands for a circle of `radius_mm`,
    /// a multiple of four so that the axes' extreme points are corners.
    ///
    /// The sagitta of a chord with corners on the circle is
    /// `r (1 - cos(pi/n))`, of a tangent polygon's corner `r (1/cos(pi/n) - 1)`;
    /// both must stay within the tolerance.
    ///
    /// # Errors
    /// [`MeshError::TooManyTriangles`] if the tolerance is so fine for the
    /// radius that the mesh could not be indexed.
    pub fn circle_segments(self, radius_mm: f64, fit: Fit) -> Result<u32, MeshError> {
        let n = (segments_for(PI, radius_mm, self.tolerance_mm, fit) / 4.0).ceil() * 4.0;
        if n > MAX_SEGMENTS {
            return Err(MeshError::TooManyTriangles { count: n * n, limit: u32::MAX as usize / 2 });
        }
        Ok((n as u32).max(8))
    }

    /// Chords for an arc of `sweep_rad` at `radius_mm`; at least one.
    ///
    /// # Errors
    /// As [`Self::circle_segments`].
    pub fn arc_segments(self, radius_mm: f64, sweep_rad: f64, fit: Fit) -> Result<u32, MeshError> {
        let n = segments_for(0.5 * sweep_rad.abs(), radius_mm, self.tolerance_mm, fit);
        if n > MAX_SEGMENTS {
            return Err(MeshError::TooManyTriangles { count: n * n, limit: u32::MAX as usize / 2 });
        }
        Ok((n as u32).max(1))
    }
}

/// Number of chords of a sweep of `2 * half_sweep_rad` such that each chord's
/// half angle is at most the one that the tolerance allows (a whole circle has
/// a half sweep of pi).
fn segments_for(half_sweep_rad: f64, radius_mm: f64, tolerance_mm: f64, fit: Fit) -> f64 {
    let cosine = match fit {
        Fit::Inside => 1.0 - tolerance_mm / radius_mm,
        // The area polygon's corners stick out by a third of the sagitta and
        // its sides sink in by two thirds; the tangent bound covers it too.
        Fit::Outside | Fit::Area => radius_mm / (radius_mm + tolerance_mm),
    };
    let half_angle_rad = cosine.clamp(0.0, 1.0).acos().max(1e-9);
    (half_sweep_rad / half_angle_rad).ceil().max(1.0)
}

impl Fit {
    /// Radius of the polygon's corners, for `half_angle_rad` = half the angle
    /// between neighbouring corners.
    pub fn corner_radius_mm(self, radius_mm: f64, half_angle_rad: f64) -> f64 {
        match self {
            Self::Inside => radius_mm,
            Self::Outside => radius_mm / half_angle_rad.cos(),
            // Area of n triangles: n/2 R^2 sin(2a) = pi r^2 with n a = pi.
            Self::Area => radius_mm * (2.0 * half_angle_rad / (2.0 * half_angle_rad).sin()).sqrt(),
        }
    }
}
