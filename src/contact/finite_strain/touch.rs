//! An object held off at the integration points of the dome's surface, with Coulomb friction by a return map.
//!
//! A point inside the object is pushed out by a stiff pressure, `penalty` times how deep it lies; sideways it hangs on a
//! spring from where it stuck to the object, which gives way at friction times pressure (P. Wriggers, Computational Contact
//! Mechanics, 2006, 5.2 and 10.5). Both are per undeformed area.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::element::{outer, quadratic};
use super::mesh::Mesh;
use crate::object::Placed;
use domecast_optics::numeric::Rigid;

/// Integration points of a face along each side (Gauss), with their weights.
const AT: [f64; 5] =
    [-0.906_179_845_938_664, -0.538_469_310_105_683, 0.0, 0.538_469_310_105_683, 0.906_179_845_938_664];
const WEIGHTS: [f64; 5] = [
    0.236_926_885_056_189_1,
    0.478_628_670_499_366_5,
    0.568_888_888_888_888_9,
    0.478_628_670_499_366_5,
    0.236_926_885_056_189_1,
];
/// Points of a face.
pub(crate) const POINTS: usize = AT.len() * AT.len();

/// A point of the surface that may touch.
#[derive(Debug, Clone)]
pub(crate) struct Spot {
    pub at_mm: DVec3,
    pub area_mm2: f64,
    shapes: [f64; 9],
}

/// Points of the whole surface, face by face.
pub(crate) fn spots(mesh: &Mesh) -> Vec<Spot> {
    let mut spots = Vec::with_capacity(mesh.faces.len() * POINTS);
    for face in &mesh.faces {
        for point in 0..POINTS {
            let (p, q) = (point % AT.len(), point / AT.len());
            let ((a, da), (b, db)) = (quadratic(AT[p]), quadratic(AT[q]));
            let (mut at_mm, mut first, mut second) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
            for (k, node) in face.iter().enumerate() {
                let place = mesh.nodes_mm[*node as usize];
                at_mm += place * (a[k % 3] * b[k / 3]);
                first += place * (da[k % 3] * b[k / 3]);
                second += place * (a[k % 3] * db[k / 3]);
            }
            spots.push(Spot {
                at_mm,
                area_mm2: WEIGHTS[p] * WEIGHTS[q] * first.cross(second).length(),
                shapes: std::array::from_fn(|k| a[k % 3] * b[k / 3]),
            });
        }
    }
    spots
}

/// The spring by which a point hangs sideways, as a part of the penalty.
const SIDEWAYS: f64 = 0.03;

/// What holds object and dome apart.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Law {
    /// Pressure by depth, MPa/mm; sideways the same.
    pub penalty: f64,
    pub friction: f64,
    /// Depth up to which the curvature of an object counts in the tangent, mm: what a pressure of twice Young's modulus brings.
    pub curved_mm: f64,
    /// How far the gap closes for a motion of the dome: 1 + what the object yields for it.
    pub sharing: f64,
}

/// One point's answer to where it is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bearing {
    /// Place of the deformed surface, mm.
    pub place_mm: DVec3,
    /// Signed distance of the object, mm.
    pub gap_mm: f64,
    pub normal: DVec3,
    /// Force on the dome, N.
    pub force_n: DVec3,
    pub sticks: bool,
    /// Derivative of the force taken from the dome by its motion: a symmetric part and the rest, N/mm.
    even: DMat3,
    odd: DMat3,
}

/// The whole surface's answer.
#[derive(Debug)]
pub(crate) struct Bearings {
    /// By spot; `None` where it is outside.
    pub of: Vec<Option<Bearing>>,
    /// Whether the tangent is symmetric.
    pub is_even: bool,
}

/// Where a point of the dome stuck to the object, object frame.
pub(crate) type Anchors = Vec<Option<DVec3>>;

impl Law {
    /// All points, for a displacement by node.
    pub fn bear(
        &self,
        mesh: &Mesh,
        spots: &[Spot],
        displaced_mm: &[DVec3],
        placed: &Placed,
        anchors: &Anchors,
    ) -> Bearings {
        let of: Vec<Option<Bearing>> = spots
            .par_iter()
            .enumerate()
            .map(|(number, spot)| {
                let face = &mesh.faces[number / POINTS];
                let u: DVec3 =
                    face.iter().zip(spot.shapes).map(|(n, shape)| displaced_mm[*n as usize] * shape).sum();
                self.at(spot, u, placed, anchors.get(number).copied().flatten())
            })
            .collect();
        let is_even = of.iter().flatten().all(|bearing| bearing.odd == DMat3::ZERO);
        Bearings { of, is_even }
    }

    fn at(&self, spot: &Spot, u: DVec3, placed: &Placed, anchor: Option<DVec3>) -> Option<Bearing> {
        let near = spot.at_mm + u * self.sharing;
        let (gap_mm, normal) = placed.distance(near);
        if gap_mm >= 0.0 {
            return None;
        }
        let weight = spot.area_mm2 * self.penalty;
        let s = self.sharing;
        let mut even = outer(normal, normal) * (weight * s);
        // At the start of a step points lie far deeper than any pressure brings them: that much curvature would turn the
        // tangent over.
        if gap_mm > -self.curved_mm {
            even += curvature(placed, near, normal) * (weight * s * gap_mm);
        }
        let mut odd = DMat3::ZERO;
        let mut force_n = normal * (-weight * gap_mm);
        let mut sticks = false;
        if let Some(anchor) = anchor.filter(|_| self.friction > 0.0) {
            let way = near - placed.sensor_from_object().point(anchor);
            let along = way - normal * way.dot(normal);
            let hang = weight * SIDEWAYS;
            let pull_n = along * hang;
            let limit_n = -self.friction * weight * gap_mm;
            let across = DMat3::IDENTITY - outer(normal, normal);
            sticks = pull_n.length() <= limit_n;
            if sticks {
                force_n -= pull_n;
                even += across * (hang * s);
            } else {
                let direction = along.normalize_or_zero();
                force_n -= direction * limit_n;
                even += (across - outer(direction, direction)) * (hang * s * limit_n / pull_n.length());
                // All of it: its symmetric half alone would not be positive.
                odd = outer(direction, normal) * (-self.friction * weight * s);
            }
        }
        Some(Bearing { place_mm: spot.at_mm + u, gap_mm, normal, force_n, sticks, even, odd })
    }

    /// Where the points stick after a step: those that slid are let go as far as friction does not hold them.
    pub fn anchored(
        &self,
        spots: &[Spot],
        bearings: &Bearings,
        placed: &Placed,
        anchors: &Anchors,
    ) -> Anchors {
        let object_from_sensor = placed.object_from_sensor();
        bearings
            .of
            .iter()
            .zip(spots)
            .enumerate()
            .map(|(number, (bearing, spot))| {
                let bearing = bearing.as_ref()?;
                let near = spot.at_mm + (bearing.place_mm - spot.at_mm) * self.sharing;
                match anchors.get(number).copied().flatten() {
                    Some(anchor) if bearing.sticks => Some(anchor),
                    Some(anchor) => {
                        let way = near - placed.sensor_from_object().point(anchor);
                        let along = (way - bearing.normal * way.dot(bearing.normal)).normalize_or_zero();
                        let held_mm = -self.friction * bearing.gap_mm / SIDEWAYS;
                        Some(object_from_sensor.point(near - along * held_mm))
                    }
                    None => Some(object_from_sensor.point(near)),
                }
            })
            .collect()
    }
}

/// Second derivative of the distance of an object with curved faces, by central differences of its normal.
fn curvature(placed: &Placed, at: DVec3, normal: DVec3) -> DMat3 {
    if let Some((center, _)) = placed.ball() {
        return (DMat3::IDENTITY - outer(normal, normal)) * (1.0 / at.distance(center).max(1e-9));
    }
    if placed.solid.is_mesh() {
        return DMat3::ZERO;
    }
    const STEP_MM: f64 = 1e-5;
    let (u, v) = normal.any_orthonormal_pair();
    let slope = |way: DVec3| {
        let ends = [at + way * STEP_MM, at - way * STEP_MM].map(|at| placed.distance(at).1);
        (ends[0] - ends[1]) / (2.0 * STEP_MM)
    };
    let sum = outer(slope(u), u) + outer(slope(v), v);
    let even = (sum + sum.transpose()) * 0.5;
    // Across an edge the normal jumps: no curvature that a step could follow.
    if even.to_cols_array().iter().all(|value| value.abs() < 0.01 / STEP_MM) { even } else { DMat3::ZERO }
}

/// The base's motion between two poses: translation straight, rotation about one axis.
pub(crate) fn between(from: &Rigid, to: &Rigid, part: f64) -> Rigid {
    let turn = to.compose(&from.inverse());
    let axis = domecast_optics::numeric::vector_from_rotation(&turn.rotation) * part;
    let mut pose = *from;
    pose.rotation = domecast_optics::numeric::rotation_from_vector(axis) * from.rotation;
    pose.translation_mm = from.translation_mm.lerp(to.translation_mm, part);
    pose
}

impl Bearings {
    /// Adds what the points take from the nodes to the inner forces.
    pub fn add_forces(&self, mesh: &Mesh, spots: &[Spot], forces_n: &mut [DVec3]) {
        for (number, (bearing, spot)) in self.of.iter().zip(spots).enumerate() {
            let Some(bearing) = bearing else { continue };
            for (node, shape) in mesh.faces[number / POINTS].iter().zip(spot.shapes) {
                forces_n[*node as usize] -= bearing.force_n * shape;
            }
        }
    }

    /// By face that touches: nodes, symmetric blocks and the others, row by row.
    pub fn blocks(&self, mesh: &Mesh, spots: &[Spot]) -> Vec<([u32; 9], Vec<DMat3>, Vec<DMat3>)> {
        let mut blocks = Vec::new();
        for (face, nodes) in mesh.faces.iter().enumerate() {
            let range = face * POINTS..(face + 1) * POINTS;
            let touching = || self.of[range.clone()].iter().zip(&spots[range.clone()]);
            if touching().all(|(bearing, _)| bearing.is_none()) {
                continue;
            }
            let (mut even, mut odd) = (vec![DMat3::ZERO; 81], vec![DMat3::ZERO; 81]);
            for (bearing, spot) in touching() {
                let Some(bearing) = bearing else { continue };
                for a in 0..9 {
                    for b in 0..9 {
                        let shape = spot.shapes[a] * spot.shapes[b];
                        even[9 * a + b] += bearing.even * shape;
                        odd[9 * a + b] += bearing.odd * shape;
                    }
                }
            }
            blocks.push((*nodes, even, odd));
        }
        blocks
    }

    /// Deepest point still inside, mm.
    pub fn penetration_mm(&self) -> f64 {
        self.of.iter().flatten().map(|bearing| -bearing.gap_mm).fold(0.0, f64::max)
    }
}
