//! The fit of all axes.

use nalgebra::Matrix6;

use super::choice::{choose, hysteresis, validate};
use super::motion::{split_half_width, with_scatter};
use super::robust::{RobustFit, dot, robust};
use super::types::{AxisFit, ForceError, ForceFit, ForceModel, MotionNoise, Pair};
use crate::constants::{POSE_AXES, WRENCH_AXES, rows};

/// Readings beyond so many standard deviations are called outliers.
const OUTLIER_SDS: f64 = 4.0;

/// The rows with a reading on one axis of the wrench.
fn rows_of(pairs: &[Pair], axis: usize) -> Vec<usize> {
    (0..pairs.len()).filter(|row| pairs[*row].wrench[axis].is_some()).collect()
}

/// Whether any pair states noise of its displacement.
fn is_noisy(pairs: &[Pair]) -> bool {
    pairs.iter().any(|pair| pair.displacement_covariance != Matrix6::zeros())
}

/// Axes of the displacement that range farther than their size.
fn moved_axes(pairs: &[Pair], sizes: &[f64; 6]) -> Vec<usize> {
    let range = |axis: usize| {
        let values = pairs.iter().map(|pair| pair.displacement[axis]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        high - low
    };
    (0..6).filter(|axis| range(*axis) > sizes[*axis]).collect()
}

/// Axes of the wrench with enough readings; why the others have not is added to what is refused.
fn fitted_axes(pairs: &[Pair], needed: usize, refused: &mut Vec<String>) -> Vec<usize> {
    let mut fitted = Vec::new();
    for (axis, name) in WRENCH_AXES.iter().enumerate() {
        let readings = rows_of(pairs, axis).len();
        if readings == 0 {
            refused.push(format!("{name}: no reading"));
        } else if readings < needed {
            refused.push(format!("{name}: {readings} readings, a fit needs {needed}"));
        } else {
            fitted.push(axis);
        }
    }
    fitted
}

/// What the coefficients of one axis become in the result.
fn axis_fit(
    pairs: &[Pair],
    axis: usize,
    model: ForceModel,
    solved: RobustFit,
    scores: &[(f64, f64)],
) -> AxisFit {
    let rows = rows_of(pairs, axis);
    let predict = |row: usize| dot(&model.terms(&pairs[row].displacement), &solved.coefficients);
    let left = |row: usize| pairs[row].wrench[axis].map_or(0.0, |w| w - predict(row));
    let is_outlier = |row: &usize| left(*row).abs() > OUTLIER_SDS * solved.sd.max(1e-12);
    let outliers: Vec<usize> = rows.iter().copied().filter(is_outlier).collect();
    let hysteresis = hysteresis(pairs, axis, &rows, &outliers, left);
    AxisFit {
        axis: WRENCH_AXES[axis],
        readings: rows.len(),
        coefficients: solved.coefficients,
        half_widths: solved.half_widths,
        covariance: solved.covariance,
        sd: solved.sd,
        outliers,
        hysteresis,
        validation: ForceModel::ALL.into_iter().zip(scores.iter().map(|s| s.0)).collect(),
    }
}

/// Fits the wrench to the displacements.
///
/// `nominal` is the 6x6 whose entries stay where the data refuse; `sizes` is how far a displacement axis must range
/// (mm, rad) to count as moved at all: some times the noise of the pose; `noise` says where the displacements' own
/// noise comes from, which is taken out of the coefficients.
///
/// # Errors
/// [`ForceError`] where no axis can be fitted at all.
pub fn fit(
    pairs: &[Pair],
    nominal: &Matrix6<f64>,
    sizes: &[f64; 6],
    noise: MotionNoise,
) -> Result<ForceFit, ForceError> {
    if noise == MotionNoise::Stated {
        return fit_stated(pairs, nominal, sizes);
    }
    let exact = fit_stated(pairs, nominal, sizes)?;
    let Some(noisy) = with_scatter(pairs, &exact, nominal) else { return Ok(exact) };
    let mut found = fit_stated(&noisy, nominal, sizes)?;
    split_half_width(&mut found, &exact);
    Ok(found)
}

/// [`fit`] with the covariance that each pair states.
fn fit_stated(pairs: &[Pair], nominal: &Matrix6<f64>, sizes: &[f64; 6]) -> Result<ForceFit, ForceError> {
    let moved = moved_axes(pairs, sizes);
    if moved.is_empty() {
        return Err(ForceError::NoMotion);
    }
    let mut refused: Vec<String> = (0..6)
        .filter(|axis| !moved.contains(axis))
        .map(|axis| format!("{}: does not vary in the data", POSE_AXES[axis]))
        .collect();
    let needed = 2 * (moved.len() + 1);
    let fitted = fitted_axes(pairs, needed, &mut refused);
    if fitted.is_empty() {
        let readings = (0..6).map(|axis| rows_of(pairs, axis).len()).max().unwrap_or(0);
        return Err(ForceError::TooFew { readings, needed });
    }
    // One model for all axes: the errors of each axis count relative to its own best.
    let scores: Vec<_> =
        fitted.iter().map(|axis| validate(pairs, *axis, &rows_of(pairs, *axis), &moved)).collect();
    let mut model = choose(&scores);
    let is_open = |axis: &usize| {
        let solved = robust(pairs, *axis, &rows_of(pairs, *axis), model, &moved);
        moved.contains(axis) && solved.half_widths[*axis].is_none()
    };
    // Products of noisy displacements are noise themselves: a model that they leave open is too rich.
    if model == ForceModel::Compressing && is_noisy(pairs) && fitted.iter().any(is_open) {
        model = ForceModel::Affine;
    }
    let mut stiffness = *nominal;
    let mut by_compression = Matrix6::zeros();
    let mut offset = [0.0; 6];
    let mut axes = Vec::new();
    for (axis, score) in fitted.into_iter().zip(&scores) {
        let solved = robust(pairs, axis, &rows_of(pairs, axis), model, &moved);
        for (j, name) in POSE_AXES.iter().enumerate() {
            match solved.half_widths[j] {
                Some(_) => stiffness[(axis, j)] = solved.coefficients[j],
                None if moved.contains(&j) => {
                    refused.push(format!("{} by {name}: the data do not separate it", WRENCH_AXES[axis]));
                }
                None => {}
            }
            if model == ForceModel::Compressing && solved.half_widths[7 + j].is_some() {
                by_compression[(axis, j)] = solved.coefficients[7 + j];
            }
        }
        if model >= ForceModel::Affine {
            offset[axis] = solved.coefficients[6];
        }
        axes.push(axis_fit(pairs, axis, model, solved, score));
    }
    Ok(ForceFit {
        model,
        axes,
        stiffness: rows(&stiffness),
        by_compression: (model == ForceModel::Compressing).then(|| rows(&by_compression)),
        offset: (model >= ForceModel::Affine).then_some(offset),
        refused,
        motion_sd: std::array::from_fn(|j| {
            let sum: f64 = pairs.iter().map(|pair| pair.displacement_covariance[(j, j)]).sum();
            (sum / pairs.len().max(1) as f64).max(0.0).sqrt()
        }),
    })
}
