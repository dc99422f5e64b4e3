//! Fitting a measured map to a printed test target.
//!
//! Where a mark stands on the plate is known, where it landed on the dome was measured. The model is a nominal
//! map with a [`Correction`]; it is linear in all but the rotation, so that Gauss and Newton's iteration
//! settles in a few steps. Residuals are taken where the measurement was made, on the dome or in the view
//! from outside: there the scatter is even, on the plate it is not.
//!
//! Outliers are found first, by a fit of least absolute deviations and the median of its residuals. How many
//! terms the data can carry, and on which nominal map they rest, is then decided by Bayes's information
//! criterion (G. Schwarz, Annals of Statistics 6(2), 1978).

use std::f64::consts::FRAC_PI_2;
use std::fmt;

use glam::{DVec2, DVec3};
use nalgebra::{DMatrix, DVector};

use super::{Correction, Nominal, Polar, TransferError, TransferMap, UnitPlate};

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

/// Where the scatter of a measurement is even.
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
    /// Root mean square of the residuals of the samples used, per axis, mm where they were measured.
    pub residual_rms_mm: f64,
    /// Largest residual of the samples used, mm.
    pub residual_max_mm: f64,
    /// Scatter of one mark from print to print, per axis, mm; `None` if no mark was measured twice.
    pub scatter_mm: Option<f64>,
    /// Part of the scatter that whole prints share: standard deviation of the prints' mean shifts, mm.
    pub print_shift_mm: Option<f64>,
    /// Root mean square that the map itself misses, per axis, mm: the residual beyond the scatter; `None`
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
    /// The best map folds.
    Folds(TransferError),
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
            Self::Folds(error) => write!(f, "the map that fits best cannot be used: {error}"),
        }
    }
}

impl std::error::Error for FitError {}

/// Fewest samples: as many as a model of two radial terms, two-fold terms, rotation and offset has numbers,
/// with as many again to show a misfit.
pub const FEWEST_SAMPLES: usize = 10;
/// Share of outliers above which the measurement itself is in doubt.
const MOST_OUTLIERS: f64 = 0.3;
/// A sample is an outlier beyond this multiple of the scatter. Of 1000 good samples in two dimensions, 0.04
/// lie further out.
const OUTLIER_SIGMAS: f64 = 4.5;
/// Median of the length of a scatter in two dimensions over its standard deviation per axis: sqrt(2 ln 2).
const MEDIAN_LENGTH: f64 = 1.177_410_022_515_474_7;
/// Scatter below this share of the radius counts as none: residuals are then rounding.
const LEAST_SIGMA: f64 = 1e-9;
/// Most radial terms.
const MOST_RADIAL: usize = 4;
/// Bounds on iterations.
const MOST_STEPS: u32 = 40;
const MOST_ROUNDS: u32 = 12;
/// How far past the outermost sample the map is carried: half a mark and a little, rad.
const BEYOND_RAD: f64 = 0.06;
/// Furthest that any measured map reaches, rad: at the rim itself a print cannot be measured from above.
const FURTHEST_RAD: f64 = FRAC_PI_2 - 0.03;
/// Least slope by which a plate residual is carried to the dome, so that the rim does not weigh endlessly.
const LEAST_SLOPE: f64 = 0.1;

/// Which numbers of the model are free.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Model {
    nominal: Nominal,
    radial: usize,
    two_fold: bool,
}

impl Model {
    fn parameters(self) -> usize {
        self.radial + if self.two_fold { 4 } else { 0 } + 3
    }
}

struct Problem<'a> {
    radius_mm: f64,
    samples: &'a [Sample],
    polar: Vec<Polar>,
    measured_in: MeasuredIn,
}

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
    let polar = samples.iter().map(|s| Polar::of_direction(s.landed.normalize())).collect();
    let problem = Problem { radius_mm: dome_radius_mm, samples, polar, measured_in };

    let used = problem.inliers()?;
    let rejected: Vec<usize> = (0..samples.len()).filter(|i| !used[*i]).collect();
    if rejected.len() as f64 > MOST_OUTLIERS * samples.len() as f64 {
        return Err(FitError::TooManyOutliers { samples: rejected, most: MOST_OUTLIERS });
    }
    let weights: Vec<f64> = used.iter().map(|u| f64::from(u8::from(*u))).collect();
    let count = samples.len() - rejected.len();

    // The simplest model that the data asks for; models that fold are not in the running.
    let mut best: Option<(f64, Model, Correction)> = None;
    let mut folded = None;
    for model in models() {
        if count < model.parameters() {
            continue;
        }
        let Ok(mut correction) = problem.solve(model, &weights) else { continue };
        let measured_rad = correction.max_polar_rad;
        correction.max_polar_rad = measured_rad.max(reach_rad.min(FURTHEST_RAD));
        if TransferMap::new(dome_radius_mm, model.nominal, Some(correction.clone())).is_err() {
            correction.max_polar_rad = measured_rad;
        }
        if let Err(error) = TransferMap::new(dome_radius_mm, model.nominal, Some(correction.clone())) {
            folded.get_or_insert(error);
            continue;
        }
        let squares: f64 = problem
            .residuals(model.nominal, &correction)
            .zip(&weights)
            .map(|(r, w)| w * r.length_squared())
            .sum();
        let n = 2.0 * count as f64;
        let floor = (LEAST_SIGMA * dome_radius_mm).powi(2);
        let criterion = n * (squares / n + floor).ln() + model.parameters() as f64 * n.ln();
        if best.as_ref().is_none_or(|(least, ..)| criterion < *least) {
            best = Some((criterion, model, correction));
        }
    }
    let Some((_, model, correction)) = best else {
        return Err(folded.map_or(FitError::Degenerate, FitError::Folds));
    };
    Ok(problem.report(model, correction, &used, rejected))
}

fn models() -> impl Iterator<Item = Model> {
    Nominal::ALL.into_iter().flat_map(|nominal| {
        (1..=MOST_RADIAL).flat_map(move |radial| {
            [false, true].into_iter().map(move |two_fold| Model { nominal, radial, two_fold })
        })
    })
}

impl Problem<'_> {
    /// Which samples are no outliers: by the nominal map whose fit leaves the least median residual.
    fn inliers(&self) -> Result<Vec<bool>, FitError> {
        let mut best: Option<(f64, Vec<bool>)> = None;
        for nominal in Nominal::ALL {
            let model = Model { nominal, radial: 3, two_fold: self.samples.len() >= 24 };
            let Ok(found) = self.inliers_of(model) else { continue };
            if best.as_ref().is_none_or(|(least, _)| found.0 < *least) {
                best = Some(found);
            }
        }
        best.map(|(_, used)| used).ok_or(FitError::Degenerate)
    }

    fn inliers_of(&self, model: Model) -> Result<(f64, Vec<bool>), FitError> {
        // Least absolute deviations, by weights that are renewed.
        let mut weights = vec![1.0; self.samples.len()];
        let mut lengths = Vec::new();
        for _ in 0..MOST_ROUNDS {
            let correction = self.solve(model, &weights)?;
            lengths = self.residuals(model.nominal, &correction).map(DVec2::length).collect();
            let small = (0.1 * median(&lengths)).max(LEAST_SIGMA * self.radius_mm);
            weights = lengths.iter().map(|r| small / r.max(small)).collect();
        }
        let mut used = vec![true; self.samples.len()];
        let mut sigma = 0.0;
        for _ in 0..MOST_ROUNDS {
            let kept: Vec<f64> = lengths.iter().zip(&used).filter(|(_, u)| **u).map(|(r, _)| *r).collect();
            sigma = (median(&kept) / MEDIAN_LENGTH).max(LEAST_SIGMA * self.radius_mm);
            let next: Vec<bool> = lengths.iter().map(|r| *r <= OUTLIER_SIGMAS * sigma).collect();
            let same = next == used;
            used = next;
            let weights: Vec<f64> = used.iter().map(|u| f64::from(u8::from(*u))).collect();
            let correction = self.solve(model, &weights)?;
            lengths = self.residuals(model.nominal, &correction).map(DVec2::length).collect();
            if same {
                break;
            }
        }
        Ok((sigma, used))
    }

    /// The correction that leaves the least weighted squares.
    fn solve(&self, model: Model, weights: &[f64]) -> Result<Correction, FitError> {
        let outermost = self.polar.iter().zip(weights).filter(|(_, w)| **w > 0.0).map(|(p, _)| p.polar_rad);
        let mut correction = Correction {
            radial: vec![0.0; model.radial],
            two_fold: [0.0; 2],
            two_fold_sideways: [0.0; 2],
            rotation_rad: 0.0,
            offset_mm: DVec2::ZERO,
            max_polar_rad: (outermost.fold(0.0, f64::max) + BEYOND_RAD).min(FURTHEST_RAD),
        };
        let count = model.parameters();
        for _ in 0..MOST_STEPS {
            let mut matrix = DMatrix::zeros(2 * self.samples.len(), count);
            let mut right = DVector::zeros(2 * self.samples.len());
            for (i, ((sample, at), weight)) in self.samples.iter().zip(&self.polar).zip(weights).enumerate() {
                let image = correction.unit_plate(model.nominal, at);
                let to_measured = self.to_measured(at, &image);
                let root = weight.sqrt();
                let mut put = |column: usize, on_plate: DVec2| {
                    let value = to_measured(on_plate) * root;
                    matrix[(2 * i, column)] = value.x;
                    matrix[(2 * i + 1, column)] = value.y;
                };
                let (out, side) = (image.turn.rotate(at.out), image.turn.rotate(at.out.perp()));
                let s = at.sin_polar;
                for k in 0..model.radial {
                    put(k, out * s.powi(2 * k as i32 + 1));
                }
                let mut next = model.radial;
                if model.two_fold {
                    let (cos, sin) = (at.out.x * at.out.x - at.out.y * at.out.y, 2.0 * at.out.x * at.out.y);
                    for value in [out * (s * cos), out * (s * sin), side * (s * cos), side * (s * sin)] {
                        put(next, value);
                        next += 1;
                    }
                }
                put(next, image.place(at).perp());
                put(next + 1, DVec2::X);
                put(next + 2, DVec2::Y);
                let miss = (sample.plate_mm - correction.offset_mm) / self.radius_mm - image.place(at);
                let value = to_measured(miss) * root;
                right[2 * i] = value.x;
                right[2 * i + 1] = value.y;
            }
            let step = solve_scaled(matrix, &right).ok_or(FitError::Degenerate)?;
            let mut values = step.iter().copied();
            let mut take = || values.next().unwrap_or(0.0);
            for c in &mut correction.radial {
                *c += take();
            }
            if model.two_fold {
                for pair in [&mut correction.two_fold, &mut correction.two_fold_sideways] {
                    for value in pair {
                        *value += take();
                    }
                }
            }
            correction.rotation_rad += take();
            correction.offset_mm += DVec2::new(take(), take()) * self.radius_mm;
            if step.amax() < 1e-12 {
                break;
            }
        }
        let finite = correction.offset_mm.is_finite() && correction.rotation_rad.is_finite();
        if finite { Ok(correction) } else { Err(FitError::Degenerate) }
    }

    /// Carries a small step on the plate to where the measurement was made: (towards the rim, around).
    fn to_measured(&self, at: &Polar, image: &UnitPlate) -> impl Fn(DVec2) -> DVec2 + use<> {
        let (polar, around) = (image.d_polar(at), image.d_around(at));
        let area = polar.perp_dot(around);
        let shortened = match self.measured_in {
            MeasuredIn::View => at.cos_polar.max(0.0),
            MeasuredIn::Dome => 1.0,
        };
        let area = if area.abs() < LEAST_SLOPE { LEAST_SLOPE } else { area };
        move |step: DVec2| DVec2::new(step.perp_dot(around) / area * shortened, polar.perp_dot(step) / area)
    }

    /// Residuals where they were measured, mm.
    fn residuals(&self, nominal: Nominal, correction: &Correction) -> impl Iterator<Item = DVec2> {
        self.samples.iter().zip(&self.polar).map(move |(sample, at)| {
            let image = correction.unit_plate(nominal, at);
            let miss = sample.plate_mm - correction.offset_mm - image.place(at) * self.radius_mm;
            self.to_measured(at, &image)(miss)
        })
    }

    fn report(&self, model: Model, correction: Correction, used: &[bool], rejected: Vec<usize>) -> Fit {
        let residuals: Vec<DVec2> = self.residuals(model.nominal, &correction).collect();
        let kept = || residuals.iter().zip(self.samples).zip(used).filter(|(_, u)| **u).map(|(pair, _)| pair);
        let count = kept().count();
        let squares: f64 = kept().map(|(r, _)| r.length_squared()).sum();
        let residual_rms_mm = (squares / (2 * count) as f64).sqrt();
        let residual_max_mm = kept().map(|(r, _)| r.length()).fold(0.0, f64::max);

        // Scatter of each mark about its mean over the prints.
        let mut by_mark: Vec<(u32, usize, DVec2)> = kept().map(|(r, s)| (s.mark, s.print, *r)).collect();
        by_mark.sort_by_key(|(mark, print, _)| (*mark, *print));
        let (mut spread, mut free) = (0.0, 0usize);
        for group in by_mark.chunk_by(|a, b| a.0 == b.0) {
            let mean = group.iter().map(|(_, _, r)| *r).sum::<DVec2>() / group.len() as f64;
            spread += group.iter().map(|(_, _, r)| (*r - mean).length_squared()).sum::<f64>();
            free += group.len() - 1;
        }
        let scatter_mm = (free > 0).then(|| (spread / (2 * free) as f64).sqrt());
        let lack_of_fit_mm = scatter_mm.map(|scatter| {
            let expected = scatter * scatter * (1.0 - model.parameters() as f64 / (2 * count) as f64);
            (residual_rms_mm * residual_rms_mm - expected).max(0.0).sqrt()
        });
        Fit {
            nominal: model.nominal,
            correction,
            residual_rms_mm,
            residual_max_mm,
            scatter_mm,
            print_shift_mm: print_shift_mm(kept().map(|(r, s)| (s, *r))),
            lack_of_fit_mm,
            rejected,
            parameters: model.parameters(),
            measured_to_rad: (self.polar.iter().zip(used))
                .filter(|(_, used)| **used)
                .map(|(at, _)| at.polar_rad)
                .fold(0.0, f64::max),
        }
    }
}

/// Standard deviation, per axis, of the prints' mean shifts in the plane of the base.
fn print_shift_mm<'a>(residuals: impl Iterator<Item = (&'a Sample, DVec2)>) -> Option<f64> {
    let mut sums: Vec<(DVec2, usize)> = Vec::new();
    for (sample, residual) in residuals {
        if sums.len() <= sample.print {
            sums.resize(sample.print + 1, (DVec2::ZERO, 0));
        }
        let at = Polar::of_direction(sample.landed.normalize());
        let flat = at.out * residual.x + at.out.perp() * residual.y;
        sums[sample.print].0 += flat;
        sums[sample.print].1 += 1;
    }
    let means: Vec<DVec2> = sums.iter().filter(|(_, n)| *n > 0).map(|(sum, n)| *sum / *n as f64).collect();
    if means.len() < 2 {
        return None;
    }
    let mean = means.iter().sum::<DVec2>() / means.len() as f64;
    let squares: f64 = means.iter().map(|m| (*m - mean).length_squared()).sum();
    Some((squares / (2 * (means.len() - 1)) as f64).sqrt())
}

/// Least squares with columns of equal length; `None` if the columns do not stand apart.
fn solve_scaled(mut matrix: DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    const RANK: f64 = 1e-10;
    let scale: Vec<f64> = matrix.column_iter().map(|column| column.norm()).collect();
    if scale.iter().any(|s| !(s.is_finite() && *s > 0.0)) {
        return None;
    }
    for (mut column, s) in matrix.column_iter_mut().zip(&scale) {
        column /= *s;
    }
    let decomposed = matrix.try_svd(true, true, f64::EPSILON, 1000)?;
    let (low, high) = (decomposed.singular_values.min(), decomposed.singular_values.max());
    if low.is_nan() || low < RANK * high {
        return None;
    }
    let mut solution = decomposed.solve(right, 0.0).ok()?;
    for (value, s) in solution.iter_mut().zip(&scale) {
        *value /= s;
    }
    Some(solution)
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}
