//! Haringx' column: a compressed spring's stiffness against sideways shift and tilt of its end.
//!
//! J. A. Haringx, *On highly compressible helical springs and rubber rods, and their application for
//! vibration-free mountings*, Philips Research Reports 3 (1948). The spring of length L, compressed by P, is
//! a column with bending rigidity B and shear rigidity S whose sections tilt by psi and whose axis runs
//! sideways by y:
//!
//!   y' = psi + (H + P psi) / S,    B psi'' = -(1 + P/S) (H + P psi),
//!
//! H the sideways force. P acts normal to the tilted sections' common base, so it adds to the shear. Both
//! equations have constant coefficients; with q^2 = P (1 + P/S) / B the solution from a clamped lower end is
//! built of Stumpff's functions of (qL)^2, and has no singularity at P = 0, where it is Timoshenko's beam.
//!
//! The length that bends is taken as the spring's whole length, as in Haringx' charts. Closed ends make a
//! real spring some per cent stiffer sideways; a force calibration measures what this leaves out.

use super::dual::{Jet, Stumpff};
use super::spec::SpringSpec;

/// Where the column's shear force or moment grows without bound the model ends: (qL)^2 = pi^2 is the buckling
/// load of a column with clamped, parallel ends.
pub(super) const BUCKLING_ARGUMENT: f64 = std::f64::consts::PI * std::f64::consts::PI;

/// Beyond this the series would lose digits; far past buckling, and past any pull that a spring bears.
const LARGEST_ARGUMENT: f64 = 40.0;

/// A spring seen as a column; see the module's head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    free_length_mm: f64,
    axial_n_per_mm: f64,
    /// Bending rigidity per length at any length, B / L, N*mm.
    bending_per_length: f64,
    /// Shear rigidity per length at any length, S / L, N/mm.
    shear_per_length: f64,
}

/// End stiffness of a column, lower end clamped: sideways force H and moment M on the upper end from its
/// shift y and tilt psi in one plane, with derivatives by the compression.
#[derive(Debug, Clone, Copy)]
pub struct EndStiffness {
    /// dH/dy, N/mm.
    pub(super) shear: Jet,
    /// dH/dpsi = dM/dy, N/rad = N*mm/mm.
    pub(super) coupling: Jet,
    /// dM/dpsi, N*mm/rad.
    pub(super) tilt: Jet,
}

impl EndStiffness {
    /// dH/dy, dH/dpsi = dM/dy, dM/dpsi in N/mm, N, N*mm.
    pub fn values(&self) -> [f64; 3] {
        [self.shear.v, self.coupling.v, self.tilt.v]
    }
}

impl Column {
    pub(super) fn new(spec: &SpringSpec, mean_diameter_mm: f64, axial_n_per_mm: f64) -> Self {
        let (d, r, n) = (spec.wire_diameter_mm, 0.5 * mean_diameter_mm, spec.active_coils);
        let (e, g) = (spec.elastic_modulus_mpa, spec.shear_modulus_mpa);
        let wire_bending = e * std::f64::consts::PI * d.powi(4) / 64.0;
        let turns = n * std::f64::consts::PI;
        Self {
            free_length_mm: spec.free_length_mm,
            axial_n_per_mm,
            // A coil under a bending moment bends half of its wire and twists the other half.
            bending_per_length: wire_bending / (turns * r * (1.0 + e / (2.0 * g))),
            // A coil under a force in its own plane bends as a ring.
            shear_per_length: wire_bending / (turns * r.powi(3)),
        }
    }

    /// Length at a compression, mm.
    pub fn length_mm(&self, compression_mm: f64) -> f64 {
        self.free_length_mm - compression_mm
    }

    /// (qL)^2 at a compression over that of buckling between parallel ends: below 1 the column stands by itself.
    pub fn buckling_ratio(&self, compression_mm: f64) -> f64 {
        self.argument(Jet::variable(compression_mm)).v / BUCKLING_ARGUMENT
    }

    /// (qL)^2 = P (1 + P/S) L^2 / B.
    fn argument(&self, c: Jet) -> Jet {
        let length = Jet::constant(self.free_length_mm) - c;
        let push = c * self.axial_n_per_mm;
        // P/S = k c / (s L); P L^2 / B = k c L / b.
        let swell = Jet::constant(1.0) + push * (length * self.shear_per_length).recip();
        push * length * (1.0 / self.bending_per_length) * swell
    }

    /// The end stiffness at a compression (mm; negative when pulled); `None` outside of the model: no length
    /// left, or past the load at which even an end that is held in shift and tilt gives way.
    pub fn stiffness(&self, compression_mm: f64) -> Option<EndStiffness> {
        let c = Jet::variable(compression_mm);
        let length = Jet::constant(self.free_length_mm) - c;
        // A spring pressed to a hundredth of its length, or pulled to ten times, is not one any more.
        if !(length.v > 0.01 * self.free_length_mm && length.v < 10.0 * self.free_length_mm) {
            return None;
        }
        let z = self.argument(c);
        if z.v.is_nan() || z.v.abs() >= LARGEST_ARGUMENT {
            return None;
        }
        let one = Jet::constant(1.0);
        let shear = length * self.shear_per_length;
        let bend = length * self.bending_per_length;
        let s = one + c * self.axial_n_per_mm * shear.recip();
        let c = Stumpff::at(z.v);
        let f0 = z.stumpff(0, &c);
        let f1 = z.stumpff(1, &c) * length;
        let f2 = z.stumpff(2, &c) * length * length;
        let f3 = z.stumpff(3, &c) * length * length * length;
        let per_bend = bend.recip();
        // Y = alpha H + beta M0, Psi = -beta H + gamma M0 with M0 the moment at the lower end.
        let alpha = Jet::constant(1.0 / self.shear_per_length) - s * s * f3 * per_bend;
        let beta = s * f2 * per_bend;
        let gamma = f1 * per_bend;
        let det = alpha * gamma + beta * beta;
        if !(det.v > 0.0 && det.v.is_finite()) {
            return None;
        }
        let per_det = det.recip();
        Some(EndStiffness {
            shear: gamma * per_det,
            coupling: beta * per_det * -1.0,
            tilt: (f0 * alpha + s * f1 * beta) * per_det,
        })
    }

    /// The moments that bend the lower and the upper end (N*mm) from the upper end's shift and tilt in a plane.
    pub fn end_moments(&self, compression_mm: f64, shift_mm: f64, tilt_rad: f64) -> Option<[f64; 2]> {
        let k = self.stiffness(compression_mm)?;
        let upper = k.coupling.v * shift_mm + k.tilt.v * tilt_rad;
        let side = k.shear.v * shift_mm + k.coupling.v * tilt_rad;
        // The whole column in balance: M0 = M_L + H L + P y.
        let push = self.axial_n_per_mm * compression_mm;
        Some([upper + side * self.length_mm(compression_mm) + push * shift_mm, upper])
    }
}
