//! From the platform's displacement to the wrench, by the constants.
//!
//! The constants give a 6x6 at several compressions: its columns for shift and turn are the tangent there, its column
//! for tz is a secant. `K(c) d` alone is right to first order beside the axis. But springs are conservative, and that
//! says more: with the energy U(c, q) = U0(c) + q' H(c) q / 2 of compression c and q = (tx, ty, rx, ry, rz), the axial
//! force has the part -q' H'(c) q / 2, and the moments about the fixed point follow from those that go with the
//! rotation vector, M = J^-T dU/dr + t x F with J its left Jacobian. H is read from the table's columns and its slope
//! from its neighbours, so the wrench is right to second order with no number that the constants do not have.

use glam::{DMat3, DVec3};
use nalgebra::{Matrix6, Vector6};

use super::error::TrackError;
use crate::constants::{SpringConstants, matrix_of};
use crate::mechanics::Displacement;
use crate::numeric::{Rigid, cross_matrix};

/// Entries that a table may have.
const MOST_ENTRIES: usize = 4096;

/// The springs' law as the constants tell it.
#[derive(Debug, Clone, PartialEq)]
pub struct Springs {
    at_mm: DVec3,
    stiffness: Matrix6<f64>,
    table: Vec<Entry>,
}

#[derive(Debug, Clone, PartialEq)]
struct Entry {
    compression_mm: f64,
    values: Values,
}

/// What is interpolated over the compression.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Values {
    /// Secant of the axial force, and the other five of its column.
    secant: [f64; 6],
    /// Forces by shift and turn: rows Fx, Fy, columns tx, ty, rx, ry, rz.
    force: [[f64; 5]; 2],
    /// dU/dr by shift and turn: rows rx, ry, rz.
    turn: [[f64; 5]; 3],
}

/// The columns of q in a 6x6.
const Q: [usize; 5] = [0, 1, 3, 4, 5];

impl Values {
    fn of(stiffness: &Matrix6<f64>, compression_mm: f64) -> Self {
        let force = [0, 1].map(|i: usize| Q.map(|j| stiffness[(i, j)]));
        let t = DVec3::new(0.0, 0.0, -compression_mm);
        let axial: DVec3 = DVec3::from_array([0, 1, 2].map(|i: usize| -compression_mm * stiffness[(i, 2)]));
        // Columns of dM/dq less those of t x F: e_j x F for a shift, t x dF/dq for all.
        let mut turn = [[0.0; 5]; 3];
        for (k, j) in Q.into_iter().enumerate() {
            let slope = DVec3::from_array([0, 1, 2].map(|i: usize| stiffness[(i, j)]));
            let mut moment = DVec3::from_array([3, 4, 5].map(|i: usize| stiffness[(i, j)])) - t.cross(slope);
            if j < 2 {
                moment -= [DVec3::X, DVec3::Y][j].cross(axial);
            }
            for (i, row) in turn.iter_mut().enumerate() {
                row[k] = moment[i];
            }
        }
        Self { secant: std::array::from_fn(|i| stiffness[(i, 2)]), force, turn }
    }

    fn map2(a: &Self, b: &Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            secant: std::array::from_fn(|i| f(a.secant[i], b.secant[i])),
            force: std::array::from_fn(|i| std::array::from_fn(|j| f(a.force[i][j], b.force[i][j]))),
            turn: std::array::from_fn(|i| std::array::from_fn(|j| f(a.turn[i][j], b.turn[i][j]))),
        }
    }

    /// q' H q.
    fn energy(&self, q: &[f64; 5]) -> f64 {
        let dot = |row: &[f64; 5]| row.iter().zip(q).map(|(a, b)| a * b).sum::<f64>();
        let forces: f64 = self.force.iter().zip([q[0], q[1]]).map(|(row, v)| dot(row) * v).sum();
        let turns: f64 = self.turn.iter().zip([q[2], q[3], q[4]]).map(|(row, v)| dot(row) * v).sum();
        forces + turns
    }
}

impl Springs {
    /// The law of a sensor's constants.
    ///
    /// # Errors
    /// [`TrackError`] for numbers that are not finite, or a table that does not rise.
    pub fn new(constants: &SpringConstants) -> Result<Self, TrackError> {
        let finite = |rows: &[[f64; 6]; 6]| rows.iter().flatten().all(|v| v.is_finite() && v.abs() < 1e12);
        if !constants.at_mm.iter().all(|v| v.is_finite() && v.abs() < 1e6) {
            return Err(TrackError::at("springs.at_mm", "is no point"));
        }
        if !finite(&constants.stiffness) {
            return Err(TrackError::at("springs.stiffness", "has numbers that are not finite"));
        }
        if constants.stiffness_at.len() > MOST_ENTRIES {
            return Err(TrackError::at(
                "springs.stiffness_at",
                format!("has more than {MOST_ENTRIES} entries"),
            ));
        }
        let mut table: Vec<Entry> = Vec::with_capacity(constants.stiffness_at.len());
        for (index, entry) in constants.stiffness_at.iter().enumerate() {
            let c = entry.compression_mm;
            let rises = table.last().is_none_or(|before| c > before.compression_mm + 1e-9);
            if !(c.is_finite() && c.abs() < 1e6 && rises && finite(&entry.stiffness)) {
                let field = format!("springs.stiffness_at[{index}]");
                return Err(TrackError::at(field, "is not finite, or its compression does not rise"));
            }
            table.push(Entry { compression_mm: c, values: Values::of(&matrix_of(&entry.stiffness), c) });
        }
        Ok(Self {
            at_mm: DVec3::from_array(constants.at_mm),
            stiffness: matrix_of(&constants.stiffness),
            table,
        })
    }

    /// The point that displacements and moments are stated about, rest frame, mm.
    pub fn at_mm(&self) -> DVec3 {
        self.at_mm
    }

    /// Values and their slope by the compression: the cubic through the neighbours' values and their central
    /// differences; straight on by one step beyond the ends.
    fn at(&self, compression_mm: f64) -> Option<(Values, Values)> {
        let table = self.table.as_slice();
        let last = table.len().checked_sub(1).filter(|last| *last > 0)?;
        let above = table.partition_point(|e| e.compression_mm <= compression_mm).clamp(1, last);
        let (low, high) = (&table[above - 1], &table[above]);
        let step = high.compression_mm - low.compression_mm;
        let chord = |i: usize| {
            let (a, b) = (&table[i], &table[i + 1]);
            let per = 1.0 / (b.compression_mm - a.compression_mm);
            Values::map2(&a.values, &b.values, |a, b| (b - a) * per)
        };
        // A parabola through three neighbours gives the slope in the middle one, and at the ends.
        let slope = |i: usize| {
            let mid = i.clamp(1, last - 1);
            let (h0, h1) = (
                table[mid].compression_mm - table[mid - 1].compression_mm,
                table[mid + 1].compression_mm - table[mid].compression_mm,
            );
            let from_mid = table[i].compression_mm - table[mid].compression_mm;
            Values::map2(&chord(mid - 1), &chord(mid), |d0, d1| {
                (d0 * h1 + d1 * h0) / (h0 + h1) + 2.0 * from_mid * (d1 - d0) / (h0 + h1)
            })
        };
        let (d0, d1) = if last >= 2 { (slope(above - 1), slope(above)) } else { (chord(0), chord(0)) };
        // Within half a step of the table's ends the cubic of the last piece goes on; farther it is held.
        let t = ((compression_mm - low.compression_mm) / step).clamp(-1.0, 2.0);
        let beyond = !(0.0..=1.0).contains(&t);
        let (h00, h10) = if beyond && t < 0.0 {
            (1.0, t)
        } else {
            ((1.0 + 2.0 * t) * (1.0 - t) * (1.0 - t), t * (1.0 - t) * (1.0 - t))
        };
        let (h00, h10, h01, h11) = if beyond && t < 0.0 {
            (h00, h10, 0.0, 0.0)
        } else if beyond {
            (0.0, 0.0, 1.0, t - 1.0)
        } else {
            (h00, h10, t * t * (3.0 - 2.0 * t), t * t * (t - 1.0))
        };
        let ends = Values::map2(&low.values, &high.values, |a, b| h00 * a + h01 * b);
        let ways = Values::map2(&d0, &d1, |a, b| (h10 * a + h11 * b) * step);
        let values = Values::map2(&ends, &ways, |a, b| a + b);
        let by = if beyond && t < 0.0 {
            d0
        } else if beyond {
            d1
        } else {
            let g = 6.0 * t * (1.0 - t) / step;
            let (g10, g11) = (1.0 - 4.0 * t + 3.0 * t * t, 3.0 * t * t - 2.0 * t);
            let chord = Values::map2(&low.values, &high.values, |a, b| g * (b - a));
            let ways = Values::map2(&d0, &d1, |a, b| g10 * a + g11 * b);
            Values::map2(&chord, &ways, |a, b| a + b)
        };
        Some((values, by))
    }

    /// The wrench that holds the platform at a displacement: N, N*mm, about [`Springs::at_mm`]. Without a table it is
    /// the constants' one 6x6 times the displacement, as in the paper.
    pub fn wrench(&self, displacement: &Displacement) -> [f64; 6] {
        let d = displacement.to_array();
        let Some((values, slope)) = self.at(-d[2]) else {
            return (self.stiffness * Vector6::from(d)).into();
        };
        let q = [d[0], d[1], d[3], d[4], d[5]];
        let dot = |row: &[f64; 5]| row.iter().zip(&q).map(|(a, b)| a * b).sum::<f64>();
        let axial = DVec3::new(values.secant[0], values.secant[1], values.secant[2]) * d[2];
        let force = axial + DVec3::new(dot(&values.force[0]), dot(&values.force[1]), -0.5 * slope.energy(&q));
        let own = DVec3::new(values.secant[3], values.secant[4], values.secant[5]) * d[2];
        let by_turn = DVec3::new(dot(&values.turn[0]), dot(&values.turn[1]), dot(&values.turn[2]));
        let moment =
            own + with_turn(displacement.rotation_rad) * by_turn + displacement.translation_mm.cross(force);
        [force.x, force.y, force.z, moment.x, moment.y, moment.z]
    }

    /// Derivative of the wrench by the displacement, by central differences of a smooth function.
    pub fn tangent(&self, displacement: &Displacement) -> Matrix6<f64> {
        let mut tangent = Matrix6::zeros();
        for j in 0..6 {
            // A thousandth of a millimetre or radian: far above rounding, far below the law's own scale.
            const STEP: f64 = 1e-3;
            let side = |sign: f64| {
                let mut d = displacement.to_array();
                d[j] += sign * STEP;
                Vector6::from(self.wrench(&Displacement::from_array(d)))
            };
            tangent.set_column(j, &((side(1.0) - side(-1.0)) / (2.0 * STEP)));
        }
        tangent
    }

    /// [`Springs::wrench`] of a pose (`rest_from_platform`).
    pub fn wrench_of_pose(&self, pose: &Rigid) -> [f64; 6] {
        self.wrench(&Displacement::of_pose(pose, self.at_mm))
    }
}

/// J^-T of a rotation vector, with J the left Jacobian: 1 + [r]/2 + e [r]^2.
fn with_turn(rotation_rad: DVec3) -> DMat3 {
    let square = rotation_rad.length_squared();
    let e = if square < 1e-4 {
        1.0 / 12.0 + square / 720.0
    } else {
        let half = 0.5 * square.sqrt();
        (1.0 - half / half.tan()) / square
    };
    let cross = cross_matrix(rotation_rad);
    DMat3::IDENTITY + cross * 0.5 + cross * cross * e
}
