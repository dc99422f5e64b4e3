//! The simplest map that a measurement asks for.

use glam::DVec3;

use super::error::{FitError, PLATE_OVER_DOME};
use super::outliers::{MAX_OUTLIERS, quantile};
use super::report::TransferFit;
use super::sample::{MeasuredIn, Sample};
use super::solve::{BEYOND_RAD, FitModel, FitProblem, MAX_POLAR_RAD};
use crate::transfer::{Correction, Nominal, Polar, TransferError, TransferMap};

/// Fewest samples: as many as a model of two radial terms, two-fold terms, rotation and offset has numbers,
/// with as many again to show a misfit.
pub const MIN_SAMPLES: usize = 10;
/// Residuals above this share of the radius are no scatter of a print: ten times what a poor pad leaves.
const MAX_SCATTER: f64 = 0.03;
/// Scatter below this share of the radius counts as none: residuals are then rounding.
const MIN_SIGMA: f64 = 1e-9;
/// Most radial terms.
const MAX_RADIAL: usize = 4;
/// A difference of the information criterion that counts as decisive (R. Kass and A. Raftery, JASA 90, 1995).
const DECISIVE: f64 = 10.0;
/// Fits a measured map. It is extrapolated to `reach_rad` (the pad's wrap limit), even if the marks landed less far,
/// as long as it does not fold there; a soft pad draws a target together, and its next print reaches further.
///
/// # Errors
/// See [`FitError`].
pub fn fit(
    dome_radius_mm: f64,
    samples: &[Sample],
    measured_in: MeasuredIn,
    reach_rad: f64,
) -> Result<TransferFit, FitError> {
    if samples.len() < MIN_SAMPLES {
        return Err(FitError::TooFew { have: samples.len(), need: MIN_SAMPLES });
    }
    for (sample, s) in samples.iter().enumerate() {
        if !(s.plate_mm.is_finite() && s.landed.is_finite() && s.landed.length() > 0.0) {
            return Err(FitError::NotFinite { sample });
        }
    }
    let plate_over_dome = plate_over_dome(dome_radius_mm, samples);
    if !(PLATE_OVER_DOME[0]..=PLATE_OVER_DOME[1]).contains(&plate_over_dome) {
        return Err(FitError::OtherScale { plate_over_dome });
    }
    let found = fit_as_read(dome_radius_mm, samples, measured_in, reach_rad);
    if matches!(&found, Err(error) if !matches!(error, FitError::Degenerate)) {
        let over = |sample: &Sample| Sample {
            landed: DVec3::new(sample.landed.x, -sample.landed.y, sample.landed.z),
            ..sample.clone()
        };
        let turned: Vec<Sample> = samples.iter().map(over).collect();
        if fit_as_read(dome_radius_mm, &turned, measured_in, reach_rad).is_ok() {
            return Err(FitError::Mirrored);
        }
    }
    found
}

/// Median distance from the middle on the plate over the median distance from the axis on the dome.
fn plate_over_dome(dome_radius_mm: f64, samples: &[Sample]) -> f64 {
    let middle = |places: &mut dyn Iterator<Item = f64>| quantile(&places.collect::<Vec<f64>>(), 0.5);
    let on_plate = middle(&mut samples.iter().map(|sample| sample.plate_mm.length()));
    let on_dome = middle(&mut samples.iter().map(|sample| sample.landed.normalize().truncate().length()));
    on_plate / (on_dome * dome_radius_mm).max(f64::MIN_POSITIVE)
}

fn fit_as_read(
    dome_radius_mm: f64,
    samples: &[Sample],
    measured_in: MeasuredIn,
    reach_rad: f64,
) -> Result<TransferFit, FitError> {
    let polar = samples.iter().map(|s| Polar::of_direction(s.landed.normalize())).collect();
    let problem = FitProblem { radius_mm: dome_radius_mm, samples, polar, measured_in };
    let used = problem.inliers()?;
    let rejected: Vec<usize> = (0..samples.len()).filter(|i| !used[*i]).collect();
    if rejected.len() as f64 > MAX_OUTLIERS * samples.len() as f64 {
        return Err(FitError::TooManyOutliers { samples: rejected, max: MAX_OUTLIERS });
    }
    let weights: Vec<f64> = used.iter().map(|u| f64::from(u8::from(*u))).collect();
    let count = samples.len() - rejected.len();

    // The simplest model that the data asks for. A model that folds cannot be used; if it explains the data
    // decisively better than every one that can, the pad itself folds, and a worse fit would hide that.
    let mut best: Option<(f64, FitModel, Correction)> = None;
    let mut folded: Option<(f64, TransferError)> = None;
    let max_radial = problem.max_radial();
    for model in models() {
        if count < model.parameters() || model.radial > max_radial {
            continue;
        }
        let Ok(mut correction) = problem.solve(model, &weights) else { continue };
        // As far as it is wanted, or as far as it holds: a series may fold just past the marks that it was fitted to.
        let measured_rad = correction.max_polar_rad;
        let reaches =
            [measured_rad.max(reach_rad.min(MAX_POLAR_RAD)), measured_rad, measured_rad - BEYOND_RAD];
        let reaches = reaches.into_iter().filter(|reach| *reach > 0.0);
        let mut made = None;
        for reach in reaches {
            correction.max_polar_rad = reach;
            made = Some(TransferMap::new(dome_radius_mm, model.nominal, Some(correction.clone())));
            if matches!(made, Some(Ok(_))) {
                break;
            }
        }
        let squares: f64 = problem
            .residuals(model.nominal, &correction)
            .zip(&weights)
            .map(|(r, w)| w * r.length_squared())
            .sum();
        let n = 2.0 * count as f64;
        let floor = (MIN_SIGMA * dome_radius_mm).powi(2);
        let criterion = n * (squares / n + floor).ln() + model.parameters() as f64 * n.ln();
        if let Some(Err(error)) = made {
            if folded.as_ref().is_none_or(|(lowest, _)| criterion < *lowest) {
                folded = Some((criterion, error));
            }
            continue;
        }
        if best.as_ref().is_none_or(|(lowest, ..)| criterion < *lowest) {
            best = Some((criterion, model, correction));
        }
    }
    match (best, folded) {
        (Some((usable, model, correction)), folded)
            if folded.as_ref().is_none_or(|(lowest, _)| lowest + DECISIVE > usable) =>
        {
            let found = problem.report(model, correction, &used, rejected);
            let (rms_mm, max_mm) = (found.residual_rms_mm, MAX_SCATTER * dome_radius_mm);
            if rms_mm <= max_mm { Ok(found) } else { Err(FitError::TooScattered { rms_mm, max_mm }) }
        }
        (_, Some((_, error))) => Err(FitError::Folds(error)),
        (_, None) => Err(FitError::Degenerate),
    }
}

fn models() -> impl Iterator<Item = FitModel> {
    Nominal::ALL.into_iter().flat_map(|nominal| {
        (1..=MAX_RADIAL).flat_map(move |radial| {
            [false, true].into_iter().map(move |two_fold| FitModel { nominal, radial, two_fold })
        })
    })
}
