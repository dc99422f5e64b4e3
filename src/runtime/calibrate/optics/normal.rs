//! The normal equations, with the poses eliminated frame by frame.

use glam::{DVec2, DVec3};
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

use super::problem::{Problem, Seen};
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

/// The reduced equations of the priors alone.
fn priors_only(problem: &Problem<'_>, x: &[f64]) -> Reduced {
    let n = problem.numbers();
    let mut out = Reduced {
        matrix: DMatrix::zeros(n, n),
        right: DVector::zeros(n),
        poses: Vec::new(),
        cost: 0.0,
        squares: 0.0,
        count: 0,
        outliers: 0,
    };
    for (k, (value, sd)) in x.iter().zip(&problem.priors).enumerate() {
        let weight = sd.powi(-2);
        out.cost += value * value * weight;
        out.matrix[(k, k)] += weight;
        out.right[k] -= value * weight;
    }
    out
}

/// The camera's and the layers' numbers a step up and a step down each, with the step.
struct Shifted {
    optics: Vec<[SensorOptics; 2]>,
    steps: Vec<f64>,
}

impl Shifted {
    fn new(problem: &Problem<'_>, x: &[f64]) -> Option<Self> {
        let camera = problem.camera_numbers();
        // Steps a hundredth of a tolerance wide: rounding and curvature are both far below.
        let steps: Vec<f64> = problem.priors[..camera].iter().map(|sd| 0.01 * sd.max(1e-4)).collect();
        let mut optics = Vec::with_capacity(camera);
        for k in 0..camera {
            let with = |sign: f64| {
                let mut y = x.to_vec();
                y[k] += sign * steps[k];
                SensorOptics::new(&problem.spec(&y)).ok()
            };
            optics.push([with(1.0)?, with(-1.0)?]);
        }
        Some(Self { optics, steps })
    }

    fn at_pose(&self, pose: &Rigid) -> Option<Vec<[SensorOptics; 2]>> {
        self.optics
            .iter()
            .map(|[up, down]| Some([up.at_pose(pose).ok()?, down.at_pose(pose).ok()?]))
            .collect()
    }
}

/// A mark's residual with its weight, and its derivatives.
struct MarkTerms {
    left: DVec2,
    weight: f64,
    /// The numbers that this mark depends on, and how.
    columns: Vec<(usize, DVec2)>,
    by_pose: [DVec2; 6],
}

/// The equations of one frame's pose.
struct PoseBlock {
    own: Matrix6<f64>,
    right: Vector6<f64>,
    coupling: DMatrix<f64>,
}

impl PoseBlock {
    fn new(numbers: usize) -> Self {
        Self { own: Matrix6::zeros(), right: Vector6::zeros(), coupling: DMatrix::zeros(numbers, 6) }
    }

    fn add(&mut self, mark: &MarkTerms) {
        for (i, a) in mark.by_pose.iter().enumerate() {
            self.right[i] += mark.weight * a.dot(mark.left);
            for (j, b) in mark.by_pose.iter().enumerate() {
                self.own[(i, j)] += mark.weight * a.dot(*b);
            }
            for (k, b) in &mark.columns {
                self.coupling[(*k, i)] += mark.weight * b.dot(*a);
            }
        }
    }

    /// Schur's complement: takes the pose out of the equations of the numbers.
    fn eliminate(mut self, damping: f64, out: &mut Reduced) -> Option<OwnBlock> {
        for i in 0..6 {
            self.own[(i, i)] *= 1.0 + damping;
        }
        let inverse = self.own.cholesky()?.inverse();
        let across = &self.coupling * inverse;
        out.matrix -= &across * self.coupling.transpose();
        out.right -= &across * self.right;
        Some((inverse, self.coupling, self.right))
    }
}

impl Reduced {
    fn add(&mut self, mark: &MarkTerms) {
        for (k, a) in &mark.columns {
            self.right[*k] += mark.weight * a.dot(mark.left);
            for (l, b) in &mark.columns {
                self.matrix[(*k, *l)] += mark.weight * a.dot(*b);
            }
        }
    }
}

impl Problem<'_> {
    /// Residuals and the reduced normal equations; `None` where a mark is not seen.
    pub fn reduce(
        &self,
        x: &[f64],
        poses: &[Rigid],
        priors: &CalibrationPriors,
        damping: f64,
    ) -> Option<Reduced> {
        let rest = SensorOptics::new(&self.spec(x)).ok()?;
        let shifted = Shifted::new(self, x)?;
        let mut out = priors_only(self, x);
        for (frame, (seen, pose)) in self.seen.iter().zip(poses).enumerate() {
            let optics = rest.at_pose(pose).ok()?;
            let placed = shifted.at_pose(pose)?;
            let mut block = (frame >= self.at_rest).then(|| PoseBlock::new(self.numbers()));
            for mark in seen {
                let sd = self.noise(priors, mark.observation.kind);
                let mut terms = self.mark_terms(x, mark, &optics, &placed, &shifted.steps)?;
                let (cost, weight) = cost_of(terms.left.length() / sd);
                out.cost += cost;
                out.squares += terms.left.length_squared();
                out.count += 2;
                out.outliers += usize::from(weight < 1.0);
                terms.weight = weight / (sd * sd);
                out.add(&terms);
                if let Some(block) = &mut block {
                    block.add(&terms);
                }
            }
            let own = match block {
                Some(block) => Some(block.eliminate(damping, &mut out)?),
                None => None,
            };
            out.poses.push(own);
        }
        Some(out)
    }

    /// A mark's residual and derivatives, of weight one.
    fn mark_terms(
        &self,
        x: &[f64],
        mark: &Seen<'_>,
        optics: &SensorOptics,
        placed: &[[SensorOptics; 2]],
        steps: &[f64],
    ) -> Option<MarkTerms> {
        let at = self.place(x, mark);
        let motion = optics.project_with_motion(at).ok()?;
        let offset = self.offset(x, mark, optics, motion.pixel)?;
        let left = mark.observation.centroid_px - motion.pixel - offset;
        let mut columns: Vec<(usize, DVec2)> = Vec::with_capacity(placed.len() + 2);
        for (k, [up, down]) in placed.iter().enumerate() {
            columns.push((k, (up.project(at).ok()? - down.project(at).ok()?) / (2.0 * steps[k])));
        }
        let by = |v: DVec3| {
            let row = |i: usize| (0..3).map(|j| motion.by_point[(i, j)] * v[j]).sum::<f64>();
            DVec2::new(row(0), row(1))
        };
        let (first, axes) = match mark.observation.kind {
            Kind::White => (self.camera_numbers() + 2 * mark.index, [DVec3::X, DVec3::Y]),
            Kind::Black => {
                let dot = &self.black_dots[mark.index];
                (self.black_number(mark.index), [dot.east, dot.north])
            }
        };
        columns.push((first, by(axes[0])));
        columns.push((first + 1, by(axes[1])));
        let by_pose = std::array::from_fn(|i| DVec2::new(motion.by_pose[(0, i)], motion.by_pose[(1, i)]));
        Some(MarkTerms { left, weight: 1.0, columns, by_pose })
    }
}
