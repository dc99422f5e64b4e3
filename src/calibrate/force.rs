//! The 6x6 from measured pairs of displacement and wrench.
//!
//! Each axis of the wrench is fitted by itself (its own readings may be missing) with Tukey's biweight, so that a
//! twentieth of wild readings does not bend it; the model (linear, with an offset, or with a stiffness that grows
//! with compression) is the simplest within one standard error of the best in five-fold cross-validation.

use nalgebra::{DMatrix, DVector, Matrix6};
use serde::Serialize;

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
    const ALL: [Self; 3] = [Self::Linear, Self::Affine, Self::Compressing];

    /// What the coefficients of one wrench axis multiply.
    fn terms(self, d: &[f64; 6]) -> Vec<f64> {
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

/// Tukey's constant: full efficiency of 95 % for normal noise.
const TUKEY: f64 = 4.685;
/// Median absolute deviation to standard deviation for normal noise.
const MAD_TO_SD: f64 = 1.4826;
const FOLDS: usize = 5;
const MOST_ROUNDS: usize = 60;
/// A coefficient whose term varies by less than this part of the others, once scaled, is not determined.
const LEAST_SINGULAR: f64 = 1e-3;
/// Readings beyond so many standard deviations are called outliers.
const OUTLIER_SDS: f64 = 4.0;

struct Solved {
    coefficients: Vec<f64>,
    half_widths: Vec<Option<f64>>,
    sd: f64,
}

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

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Iteratively reweighted least squares of one wrench axis; terms of axes that do not move are left at zero.
fn robust(pairs: &[Pair], axis: usize, rows: &[usize], model: ForceModel, moved: &[usize]) -> Solved {
    let all: Vec<Vec<f64>> = rows.iter().map(|row| model.terms(&pairs[*row].displacement)).collect();
    let count = all.first().map_or(0, Vec::len);
    // The offset stands at 6; a product term belongs to the axis that it multiplies.
    let belongs = |term: usize| match term {
        0..6 => moved.contains(&term),
        6 => true,
        _ => moved.contains(&(term - 7)) && moved.contains(&2),
    };
    let used: Vec<usize> = (0..count).filter(|term| belongs(*term)).collect();
    let scale: Vec<f64> = used
        .iter()
        .map(|term| {
            (all.iter().map(|t| t[*term] * t[*term]).sum::<f64>() / rows.len() as f64).sqrt().max(1e-300)
        })
        .collect();
    let design = DMatrix::from_fn(rows.len(), used.len(), |i, j| all[i][used[j]] / scale[j]);
    let target = DVector::from_fn(rows.len(), |i, _| pairs[rows[i]].wrench[axis].unwrap_or(0.0));
    let mut weights = DVector::from_element(rows.len(), 1.0);
    let mut found = DVector::zeros(used.len());
    let mut sd = 0.0;
    let mut inverse = DMatrix::zeros(used.len(), used.len());
    let mut determined = vec![true; used.len()];
    for round in 0..MOST_ROUNDS {
        let root = weights.map(f64::sqrt);
        let weighted = DMatrix::from_fn(rows.len(), used.len(), |i, j| design[(i, j)] * root[i]);
        let svd = weighted.clone().svd(false, true);
        let Some(v_t) = svd.v_t.as_ref() else { break };
        let largest = svd.singular_values.max();
        // Directions that the data do not show are left out, and so is every coefficient that they reach.
        inverse.fill(0.0);
        determined.fill(true);
        for (k, s) in svd.singular_values.iter().enumerate() {
            let direction = v_t.row(k).transpose();
            if *s > LEAST_SINGULAR * largest {
                inverse += &direction * direction.transpose() / (s * s);
            } else {
                for (flag, part) in determined.iter_mut().zip(direction.iter()) {
                    *flag &= part.abs() < 0.05;
                }
            }
        }
        let right = weighted.transpose() * target.component_mul(&root);
        let next = &inverse * right;
        let left = &target - &design * &next;
        let mut sizes: Vec<f64> = left.iter().map(|v| v.abs()).collect();
        let range = target.amax();
        sd = (MAD_TO_SD * median(&mut sizes)).max(1e-13 * range);
        // The first round's scale is that of plain least squares, which outliers widen: it only lets them go
        // more slowly.
        let change = (&next - &found).amax();
        found = next;
        weights = left.map(|r| {
            let u = r / (TUKEY * sd.max(f64::MIN_POSITIVE));
            if u.abs() < 1.0 { (1.0 - u * u).powi(2) } else { 0.0 }
        });
        if round > 3 && change <= 1e-10 * found.amax() {
            break;
        }
    }
    // Huber's asymptotic covariance of an M-estimate: sd^2 E[psi^2] / E[psi']^2 (X^T X)^-1.
    let n = rows.len() as f64;
    let left = &target - &design * &found;
    let (mut psi2, mut slope) = (0.0, 0.0);
    for r in left.iter() {
        let u = r / (TUKEY * sd.max(f64::MIN_POSITIVE));
        if u.abs() < 1.0 {
            psi2 += (r * (1.0 - u * u).powi(2)).powi(2);
            slope += (1.0 - u * u) * (1.0 - 5.0 * u * u);
        }
    }
    let freedom = (n - used.len() as f64).max(1.0);
    let variance = (psi2 / freedom) / (slope / n).max(0.05).powi(2);
    let gram = design.transpose() * &design;
    let covariance = gram.pseudo_inverse(1e-12).unwrap_or_else(|_| DMatrix::zeros(used.len(), used.len()));
    let mut coefficients = vec![0.0; count];
    let mut half_widths = vec![None; count];
    for (k, term) in used.iter().enumerate() {
        coefficients[*term] = found[k] / scale[k];
        if determined[k] {
            half_widths[*term] = Some(1.96 * (variance * covariance[(k, k)]).max(0.0).sqrt() / scale[k]);
        }
    }
    Solved { coefficients, half_widths, sd }
}

/// Error of each model in cross-validation, and the standard error of its difference from the best: readings
/// are dealt out in turn.
fn validate(pairs: &[Pair], axis: usize, rows: &[usize], moved: &[usize]) -> Vec<(f64, f64)> {
    let mut squares: Vec<Vec<f64>> = vec![Vec::new(); ForceModel::ALL.len()];
    for fold in 0..FOLDS {
        let (test, train): (Vec<usize>, Vec<usize>) = (0..rows.len()).partition(|i| i % FOLDS == fold);
        let train: Vec<usize> = train.into_iter().map(|i| rows[i]).collect();
        for (model, into) in ForceModel::ALL.into_iter().zip(&mut squares) {
            let solved = robust(pairs, axis, &train, model, moved);
            for i in &test {
                let pair = &pairs[rows[*i]];
                let predicted = dot(&model.terms(&pair.displacement), &solved.coefficients);
                into.push((pair.wrench[axis].unwrap_or(predicted) - predicted).powi(2));
            }
        }
    }
    // Outliers tell nothing of a model: a reading counts up to sixteen times the median square.
    let caps: Vec<f64> = squares.iter().map(|s| 16.0 * median(&mut s.clone())).collect();
    let cap = caps.iter().copied().fold(f64::INFINITY, f64::min);
    let n = rows.len().max(1) as f64;
    // Differences below a billionth of the readings are rounding, not a better model.
    let size = rows.iter().filter_map(|row| pairs[*row].wrench[axis]).fold(0.0_f64, |m, w| m.max(w.abs()));
    squares
        .iter()
        .map(|s| {
            let mean = s.iter().map(|v| v.min(cap)).sum::<f64>() / n;
            let spread = s.iter().map(|v| (v.min(cap) - mean).powi(2)).sum::<f64>() / n;
            let error = (spread / n).sqrt() / (2.0 * mean.sqrt()).max(f64::MIN_POSITIVE);
            (mean.sqrt(), error + 1e-9 * size)
        })
        .collect()
}

/// The simplest model whose error on every axis is within one standard error of that axis's best.
fn choose(scores: &[Vec<(f64, f64)>]) -> ForceModel {
    let good = |k: usize| {
        scores.iter().all(|axis| {
            let best = axis.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, 0.0));
            axis.get(k).is_none_or(|s| s.0 <= best.0 + best.1)
        })
    };
    ForceModel::ALL
        .into_iter()
        .enumerate()
        .find(|(k, _)| good(*k))
        .map_or(ForceModel::Compressing, |(_, m)| m)
}

/// Mean residual on rising load less that on falling load, over the range of the readings; `None` without enough
/// of both.
fn hysteresis(
    pairs: &[Pair],
    axis: usize,
    rows: &[usize],
    outliers: &[usize],
    left: impl Fn(usize) -> f64,
) -> Option<f64> {
    let value = |row: usize| pairs[row].wrench[axis].unwrap_or(0.0);
    let range = rows.iter().map(|r| value(*r)).fold(f64::NEG_INFINITY, f64::max)
        - rows.iter().map(|r| value(*r)).fold(f64::INFINITY, f64::min);
    let (mut rising, mut falling) = (Vec::new(), Vec::new());
    for pair in rows.windows(2) {
        if outliers.contains(&pair[0]) || outliers.contains(&pair[1]) {
            continue;
        }
        let change = value(pair[1]).abs() - value(pair[0]).abs();
        if change > 0.0 {
            rising.push(left(pair[1]));
        } else if change < 0.0 {
            falling.push(left(pair[1]));
        }
    }
    if rising.len() < 5 || falling.len() < 5 || range <= 0.0 {
        return None;
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    Some((mean(&rising) - mean(&falling)) / range)
}
