//! One compression spring: what its shape and wire say of stiffness, solid height and stress.

use std::f64::consts::PI;

use super::column::Column;
use super::spec::{SpecError, SpringSpec};

/// A checked spring with the figures that follow from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    spec: SpringSpec,
}

impl Spring {
    /// Checks the numbers.
    ///
    /// # Errors
    /// [`SpecError`] for a value that is not finite or not positive, a coil not wider than twice its wire,
    /// or a free length not above the solid height.
    pub fn new(spec: SpringSpec) -> Result<Self, SpecError> {
        let positive = [
            ("wire_diameter_mm", spec.wire_diameter_mm),
            ("outer_diameter_mm", spec.outer_diameter_mm),
            ("free_length_mm", spec.free_length_mm),
            ("active_coils", spec.active_coils),
            ("shear_modulus_mpa", spec.shear_modulus_mpa),
            ("elastic_modulus_mpa", spec.elastic_modulus_mpa),
            ("allowable_shear_mpa", spec.allowable_shear_mpa),
        ];
        for (field, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(SpecError { field, value, allowed: "a finite number above 0".into() });
            }
        }
        let spring = Self { spec };
        if spec.outer_diameter_mm <= 2.0 * spec.wire_diameter_mm {
            return Err(SpecError {
                field: "outer_diameter_mm",
                value: spec.outer_diameter_mm,
                allowed: format!("more than twice the wire, {} mm", 2.0 * spec.wire_diameter_mm),
            });
        }
        if spec.free_length_mm <= spring.solid_height_mm() {
            return Err(SpecError {
                field: "free_length_mm",
                value: spec.free_length_mm,
                allowed: format!("more than the solid height, {} mm", spring.solid_height_mm()),
            });
        }
        if !(spring.axial_n_per_mm().is_finite() && spring.axial_n_per_mm() > 0.0) {
            return Err(SpecError {
                field: "wire_diameter_mm",
                value: spec.wire_diameter_mm,
                allowed: "a wire whose stiffness is a finite number above 0".into(),
            });
        }
        Ok(spring)
    }

    /// What it was made from.
    pub fn spec(&self) -> &SpringSpec {
        &self.spec
    }

    /// Mean diameter of the coil D, mm: outer less one wire.
    pub fn mean_diameter_mm(&self) -> f64 {
        self.spec.outer_diameter_mm - self.spec.wire_diameter_mm
    }

    /// Spring index C = D / d.
    pub fn index(&self) -> f64 {
        self.mean_diameter_mm() / self.spec.wire_diameter_mm
    }

    /// Wahl's factor (4C - 1)/(4C - 4) + 0.615/C: curvature and direct shear at the inside of the coil
    /// (A. M. Wahl, *Mechanical Springs*, 1963).
    pub fn wahl_factor(&self) -> f64 {
        let c = self.index();
        (4.0 * c - 1.0) / (4.0 * c - 4.0) + 0.615 / c
    }

    /// All coils, the dead ones at the ends included.
    pub fn total_coils(&self) -> f64 {
        self.spec.active_coils + self.spec.ends.dead_coils()
    }

    /// Length with every coil on its neighbour, mm.
    pub fn solid_height_mm(&self) -> f64 {
        let unground = if self.spec.ends.is_ground() { 0.0 } else { 1.0 };
        (self.total_coils() + unground) * self.spec.wire_diameter_mm
    }

    /// Compression from the free length at which the coils bind, mm.
    pub fn solid_compression_mm(&self) -> f64 {
        self.spec.free_length_mm - self.solid_height_mm()
    }

    /// Axial stiffness k = G d^4 / (8 D^3 n), N/mm.
    pub fn axial_n_per_mm(&self) -> f64 {
        let (d, big) = (self.spec.wire_diameter_mm, self.mean_diameter_mm());
        self.spec.shear_modulus_mpa * d.powi(4) / (8.0 * big.powi(3) * self.spec.active_coils)
    }

    /// Stiffness against twist about the axis, E d^4 / (64 D n), N*mm/rad: the wire bends.
    pub fn torsion_nmm_per_rad(&self) -> f64 {
        let (d, big) = (self.spec.wire_diameter_mm, self.mean_diameter_mm());
        self.spec.elastic_modulus_mpa * d.powi(4) / (64.0 * big * self.spec.active_coils)
    }

    /// The spring as a column that shortens, shears and bends.
    pub fn column(&self) -> Column {
        Column::new(&self.spec, self.mean_diameter_mm(), self.axial_n_per_mm())
    }

    /// Sideways stiffness with both ends held parallel, N/mm, at a compression from the free length (mm).
    ///
    /// `None` where the spring is compressed to nothing or has buckled.
    pub fn lateral_n_per_mm(&self, compression_mm: f64) -> Option<f64> {
        self.column().stiffness(compression_mm).map(|k| k.shear.v)
    }

    /// Corrected shear stress in the wire, MPa, under an axial force (N), a moment that bends the spring's end
    /// and one that twists it about its axis (N*mm).
    ///
    /// The wire's torque is that of the axial force on the mean radius plus the end's moment at the worst
    /// azimuth; a twist of the spring bends the wire. Joined by the maximum-shear rule, with Wahl's factor on
    /// all: Wahl's own rule for a laterally loaded spring where there is no twist.
    pub fn shear_stress_mpa(&self, axial_n: f64, bending_nmm: f64, twist_nmm: f64) -> f64 {
        let torque = axial_n.abs() * 0.5 * self.mean_diameter_mm() + bending_nmm.abs();
        self.wahl_factor() * 16.0 / (PI * self.spec.wire_diameter_mm.powi(3)) * torque.hypot(twist_nmm)
    }

    /// Free length over mean diameter; below about 2.6 a spring with parallel ends cannot buckle.
    pub fn slenderness(&self) -> f64 {
        self.spec.free_length_mm / self.mean_diameter_mm()
    }
}
