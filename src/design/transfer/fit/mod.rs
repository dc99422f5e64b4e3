//! Fitting a measured map to a printed test target.
//!
//! Where a mark stands on the plate is known, where it landed on the dome was measured. The model is a nominal
//! map with a [`Correction`]; it is linear in all but the rotation, so that Gauss and Newton's iteration
//! settles in a few steps. Residuals are taken where the measurement was made, on the dome or in the view
//! from outside: there its errors are even, on the plate they are not. What is reported of them is in mm along
//! the dome, whichever the measurement was: a view from outside shortens what scatters towards the rim.
//!
//! Outliers are found first, see `outliers`. How many terms the data can carry, and on which nominal map they rest, is then decided by Bayes's information
//! criterion (G. Schwarz, Annals of Statistics 6(2), 1978).

mod outliers;
mod report;
mod solve;
#[cfg(test)]
mod tests;

use std::f64::consts::FRAC_PI_2;
use std::fmt;

use glam::{DVec2, DVec3};

use super::{Correction, Nominal, Polar, TransferError, TransferMap};
use solve::{Model, Problem};

/// A mark that was printed and measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Where it stands on the plate, mm.
    pub plate_mm: DVec2,
    /// Where it landed: direction from the dome's centre, in the frame of the hit; any length but zero.
    pub landed: DVec3,
    /// Which mark it is; equal for the same mark of several prints.
    pub mark: u32,
    /// Which print it belongs to, from 0.
    pub print: usize,
}

/// Where the errors of a measurement are even.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeasuredIn {
    /// In the orthographic view from outside.
    View,
    /// In angles on the dome.
    Dome,
}

/// A fitted map and how well it fits.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The nominal map on which the correction rests.
    pub nominal: Nominal,
    /// The correction.
    pub correction: Correction,
    /// Root mean square of the residuals of the samples used, per axis, mm along the dome.
    pub residual_rms_mm: f64,
    /// Largest residual of the samples used, mm along the dome.
    pub residual_max_mm: f64,
    /// Scatter of one mark from print to print, per axis, mm along the dome; `None` if no mark was measured twice.
    pub scatter_mm: Option<f64>,
    /// Part of the scatter that whole prints share: standard deviation of the prints' mean shifts, mm
    /// along the dome.
    pub print_shift_mm: Option<f64>,
    /// Root mean square that the map itself misses, per axis, mm along the dome: the residual beyond the scatter; `None`
    /// without several prints.
    pub lack_of_fit_mm: Option<f64>,
    /// Indices of the samples that were left out as outliers, ascending.
    pub rejected: Vec<usize>,
    /// Number of free numbers of the model.
    pub parameters: usize,
    /// Polar angle of the outermost sample used, rad; beyond it the map is carried on by its formula.
    pub measured_to_rad: f64,
}

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
        most: f64,
    },
    /// What the best map leaves is no scatter of a print.
    TooScattered {
        /// Root mean square of the residuals, per axis, mm along the dome.
        rms_mm: f64,
        /// The most that is accepted, mm.
        most_mm: f64,
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
            Self::TooManyOutliers { samples, most } => write!(
                f,
                "{} points do not fit the others, more than {} %: wrong marks or a wrong unit?",
                samples.len(),
                most * 100.0
            ),
            Self::TooScattered { rms_mm, most_mm } => write!(
                f,
                "the points miss the map that fits them best by {rms_mm:.3} mm rms, more than {most_mm:.3}: wrong \
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

/// Fewest samples: as many as a model of two radial terms, two-fold terms, rotation and offset has numbers,
/// with as many again to show a misfit.
pub const FEWEST_SAMPLES: usize = 10;
/// Share of outliers above which the measurement itself is in doubt.
const MOST_OUTLIERS: f64 = 0.3;
/// Residuals above this share of the radius are no scatter of a print: ten times what a poor pad leaves.
const MOST_SCATTER: f64 = 0.03;
/// Distances from the middle on the plate over those on the dome, seen from above, that a pad can make: 1 where the
/// pad comes straight down, 1.57 at the rim where it keeps arc length; with room for soft and stiff ones.
const PLATE_OVER_DOME: [f64; 2] = [0.6, 2.2];
/// Scatter below this share of the radius counts as none: residuals are then rounding.
const LEAST_SIGMA: f64 = 1e-9;
/// Most radial terms.
const MOST_RADIAL: usize = 4;
/// A difference of the information criterion that counts as decisive (R. Kass and A. Raftery, JASA 90, 1995).
const DECISIVE: f64 = 10.0;
/// How far past the outermost sample the map is carried: half a mark and a little, rad.
const BEYOND_RAD: f64 = 0.06;
/// Furthest that any measured map reaches, rad: at the rim itself a print cannot be measured from above.
const FURTHEST_RAD: f64 = FRAC_PI_2 - 0.03;
/// Fits a measured map. It is carried on to `reach_rad` (the pad's wrap limit), even if the marks landed less far,
/// as long as it does not fold there; a soft pad draws a target together, and its next print reaches further.
///
/// # Errors
/// See [`FitError`].
pub fn fit(
    dome_radius_mm: f64,
    samples: &[Sample],
    measured_in: MeasuredIn,
    reach_rad: f64,
) -> Result<Fit, FitError> {
    if samples.len() < FEWEST_SAMPLES {
        return Err(FitError::TooFew { have: samples.len(), need: FEWEST_SAMPLES });
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
) -> Result<Fit, FitError> {
    let polar = samples.iter().map(|s| Polar::of_direction(s.landed.normalize())).collect();
    let problem = Problem { radius_mm: dome_radius_mm, samples, polar, measured_in };
    let used = problem.inliers()?;
    let rejected: Vec<usize> = (0..samples.len()).filter(|i| !used[*i]).collect();
    if rejected.len() as f64 > MOST_OUTLIERS * samples.len() as f64 {
        return Err(FitError::TooManyOutliers { samples: rejected, most: MOST_OUTLIERS });
    }
    let weights: Vec<f64> = used.iter().map(|u| f64::from(u8::from(*u))).collect();
    let count = samples.len() - rejected.len();

    // The simplest model that the data asks for. A model that folds cannot be used; if it explains the data
    // decisively better than every one that can, the pad itself folds, and to fit it worse would be to lie.
    let mut best: Option<(f64, Model, Correction)> = None;
    let mut folded: Option<(f64, TransferError)> = None;
    let most_radial = problem.most_radial();
    for model in models() {
        if count < model.parameters() || model.radial > most_radial {
            continue;
        }
        let Ok(mut correction) = problem.solve(model, &weights) else { continue };
        // As far as it is wanted, or as far as it holds: a series may fold just past the marks that it was fitted to.
        let measured_rad = correction.max_polar_rad;
        let reaches =
            [measured_rad.max(reach_rad.min(FURTHEST_RAD)), measured_rad, measured_rad - BEYOND_RAD];
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
        let floor = (LEAST_SIGMA * dome_radius_mm).powi(2);
        let criterion = n * (squares / n + floor).ln() + model.parameters() as f64 * n.ln();
        if let Some(Err(error)) = made {
            if folded.as_ref().is_none_or(|(least, _)| criterion < *least) {
                folded = Some((criterion, error));
            }
            continue;
        }
        if best.as_ref().is_none_or(|(least, ..)| criterion < *least) {
            best = Some((criterion, model, correction));
        }
    }
    match (best, folded) {
        (Some((usable, model, correction)), folded)
            if folded.as_ref().is_none_or(|(least, _)| least + DECISIVE > usable) =>
        {
            let found = problem.report(model, correction, &used, rejected);
            let (rms_mm, most_mm) = (found.residual_rms_mm, MOST_SCATTER * dome_radius_mm);
            if rms_mm <= most_mm { Ok(found) } else { Err(FitError::TooScattered { rms_mm, most_mm }) }
        }
        (_, Some((_, error))) => Err(FitError::Folds(error)),
        (_, None) => Err(FitError::Degenerate),
    }
}

/// The value below which this share of the values lies.
fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get((sorted.len() as f64 * share) as usize).or(sorted.last()).copied().unwrap_or(0.0)
}

fn models() -> impl Iterator<Item = Model> {
    Nominal::ALL.into_iter().flat_map(|nominal| {
        (1..=MOST_RADIAL).flat_map(move |radial| {
            [false, true].into_iter().map(move |two_fold| Model { nominal, radial, two_fold })
        })
    })
}
