//! What a contact solve answers.

use glam::DVec3;

use crate::field::Field;
use crate::outcome::{Extent, History, Status, TouchedNode};
use domecast_optics::numeric::{LengthMismatch, Rigid, batch};
use domecast_springs::Wrench;

/// A dome touched by an object.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactState {
    /// How the solve ended.
    pub status: Status,
    /// What the object puts on the dome, about the base's centre, sensor frame.
    pub wrench: Wrench,
    /// The nodes that bear it.
    pub nodes: Vec<TouchedNode>,
    /// Radius of a disc of the touched area, mm, measured by moments of the pressure (or push-out) that make it exact
    /// for Hertz' half ellipsoid and smooth as nodes come and go.
    pub contact_radius_mm: f64,
    /// Largest pressure, MPa.
    pub peak_pressure_mpa: f64,
    /// How deep a node of the deformed dome still lies in the (deformed) object, mm; 0 if none does.
    pub penetration_mm: f64,
    /// What the last iteration changed, mm.
    pub residual_mm: f64,
    /// Iterations of the outer loop.
    pub iterations: u32,
    /// Counted work, multiplications.
    pub work: f64,
    pub(crate) field: Field,
    pub(crate) history: History,
}

impl ContactState {
    /// Nothing touches.
    pub(crate) fn free(sensor_from_object: &Rigid) -> Self {
        Self {
            status: Status::Free,
            wrench: Wrench::default(),
            nodes: Vec::new(),
            contact_radius_mm: 0.0,
            peak_pressure_mpa: 0.0,
            penetration_mm: 0.0,
            residual_mm: 0.0,
            iterations: 0,
            work: 0.0,
            field: Field::Still,
            history: History { sensor_from_object: Some(*sensor_from_object), ..Default::default() },
        }
    }

    /// Displacement of a point of the undeformed dome (sensor frame, mm); zero if the point is not finite.
    pub fn displacement_mm(&self, at_mm: DVec3) -> DVec3 {
        let u = if at_mm.is_finite() { self.field.at(at_mm) } else { DVec3::ZERO };
        if u.is_finite() { u } else { DVec3::ZERO }
    }

    /// The displacements of many points; each depends on its own point only.
    ///
    /// # Errors
    /// [`LengthMismatch`].
    pub fn displacements_mm(&self, at_mm: &[DVec3], out: &mut [DVec3]) -> Result<(), LengthMismatch> {
        self.field.prepare(at_mm.len());
        batch::fill(at_mm, out, |at| self.displacement_mm(*at))
    }

    /// Where the dome moves.
    pub fn extent(&self) -> Extent {
        self.field.extent()
    }

    /// Heights of the deformed membrane over the base's square [-R, R]^2, row by row from -y, `side` by `side`
    /// samples at the cells' middles, mm; 0 beside the dome.
    ///
    /// Each sample is the dome's point over it, moved: its height is that point's z after the motion.
    pub fn height_map_mm(&self, dome_radius_mm: f64, side: usize) -> Vec<f64> {
        let at = |i: usize| ((2 * i + 1) as f64 / side as f64 - 1.0) * dome_radius_mm;
        let mut points = Vec::with_capacity(side * side);
        for row in 0..side {
            for column in 0..side {
                let (x, y) = (at(column), at(row));
                let z2 = dome_radius_mm * dome_radius_mm - x * x - y * y;
                points.push(if z2 > 0.0 { DVec3::new(x, y, z2.sqrt()) } else { DVec3::ZERO });
            }
        }
        self.field.prepare(points.len());
        points.iter().map(|p| if p.z > 0.0 { p.z + self.displacement_mm(*p).z } else { 0.0 }).collect()
    }
}
