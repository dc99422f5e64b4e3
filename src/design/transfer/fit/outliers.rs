//! Which samples are no outliers.
//!
//! Pairs of samples, each of which fixes a plain map, vote first; the best of them starts a least trimmed squares fit
//! of the whole model (P. Rousseeuw and K. Van Driessen, Data Mining and Knowledge Discovery 12, 2006), which reads
//! the best seven samples of ten only. Wrong marks bias it less than they bias least squares, or, where they
//! are far off, least absolute deviations. Samples beyond its scatter are then left out, and the
//! scatter is computed again.

use glam::DVec2;

use super::error::FitError;
use super::sample::Sample;
use super::solve::{BEYOND_RAD, FitModel, FitProblem};
use crate::transfer::{Nominal, TransferMap, UnitPlate};

/// Share of outliers above which the measurement itself is in doubt.
pub(super) const MAX_OUTLIERS: f64 = 0.3;
/// A sample is an outlier beyond this multiple of the scatter. Of 1000 good samples in two dimensions, 0.04
/// lie further out.
const OUTLIER_SIGMAS: f64 = 4.5;
/// A sample this close to the map, as a share of the radius, is none: so far a wrong nominal map may miss, and
/// no print is better.
const NO_OUTLIER: f64 = 0.002;
/// Median of the length of a scatter in two dimensions over its standard deviation per axis: sqrt(2 ln 2).
const MEDIAN_LENGTH: f64 = 1.177_410_022_515_474_7;
/// Bound on the rounds of either search.
const MAX_ROUNDS: u32 = 12;
/// Pairs of samples that vote. With three mistaken marks of ten, half of the pairs are good.
const PAIRS: usize = 64;

impl FitProblem<'_> {
    /// Which samples are no outliers: by the model that explains seven samples of ten best, among those that do not
    /// fold. A series that meets every ring can bend, and fold, to meet a mistaken mark beyond them; one with a term
    /// less can not, but may miss a ring.
    pub fn inliers(&self) -> Result<Vec<bool>, FitError> {
        let mut best: Option<((bool, f64), Vec<bool>)> = None;
        let count = self.samples.len();
        let limit = self.max_radial().min(if count >= 40 { 4 } else { 3 });
        for nominal in Nominal::ALL {
            for radial in limit.saturating_sub(1).max(1)..=limit {
                let model = FitModel { nominal, radial, two_fold: count >= 24 };
                let Ok((length, used)) = self.inliers_of(model) else { continue };
                let rank = (self.folds(model, &used), length);
                if best.as_ref().is_none_or(|(lowest, _)| rank < *lowest) {
                    best = Some((rank, used));
                }
            }
        }
        best.map(|(_, used)| used).ok_or(FitError::Degenerate)
    }

    /// Whether the map through the samples used folds among them.
    fn folds(&self, model: FitModel, used: &[bool]) -> bool {
        let weights: Vec<f64> = used.iter().map(|used| f64::from(u8::from(*used))).collect();
        let Ok(mut correction) = self.solve(model, &weights) else { return true };
        correction.max_polar_rad -= BEYOND_RAD;
        TransferMap::new(self.radius_mm, model.nominal, Some(correction)).is_err()
    }

    fn inliers_of(&self, model: FitModel) -> Result<(f64, Vec<bool>), FitError> {
        let mut lengths = self.by_pairs(model.nominal);
        let mut used = Vec::new();
        for _ in 0..MAX_ROUNDS {
            let next = best_of(&lengths, 1.0 - MAX_OUTLIERS);
            if next == used {
                break;
            }
            used = next;
            lengths = self.lengths_without(model, &used)?;
        }
        used = vec![true; lengths.len()];
        // The trimmed fit flatters the few samples that it read (P. Rousseeuw and A. Leroy, "Robust Regression and
        // Outlier Detection", 1987, chapter 5).
        let free = lengths.len().saturating_sub(model.parameters() / 2).max(1);
        let mut small_sample = 1.0 + 5.0 / free as f64;
        for _ in 0..MAX_ROUNDS {
            let kept = lengths.iter().zip(&used).filter(|(_, used)| **used).map(|(length, _)| *length);
            let sigma = small_sample * scatter(kept.collect(), model.parameters());
            let limit = (OUTLIER_SIGMAS * sigma).max(NO_OUTLIER * self.radius_mm);
            let next: Vec<bool> = lengths.iter().map(|length| *length <= limit).collect();
            let same = next == used;
            used = next;
            // So few that agree determine no map; the caller names the rest.
            if used.iter().filter(|used| **used).count() as f64 <= (1.0 - MAX_OUTLIERS) * used.len() as f64 {
                break;
            }
            lengths = self.lengths_without(model, &used)?;
            if same {
                break;
            }
            small_sample = 1.0;
        }
        // Over all samples: a wrong nominal map can fit a few rings exactly and reject the rest.
        Ok((quantile(&lengths, 1.0 - MAX_OUTLIERS), used))
    }

    /// Lengths of all residuals of a fit to the samples used.
    fn lengths_without(&self, model: FitModel, used: &[bool]) -> Result<Vec<f64>, FitError> {
        let weights: Vec<f64> = used.iter().map(|used| f64::from(u8::from(*used))).collect();
        let correction = self.solve(model, &weights)?;
        Ok(self.residuals(model.nominal, &correction).map(DVec2::length).collect())
    }

    /// Lengths of the residuals on the plate by the plain map (a nominal one, turned, stretched and shifted) through
    /// two samples that leaves the least to seven samples of ten.
    fn by_pairs(&self, nominal: Nominal) -> Vec<f64> {
        let count = self.samples.len();
        let nominal_places: Vec<DVec2> = (self.polar.iter())
            .map(|at| UnitPlate::round(nominal.radius_over_sin(at.polar_rad), 0.0).place(at) * self.radius_mm)
            .collect();
        let widest = nominal_places.iter().map(|place| place.length()).fold(0.0, f64::max);
        let mut best = (f64::INFINITY, vec![0.0; count]);
        for k in 1..=PAIRS {
            // Two sequences that spread evenly over all samples (multiples of irrational numbers).
            let pick = |step: f64| ((k as f64 * step).fract() * count as f64) as usize % count;
            let (i, j) = (pick(0.618_033_988_75), pick(0.754_877_666_25));
            let apart = nominal_places[i] - nominal_places[j];
            if apart.length() < 0.2 * widest || i == j {
                continue;
            }
            // The similarity as a complex number: turn and stretch in one.
            let on_plate = self.samples[i].plate_mm - self.samples[j].plate_mm;
            let turn = DVec2::new(apart.dot(on_plate), apart.perp_dot(on_plate)) / apart.length_squared();
            let shift = self.samples[i].plate_mm - turn.rotate(nominal_places[i]);
            let off =
                |(place, sample): (&DVec2, &Sample)| (turn.rotate(*place) + shift).distance(sample.plate_mm);
            let lengths: Vec<f64> = nominal_places.iter().zip(self.samples).map(off).collect();
            let score = quantile(&lengths, 1.0 - MAX_OUTLIERS);
            if score < best.0 {
                best = (score, lengths);
            }
        }
        best.1
    }
}

/// Marks the share of samples with the smallest residuals.
fn best_of(lengths: &[f64], share: f64) -> Vec<bool> {
    let mut order: Vec<usize> = (0..lengths.len()).collect();
    order.sort_by(|a, b| lengths[*a].total_cmp(&lengths[*b]));
    let mut best = vec![false; lengths.len()];
    for index in order.into_iter().take((share * lengths.len() as f64).ceil() as usize) {
        best[index] = true;
    }
    best
}

/// Scatter per axis by the median of the residuals. As many of the smallest are passed over as the fit could bring to
/// zero by its free numbers, two to a sample.
fn scatter(mut lengths: Vec<f64>, parameters: usize) -> f64 {
    lengths.sort_by(f64::total_cmp);
    let informative = lengths.get(parameters / 2..).filter(|rest| !rest.is_empty()).unwrap_or(&lengths);
    quantile(informative, 0.5) / MEDIAN_LENGTH
}

/// The value below which this share of the values lies.
pub(super) fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get((sorted.len() as f64 * share) as usize).or(sorted.last()).copied().unwrap_or(0.0)
}
