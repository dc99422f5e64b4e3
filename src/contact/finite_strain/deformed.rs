//! The deformed body: what a frame leaves to the next one, and where its surface is.

use std::sync::Arc;

use glam::DVec3;

use super::element::{Material, quadratic};
use super::mesh::{Grading, Mesh};
use super::system::Body;
use super::touch::{Anchors, Spot, spots};
use crate::elastomer::Elastomer;
use crate::error::ContactError;
use domecast_optics::numeric::Rigid;

/// A step of a way that was solved: how far on it, the nodes' displacement there, and where the surface stuck.
#[derive(Debug, Clone)]
pub(crate) struct Step {
    pub part: f64,
    pub displaced_mm: Vec<DVec3>,
    pub anchors: Anchors,
}

/// The way that an object has come, and to where.
#[derive(Debug, Clone)]
pub(crate) struct Walked {
    pub sensor_from_object: Rigid,
    pub steps: Vec<Step>,
}

/// What was found at a place near by, from the same start.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tried<'a> {
    pub deformed: &'a Deformed,
    /// Whether the way to there may be taken for this one's, up to its last step.
    pub shares_way: bool,
}

/// The deformed body, for the displacement of its surface and for the next frame.
#[derive(Debug, Clone)]
pub(crate) struct Deformed {
    pub body: Arc<Body>,
    pub spots: Arc<Vec<Spot>>,
    /// By node.
    pub displaced_mm: Vec<DVec3>,
    /// By spot.
    pub anchors: Anchors,
    /// What the object moved beyond its share, mm: so far it is behind its own pose.
    pub beyond_mm: DVec3,
    /// The way that led here.
    pub walked: Option<Arc<Walked>>,
}

/// How far a mesh laid out for one touch may be from what another asks for, to serve it as well: its middle by a part of the patch, the
/// patch by a factor.
const SERVES: [f64; 2] = [0.1, 1.25];

impl PartialEq for Deformed {
    fn eq(&self, other: &Self) -> bool {
        self.body.mesh.grading == other.body.mesh.grading
            && self.displaced_mm == other.displaced_mm
            && self.anchors == other.anchors
    }
}

impl Deformed {
    /// At rest, meshed for an object that touches about a direction.
    pub fn new(elastomer: &Elastomer, grading: Grading) -> Result<Self, ContactError> {
        let bulk_mpa = elastomer.young_mpa / (3.0 * (1.0 - 2.0 * elastomer.poisson));
        let material = Material { shear_mpa: elastomer.shear_mpa(), bulk_mpa };
        let body = Body::new(Mesh::new(grading), material)?;
        let spots = spots(&body.mesh);
        Ok(Self::at_rest(&Arc::new(body), &Arc::new(spots)))
    }

    /// A meshed body at rest.
    fn at_rest(body: &Arc<Body>, spots: &Arc<Vec<Spot>>) -> Self {
        let displaced_mm = vec![DVec3::ZERO; body.mesh.nodes_mm.len()];
        let anchors = vec![None; spots.len()];
        Self {
            body: Arc::clone(body),
            spots: Arc::clone(spots),
            displaced_mm,
            anchors,
            beyond_mm: DVec3::ZERO,
            walked: None,
        }
    }

    /// The same body at rest, where its mesh serves a touch that asks for another of its size: then what is found varies smoothly with the
    /// touch.
    pub fn rested(&self, wanted: &Grading) -> Option<Self> {
        let own = &self.body.mesh.grading;
        let patch = own.patch_rad / wanted.patch_rad;
        let serves = own.radius_mm == wanted.radius_mm
            && own.across == wanted.across
            && own.middle.distance(wanted.middle) < SERVES[0] * own.patch_rad
            && (1.0 / SERVES[1]..SERVES[1]).contains(&patch);
        serves.then(|| Self::at_rest(&self.body, &self.spots))
    }

    /// Displacement of a point of the undeformed surface, mm.
    pub fn at(&self, at_mm: DVec3) -> DVec3 {
        let Some(direction) = at_mm.try_normalize() else { return DVec3::ZERO };
        let mesh = &self.body.mesh;
        let (face, [xi, eta]) = mesh.locate(direction);
        let ((a, _), (b, _)) = (quadratic(xi), quadratic(eta));
        let nodes = mesh.faces[face].iter().enumerate();
        nodes.map(|(k, node)| self.displaced_mm[*node as usize] * (a[k % 3] * b[k / 3])).sum()
    }

    /// The most that any node moves, mm.
    pub fn largest_mm(&self) -> f64 {
        self.displaced_mm.iter().map(|u| u.length()).fold(0.0, f64::max)
    }
}
