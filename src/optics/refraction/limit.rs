//! Where the optics end, by name.

use crate::camera::LensLimit;

/// Why a pixel has no surface point, or a point no pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum RayLimit {
    /// Past the fold of the lens model.
    BeyondFold,
    /// Past the lens's field of view.
    BeyondFieldOfView,
    /// Not in front of the camera.
    BehindCamera,
    /// NaN or infinite input.
    NotFinite,
    /// No ray from there gets out of the layers into the air of the camera:
    /// the pupil touches the sheet and the point lies past the critical angle.
    TotalInternalReflection,
    /// The pixel's ray leaves the sheet's top outside the dome, or never
    /// reaches the sheet.
    MissesDome,
    /// The point lies above the sheet and outside the dome.
    OutsideDome,
    /// There is nothing between the pupil and the point for a ray to cross.
    Unreachable,
    /// The entrance pupil of this ray would lie inside the sheet.
    PupilInsideSheet,
    /// The bound on iterations was reached; no result is trusted.
    NotConverged,
}

impl RayLimit {
    /// The name in files.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::BeyondFold => LensLimit::BeyondFold.as_str(),
            Self::BeyondFieldOfView => LensLimit::BeyondFieldOfView.as_str(),
            Self::BehindCamera => LensLimit::BehindCamera.as_str(),
            Self::NotFinite => LensLimit::NotFinite.as_str(),
            Self::TotalInternalReflection => "total_internal_reflection",
            Self::MissesDome => "misses_dome",
            Self::OutsideDome => "outside_dome",
            Self::Unreachable => "unreachable",
            Self::PupilInsideSheet => "pupil_inside_sheet",
            Self::NotConverged => LensLimit::NotConverged.as_str(),
        }
    }
}

impl From<LensLimit> for RayLimit {
    fn from(limit: LensLimit) -> Self {
        match limit {
            LensLimit::BeyondFold => Self::BeyondFold,
            LensLimit::BeyondFieldOfView => Self::BeyondFieldOfView,
            LensLimit::BehindCamera => Self::BehindCamera,
            LensLimit::NotFinite => Self::NotFinite,
            LensLimit::NotConverged => Self::NotConverged,
        }
    }
}

impl std::fmt::Display for RayLimit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}

impl std::error::Error for RayLimit {}
