//! The 6x6 from measured pairs of displacement and wrench.
//!
//! Each axis of the wrench is fitted by itself (its own readings may be missing) with Tukey's biweight, so that a
//! twentieth of wild readings does not bend it; the model (linear, with an offset, or with a stiffness that grows
//! with compression) is the simplest within one standard error of the best in five-fold cross-validation.

use nalgebra::Matrix6;
use serde::Serialize;

mod choice;
mod robust;

use choice::{choose, hysteresis, validate};
use robust::{dot, robust};

use crate::constants::{POSE_AXES, WRENCH_AXES};

/// A displacement (mm, rad) and the reference wrench (N, N*mm; missing axes are `None`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// (tx, ty, tz, rx, ry, rz).
    pub displacement: [f64; 6],
    /// (Fx, Fy, Fz, Mx, My, Mz).
    pub wrench: [Option<f64>; 6],
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
}

impl std::fmt::Display for ForceError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::TooFew { readings, needed } => {
                write!(f, "at most {readings} readings on an axis; a fit needs {needed}")
            }
            Self::NoMotion => write!(f, "no axis of the displacement varies"),
        }
    }
}

impl std::error::Error for ForceError {}

/// Readings beyond so many standard deviations are called outliers.
const OUTLIER_SDS: f64 = 4.0;

/// Fits the wrench to the displacements.
///
/// `nominal` is the 6x6 whose entries stay where the data refuse; `sizes` is how far a displacement axis must range
/// (mm, rad) to count as moved at all: some times the noise of the pose.
///
/// # Errors
/// [`ForceError`] where no axis can be fitted at all.
pub fn fit(pairs: &[Pair], nominal: &Matrix6<f64>, sizes: &[f64; 6]) -> Result<ForceFit, ForceError> {
    let moved: Vec<usize> = (0..6)
        .filter(|axis| {
            let values = pairs.iter().map(|pair| pair.displacement[*axis]);
            let (low, high) =
                values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
            high - low > sizes[*axis]
        })
        .collect();
    if moved.is_empty() {
        return Err(ForceError::NoMotion);
    }
    let mut refused: Vec<String> = (0..6)
        .filter(|axis| !moved.contains(axis))
        .map(|axis| format!("{}: does not vary in the data", POSE_AXES[axis]))
        .collect();
    let needed = 2 * (moved.len() + 1);
    let rows_of = |axis: usize| -> Vec<usize> {
        (0..pairs.len()).filter(|row| pairs[*row].wrench[axis].is_some()).collect()
    };
    let mut fitted_axes = Vec::new();
    for (axis, name) in WRENCH_AXES.iter().enumerate() {
        let readings = rows_of(axis).len();
        if readings == 0 {
            refused.push(format!("{name}: no reading"));
        } else if readings < needed {
            refused.push(format!("{name}: {readings} readings, a fit needs {needed}"));
        } else {
            fitted_axes.push(axis);
        }
    }
    if fitted_axes.is_empty() {
        let readings = (0..6).map(|axis| rows_of(axis).len()).max().unwrap_or(0);
        return Err(ForceError::TooFew { readings, needed });
    }
    // One model for all axes: the errors of each axis count relative to its own best.
    let mut scores = Vec::new();
    for axis in &fitted_axes {
        scores.push(validate(pairs, *axis, &rows_of(*axis), &moved));
    }
    let model = choose(&scores);
    let mut stiffness = *nominal;
    let mut by_compression = Matrix6::zeros();
    let mut offset = [0.0; 6];
    let mut axes = Vec::new();
    for (axis, score) in fitted_axes.iter().zip(scores) {
        let rows = rows_of(*axis);
        let solved = robust(pairs, *axis, &rows, model, &moved);
        for (j, name) in POSE_AXES.iter().enumerate() {
            match solved.half_widths[j] {
                Some(_) => stiffness[(*axis, j)] = solved.coefficients[j],
                None if moved.contains(&j) => {
                    let other = format!("{} by {name}: the data do not separate it", WRENCH_AXES[*axis]);
                    refused.push(other);
                }
                None => {}
            }
            if model == ForceModel::Compressing && solved.half_widths[7 + j].is_some() {
                by_compression[(*axis, j)] = solved.coefficients[7 + j];
            }
        }
        if model >= ForceModel::Affine {
            offset[*axis] = solved.coefficients[6];
        }
        let predict = |row: usize| dot(&model.terms(&pairs[row].displacement), &solved.coefficients);
        let left = |row: usize| pairs[row].wrench[*axis].map_or(0.0, |w| w - predict(row));
        let outliers: Vec<usize> = rows
            .iter()
            .copied()
            .filter(|row| left(*row).abs() > OUTLIER_SDS * solved.sd.max(1e-12))
            .collect();
        let hysteresis = hysteresis(pairs, *axis, &rows, &outliers, left);
        axes.push(AxisFit {
            axis: WRENCH_AXES[*axis],
            readings: rows.len(),
            coefficients: solved.coefficients,
            half_widths: solved.half_widths,
            sd: solved.sd,
            outliers,
            hysteresis,
            validation: ForceModel::ALL.into_iter().zip(score.iter().map(|s| s.0)).collect(),
        });
    }
    let rows = |m: &Matrix6<f64>| std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]));
    Ok(ForceFit {
        model,
        axes,
        stiffness: rows(&stiffness),
        by_compression: (model == ForceModel::Compressing).then(|| rows(&by_compression)),
        offset: (model >= ForceModel::Affine).then_some(offset),
        refused,
    })
}
