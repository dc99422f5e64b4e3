//! What is wrong with a map, and why a point has no partner on its other side.

use std::fmt;

/// A map that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TransferError {
    /// The field at fault, as it is called in a design's `print` section.
    pub field: String,
    /// Its value.
    pub value: String,
    /// What is wrong.
    pub problem: String,
    /// What is allowed.
    pub allowed: String,
}

impl fmt::Display for TransferError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` is {}: {}; allowed: {}", self.field, self.value, self.problem, self.allowed)
    }
}

impl std::error::Error for TransferError {}

/// Why a point has no partner on the other side of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TransferLimit {
    /// A coordinate is not a finite number.
    NotFinite,
    /// The point lies this far outside (or inside, negative) the dome's surface.
    NotOnDome {
        /// Distance from the surface, mm.
        off_mm: f64,
    },
    /// Below the rim, or off the picture of the whole dome.
    BeyondDome,
    /// Further from the pole than the measurement reaches.
    BeyondMeasured {
        /// Where the point lies, rad.
        polar_rad: f64,
        /// How far the measurement reaches, rad.
        limit_rad: f64,
    },
    /// The inverse of a measured map was not found within the allowed number of steps.
    NotConverged {
        /// Steps taken.
        steps: u32,
        /// Distance on the plate that is left, as a share of the dome's radius.
        residual: f64,
    },
}

impl TransferLimit {
    /// The limit's name in files.
    pub fn as_str(&self) -> &'static str {
        match self {
            Self::NotFinite => "not_finite",
            Self::NotOnDome { .. } => "not_on_dome",
            Self::BeyondDome => "beyond_dome",
            Self::BeyondMeasured { .. } => "beyond_measured_map",
            Self::NotConverged { .. } => "not_converged",
        }
    }
}

impl fmt::Display for TransferLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite => write!(f, "a coordinate is not a finite number"),
            Self::NotOnDome { off_mm } => write!(f, "the point is {off_mm} mm off the dome's surface"),
            Self::BeyondDome => write!(f, "the point lies beyond the dome's rim"),
            Self::BeyondMeasured { polar_rad, limit_rad } => write!(
                f,
                "polar angle {:.3} deg is beyond {:.3} deg, where the measured map ends",
                polar_rad.to_degrees(),
                limit_rad.to_degrees()
            ),
            Self::NotConverged { steps, residual } => {
                write!(f, "no inverse after {steps} steps (residual {residual:.3e} of the radius)")
            }
        }
    }
}

impl std::error::Error for TransferLimit {}
