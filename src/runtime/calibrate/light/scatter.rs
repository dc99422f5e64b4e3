//! What levels may be off beside the light: noise of the camera, and errors of the model that neighbours share.
//!
//! Paint that is uneven, a lens that falls off otherwise, a skin under the ball that is not quite its sphere: such errors are smooth,
//! so a thousand places tell as little of them as a few. They are taken for Gaussian processes over the dome, one common to the
//! channels and one of each channel's own, with the covariance `exp(-d / length)`, as parts of the level (Kennedy and O'Hagan,
//! Bayesian calibration of computer models, J. R. Statist. Soc. B 63, 2001). Their sizes and length are those for which what was
//! seen is most likely, the fitted numbers integrated out.

use std::ops::Range;

use glam::DVec3;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Sizes before anything is known, which are the least ones too, and at most, parts of the level. A choice: the physics agrees with counted
/// photons to 0.5 %, and a camera that compresses colours (JPEG, 4:2:0) shifts levels beside dots by up to 1.6 %, alike in every frame, so
/// that no fit shows it.
const SIZES: [f64; 2] = [1e-2, 0.3];
/// Lengths over which places at rest, and those of a cap, are taken to share their errors at first, parts of the dome's radius.
pub(super) const FIRST_LENGTHS: [f64; 2] = [0.3, 0.05];
/// Noise at least and at most, parts of the frame's.
const NOISES: [f64; 2] = [1.0, 4.0];
/// Rounds of the search; each tries every number up and down, by less from round to round.
const STEPS: [f64; 5] = [4.0, 4.0, 2.0, 2.0, 1.4];

/// Sizes of the errors of a kind of place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scatter {
    /// Error that the channels have in common, and that each has of its own, parts of the level.
    pub common: f64,
    pub own: f64,
    /// Length over which neighbours share them, mm.
    pub length_mm: f64,
    /// Noise, of what it would be for independent pixels.
    pub noise: f64,
}

impl Scatter {
    /// Before anything is known.
    pub fn first(length_mm: f64) -> Self {
        Self { common: SIZES[0], own: SIZES[0], length_mm, noise: 1.0 }
    }

    /// The same with errors so many times as large.
    pub fn rougher(self, factor: f64) -> Self {
        Self { common: self.common * factor, own: self.own * factor, ..self }
    }

    /// Neighbours of the search, eight in all: each number once down, once up.
    fn beside(self, number: usize, step: f64, lengths_mm: [f64; 2]) -> Self {
        let by = if number.is_multiple_of(2) { 1.0 / step } else { step };
        let size = |v: f64| (v * by).clamp(SIZES[0], SIZES[1]);
        match number / 2 {
            0 => Self { common: size(self.common), ..self },
            1 => Self { own: size(self.own), ..self },
            2 => Self { noise: (self.noise * by.sqrt()).clamp(NOISES[0], NOISES[1]), ..self },
            _ => Self { length_mm: (self.length_mm * by).clamp(lengths_mm[0], lengths_mm[1]), ..self },
        }
    }
}

/// Places whose errors belong together: those of the frame at rest, or those of one press.
#[derive(Debug, Clone)]
pub(super) struct Group {
    /// Their rows, three to a place.
    pub rows: Range<usize>,
    pub points_mm: Vec<DVec3>,
    pub levels: Vec<DVec3>,
    /// Deviations by noise.
    pub noise: Vec<DVec3>,
}

/// What a group says of the unknowns: the normal equations, and its part of the likelihood.
pub(super) struct Said {
    pub matrix: DMatrix<f64>,
    pub right: DVector<f64>,
    /// Logarithm of the determinant of the covariance, and the squares of the whitened residuals.
    pub log_determinant: f64,
    pub squares: f64,
}

impl Group {
    /// Factor of the covariance of its rows.
    pub fn factor(&self, scatter: &Scatter) -> Option<Cholesky<f64, Dyn>> {
        let n = self.points_mm.len();
        let mut covariance = DMatrix::zeros(3 * n, 3 * n);
        for i in 0..n {
            for j in 0..=i {
                let near = (-self.points_mm[i].distance(self.points_mm[j]) / scatter.length_mm).exp();
                for a in 0..3 {
                    for b in 0..3 {
                        let own = if a == b { scatter.own * scatter.own } else { 0.0 };
                        let part = (scatter.common * scatter.common + own) * near;
                        covariance[(3 * i + a, 3 * j + b)] = part * self.levels[i][a] * self.levels[j][b];
                    }
                }
            }
            for c in 0..3 {
                covariance[(3 * i + c, 3 * i + c)] += (scatter.noise * self.noise[i][c]).powi(2);
            }
        }
        covariance.cholesky()
    }

    /// Squares of its whitened residuals.
    pub fn squares(&self, factor: &Cholesky<f64, Dyn>, off: &DVector<f64>) -> f64 {
        let own = off.rows(self.rows.start, self.rows.len()).into_owned();
        factor.l_dirty().solve_lower_triangular(&own).map_or(f64::INFINITY, |own| own.norm_squared())
    }

    /// What it says, given the derivatives of all rows.
    pub fn says(
        &self,
        factor: &Cholesky<f64, Dyn>,
        slopes: &DMatrix<f64>,
        off: &DVector<f64>,
    ) -> Option<Said> {
        let n = slopes.ncols();
        let mut own = slopes.rows(self.rows.start, self.rows.len()).into_owned().insert_column(n, 0.0);
        own.column_mut(n).copy_from(&off.rows(self.rows.start, self.rows.len()));
        let l = factor.l_dirty();
        if !l.solve_lower_triangular_mut(&mut own) {
            return None;
        }
        let white = own.columns(0, n);
        let left = own.column(n);
        Some(Said {
            matrix: white.tr_mul(&white),
            right: white.tr_mul(&left),
            log_determinant: 2.0 * (0..l.nrows()).map(|i| l[(i, i)].abs().max(1e-300).ln()).sum::<f64>(),
            squares: left.norm_squared(),
        })
    }
}

/// Twice the negative logarithm of the likelihood, the unknowns integrated out; `rest` are the normal equations of all else, with the
/// unknowns' priors.
fn unlikely(said: &[Said], rest: (&DMatrix<f64>, &DVector<f64>)) -> f64 {
    let (mut matrix, mut right, mut sum) = (rest.0.clone(), rest.1.clone(), 0.0);
    for one in said {
        matrix += &one.matrix;
        right += &one.right;
        sum += one.log_determinant + one.squares;
    }
    let Some(factor) = matrix.cholesky() else { return f64::INFINITY };
    let l = factor.l_dirty();
    let log_determinant: f64 = 2.0 * (0..l.nrows()).map(|i| l[(i, i)].abs().max(1e-300).ln()).sum::<f64>();
    sum + log_determinant - right.dot(&factor.solve(&right))
}

/// The most likely sizes for some groups that share them.
pub(super) fn likeliest(
    groups: &[Group],
    start: Scatter,
    lengths_mm: [f64; 2],
    slopes: &DMatrix<f64>,
    off: &DVector<f64>,
    rest: (&DMatrix<f64>, &DVector<f64>),
) -> Scatter {
    let value = |scatter: &Scatter| -> f64 {
        let said = groups.iter().map(|group| group.says(&group.factor(scatter)?, slopes, off));
        said.collect::<Option<Vec<Said>>>().map_or(f64::INFINITY, |said| unlikely(&said, rest))
    };
    let mut best = (value(&start), start);
    for step in STEPS {
        // One number after the other, each from where the last has led.
        for number in 0..8 {
            let next = best.1.beside(number, step, lengths_mm);
            let found = if next == best.1 { f64::INFINITY } else { value(&next) };
            if found < best.0 {
                best = (found, next);
            }
        }
    }
    best.1
}
