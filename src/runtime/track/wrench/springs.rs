//! From the platform's displacement to the wrench, by the constants.
//!
//! The constants give a 6x6 at several compressions: its columns for shift and turn are the tangent there, its column
//! for tz is a secant, so that `K(c) d` is right to first order beside the axis. Where they also say what the springs
//! are made of, the whole law stands behind them: wrench = law(d) + (K(c) - K_law(c)) d. Nominal constants leave nothing
//! of the second part; measured ones put their own first order in the law's place and keep what lies beyond.

use glam::DVec3;
use nalgebra::{Matrix6, Vector6};

use crate::constants::{SpringConstants, matrix_of};
use crate::track::error::TrackError;
use domecast_optics::numeric::Rigid;
use domecast_springs::{Displacement, Suspension, Wrench};

/// Entries that a table may have.
const MAX_ENTRIES: usize = 4096;
/// A table that differs from the law by no more than this part is the law's, rounded.
const MAX_ROUNDING: f64 = 1e-9;

/// How far a pose may be past coil bind, in parts of the springs' length; ten times as much past the magnets' grip, in
/// parts of it: noise and tolerances.
const MARGIN: f64 = 0.025;

/// Deviations of a pose that are left to it beyond that.
const DEVIATIONS: f64 = 3.0;

/// A 6x6 by compression (mm), which rises.
type Table = Vec<(f64, Matrix6<f64>)>;

/// The springs' law as the constants give it.
#[derive(Debug, Clone, PartialEq)]
pub struct Springs {
    at_mm: DVec3,
    law: Option<Suspension>,
    grip_force_n: Option<f64>,
    /// What is added to the law, or all where there is none; one entry at least unless the law says everything.
    table: Table,
}

/// Wrench and its derivative by the displacement.
type Linear = (Vector6<f64>, Matrix6<f64>);

fn largest(matrix: &Matrix6<f64>) -> f64 {
    matrix.iter().fold(0.0, |max, v| f64::max(max, v.abs()))
}

/// `K(c) d` and its derivative: linear between two entries, the nearest beyond them.
fn by_table(table: &Table, d: &Vector6<f64>) -> Linear {
    let compression_mm = -d[2];
    let above = table.partition_point(|entry| entry.0 <= compression_mm);
    match (above.checked_sub(1).and_then(|i| table.get(i)), table.get(above)) {
        (Some(low), Some(high)) => {
            let slope = (high.1 - low.1) / (high.0 - low.0);
            let stiffness = low.1 + slope * (compression_mm - low.0);
            let mut tangent = stiffness;
            tangent.set_column(2, &(stiffness.column(2) - slope * d));
            (stiffness * d, tangent)
        }
        (Some(end), None) | (None, Some(end)) => (end.1 * d, end.1),
        (None, None) => (Vector6::zeros(), Matrix6::zeros()),
    }
}

impl Springs {
    /// The law of a sensor's constants.
    ///
    /// # Errors
    /// [`TrackError`] for numbers that are not finite, a table that does not rise, or springs that cannot be.
    pub fn new(constants: &SpringConstants) -> Result<Self, TrackError> {
        let finite = |rows: &[[f64; 6]; 6]| rows.iter().flatten().all(|v| v.is_finite() && v.abs() < 1e12);
        if !constants.at_mm.iter().all(|v| v.is_finite() && v.abs() < 1e6) {
            return Err(TrackError::at("springs.at_mm", "is no point"));
        }
        if !finite(&constants.stiffness) {
            return Err(TrackError::at("springs.stiffness", "has numbers that are not finite"));
        }
        if constants.stiffness_at.len() > MAX_ENTRIES {
            let problem = format!("has more than {MAX_ENTRIES} entries");
            return Err(TrackError::at("springs.stiffness_at", problem));
        }
        let mut table: Table = Vec::with_capacity(constants.stiffness_at.len());
        for (index, entry) in constants.stiffness_at.iter().enumerate() {
            let c = entry.compression_mm;
            let rises = table.last().is_none_or(|before| c > before.0 + 1e-9);
            if !(c.is_finite() && c.abs() < 1e6 && rises && finite(&entry.stiffness)) {
                let field = format!("springs.stiffness_at[{index}]");
                return Err(TrackError::at(field, "is not finite, or its compression does not rise"));
            }
            table.push((c, matrix_of(&entry.stiffness)));
        }
        if table.is_empty() {
            table.push((0.0, matrix_of(&constants.stiffness)));
        }
        let mut law = None;
        if let Some(given) = &constants.law {
            let fault = |problem: String| TrackError::at("springs.law", problem);
            let suspension =
                given.suspension(constants.at_mm).map_err(|error| fault(format!("cannot be: {error}")))?;
            let mut same = true;
            for (compression_mm, stiffness) in &mut table {
                let own = suspension
                    .stiffness_at(*compression_mm)
                    .map_err(|error| fault(format!("ends before {compression_mm} mm: {error}")))?;
                let scale = largest(&own);
                *stiffness -= own;
                same &= largest(stiffness) <= MAX_ROUNDING * scale;
            }
            if same {
                table.clear();
            }
            law = Some(suspension);
        }
        let grip_force_n = constants.law.as_ref().and_then(|law| law.grip_force_n);
        if grip_force_n.is_some_and(|grip| !(grip.is_finite() && grip >= 0.0)) {
            return Err(TrackError::at("springs.law.grip_force_n", "is no force"));
        }
        Ok(Self { at_mm: DVec3::from_array(constants.at_mm), law, grip_force_n, table })
    }

    /// The point that displacements and moments are stated about, rest frame, mm.
    pub fn at_mm(&self) -> DVec3 {
        self.at_mm
    }

    /// The wrench that holds the platform at a displacement, N, N*mm, about [`Springs::at_mm`], and its derivative by
    /// the displacement; `None` for a pose that these springs cannot have.
    pub fn wrench(&self, displacement: &Displacement) -> Option<(Wrench, Matrix6<f64>)> {
        let (mut wrench, mut tangent) = by_table(&self.table, &Vector6::from(displacement.to_array()));
        if let Some(law) = &self.law {
            let (own, slope) = law.wrench_and_tangent_at(displacement).ok()?;
            wrench += own.to_vector();
            tangent += slope;
        }
        let finite = wrench.iter().chain(tangent.iter()).all(|v| v.is_finite());
        finite.then(|| (Wrench::from_array(wrench.into()), tangent))
    }

    /// Whether springs can stand like this at a pose (`rest_from_platform`): none is bound, none torn off its magnets,
    /// within a small margin and three times what the displacement's `covariance` (about [`Springs::at_mm`]) leaves open. True
    /// where the constants do not say what they are made of.
    pub fn can_stand(&self, pose: &Rigid, covariance: &Matrix6<f64>) -> bool {
        let Some(law) = &self.law else { return true };
        let spring = &law.spec().spring;
        let max_mm = spring.solid_compression_mm() + MARGIN * spring.spec().free_length_mm;
        let min_mm = match self.grip_force_n {
            Some(grip) => -(1.0 + 10.0 * MARGIN) * grip / spring.axial_n_per_mm(),
            None => f64::NEG_INFINITY,
        };
        law.spec().upper_ends_mm.iter().all(|end| {
            let compression_mm = law.rest_compression_mm() - (pose.point(*end) - *end).z;
            let arm = *end - self.at_mm;
            let by_motion = Vector6::new(0.0, 0.0, 1.0, arm.y, -arm.x, 0.0);
            let open_mm = DEVIATIONS * by_motion.dot(&(covariance * by_motion)).max(0.0).sqrt();
            (min_mm - open_mm..=max_mm + open_mm).contains(&compression_mm)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constants::{SpringLaw, SpringLawEnds, StiffnessAt, rows};

    fn law() -> SpringLaw {
        let around = |k: u32| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_3).sin_cos();
            [9.0 * cos, 9.0 * sin, -2.0]
        };
        SpringLaw {
            upper_ends_mm: (0..6).map(around).collect(),
            wire_diameter_mm: 0.3,
            outer_diameter_mm: 3.0,
            free_length_mm: 5.0,
            active_coils: 4.0,
            ends: SpringLawEnds::ClosedGround,
            shear_modulus_mpa: 79_000.0,
            elastic_modulus_mpa: 203_000.0,
            allowable_shear_mpa: 1_100.0,
            grip_force_n: Some(0.8),
            magnets: None,
            weight_n: [0.0; 3],
            center_of_mass_mm: [0.0; 3],
        }
    }

    fn constants(law: SpringLaw, factor: f64) -> SpringConstants {
        let suspension = law.suspension([0.0, 0.0, -4.5]).unwrap();
        let at = |c: f64| StiffnessAt {
            compression_mm: c,
            stiffness: rows(&(suspension.stiffness_at(c).unwrap() * factor)),
        };
        SpringConstants {
            stiffness: rows(&(suspension.stiffness().unwrap() * factor)),
            at_mm: [0.0, 0.0, -4.5],
            source: "nominal".into(),
            stiffness_at: (0..6).map(|i| at(0.5 * f64::from(i))).collect(),
            law: Some(law),
            offset: None,
            uncertainty: None,
            temperature: None,
            moving: None,
            plain_runtime: None,
        }
    }

    fn moved(d: [f64; 6]) -> Displacement {
        Displacement::from_array(d)
    }

    #[test]
    fn nominal_constants_give_the_law_and_measured_ones_their_first_order() {
        let d = moved([0.1, -0.2, -0.9, 0.03, -0.02, 0.05]);
        let suspension = law().suspension([0.0, 0.0, -4.5]).unwrap();
        let exact = suspension.wrench_at(&d).unwrap().to_array();
        let nominal = Springs::new(&constants(law(), 1.0)).unwrap();
        assert!(nominal.table.is_empty());
        assert_eq!(nominal.wrench(&d).unwrap().0.to_array(), exact);
        // Springs a tenth stiffer than their geometry says: ten per cent on the first order, the rest as before.
        let measured = Springs::new(&constants(law(), 1.1)).unwrap();
        for part in [1.0, 0.1] {
            let small = moved(d.to_array().map(|v| v * part));
            let (own, law) =
                (measured.wrench(&small).unwrap().0.to_array(), nominal.wrench(&small).unwrap().0.to_array());
            for (own, law) in own.iter().zip(law) {
                assert!((own - 1.1 * law).abs() < 0.02 * law.abs().max(0.05), "{own} {law}");
            }
        }
    }

    #[test]
    fn the_derivative_is_that_of_the_wrench() {
        for constants in [constants(law(), 1.0), constants(law(), 1.2), {
            let mut alone = constants(law(), 1.0);
            alone.law = None;
            alone
        }] {
            let springs = Springs::new(&constants).unwrap();
            let at = [0.1, -0.2, -0.9, 0.03, -0.02, 0.05];
            let (_, tangent) = springs.wrench(&moved(at)).unwrap();
            for j in 0..6 {
                let side = |sign: f64| {
                    let mut d = at;
                    d[j] += sign * 1e-5;
                    springs.wrench(&moved(d)).unwrap().0.to_vector()
                };
                let slope = (side(1.0) - side(-1.0)) / 2e-5;
                assert!((slope - tangent.column(j)).norm() < 1e-5 * tangent.norm(), "{j}");
            }
        }
    }

    #[test]
    fn springs_that_cannot_be_are_named() {
        let mut bad = constants(law(), 1.0);
        bad.law.as_mut().unwrap().wire_diameter_mm = -1.0;
        assert_eq!(Springs::new(&bad).unwrap_err().field, "springs.law");
        let mut bad = constants(law(), 1.0);
        bad.stiffness_at[2].compression_mm = 0.1;
        assert_eq!(Springs::new(&bad).unwrap_err().field, "springs.stiffness_at[2]");
        let springs = Springs::new(&constants(law(), 1.0)).unwrap();
        let stands = |z: f64, sd: f64| {
            let pose = moved([0.0, 0.0, z, 0.0, 0.0, 0.0]).to_pose(springs.at_mm());
            springs.can_stand(&pose, &(Matrix6::identity() * sd * sd))
        };
        assert!(stands(0.0, 0.0) && stands(-2.5, 0.0) && stands(0.6, 0.0));
        assert!(!stands(-4.0, 0.0) && !stands(1.5, 0.0));
        // what the pose leaves open is no fault of the springs
        assert!(stands(1.5, 0.3) && stands(-4.0, 0.3) && !stands(1.5, 0.01) && !stands(-4.0, 0.01));
        // Pressed through the floor.
        assert_eq!(springs.wrench(&moved([0.0, 0.0, -5.2, 0.0, 0.0, 0.0])), None);
    }
}
