//! Weighted least squares: the correction to a nominal map that leaves the least residuals.

use std::f64::consts::FRAC_PI_2;

use glam::DVec2;
use nalgebra::{DMatrix, DVector};

use super::error::FitError;
use super::sample::{MeasuredIn, Sample};
use crate::transfer::{Correction, Nominal, Polar, UnitPlate};

/// Bound on the steps; the model is linear in all but the rotation, and three to five are taken.
const MAX_STEPS: u32 = 12;
/// Radii on the plate that differ by less, as a share of the dome's radius, cannot be distinguished: the two-fold terms alone
/// spread a ring by half of this.
const RING_GAP: f64 = 0.08;
/// Smallest slope by which a plate residual is projected to the dome: it bounds the weight of the rim.
pub(super) const MIN_SLOPE: f64 = 0.1;

/// How far past the outermost sample the map is extrapolated: half a mark and a little, rad.
pub(super) const BEYOND_RAD: f64 = 0.06;
/// Furthest that any measured map reaches, rad: at the rim itself a print cannot be measured from above.
pub(super) const MAX_POLAR_RAD: f64 = FRAC_PI_2 - 0.03;

/// Which numbers of the model are free.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FitModel {
    pub nominal: Nominal,
    pub radial: usize,
    pub two_fold: bool,
}

impl FitModel {
    pub fn parameters(self) -> usize {
        self.radial + if self.two_fold { 4 } else { 0 } + 3
    }
}

pub(super) struct FitProblem<'a> {
    pub radius_mm: f64,
    pub samples: &'a [Sample],
    pub polar: Vec<Polar>,
    pub measured_in: MeasuredIn,
}

impl FitProblem<'_> {
    /// Most radial terms that the marks can tell apart: one for each ring of the artwork.
    pub fn max_radial(&self) -> usize {
        let middle =
            self.samples.iter().map(|sample| sample.plate_mm).sum::<DVec2>() / self.samples.len() as f64;
        let mut radii: Vec<f64> =
            self.samples.iter().map(|sample| sample.plate_mm.distance(middle) / self.radius_mm).collect();
        radii.sort_by(f64::total_cmp);
        let mut last = 0.0;
        radii.retain(|radius| {
            let apart = *radius > last + RING_GAP;
            if apart {
                last = *radius;
            }
            apart
        });
        radii.len().max(1)
    }

    /// The correction that leaves the least weighted squares.
    pub fn solve(&self, model: FitModel, weights: &[f64]) -> Result<Correction, FitError> {
        let outermost = self.polar.iter().zip(weights).filter(|(_, w)| **w > 0.0).map(|(p, _)| p.polar_rad);
        let mut correction = Correction {
            radial: vec![0.0; model.radial],
            two_fold: [0.0; 2],
            two_fold_sideways: [0.0; 2],
            rotation_rad: 0.0,
            offset_mm: DVec2::ZERO,
            max_polar_rad: (outermost.fold(0.0, f64::max) + BEYOND_RAD).min(MAX_POLAR_RAD),
        };
        let count = model.parameters();
        for _ in 0..MAX_STEPS {
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
            let step = solve_scaled(matrix, right).ok_or(FitError::Degenerate)?;
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
            if step.amax() < 1e-11 {
                break;
            }
        }
        let finite = correction.offset_mm.is_finite() && correction.rotation_rad.is_finite();
        if finite { Ok(correction) } else { Err(FitError::Degenerate) }
    }

    /// Projects a small step on the plate to where the measurement was made: (towards the rim, around).
    fn to_measured(&self, at: &Polar, image: &UnitPlate) -> impl Fn(DVec2) -> DVec2 + use<> {
        let (polar, around) = (image.d_polar(at), image.d_around(at));
        let area = polar.perp_dot(around);
        let shortened = match self.measured_in {
            MeasuredIn::View => at.cos_polar.max(0.0),
            MeasuredIn::Dome => 1.0,
        };
        let area = if area.abs() < MIN_SLOPE { MIN_SLOPE } else { area };
        move |step: DVec2| DVec2::new(step.perp_dot(around) / area * shortened, polar.perp_dot(step) / area)
    }

    /// Residuals where they were measured, mm.
    pub fn residuals(&self, nominal: Nominal, correction: &Correction) -> impl Iterator<Item = DVec2> {
        self.samples.iter().zip(&self.polar).map(move |(sample, at)| {
            let image = correction.unit_plate(nominal, at);
            let miss = sample.plate_mm - correction.offset_mm - image.place(at) * self.radius_mm;
            self.to_measured(at, &image)(miss)
        })
    }
}

/// Least squares with columns of equal length; `None` if the columns do not stand apart.
fn solve_scaled(mut matrix: DMatrix<f64>, mut right: DVector<f64>) -> Option<DVector<f64>> {
    const RANK: f64 = 1e-10;
    let scale: Vec<f64> = matrix.column_iter().map(|column| column.norm()).collect();
    if scale.iter().any(|s| !(s.is_finite() && *s > 0.0)) || matrix.nrows() < matrix.ncols() {
        return None;
    }
    for (mut column, s) in matrix.column_iter_mut().zip(&scale) {
        column /= *s;
    }
    // The tall matrix becomes a small triangular one, whose singular values are its own.
    let count = matrix.ncols();
    let tall = matrix.qr();
    tall.q_tr_mul(&mut right);
    let decomposed = tall.unpack_r().try_svd(true, true, f64::EPSILON, 1000)?;
    let (low, high) = (decomposed.singular_values.min(), decomposed.singular_values.max());
    if low.is_nan() || low < RANK * high {
        return None;
    }
    let mut solution = decomposed.solve(&right.rows(0, count).into_owned(), 0.0).ok()?;
    for (value, s) in solution.iter_mut().zip(&scale) {
        *value /= s;
    }
    Some(solution)
}
