//! Displacement of the dome's surface, by level.

mod pushed_out;
mod sunk;

use glam::DVec3;

use crate::fem::SurfaceField;
use crate::outcome::Extent;
pub(crate) use pushed_out::PushedOut;
pub(crate) use sunk::Sunk;

/// A displacement field over the dome.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Field {
    /// Nothing moves.
    Still,
    /// The geometric rule.
    PushedOut(PushedOut),
    /// Hertz' field, carried to the dome.
    Sunk(Sunk),
    /// The finite elements' own.
    Elastic(SurfaceField),
}

impl Field {
    /// Makes ready for many points.
    pub fn prepare(&self, points: usize) {
        if let Self::Elastic(field) = self {
            field.prepare(points);
        }
    }

    /// The displacement of a point of the dome.
    pub fn at(&self, at_mm: DVec3) -> DVec3 {
        match self {
            Self::Still => DVec3::ZERO,
            Self::PushedOut(field) => field.at(at_mm),
            Self::Sunk(field) => field.at(at_mm),
            Self::Elastic(field) => field.at(at_mm),
        }
    }

    /// Where it differs from zero.
    pub fn extent(&self) -> Extent {
        match self {
            Self::Still => Extent { direction: DVec3::Z, angle_rad: 0.0, beyond_mm: 0.0 },
            Self::PushedOut(field) => {
                Extent { direction: field.axis, angle_rad: field.angle_rad, beyond_mm: 0.0 }
            }
            Self::Sunk(field) => field.extent(),
            Self::Elastic(field) => field.extent(),
        }
    }
}
