//! What the geometric level and the closed form both begin with.

use glam::DVec3;

use crate::elastomer::{Elastomer, Indenter};
use crate::error::ContactError;
use crate::half_space::held;
use crate::level::DEEPEST;
use crate::object::Placed;
use domecast_optics::numeric::Rigid;

/// An object before the dome, and how the two bodies share what it is pressed in.
pub(super) struct Approach<'a> {
    elastomer: &'a Elastomer,
    pub placed: Placed,
    /// Radius of the dome, mm.
    pub radius_mm: f64,
    /// The approach of both bodies over the dome's own.
    pub sharing: f64,
    /// Plane-strain modulus of both bodies together, MPa.
    pub modulus_mpa: f64,
}

impl<'a> Approach<'a> {
    /// The object of an indenter at a pose.
    pub fn new(elastomer: &'a Elastomer, indenter: &Indenter, sensor_from_object: &Rigid) -> Self {
        let sharing = 1.0 + indenter.yield_ratio(elastomer);
        Self {
            elastomer,
            placed: Placed::new(indenter.solid.clone(), *sensor_from_object),
            radius_mm: elastomer.dome_radius_mm,
            sharing,
            modulus_mpa: elastomer.plane_strain_mpa() / sharing,
        }
    }

    /// Refuses a depth that small strains do not cover, or that has no way out (`is_covered` is false).
    pub fn check_depth(&self, depth_mm: f64, is_covered: bool) -> Result<(), ContactError> {
        let limit_mm = DEEPEST * self.radius_mm;
        if depth_mm > limit_mm || !is_covered {
            return Err(ContactError::TooDeep { depth_mm, limit_mm });
        }
        Ok(())
    }

    /// What the bonded base holds back at a point of the dome, mm/N.
    pub fn held_mm_per_n(&self, at_mm: DVec3) -> f64 {
        let polar = (at_mm.z / self.radius_mm).clamp(-1.0, 1.0).acos();
        held(self.elastomer, polar) / (self.elastomer.plane_strain_mpa() * self.radius_mm)
    }
}
