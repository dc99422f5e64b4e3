//! What known loads, a few of them, say of the springs: the law of the springs' geometry, what it may be off by, and what each load
//! takes away of that.
//!
//! The stiffness is that of the law plus a 6x6 that starts at zero, with the covariance that the springs' tolerances give it. A
//! load of a known weight is six linear equations for its 36 numbers: `wrench - law(d) = dK d`, with the noise of the weight, of its
//! place and direction, and of the motion that the camera saw. Their update is Kalman's (Transactions of the ASME 82, 1960), in Joseph's
//! form, which keeps the covariance positive. From the first load on everything has a standard deviation; [`super::fit`], which
//! takes nothing from the geometry, needs several times more loads than there are numbers.
//!
//! All motions are from one rest, and what its picture is off by (a marker whose edge something bright touches is off by the same in each
//! of its frames) is in all of them alike: no number of loads takes that out of a mean. So it is six unknowns more, `d0`, which begin with
//! the covariance of the rest's pose: `wrench - law(d) = dK d - K d0`.

use nalgebra::{DMatrix, Matrix6, SMatrix, SVector, Vector6};

use super::types::{AxisFit, ForceError, ForceFit, ForceModel};
use crate::constants::{
    Constants, SpringConstants, SpringLaw, SpringTolerances, WRENCH_AXES, matrix_of, rows,
};
use domecast_springs::{Displacement, Suspension};

/// Entries of the 6x6, by rows.
const ENTRIES: usize = 36;
/// What springs may be off by where the constants do not say it: parts of their rate, all alike and each by itself.
const RATE_PART: f64 = 0.1;
/// What the law leaves out (places of the ends, how they are held), a part of the roots of two diagonal entries' product.
const LAW_PART: f64 = 0.02;
/// Step of the derivatives, in standard deviations.
const STEP_SDS: f64 = 0.1;
/// An axis is known once less than this part of the deviation that it started with is left.
const KNOWN_SHARE: f64 = 0.9;

/// The entries, and what the rest is off by.
const UNKNOWNS: usize = ENTRIES + 6;

type Covariance36 = SMatrix<f64, ENTRIES, ENTRIES>;
type Covariance42 = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// A load that is known, and what it did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownLoad {
    /// (tx, ty, tz, rx, ry, rz) about `springs.at_mm`, mm and rad.
    pub displacement: [f64; 6],
    /// Covariance of its noise.
    pub displacement_covariance: Matrix6<f64>,
    /// (Fx .. Mz) about `springs.at_mm`, N and N mm.
    pub wrench: [f64; 6],
    /// Covariance of what is not known of it.
    pub wrench_covariance: Matrix6<f64>,
}

/// What is known of the springs so far.
#[derive(Debug, Clone)]
pub struct SpringKnowledge {
    law: Option<Suspension>,
    /// The 6x6 at rest of the constants, and of the law itself.
    nominal: Matrix6<f64>,
    of_law: Matrix6<f64>,
    /// The entries beyond the nominal ones, then what the rest is off by, mm and rad.
    unknowns: SVector<f64, UNKNOWNS>,
    covariance: Covariance42,
    prior_parts: [f64; 6],
    loads: usize,
}

/// The entries of a 6x6 by rows.
fn entries(matrix: &Matrix6<f64>) -> SVector<f64, ENTRIES> {
    SVector::from_fn(|k, _| matrix[(k / 6, k % 6)])
}

/// What multiplies the unknowns in the six equations of a load; `slope`: of the wrench by the displacement.
fn equations(displacement: &[f64; 6], slope: &Matrix6<f64>) -> SMatrix<f64, 6, UNKNOWNS> {
    SMatrix::from_fn(|row, k| match k {
        k if k >= ENTRIES => -slope[(row, k - ENTRIES)],
        k if k / 6 == row => displacement[k % 6],
        _ => 0.0,
    })
}

/// Knowledge of the entries alone.
fn widened(covariance: &Covariance36) -> Covariance42 {
    Covariance42::from_fn(|i, j| if i < ENTRIES && j < ENTRIES { covariance[(i, j)] } else { 0.0 })
}

/// A load beside what is known.
struct Innovation {
    /// Its wrench beyond what is known.
    left: Vector6<f64>,
    /// Covariance of that, and the load's own share.
    whole: Matrix6<f64>,
    noise: Matrix6<f64>,
    equations: SMatrix<f64, 6, UNKNOWNS>,
}

/// Covariance of the entries by the springs' tolerances.
fn prior(springs: &SpringConstants, tolerances: Option<SpringTolerances>) -> Option<Covariance36> {
    let nominal = matrix_of(&springs.stiffness);
    let mut covariance = Covariance36::from_fn(|i, j| {
        let size = nominal[(i / 6, i / 6)] * nominal[(i % 6, i % 6)];
        if i == j { LAW_PART * LAW_PART * size.abs() } else { 0.0 }
    });
    let mut add = |change: SVector<f64, ENTRIES>| covariance += change * change.transpose();
    let Some((law, t)) = springs.law.as_ref().zip(tolerances) else {
        add(entries(&nominal) * RATE_PART);
        return Some(covariance);
    };
    let stiffness =
        |law: &SpringLaw| law.suspension(springs.at_mm).ok()?.stiffness().ok().map(|k| entries(&k));
    let slope = |law: &SpringLaw, change: &dyn Fn(&mut SpringLaw)| {
        let mut changed = law.clone();
        change(&mut changed);
        Some((stiffness(&changed)? - stiffness(law)?) / STEP_SDS)
    };
    add(slope(law, &|law| law.wire_diameter_mm += STEP_SDS * t.wire_diameter_mm)?);
    add(slope(law, &|law| {
        law.shear_modulus_mpa *= 1.0 + STEP_SDS * t.modulus_part;
        law.elastic_modulus_mpa *= 1.0 + STEP_SDS * t.modulus_part;
    })?);
    // each spring by itself bears its share of the weight
    let share = 1.0 / law.upper_ends_mm.len().max(1) as f64;
    for end in &law.upper_ends_mm {
        let mut alone = law.clone();
        alone.upper_ends_mm = vec![*end];
        alone.weight_n = law.weight_n.map(|v| v * share);
        add(slope(&alone, &|law| law.outer_diameter_mm += STEP_SDS * t.outer_diameter_mm)?);
        add(slope(&alone, &|law| law.active_coils += STEP_SDS * t.active_coils)?);
    }
    Some(covariance)
}

impl SpringKnowledge {
    /// What the geometry says, before any load.
    ///
    /// # Errors
    /// Constants without springs, or whose springs make none; springs that were measured already.
    pub fn new(constants: &Constants) -> Result<Self, ForceError> {
        let suspect = |what: &str| ForceError::Suspect(what.into());
        let springs = constants.springs.as_ref().ok_or_else(|| suspect("the constants have no springs"))?;
        if springs.source != "nominal" {
            return Err(suspect("the springs of these constants are measured: begin with the nominal ones"));
        }
        let law = match &springs.law {
            Some(law) => Some(law.suspension(springs.at_mm).map_err(|e| ForceError::Suspect(e.to_string()))?),
            None => None,
        };
        let nominal = matrix_of(&springs.stiffness);
        let of_law = match &law {
            Some(law) => law.stiffness().map_err(|e| ForceError::Suspect(e.to_string()))?,
            None => nominal,
        };
        let tolerances = constants.tolerances.and_then(|t| t.springs);
        let covariance =
            prior(springs, tolerances).ok_or_else(|| suspect("the springs' law has no stiffness at rest"))?;
        let mut made = Self {
            law,
            nominal,
            of_law,
            unknowns: SVector::zeros(),
            covariance: widened(&covariance),
            prior_parts: [0.0; 6],
            loads: 0,
        };
        made.prior_parts = made.parts();
        if made.prior_parts.iter().any(|v| !v.is_finite()) {
            return Err(suspect("the springs' stiffness has no inverse"));
        }
        Ok(made)
    }

    /// Says how far the rest that all motions are from may be off; before the first load.
    pub fn open_rest(&mut self, covariance: &Matrix6<f64>) {
        self.covariance.fixed_view_mut::<6, 6>(ENTRIES, ENTRIES).copy_from(covariance);
    }

    /// The 6x6 at rest.
    pub fn stiffness(&self) -> Matrix6<f64> {
        self.nominal + Matrix6::from_fn(|i, j| self.unknowns[6 * i + j])
    }

    /// The law, where the constants have one.
    pub fn law(&self) -> Option<&Suspension> {
        self.law.as_ref()
    }

    /// The wrench of a displacement as far as it is known; `None` where the law has none for it.
    pub fn wrench(&self, displacement: &[f64; 6]) -> Option<[f64; 6]> {
        let d = Vector6::from(*displacement);
        let own = match &self.law {
            Some(law) => {
                let of_law = law.wrench_at(&Displacement::from_array(*displacement)).ok()?.to_vector();
                of_law + (self.stiffness() - self.of_law) * d
            }
            None => self.stiffness() * d,
        };
        own.iter().all(|v| v.is_finite()).then(|| own.into())
    }

    fn innovation(&self, load: &KnownLoad) -> Option<Innovation> {
        let slope = match &self.law {
            Some(law) => law.tangent_at(&Displacement::from_array(load.displacement)).ok()?,
            None => self.stiffness(),
        };
        let rest = self.unknowns.fixed_rows::<6>(ENTRIES);
        let own = Vector6::from(self.wrench(&load.displacement)?) - slope * rest;
        let noise = load.wrench_covariance + slope * load.displacement_covariance * slope.transpose();
        let equations = equations(&load.displacement, &slope);
        let whole = noise + equations * self.covariance * equations.transpose();
        Some(Innovation { left: Vector6::from(load.wrench) - own, whole, noise, equations })
    }

    /// How far a load is from what is known, as a sum of six squares of standard normal numbers; `None` where the springs cannot
    /// be where it has them.
    pub fn surprise(&self, load: &KnownLoad) -> Option<f64> {
        let Innovation { left, whole, .. } = self.innovation(load)?;
        Some(left.dot(&whole.cholesky()?.solve(&left)))
    }

    /// By how much a load like this would lower the logarithm of the covariance's determinant.
    pub fn gain(&self, load: &KnownLoad) -> Option<f64> {
        let Innovation { whole, noise, .. } = self.innovation(load)?;
        let log = |m: Matrix6<f64>| Some(m.cholesky()?.l().diagonal().map(f64::ln).sum() * 2.0);
        Some(log(whole)? - log(noise)?)
    }

    /// Takes a load in; whether it says anything.
    pub fn add(&mut self, load: &KnownLoad) -> bool {
        let Some(Innovation { left, whole, noise, equations }) = self.innovation(load) else { return false };
        let Some(inverse) = whole.cholesky().map(|c| c.inverse()) else { return false };
        let weight = self.covariance * equations.transpose() * inverse;
        self.unknowns += weight * left;
        let stays = Covariance42::identity() - weight * equations;
        let next = stays * self.covariance * stays.transpose() + weight * noise * weight.transpose();
        self.covariance = 0.5 * (next + next.transpose());
        self.loads += 1;
        true
    }

    /// Standard deviation of the reading of a load along one axis alone, a part of it: Fx to Mz.
    pub fn parts(&self) -> [f64; 6] {
        let Some(softness) = self.stiffness().try_inverse() else { return [f64::NAN; 6] };
        std::array::from_fn(|axis| {
            let d: [f64; 6] = std::array::from_fn(|j| softness[(j, axis)]);
            let h = equations(&d, &Matrix6::zeros());
            (h * self.covariance * h.transpose())[(axis, axis)].max(0.0).sqrt()
        })
    }

    /// [`SpringKnowledge::parts`] before any load.
    pub fn prior_parts(&self) -> [f64; 6] {
        self.prior_parts
    }

    /// Whether the loads say anything of each axis: less than nine tenths of what was open is left.
    pub fn is_known(&self) -> [bool; 6] {
        let now = self.parts();
        std::array::from_fn(|axis| now[axis] < KNOWN_SHARE * self.prior_parts[axis])
    }

    /// Standard deviation of each entry of the 6x6.
    pub fn stiffness_sd(&self) -> Matrix6<f64> {
        Matrix6::from_fn(|i, j| self.covariance[(6 * i + j, 6 * i + j)].max(0.0).sqrt())
    }

    /// The same as [`super::fit`] gives it: what constants take in and [`super::examine_fit`] looks at.
    pub fn to_fit(&self) -> ForceFit {
        let (stiffness, sd) = (self.stiffness(), self.stiffness_sd());
        let axis = |i: usize| AxisFit {
            axis: WRENCH_AXES[i],
            readings: self.loads,
            coefficients: (0..6).map(|j| stiffness[(i, j)]).collect(),
            half_widths: (0..6).map(|j| Some(1.96 * sd[(i, j)])).collect(),
            covariance: DMatrix::from_fn(6, 6, |a, b| self.covariance[(6 * i + a, 6 * i + b)]),
            sd: 0.0,
            outliers: Vec::new(),
            hysteresis: None,
            validation: Vec::new(),
        };
        let known = self.is_known();
        ForceFit {
            model: ForceModel::Linear,
            axes: (0..6).map(axis).collect(),
            stiffness: rows(&stiffness),
            by_compression: None,
            offset: None,
            refused: (0..6)
                .filter(|i| !known[*i])
                .map(|i| format!("{}: no load says more of it than the springs' tolerances", WRENCH_AXES[i]))
                .collect(),
            motion_sd: [0.0; 6],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Knowledge without a law: a diagonal stiffness, a tenth open.
    fn fresh() -> SpringKnowledge {
        let nominal = Matrix6::from_diagonal(&Vector6::from([6.0, 6.0, 8.0, 400.0, 400.0, 600.0]));
        let mut made = SpringKnowledge {
            law: None,
            nominal,
            of_law: nominal,
            unknowns: SVector::zeros(),
            covariance: widened(&Covariance36::from_fn(|i, j| {
                let size = nominal[(i / 6, i / 6)] * nominal[(i % 6, i % 6)];
                if i == j { 0.01 * size } else { 0.0 }
            })),
            prior_parts: [0.0; 6],
            loads: 0,
        };
        made.prior_parts = made.parts();
        made
    }

    fn load(truth: &Matrix6<f64>, displacement: [f64; 6]) -> KnownLoad {
        let wrench = (truth * Vector6::from(displacement)).into();
        let noise = Vector6::from([1e-3, 1e-3, 1e-3, 0.05, 0.05, 0.05]).map(|v: f64| v * v);
        let wrench_covariance = Matrix6::from_diagonal(&noise);
        KnownLoad { displacement, displacement_covariance: Matrix6::zeros(), wrench, wrench_covariance }
    }

    #[test]
    fn a_rest_that_is_off_is_found_and_is_no_stiffness() {
        let truth = fresh().nominal * 1.05;
        let off = [0.01, -0.02, 0.015, 1e-3, -5e-4, 2e-4];
        let errors = [0.0, 1e-2].map(|open| {
            let mut springs = fresh();
            springs.open_rest(&Matrix6::from_diagonal(
                &Vector6::from([1.0, 1.0, 1.0, 0.1, 0.1, 0.1]).map(|v: f64| (v * open).powi(2)),
            ));
            for way in 0..12 {
                let mut d = [0.0; 6];
                d[way % 6] = if way % 6 < 3 { 0.2 } else { 0.03 } * if way < 6 { 1.0 } else { -1.0 };
                let mut seen = load(&truth, d);
                seen.displacement = std::array::from_fn(|i| d[i] + off[i]);
                assert!(springs.add(&seen));
            }
            (0..6).map(|i| (springs.stiffness()[(i, i)] / truth[(i, i)] - 1.0).abs()).fold(0.0, f64::max)
        });
        assert!(errors[1] < 0.01 && errors[0] > 2.0 * errors[1], "{errors:?}");
    }

    #[test]
    fn exact_loads_bring_the_truth_and_each_axis_when_it_is_loaded() {
        let mut springs = fresh();
        let truth = springs.nominal * 1.15;
        let log_det = |s: &SpringKnowledge| -> f64 {
            let entries = s.covariance.fixed_view::<ENTRIES, ENTRIES>(0, 0).into_owned();
            entries.cholesky().unwrap().l().diagonal().map(f64::ln).sum() * 2.0
        };
        for axis in 0..6 {
            assert!(!springs.is_known()[axis], "{axis}");
            let mut d = [0.0; 6];
            d[axis] = if axis < 3 { 0.2 } else { 0.03 };
            let one = load(&truth, d);
            let (gain, before) = (springs.gain(&one).unwrap(), log_det(&springs));
            assert!(springs.surprise(&one).unwrap() < 22.5);
            assert!(springs.add(&one));
            assert!((before - log_det(&springs) - gain).abs() < 1e-6 * gain, "{axis}");
            assert!(springs.is_known()[axis] && springs.parts()[axis] < 0.01);
        }
        assert!(
            (springs.stiffness() - truth)
                .iter()
                .zip(truth.iter())
                .all(|(d, k)| d.abs() < 0.01 * k.abs() + 0.3)
        );
        assert!(springs.surprise(&load(&(truth * 1.5), [0.2, 0.0, 0.0, 0.0, 0.0, 0.0])).unwrap() > 1000.0);
    }
}
