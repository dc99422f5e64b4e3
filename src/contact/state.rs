//! What a contact solve answers.

use glam::DVec3;

use crate::field::Field;
use crate::outcome::{Deviation, Extent, History, Status, TouchedNode};
use domecast_optics::DomeShape;
use domecast_optics::numeric::{LengthMismatch, Rigid, batch};
use domecast_springs::Wrench;

/// A dome touched by an object.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactState {
    /// How the solve ended.
    pub status: Status,
    /// What the object puts on the dome, about the base's centre, sensor frame; its forces act where the levels of finite
    /// elements have the dome now, the others where it is at rest.
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
    /// How far it may be from the truth.
    pub deviation: Deviation,
    /// Counted work, multiplications.
    pub work: f64,
    /// The nodes' forces as the dome bears them now, spread as the level's elements spread them; still where the level has
    /// no elements of its own.
    pub(crate) bearing: Field,
    /// The dome's own field under this contact's forces.
    pub(crate) field: Field,
    /// What moved the dome besides.
    pub(crate) beside: Field,
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
            deviation: Deviation::default(),
            work: 0.0,
            bearing: Field::Still,
            field: Field::Still,
            beside: Field::Still,
            history: History { sensor_from_object: Some(*sensor_from_object), ..Default::default() },
        }
    }

    /// The dome under several contacts, and what moved it besides: forces, wrench and field are sums, the status is the
    /// worst, and the radius that of a disc of the same area as all.
    pub(crate) fn of_all<'s>(states: impl Iterator<Item = &'s Self> + Clone, beside: &Field) -> Self {
        let mut all = Self::free(&Rigid::identity());
        all.history = History::default();
        let rank = |status: &Status| match status {
            Status::Free => 0,
            Status::Solved => 1,
            Status::NotApplicable(_) => 2,
            Status::BoundReached => 3,
        };
        let mut area = 0.0;
        for state in states.clone() {
            if rank(&state.status) > rank(&all.status) {
                all.status = state.status;
            }
            all.nodes.extend(&state.nodes);
            area += state.contact_radius_mm * state.contact_radius_mm;
            all.peak_pressure_mpa = all.peak_pressure_mpa.max(state.peak_pressure_mpa);
            all.penetration_mm = all.penetration_mm.max(state.penetration_mm);
            all.residual_mm = all.residual_mm.max(state.residual_mm);
            all.iterations = all.iterations.max(state.iterations);
            all.work += state.work;
            all.wrench = all.wrench + state.wrench;
        }
        all.contact_radius_mm = area.sqrt();
        all.bearing = Field::sum(&states.clone().map(|state| (1.0, &state.bearing)).collect::<Vec<_>>());
        let fields = std::iter::once(beside).chain(states.map(|state| &state.field));
        all.field = Field::sum(&fields.map(|field| (1.0, field)).collect::<Vec<_>>());
        all
    }

    /// Whether the dome is out of its shape.
    pub fn is_moved(&self) -> bool {
        self.field != Field::Still
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

    /// Heights of the deformed membrane over the base's square [-R, R]^2 about the rim, row by row from -y, `side` by
    /// `side` samples at the cells' middles, mm; 0 beside the dome.
    ///
    /// Each sample is the dome's point over it, moved: its height is that point's z after the motion.
    pub fn height_map_mm(&self, dome: &DomeShape, side: usize) -> Vec<f64> {
        let (radius_mm, rim_mm) = (dome.radius_mm(), dome.rim_radius_mm());
        let at = |i: usize| ((2 * i + 1) as f64 / side as f64 - 1.0) * rim_mm;
        let mut points = Vec::with_capacity(side * side);
        for row in 0..side {
            for column in 0..side {
                let (x, y) = (at(column), at(row));
                let flat2 = x * x + y * y;
                let z = dome.center_z_mm() + (radius_mm * radius_mm - flat2).max(0.0).sqrt();
                points.push(if flat2 < rim_mm * rim_mm { DVec3::new(x, y, z) } else { DVec3::ZERO });
            }
        }
        self.field.prepare(points.len());
        points.iter().map(|p| if p.z > 0.0 { p.z + self.displacement_mm(*p).z } else { 0.0 }).collect()
    }
}
