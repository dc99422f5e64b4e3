//! What goes into the fit and what comes out of it.

use nalgebra::{DMatrix, Matrix6};
use serde::Serialize;

/// A displacement (mm, rad) and the reference wrench (N, N*mm; missing axes are `None`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// (tx, ty, tz, rx, ry, rz).
    pub displacement: [f64; 6],
    /// Covariance of the displacement's own noise (mm, rad, squared); zero where it is exact.
    pub displacement_covariance: Matrix6<f64>,
    /// (Fx, Fy, Fz, Mx, My, Mz).
    pub wrench: [Option<f64>; 6],
}

impl Pair {
    /// What an affine law of the displacement is made of, with the compression's products: springs that stiffen are no drift and no lag.
    pub(super) fn affine_terms(&self) -> Vec<f64> {
        let d = &self.displacement;
        let products = d.iter().map(|v| d[2] * v);
        d.iter().copied().chain(products).chain([1.0]).collect()
    }
}

/// Where the noise of the displacements comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotionNoise {
    /// Each pair states its own covariance.
    Stated,
    /// Nobody stated it: the reference is taken to hold to a hundredth of its range, and what the readings scatter
    /// beyond that is the motions'.
    FromScatter,
}

/// How the wrench depends on the displacement d.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ForceModel {
    /// K d.
    Linear,
    /// K d + b: a zero that is off.
    Affine,
    /// (K + c K') d + b, c the compression -tz: springs that stiffen sideways as they shorten.
    Compressing,
}

impl ForceModel {
    pub(super) const ALL: [Self; 3] = [Self::Linear, Self::Affine, Self::Compressing];

    /// What the coefficients of one wrench axis multiply.
    pub(super) fn terms(self, d: &[f64; 6]) -> Vec<f64> {
        let mut terms = d.to_vec();
        if self >= Self::Affine {
            terms.push(1.0);
        }
        if self == Self::Compressing {
            terms.extend(d.iter().map(|v| -d[2] * v));
        }
        terms
    }

    /// Derivative of [`ForceModel::terms`] by the displacement, a row for each term.
    pub(super) fn slopes(self, d: &[f64; 6]) -> DMatrix<f64> {
        let mut slopes = DMatrix::zeros(self.terms(d).len(), 6);
        for j in 0..6 {
            slopes[(j, j)] = 1.0;
            if self == Self::Compressing {
                slopes[(7 + j, j)] -= d[2];
                slopes[(7 + j, 2)] -= d[j];
            }
        }
        slopes
    }
}

/// The fit of one axis of the wrench.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxisFit {
    /// Name: Fx ..
    pub axis: &'static str,
    /// Readings used.
    pub readings: usize,
    /// Coefficients: six of the displacement, then the offset, then six of compression times displacement.
    pub coefficients: Vec<f64>,
    /// Half width of the 95 % confidence interval of each; null where the data do not determine it.
    pub half_widths: Vec<Option<f64>>,
    /// Covariance of the coefficients; rows of those that the data do not determine are zero.
    #[serde(skip)]
    pub covariance: DMatrix<f64>,
    /// Standard deviation of the readings about the fit (robust), N or N*mm.
    pub sd: f64,
    /// Rows of the data that are outliers, from 0.
    pub outliers: Vec<usize>,
    /// Mean reading while the load on this axis rises less that while it falls, over the range of the readings.
    pub hysteresis: Option<f64>,
    /// Root of the mean squared error in cross-validation, by model, over readings that are no outliers.
    pub validation: Vec<(ForceModel, f64)>,
}

/// The result of a force calibration.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ForceFit {
    /// The model that was chosen.
    pub model: ForceModel,
    /// Each axis that has readings.
    pub axes: Vec<AxisFit>,
    /// The 6x6 at rest; refused entries keep the nominal value.
    pub stiffness: [[f64; 6]; 6],
    /// How the 6x6 grows with a millimetre of compression, where the model says so.
    pub by_compression: Option<[[f64; 6]; 6]>,
    /// The wrench that the reference shows at rest, where the model has an offset.
    pub offset: Option<[f64; 6]>,
    /// Axes that the data do not determine, and why: they keep the nominal numbers.
    pub refused: Vec<String>,
    /// Standard deviation of the noise of each displacement axis that the fit took out (mm, rad).
    pub motion_sd: [f64; 6],
}

/// Why nothing can be fitted.
#[derive(Debug, Clone, PartialEq)]
pub enum ForceError {
    /// Fewer readings than a fit needs on every axis.
    TooFew {
        /// Most readings on any axis.
        readings: usize,
        /// How many a fit needs.
        needed: usize,
    },
    /// No displacement axis varies.
    NoMotion,
    /// The table cannot be this sensor's: what it looks like, in words.
    Suspect(String),
}

impl std::fmt::Display for ForceError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::TooFew { readings, needed } => {
                write!(f, "at most {readings} readings on an axis; a fit needs {needed}")
            }
            Self::NoMotion => write!(f, "no axis of the displacement varies"),
            Self::Suspect(what) => f.write_str(what),
        }
    }
}

impl std::error::Error for ForceError {}
