//! Whether a fitted 6x6 can be that of springs between two platforms.

use domecast_optics::numeric::symmetric_eigen;
use nalgebra::{DMatrix, Matrix3, Matrix6};

use super::plausibility::MAX_FACTOR;
use super::reference::SpringReference;
use super::statistics::spread;
use super::types::{ForceError, ForceFit, Pair};
use crate::constants::{POSE_AXES, SpringConstants, WRENCH_AXES, matrix_of};

/// Least eigenvalue of the 6x6, scaled to a diagonal of ones.
const MIN_EIGENVALUE: f64 = 0.02;
/// Readings may scatter about the fit by this part of their range.
const MAX_SCATTER: f64 = 0.3;
/// Part of the readings that may be outliers.
const MAX_OUTLIERS: f64 = 0.25;
/// A lever by which moments are off their point, mm: springs under load have one of a millimetre or two.
const MIN_LEVER_MM: f64 = 4.0;
/// Axes that are turned by less than this are a matter of mounting, rad.
const MIN_TURN_RAD: f64 = 0.12;
/// Beyond so many half widths a difference is none of noise.
const CLEAR_HALF_WIDTHS: f64 = 3.0;

/// Asks whether a fit can be that of this sensor's springs; `pairs`: what it was fitted to.
///
/// # Errors
/// [`ForceError::Suspect`] with the first that springs of this geometry cannot do.
pub fn examine_fit(found: &ForceFit, pairs: &[Pair], springs: &SpringConstants) -> Result<(), ForceError> {
    let reference = SpringReference::new(springs);
    let stiffness = matrix_of(&found.stiffness);
    let checks = [
        scatter(found, pairs),
        wrong_axes(found, &stiffness),
        far_from_geometry(found, &stiffness, &reference),
        not_positive(&stiffness),
        wrong_point(found, &stiffness),
    ];
    checks.into_iter().flatten().next().map_or(Ok(()), |what| Err(ForceError::Suspect(what)))
}

fn half_width(found: &ForceFit, row: usize, column: usize) -> Option<f64> {
    found.axes.iter().find(|axis| axis.axis == WRENCH_AXES[row])?.half_widths[column]
}

/// Readings that do not lie about the fit.
fn scatter(found: &ForceFit, pairs: &[Pair]) -> Option<String> {
    found.axes.iter().find_map(|axis| {
        let i = WRENCH_AXES.iter().position(|name| *name == axis.axis)?;
        let readings: Vec<f64> = pairs.iter().filter_map(|pair| pair.wrench[i]).collect();
        let (range, own) = (spread(&readings), axis.half_widths[i]);
        let is_loaded = own.is_some_and(|half| half < 0.25 * axis.coefficients[i].abs());
        let outliers = axis.outliers.len() as f64 > MAX_OUTLIERS * axis.readings as f64;
        if is_loaded && outliers {
            return Some(format!(
                "{} of {} readings of {} lie far from the others' fit: rows of another unit or another row's readings",
                axis.outliers.len(),
                axis.readings,
                axis.axis
            ));
        }
        (is_loaded && axis.sd > MAX_SCATTER * range).then(|| {
            format!("{} scatters by {:.3} about the fit, of a range of {range:.3}: noise or unpaired rows", axis.axis, axis.sd)
        })
    })
}

fn far_from_geometry(
    found: &ForceFit,
    stiffness: &Matrix6<f64>,
    reference: &SpringReference,
) -> Option<String> {
    (0..6).find_map(|i| {
        let half = half_width(found, i, i)?;
        let (own, nominal) = (stiffness[(i, i)], reference.stiffness[(i, i)]);
        let factor = own / nominal;
        // Noise alone must not look like other springs.
        let is_clear = half < 0.2 * own.abs().max(nominal.abs());
        (is_clear && !(1.0 / MAX_FACTOR..=MAX_FACTOR).contains(&factor)).then(|| {
            format!(
                "{} by {} is {own:.4}, {factor:.3} times the geometry's {nominal:.4}; allowed is a factor of \
                 {MAX_FACTOR} either way: units, another sensor's constants, or other springs than the design's",
                WRENCH_AXES[i], POSE_AXES[i]
            )
        })
    })
}

/// Springs hold their platform: the symmetric part has no direction without a restoring load.
fn not_positive(stiffness: &Matrix6<f64>) -> Option<String> {
    if let Some(i) = (0..6).find(|i| stiffness[(*i, *i)] <= 0.0 || stiffness[(*i, *i)].is_nan()) {
        return Some(format!(
            "the stiffness is not positive definite: {} by {} is {:.4}",
            WRENCH_AXES[i],
            POSE_AXES[i],
            stiffness[(i, i)]
        ));
    }
    let scaled = DMatrix::from_fn(6, 6, |i, j| {
        let size = (stiffness[(i, i)] * stiffness[(j, j)]).sqrt();
        0.5 * (stiffness[(i, j)] + stiffness[(j, i)]) / size
    });
    let Some(eigen) = symmetric_eigen(scaled) else { return Some("the stiffness is not finite".into()) };
    let smallest = eigen.eigenvalues.min();
    (smallest < MIN_EIGENVALUE).then(|| {
        format!(
            "the stiffness is not positive definite (least eigenvalue {smallest:.3} of the 6x6 scaled to ones): the \
             springs would push the platform further on its way"
        )
    })
}

/// Reciprocity: what tx does to Fy, ty does to Fx. A turned reference breaks it: `K' = R K`.
fn wrong_axes(found: &ForceFit, stiffness: &Matrix6<f64>) -> Option<String> {
    let noise = half_width(found, 0, 1)?.hypot(half_width(found, 1, 0)?);
    let (across, along) = (stiffness[(1, 0)] - stiffness[(0, 1)], stiffness[(0, 0)] + stiffness[(1, 1)]);
    let turn = across.atan2(along);
    (turn.abs() > MIN_TURN_RAD && across.abs() > CLEAR_HALF_WIDTHS * noise).then(|| {
        format!(
            "looks like axes of the reference turned about z by {:.1} degrees: Fx follows ty and Fy tx with the \
             opposite sign",
            turn.to_degrees()
        )
    })
}

/// Moments about another point `r` off: `K_MF - K_FM^T = [r]x K_FF`; displacements of another point: the same of K_FM.
fn wrong_point(found: &ForceFit, stiffness: &Matrix6<f64>) -> Option<String> {
    let mut noise: f64 = 0.0;
    for (i, j) in [(3, 1), (1, 3), (4, 0), (0, 4)] {
        noise = noise.max(half_width(found, i, j)?);
    }
    let block = |i: usize, j: usize| -> Matrix3<f64> { stiffness.fixed_view::<3, 3>(i, j).into_owned() };
    let difference = block(3, 0) - block(0, 3).transpose();
    let lever = difference * block(0, 0).try_inverse()?;
    // Of [r]x the part that a point on the axis has: heights are what people mistake.
    let height_mm = 0.5 * (lever[(1, 0)] - lever[(0, 1)]);
    let noise_mm = noise / (0.5 * (stiffness[(0, 0)] + stiffness[(1, 1)])).max(1e-9);
    (height_mm.abs() > MIN_LEVER_MM && height_mm.abs() > CLEAR_HALF_WIDTHS * noise_mm).then(|| {
        format!(
            "looks like moments (or displacements) about another point than springs.at_mm: {:.1} mm apart in z, by \
             how Mx and My follow ty and tx",
            height_mm.abs()
        )
    })
}
