//! Why there is no pose.

use crate::refraction::RayLimit;

/// Why markers and pixels give no pose that deserves the name.
#[derive(Debug, Clone, PartialEq)]
pub enum PoseError {
    /// A marker's pixel is NaN or infinite.
    NotFinite {
        /// The marker.
        id: u32,
    },
    /// A sighting names a marker that the sensor does not have.
    UnknownMarker {
        /// The number given.
        id: u32,
    },
    /// Two sightings name the same marker, or two markers have the same pixel or the same place.
    Duplicate {
        /// The two markers (the same number twice where one is named twice).
        ids: [u32; 2],
    },
    /// Fewer than four markers are seen.
    Missing {
        /// Those that are not.
        ids: Vec<u32>,
    },
    /// The markers, or their pixels, lie on one line, or all but one do.
    Collinear,
    /// The camera cannot see such a pixel or marker.
    NotVisible {
        /// The marker.
        id: u32,
        /// What it is past.
        limit: RayLimit,
    },
    /// The pixels fit well once these markers change places.
    Swapped {
        /// For each marker seen, in the order of the sightings, the marker whose pixel it really has.
        ids: Vec<u32>,
    },
    /// No pose explains the pixels.
    DoesNotFit {
        /// Root mean square of the residuals, px.
        rms_px: f64,
        /// Largest that noise would leave, px.
        allowed_px: f64,
    },
    /// No pose from which the camera could see all markers comes near the pixels.
    NoViewFits {
        /// The marker that a start would hide.
        id: u32,
        /// What it would be past.
        limit: RayLimit,
    },
    /// The pixels fit a pose that the platform cannot reach.
    OutOfReach {
        /// Its distance from rest, mm.
        shift_mm: f64,
        /// Its angle from rest, rad.
        turn_rad: f64,
    },
    /// The refinement used up its steps.
    NotConverged {
        /// Root mean square of the residuals at the end, px.
        rms_px: f64,
    },
}

impl PoseError {
    /// The name in files.
    pub fn as_str(&self) -> &'static str {
        match self {
            Self::NotFinite { .. } => "not_finite",
            Self::UnknownMarker { .. } => "unknown_marker",
            Self::Duplicate { .. } => "duplicate_marker",
            Self::Missing { .. } => "missing_marker",
            Self::Collinear => "collinear_markers",
            Self::NotVisible { .. } => "marker_not_visible",
            Self::Swapped { .. } => "swapped_markers",
            Self::DoesNotFit { .. } | Self::NoViewFits { .. } => "does_not_fit",
            Self::OutOfReach { .. } => "out_of_reach",
            Self::NotConverged { .. } => "not_converged",
        }
    }
}

impl std::fmt::Display for PoseError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotFinite { id } => write!(f, "marker {id} has a pixel that is not finite"),
            Self::UnknownMarker { id } => write!(f, "there is no marker {id}"),
            Self::Duplicate { ids: [a, b] } if a == b => write!(f, "marker {a} is given twice"),
            Self::Duplicate { ids: [a, b] } => write!(f, "markers {a} and {b} are in the same place"),
            Self::Missing { ids } => write!(f, "a pose takes four markers; not seen: {ids:?}"),
            Self::Collinear => write!(f, "the markers lie on one line"),
            Self::NotVisible { id, limit } => write!(f, "marker {id} is past a limit of the camera: {limit}"),
            Self::Swapped { ids } => write!(f, "markers changed places: the pixels are those of {ids:?}"),
            Self::DoesNotFit { rms_px, allowed_px } => {
                write!(f, "no pose explains the pixels: {rms_px:.3} px rms, noise leaves {allowed_px:.3}")
            }
            Self::NoViewFits { id, limit } => {
                write!(f, "no pose explains the pixels: where they would fit, marker {id} is past {limit}")
            }
            Self::OutOfReach { shift_mm, turn_rad } => write!(
                f,
                "the pixels fit a pose {shift_mm:.2} mm and {:.1} degrees from rest, out of the platform's reach",
                turn_rad.to_degrees()
            ),
            Self::NotConverged { rms_px } => {
                write!(f, "the refinement did not converge; {rms_px:.3} px rms are left")
            }
        }
    }
}

impl std::error::Error for PoseError {}
