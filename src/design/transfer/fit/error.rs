//! Why no map fits a measurement.

use std::fmt;

use crate::transfer::TransferError;

/// Distances from the middle on the plate over those on the dome, seen from above, that a pad can make: 1 where the
/// pad comes straight down, 1.57 at the rim where it keeps arc length; with room for soft and stiff ones.
pub(super) const PLATE_OVER_DOME: [f64; 2] = [0.6, 2.2];

/// A measurement to which no map can be fitted.
#[derive(Debug, Clone, PartialEq)]
pub enum FitError {
    /// Too few samples.
    TooFew {
        /// How many there are.
        have: usize,
        /// How many are needed.
        need: usize,
    },
    /// A sample has a coordinate that is not finite, or no direction.
    NotFinite {
        /// Its index.
        sample: usize,
    },
    /// The marks lie so that no model is determined: all on a line, or on one ring.
    Degenerate,
    /// Too large a share of the samples does not fit the others.
    TooManyOutliers {
        /// Their indices.
        samples: Vec<usize>,
        /// The share that is accepted.
        max: f64,
    },
    /// What the best map leaves is no scatter of a print.
    TooScattered {
        /// Root mean square of the residuals, per axis, mm along the dome.
        rms_mm: f64,
        /// The most that is accepted, mm.
        max_mm: f64,
    },
    /// The best map folds.
    Folds(TransferError),
    /// The marks fit once they are turned over: they were measured from inside, or in a mirrored picture.
    Mirrored,
    /// The marks are spread far more widely on the plate than on the dome, or far less.
    OtherScale {
        /// Median distance from the middle on the plate over the same on the dome.
        plate_over_dome: f64,
    },
}

impl fmt::Display for FitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFew { have, need } => write!(f, "{have} points, at least {need} are needed"),
            Self::NotFinite { sample } => write!(f, "point {sample} has no finite place"),
            Self::Degenerate => write!(f, "the points determine no map: they lie on a line or on one ring"),
            Self::TooManyOutliers { samples, max } => write!(
                f,
                "{} points do not fit the others, more than {} %: wrong marks or a wrong unit?",
                samples.len(),
                max * 100.0
            ),
            Self::TooScattered { rms_mm, max_mm } => write!(
                f,
                "the points miss the map that fits them best by {rms_mm:.3} mm rms, more than {max_mm:.3}: wrong \
                 marks, or another artwork?"
            ),
            Self::Folds(error) => write!(f, "the map that fits best cannot be used: {error}"),
            Self::Mirrored => write!(
                f,
                "the points fit only when they are turned over: they were measured from inside or in a mirrored \
                 picture; the table holds what is seen from outside"
            ),
            Self::OtherScale { plate_over_dome } => write!(
                f,
                "the marks are {plate_over_dome:.3} times as far from the middle on the plate as they were found on \
                 the dome, a pad makes it {:.1} to {:.1}: a wrong unit?",
                PLATE_OVER_DOME[0], PLATE_OVER_DOME[1]
            ),
        }
    }
}

impl std::error::Error for FitError {}
