//! The law's inverse: the pose at which the springs balance a load.

use domecast_optics::numeric::symmetric_eigen;
use nalgebra::{DMatrix, Matrix6, Vector6};

use super::dual::jacobian;
use super::load::Wrench;
use super::state::{Displacement, Equilibrium, MechanicsError};
use super::suspension::Suspension;

const MAX_NEWTON_STEPS: u32 = 40;
/// The load is applied in halves, quarters, .. down to this part when Newton fails from further away.
const SMALLEST_LOAD_STEP: f64 = 1.0 / 1024.0;

impl Suspension {
    /// The pose at which the springs balance a wrench (about [`Suspension::at_mm`]).
    ///
    /// Newton's method on the exact tangent, the load put on at once where that converges and in smaller steps
    /// where not; every step keeps each spring inside its model. Bounded by 40 Newton steps a load step and 1024
    /// load steps.
    ///
    /// # Errors
    /// [`MechanicsError::NotFinite`], or [`MechanicsError::NotCarried`] with the part of the load that was carried.
    pub fn equilibrium(&self, wrench: &Wrench) -> Result<Equilibrium, MechanicsError> {
        if !wrench.is_finite() {
            return Err(MechanicsError::NotFinite);
        }
        let (mut carried, mut step) = (0.0, 1.0);
        let (mut x, mut iterations, mut residual_n) = (Vector6::zeros(), 0, 0.0);
        while carried < 1.0 {
            let part = f64::min(carried + step, 1.0);
            let (next, used, left, done) = self.newton(x, &wrench.scaled(part).to_vector());
            iterations += used;
            if done {
                (x, carried, residual_n) = (next, part, left);
                step *= 2.0;
            } else {
                step *= 0.5;
                if step < SMALLEST_LOAD_STEP {
                    return Err(MechanicsError::NotCarried { carried, residual_n: left });
                }
            }
        }
        let displacement = Displacement::from_array(x.into());
        Ok(Equilibrium {
            pose: displacement.to_pose(self.at_mm),
            displacement,
            residual_n,
            iterations,
            min_stiffness_n_per_mm: self.min_stiffness(&self.tangent_at(&displacement)?),
        })
    }

    fn newton(&self, start: Vector6<f64>, target: &Vector6<f64>) -> (Vector6<f64>, u32, f64, bool) {
        let reach = self.reach_mm();
        let size = |v: &Vector6<f64>| v.fixed_rows::<3>(0).norm().hypot(v.fixed_rows::<3>(3).norm() / reach);
        let residual = |x: &Vector6<f64>| -> Option<(Vector6<f64>, Matrix6<f64>)> {
            let (force, moment) = self.derive(&Displacement::from_array((*x).into())).ok()?;
            let load = Wrench { force_n: force.value(), moment_nmm: moment.value() };
            let balance = target + self.rest_load.to_vector() - load.to_vector();
            Some((balance, jacobian(force, moment)))
        };
        let (mut x, mut used) = (start, 0);
        let Some((mut balance, mut tangent)) = residual(&x) else {
            return (x, used, f64::INFINITY, false);
        };
        // Rounding of sums of this size; below it a step cannot improve.
        let floor =
            1e-13 * (size(target) + size(&self.rest_load.to_vector()) + self.spec.spring.axial_n_per_mm());
        while used < MAX_NEWTON_STEPS {
            let left = size(&balance);
            if left <= floor {
                return (x, used, left, true);
            }
            used += 1;
            let Some(full) = tangent.lu().solve(&balance) else { break };
            let mut factor = 1.0;
            let mut moved = false;
            while factor > 1e-3 {
                let next = x + full * factor;
                if let Some((b, t)) = residual(&next)
                    && size(&b) < left
                {
                    (x, balance, tangent, moved) = (next, b, t, true);
                    break;
                }
                factor *= 0.5;
            }
            if !moved {
                // Rounding keeps the balance from falling further: accept what is at its floor.
                return (x, used, left, left <= 100.0 * floor);
            }
        }
        let left = size(&balance);
        (x, used, left, left <= floor)
    }

    /// Least eigenvalue of the symmetric tangent stiffness at a pose; see [`Equilibrium`].
    ///
    /// # Errors
    /// As [`Suspension::wrench_at`].
    pub fn min_stiffness_at(&self, displacement: &Displacement) -> Result<f64, MechanicsError> {
        Ok(self.min_stiffness(&self.tangent_at(displacement)?))
    }

    fn min_stiffness(&self, tangent: &Matrix6<f64>) -> f64 {
        let reach = self.reach_mm();
        let scale = |i: usize| if i < 3 { 1.0 } else { 1.0 / reach };
        let symmetric =
            DMatrix::from_fn(6, 6, |i, j| 0.5 * (tangent[(i, j)] + tangent[(j, i)]) * scale(i) * scale(j));
        symmetric_eigen(symmetric).map_or(f64::NEG_INFINITY, |eigen| eigen.eigenvalues.min())
    }
}
