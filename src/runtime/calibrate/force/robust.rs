//! One axis of the wrench by Tukey's biweight, with confidence intervals, and with the noise of the displacements
//! taken out.
//!
//! Noise in what a regression multiplies pulls its coefficients towards zero, by the noise's part of the variance. With a
//! known covariance `S` of the noise of the terms the normal equations lose what it adds, `X^T W X - c sum(w S)`
//! (W. A. Fuller, *Measurement Error Models*, 1987, section 2.2); `c` keeps the biweight consistent, because a reading
//! that is off weighs less.

use domecast_optics::numeric::{pseudo_inverse, singular_values, symmetric_eigen};
use nalgebra::{DMatrix, DVector};

use super::statistics::MEDIAN_TO_SD;
use super::types::{ForceModel, Pair};

/// Tukey's constant: full efficiency of 95 % for normal noise.
const TUKEY: f64 = 4.685;
const MAX_ROUNDS: usize = 60;
/// A coefficient whose term varies by less than this part of the others, once scaled, is not determined.
const MIN_SINGULAR: f64 = 1e-3;
/// `E[w(u) u^2] / E[w(u)]` of the biweight for normal noise: `(1 - 6/k^2 + 15/k^4) / (1 - 2/k^2 + 3/k^4)`.
const NOISE_SHARE: f64 = 0.8284;
/// A product of two motions counts from this part on of the product of their sizes: less is rounding.
const MIN_TOGETHER: f64 = 1e-6;
/// A direction of the terms must vary by more than this many times its noise to be determined.
const MIN_VARIANCE_IN_NOISE: f64 = 1.0;

/// Rows that move one axis scatter as the others do. Where they scatter by this many times that, they are no outliers: the coefficient
/// is wrong, for the many rows that hold the axis still do not need it.
const MAX_GROUP: f64 = 3.0;
/// Such rows at least.
const MIN_GROUP: usize = 6;

/// The fit of one axis.
pub(super) struct RobustFit {
    pub coefficients: Vec<f64>,
    pub half_widths: Vec<Option<f64>>,
    /// Of the coefficients; zero where the data do not determine them.
    pub covariance: DMatrix<f64>,
    pub sd: f64,
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Terms of one wrench axis, each scaled to a root mean square of one.
struct Terms {
    /// Terms of the whole model, those that are used, and their scales.
    count: usize,
    used: Vec<usize>,
    scale: Vec<f64>,
    design: DMatrix<f64>,
    target: DVector<f64>,
    /// Covariance of each row's noise, scaled as the design; empty where the displacements are exact.
    noise: Vec<DMatrix<f64>>,
}

impl Terms {
    /// Terms of axes that do not move are left out.
    fn new(pairs: &[Pair], axis: usize, rows: &[usize], model: ForceModel, moved: &[usize]) -> Self {
        let all: Vec<Vec<f64>> = rows.iter().map(|row| model.terms(&pairs[*row].displacement)).collect();
        let count = all.first().map_or(0, Vec::len);
        let rms =
            |term: usize| (all.iter().map(|t| t[term] * t[term]).sum::<f64>() / rows.len() as f64).sqrt();
        // The offset stands at 6; a product term belongs to the axis that it multiplies, where the two ever move together.
        let belongs = |term: usize| match term {
            0..6 => moved.contains(&term),
            6 => true,
            _ => {
                let apart = rms(term - 7) * rms(2);
                moved.contains(&(term - 7)) && moved.contains(&2) && rms(term) > MIN_TOGETHER * apart
            }
        };
        let used: Vec<usize> = (0..count).filter(|term| belongs(*term)).collect();
        let scale: Vec<f64> = used.iter().map(|term| rms(*term).max(1e-300)).collect();
        let design = DMatrix::from_fn(rows.len(), used.len(), |i, j| all[i][used[j]] / scale[j]);
        let target = DVector::from_fn(rows.len(), |i, _| pairs[rows[i]].wrench[axis].unwrap_or(0.0));
        let noise_of = |row: &usize| {
            let pair = &pairs[*row];
            let slopes = model.slopes(&pair.displacement);
            let whole = &slopes * pair.displacement_covariance * slopes.transpose();
            DMatrix::from_fn(used.len(), used.len(), |i, j| whole[(used[i], used[j])] / (scale[i] * scale[j]))
        };
        let is_exact =
            rows.iter().all(|row| pairs[*row].displacement_covariance == nalgebra::Matrix6::zeros());
        let noise = if is_exact { Vec::new() } else { rows.iter().map(noise_of).collect() };
        Self { count, used, scale, design, target, noise }
    }

    /// The scatter beyond which a row is an outlier: that of all rows, or that of the rows that move one of the axes.
    fn scatter(&self, left: &DVector<f64>, sd: f64) -> f64 {
        let of_group = |term: usize| {
            // Columns have a root mean square of one.
            let is_moved = |row: &usize| self.design[(*row, term)].abs() > 1.0;
            let mut sizes: Vec<f64> = (0..left.len()).filter(is_moved).map(|row| left[row].abs()).collect();
            if sizes.len() < MIN_GROUP { 0.0 } else { MEDIAN_TO_SD * median(&mut sizes) }
        };
        let largest = (0..self.used.len()).map(of_group).fold(0.0, f64::max);
        if largest > MAX_GROUP * sd { largest } else { sd }
    }

    /// What noise adds to the normal matrix under these weights.
    fn noise_sum(&self, weight: impl Fn(usize) -> f64) -> DMatrix<f64> {
        let width = self.used.len();
        let add = |sum, (row, noise): (usize, &DMatrix<f64>)| sum + noise * weight(row);
        self.noise.iter().enumerate().fold(DMatrix::zeros(width, width), add)
    }

    /// [`Self::solve`] with the noise of the displacements taken out of the normal matrix. Directions that vary by
    /// little more than their noise are left out too.
    fn solve_noisy(&self, weights: &DVector<f64>) -> Option<(DVector<f64>, Vec<bool>)> {
        let width = self.used.len();
        let weighted = DMatrix::from_fn(self.design.nrows(), width, |i, j| self.design[(i, j)] * weights[i]);
        let noise = self.noise_sum(|row| NOISE_SHARE * weights[row]);
        let normal = weighted.transpose() * &self.design - &noise;
        let eigen = symmetric_eigen(normal)?;
        let largest = eigen.eigenvalues.max();
        let mut inverse = DMatrix::zeros(width, width);
        let mut determined = vec![true; width];
        for (k, value) in eigen.eigenvalues.iter().enumerate() {
            let direction = eigen.eigenvectors.column(k).into_owned();
            let own_noise = direction.dot(&(&noise * &direction));
            if *value > (MIN_SINGULAR * MIN_SINGULAR * largest).max(MIN_VARIANCE_IN_NOISE * own_noise) {
                inverse += &direction * direction.transpose() / *value;
            } else {
                for (flag, part) in determined.iter_mut().zip(direction.iter()) {
                    *flag &= part.abs() < 0.05;
                }
            }
        }
        Some((&inverse * (weighted.transpose() * &self.target), determined))
    }

    /// Weighted least squares, and which coefficients the data determine. Directions that the data do not show are
    /// left out, and so is every coefficient that they reach.
    fn solve(&self, weights: &DVector<f64>) -> Option<(DVector<f64>, Vec<bool>)> {
        if !self.noise.is_empty() {
            return self.solve_noisy(weights);
        }
        let root = weights.map(f64::sqrt);
        let (height, width) = self.design.shape();
        let weighted = DMatrix::from_fn(height, width, |i, j| self.design[(i, j)] * root[i]);
        let svd = singular_values(weighted.clone())?;
        let v_t = svd.v_t.as_ref()?;
        let largest = svd.singular_values.max();
        let mut inverse = DMatrix::zeros(width, width);
        let mut determined = vec![true; width];
        for (k, s) in svd.singular_values.iter().enumerate() {
            let direction = v_t.row(k).transpose();
            if *s > MIN_SINGULAR * largest {
                inverse += &direction * direction.transpose() / (s * s);
            } else {
                for (flag, part) in determined.iter_mut().zip(direction.iter()) {
                    *flag &= part.abs() < 0.05;
                }
            }
        }
        let right = weighted.transpose() * self.target.component_mul(&root);
        Some((&inverse * right, determined))
    }

    /// Huber's asymptotic variance of an M-estimate: `sd^2 E[psi^2] / E[psi']^2 (X^T X)^-1`.
    fn covariance(&self, found: &DVector<f64>, sd: f64) -> DMatrix<f64> {
        let (height, width) = self.design.shape();
        let n = height as f64;
        let left = &self.target - &self.design * found;
        let (mut psi2, mut slope) = (0.0, 0.0);
        for r in left.iter() {
            let u = r / (TUKEY * sd.max(f64::MIN_POSITIVE));
            if u.abs() < 1.0 {
                psi2 += (r * (1.0 - u * u).powi(2)).powi(2);
                slope += (1.0 - u * u) * (1.0 - 5.0 * u * u);
            }
        }
        let freedom = (n - width as f64).max(1.0);
        let variance = (psi2 / freedom) / (slope / n).max(0.05).powi(2);
        let gram = self.design.transpose() * &self.design;
        let inverse = |matrix: DMatrix<f64>| {
            pseudo_inverse(matrix, 1e-12).unwrap_or_else(|| DMatrix::zeros(width, width))
        };
        if self.noise.is_empty() {
            return inverse(gram) * variance;
        }
        // Fuller (1987), theorem 2.2.1: residuals and noise of the terms go together, which widens the middle.
        let noise = self.noise_sum(|_| 1.0);
        let pull = &noise * found / n.max(1.0);
        let middle = &gram + &pull * pull.transpose() * (n / (sd * sd).max(f64::MIN_POSITIVE));
        let outer = inverse(gram - noise);
        &outer * middle * &outer * variance
    }
}

/// Iteratively reweighted least squares of one wrench axis; terms of axes that do not move are left at zero.
pub(super) fn robust(
    pairs: &[Pair],
    axis: usize,
    rows: &[usize],
    model: ForceModel,
    moved: &[usize],
) -> RobustFit {
    let terms = Terms::new(pairs, axis, rows, model, moved);
    let width = terms.used.len();
    let mut weights = DVector::from_element(rows.len(), 1.0);
    let mut found = DVector::zeros(width);
    let (mut sd, mut scatter) = (0.0, 0.0);
    let mut determined = vec![true; width];
    for round in 0..MAX_ROUNDS {
        let Some((next, flags)) = terms.solve(&weights) else { break };
        determined = flags;
        let left = &terms.target - &terms.design * &next;
        let mut sizes: Vec<f64> = left.iter().map(|v| v.abs()).collect();
        sd = (MEDIAN_TO_SD * median(&mut sizes)).max(1e-13 * terms.target.amax());
        scatter = terms.scatter(&left, sd);
        // The first round's scale is that of plain least squares, which outliers widen: it only lets them go
        // more slowly.
        let change = (&next - &found).amax();
        found = next;
        weights = left.map(|r| {
            let u = r / (TUKEY * scatter.max(f64::MIN_POSITIVE));
            if u.abs() < 1.0 { (1.0 - u * u).powi(2) } else { 0.0 }
        });
        if round > 3 && change <= 1e-10 * found.amax() {
            break;
        }
    }
    let scaled = terms.covariance(&found, scatter);
    let mut covariance = DMatrix::zeros(terms.count, terms.count);
    let mut coefficients = vec![0.0; terms.count];
    let mut half_widths = vec![None; terms.count];
    for (k, term) in terms.used.iter().enumerate() {
        coefficients[*term] = found[k] / terms.scale[k];
        if determined[k] {
            half_widths[*term] = Some(1.96 * scaled[(k, k)].max(0.0).sqrt() / terms.scale[k]);
            for (j, other) in terms.used.iter().enumerate().filter(|(j, _)| determined[*j]) {
                covariance[(*term, *other)] = scaled[(k, j)] / (terms.scale[k] * terms.scale[j]);
            }
        }
    }
    RobustFit { coefficients, half_widths, covariance, sd }
}
