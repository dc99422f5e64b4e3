//! Parts of what a solve answers: how it ended, the nodes that bear a force, where the dome moves, and what the next
//! frame must know.

use std::sync::Arc;

use glam::DVec3;

use crate::finite_strain::Deformed;
pub use domecast_elastic::Extent;
use domecast_optics::numeric::Rigid;
use domecast_springs::Wrench;

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Status {
    /// Nothing touches.
    Free,
    /// Solved to its tolerance.
    Solved,
    /// The bound on iterations was reached; the state is the last one, its residuals say how far it is off.
    BoundReached,
    /// The level's formulas do not cover this contact; the state is that of the geometric level.
    NotApplicable(&'static str),
}

/// How far a solved contact may be from that of a dome at large strain: the truth that it is compared with is
/// [`Level::FiniteStrain`](crate::Level::FiniteStrain). Not what the elastomer's own constants leave open.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Deviation {
    /// Of the dome's surface, the largest, mm.
    pub displacement_mm: f64,
    /// Of the contact's force, N.
    pub force_n: f64,
}

/// A node of the dome's surface that bears a force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchedNode {
    /// Its place on the undeformed dome, sensor frame, mm.
    pub at_mm: DVec3,
    /// The surface it stands for, mm2.
    pub area_mm2: f64,
    /// The force on the dome, sensor frame, N.
    pub force_n: DVec3,
    /// Its part along the contact normal, over the area, MPa.
    pub pressure_mpa: f64,
    /// Where the dome bears it, mm: the levels of finite elements know where the node is now, the others bear it at rest.
    pub place_mm: DVec3,
    /// Unit direction in which the pressure pushes the dome: the contact normal, inwards.
    pub inward: DVec3,
    /// Whether it sticks to the object.
    pub sticks: bool,
}

/// What the next state must know of this one for friction.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct History {
    /// Where the object was.
    pub sensor_from_object: Option<Rigid>,
    /// Friction force and moment about the normal of a level with one spring for the whole contact, N, N*mm.
    pub tangential_n: DVec3,
    pub torsion_nmm: f64,
    /// What the object had moved beyond its share of the dome's own displacement, mm.
    pub beyond_mm: DVec3,
    /// Unknowns of the last solve, by node of the level's grid: force in the node's frame, tangential displacement.
    pub nodes: Vec<NodeMemory>,
    /// The deformed body of the finite-strain level.
    pub body: Option<Arc<Deformed>>,
}

/// One node's part of [`History`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NodeMemory {
    pub node: u32,
    pub force_n: DVec3,
    pub displacement_mm: DVec3,
}

/// Forces of the nodes about the base's centre.
pub(crate) fn sum(nodes: &[TouchedNode]) -> Wrench {
    nodes.iter().fold(Wrench::default(), |sum, node| Wrench {
        force_n: sum.force_n + node.force_n,
        moment_nmm: sum.moment_nmm + node.at_mm.cross(node.force_n),
    })
}
