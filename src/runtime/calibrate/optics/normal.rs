//! The normal equations, with the poses eliminated frame by frame.

use glam::{DVec2, DVec3};
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

use super::problem::{Problem, camera_numbers};
use super::types::Kind;
use crate::constants::CalibrationPriors;
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;

/// Huber's threshold in standard deviations.
const HUBER: f64 = 3.0;

/// Of one pose: the inverse of its block, its coupling to the numbers, its right side.
pub(super) type OwnBlock = (Matrix6<f64>, DMatrix<f64>, Vector6<f64>);

/// Normal equations with the poses eliminated, and what brings the poses back.
pub(super) struct Reduced {
    pub matrix: DMatrix<f64>,
    pub right: DVector<f64>,
    /// For each frame that is not at rest: inverse of the pose's own block, its coupling to the numbers, its right side.
    pub poses: Vec<Option<OwnBlock>>,
    pub cost: f64,
    pub squares: f64,
    pub count: usize,
    pub outliers: usize,
}

fn cost_of(left_sds: f64) -> (f64, f64) {
    // Huber: value and weight.
    if left_sds <= HUBER {
        (left_sds * left_sds, 1.0)
    } else {
        (2.0 * HUBER * left_sds - HUBER * HUBER, HUBER / left_sds)
    }
}

impl Problem<'_> {
    /// Residuals and, where asked for, the reduced normal equations; `None` where a mark is not seen.
    pub fn reduce(
        &self,
        x: &[f64],
        poses: &[Rigid],
        priors: &CalibrationPriors,
        solve: bool,
        damping: f64,
    ) -> Option<Reduced> {
        let n = self.numbers();
        let camera = camera_numbers(self.flat);
        let rest = SensorOptics::new(&self.spec(x)).ok()?;
        // Steps a hundredth of a tolerance wide: rounding and curvature are both far below.
        let steps: Vec<f64> = self.priors[..camera].iter().map(|sd| 0.01 * sd.max(1e-4)).collect();
        let mut shifted = Vec::new();
        if solve {
            for k in 0..camera {
                let with = |sign: f64| {
                    let mut y = x.to_vec();
                    y[k] += sign * steps[k];
                    SensorOptics::new(&self.spec(&y)).ok()
                };
                shifted.push([with(1.0)?, with(-1.0)?]);
            }
        }
        let mut out = Reduced {
            matrix: DMatrix::zeros(n, n),
            right: DVector::zeros(n),
            poses: Vec::new(),
            cost: 0.0,
            squares: 0.0,
            count: 0,
            outliers: 0,
        };
        for (k, (value, sd)) in x.iter().zip(&self.priors).enumerate() {
            let weight = sd.powi(-2);
            out.cost += value * value * weight;
            out.matrix[(k, k)] += weight;
            out.right[k] -= value * weight;
        }
        for (frame, seen) in self.seen.iter().enumerate() {
            let optics = rest.at_pose(&poses[frame]).ok()?;
            let mut placed = Vec::new();
            for [up, down] in &shifted {
                placed.push([up.at_pose(&poses[frame]).ok()?, down.at_pose(&poses[frame]).ok()?]);
            }
            let mut own = Matrix6::zeros();
            let mut own_right = Vector6::zeros();
            let mut coupling =
                if solve && frame >= self.at_rest { DMatrix::zeros(n, 6) } else { DMatrix::zeros(0, 6) };
            for mark in seen {
                let at = self.place(x, mark);
                let motion = optics.project_with_motion(at).ok()?;
                let offset = self.offset(x, mark, &optics, motion.pixel)?;
                let left = mark.observation.centroid_px - motion.pixel - offset;
                let sd = self.noise(priors, mark.observation.kind);
                let (cost, weight) = cost_of(left.length() / sd);
                out.cost += cost;
                out.squares += left.length_squared();
                out.count += 2;
                out.outliers += usize::from(weight < 1.0);
                if !solve {
                    continue;
                }
                let weight = weight / (sd * sd);
                // The numbers that this mark depends on, and how.
                let mut columns: Vec<(usize, DVec2)> = Vec::with_capacity(camera + 2);
                for (k, [up, down]) in placed.iter().enumerate() {
                    columns.push((k, (up.project(at).ok()? - down.project(at).ok()?) / (2.0 * steps[k])));
                }
                let by = |v: DVec3| {
                    let row = |i: usize| (0..3).map(|j| motion.by_point[(i, j)] * v[j]).sum::<f64>();
                    DVec2::new(row(0), row(1))
                };
                let (first, axes) = match mark.observation.kind {
                    Kind::White => (camera + 2 * mark.index, [DVec3::X, DVec3::Y]),
                    Kind::Black => {
                        let dot = &self.blacks[mark.index];
                        (self.black_number(mark.index), [dot.east, dot.north])
                    }
                };
                columns.push((first, by(axes[0])));
                columns.push((first + 1, by(axes[1])));
                for (k, a) in &columns {
                    out.right[*k] += weight * a.dot(left);
                    for (l, b) in &columns {
                        out.matrix[(*k, *l)] += weight * a.dot(*b);
                    }
                }
                if frame >= self.at_rest {
                    for i in 0..6 {
                        let a = DVec2::new(motion.by_pose[(0, i)], motion.by_pose[(1, i)]);
                        own_right[i] += weight * a.dot(left);
                        for j in 0..6 {
                            let b = DVec2::new(motion.by_pose[(0, j)], motion.by_pose[(1, j)]);
                            own[(i, j)] += weight * a.dot(b);
                        }
                        for (k, b) in &columns {
                            coupling[(*k, i)] += weight * b.dot(a);
                        }
                    }
                }
            }
            if solve {
                if frame < self.at_rest {
                    out.poses.push(None);
                } else {
                    for i in 0..6 {
                        own[(i, i)] *= 1.0 + damping;
                    }
                    let inverse = own.cholesky()?.inverse();
                    let across = &coupling * inverse;
                    out.matrix -= &across * coupling.transpose();
                    out.right -= &across * own_right;
                    out.poses.push(Some((inverse, coupling, own_right)));
                }
            }
        }
        Some(out)
    }
}
