//! The deformed body: what a frame leaves to the next one, and where its surface is.

use std::sync::Arc;

use glam::DVec3;

use super::element::{Material, quadratic};
use super::mesh::{Grading, Mesh};
use super::system::Body;
use super::touch::{Anchors, Spot, spots};
use crate::elastomer::Elastomer;
use crate::error::ContactError;

/// The deformed body, for the displacement of its surface and for the next frame.
#[derive(Debug, Clone)]
pub(crate) struct Deformed {
    pub body: Arc<Body>,
    pub spots: Arc<Vec<Spot>>,
    /// By node.
    pub displaced_mm: Vec<DVec3>,
    /// By spot.
    pub anchors: Anchors,
}

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
        let displaced_mm = vec![DVec3::ZERO; body.mesh.nodes_mm.len()];
        let anchors = vec![None; spots.len()];
        Ok(Self { body: Arc::new(body), spots: Arc::new(spots), displaced_mm, anchors })
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
