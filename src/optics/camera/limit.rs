//! Where a lens ends, by name.

/// Why a ray has no pixel, or a pixel no ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LensLimit {
    /// Past the first zero of the derivative of the image radius: the model
    /// has turned back on itself there.
    BeyondFold,
    /// Past half the stated field of view (or, for models that divide by z,
    /// within a microradian of 90 degrees).
    BeyondFieldOfView,
    /// The ray points away from the scene and lies outside the model's domain.
    BehindCamera,
    /// The input is NaN, infinite, or a direction of no length.
    NotFinite,
    /// The bound on iterations was reached; no result is trusted.
    NotConverged,
}

impl LensLimit {
    /// The name in files.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::BeyondFold => "beyond_fold",
            Self::BeyondFieldOfView => "beyond_field_of_view",
            Self::BehindCamera => "behind_camera",
            Self::NotFinite => "not_finite",
            Self::NotConverged => "not_converged",
        }
    }
}

impl std::fmt::Display for LensLimit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}

impl std::error::Error for LensLimit {}

/// The part of a model that is a lens: field angles from 0 to `end_rad`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Domain {
    /// Last field angle, inclusive.
    pub end_rad: f64,
    /// Where the model folds, whether or not the field of view reaches it.
    pub fold_rad: Option<f64>,
    /// What lies past `end_rad`.
    pub limit: LensLimit,
}

impl Domain {
    /// The nearer of the fold and half the field of view.
    pub fn new(half_view_rad: f64, fold_rad: Option<f64>) -> Self {
        match fold_rad {
            Some(fold) if fold <= half_view_rad => {
                Self { end_rad: fold, fold_rad, limit: LensLimit::BeyondFold }
            }
            _ => Self { end_rad: half_view_rad, fold_rad, limit: LensLimit::BeyondFieldOfView },
        }
    }
}

/// Relative slack at the domain's end: a value that is past it by rounding
/// alone (about fifty ulp) still belongs to it.
pub(super) const END_ROUNDING: f64 = 1e-14;
