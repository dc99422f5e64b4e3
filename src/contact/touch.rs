//! Candidates, their planes, pressures and friction: the part of a solve that the dome and its section on the pole share.
//!
//! Every candidate node sees the object as the plane that touches it where the node is now; pressures and friction
//! follow from sweeps over the nodes on these planes ([`super::sweeps`]), and the planes are laid anew until nothing
//! moves. What is left at the end is the true distance of the moved nodes from the object.

use glam::DVec3;

use super::elastomer::Elastomer;
use super::error::ContactError;
use super::fem::Parts;
use super::geometric::{Placed, frame_of};
use super::local::{DEEPEST, sum};
use super::state::{ContactState, History, NodeMemory, Status, TouchedNode};
use super::sweeps::{Node, Settled, displacement, sweeps};
use domecast_optics::numeric::Rigid;

/// Rounds of planes and sweeps.
const MOST_ROUNDS: u32 = 160;
/// Rounds are over when no node moves by more than this part of the radius.
pub(super) const SETTLED: f64 = 1e-8;
/// A node may be left this part of the radius inside the object.
pub(super) const PENETRATION: f64 = 1e-6;
/// What the first planes are taken to move by, as a part of the radius.
const FIRST_ROUND: f64 = 1e-3;
/// A round's own error over what the last one moved: planes laid anew gain about as much.
const CLOSENESS: f64 = 0.2;
/// Rounds that move less and less do so at least by this factor, and after this many others are damped.
const SHRINKS: f64 = 0.7;
const STALLED: u32 = 3;
/// A plane turns by this part of its way at least.
const LEAST_PART: f64 = 1e-6;
/// Sweeps of one round.
const MOST_SWEEPS: u32 = 400;

/// Part of the nodes' distance by which an object that touches nothing may reach into the dome.
const LEAST_SEEN: f64 = 0.5;

/// Where no node bears a force, the object must not reach far into the dome between the nodes.
pub(super) fn check_seen(placed: &Placed, deepest_mm: DVec3, spacing_mm: f64) -> Result<(), ContactError> {
    let radius = deepest_mm.length();
    match placed.walk_out(deepest_mm, -deepest_mm / radius, radius) {
        Some((depth_mm, _)) if depth_mm > LEAST_SEEN * spacing_mm => {
            Err(ContactError::Unseen { depth_mm, spacing_mm })
        }
        _ => Ok(()),
    }
}

/// A node that may touch.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    pub node: usize,
    /// The level's nodes that it moves with and hands its force to.
    pub parts: Parts,
    pub at_mm: DVec3,
    pub area_mm2: f64,
    /// Standard deviations of its hat along the meridian and along the ring, mm; four places that have its moments.
    spread_mm: [DVec3; 2],
    hat_mm: [DVec3; 4],
    /// Its displacement (with the object's, see `sharing`), its force, sensor frame.
    pub u_mm: DVec3,
    pub force_n: DVec3,
    /// The plane that it may not pass: outward normal of the object, signed distance of the resting node.
    pub normal: DVec3,
    pub rest_gap_mm: f64,
    /// Distance to the object where it is now.
    pub gap_mm: f64,
    /// The face that has come over it, where that stays its plane.
    pub face: Option<Face>,
    /// Where it would be carried if it stuck: displacement before, and the object's since they met.
    pub carried_mm: DVec3,
    /// Displacement in the frame before, and whether it touched the object then.
    was_mm: DVec3,
    touched: bool,
}

/// Where a candidate lies.
pub(super) struct Spot {
    pub node: usize,
    pub parts: Parts,
    pub at_mm: DVec3,
    pub area_mm2: f64,
    /// Standard deviations of its hat along the meridian and along the ring, mm.
    pub spread_mm: [DVec3; 2],
}

/// How the object came: from the pose of the frame before, or along the normal from the first touch.
pub(super) struct Way<'a> {
    then: Placed,
    pub moved: Rigid,
    before: Option<&'a ContactState>,
}

impl<'a> Way<'a> {
    pub fn new(placed: &Placed, before: Option<&'a ContactState>, at_mm: DVec3, distance_mm: f64) -> Self {
        let history: Option<&History> = before.map(|state| &state.history);
        let then = match history.and_then(|history| history.sensor_from_object) {
            Some(pose) => pose,
            None => {
                let mut pose = placed.sensor_from_object();
                pose.translation_mm += at_mm.normalize_or(DVec3::Z) * -distance_mm;
                pose
            }
        };
        Self {
            then: Placed::new(placed.solid.clone(), then),
            moved: placed.sensor_from_object().compose(&then.inverse()),
            before,
        }
    }

    /// What a node remembers of the frame before; the nodes of a history are in order.
    fn memory(&self, node: u32) -> Option<&'a NodeMemory> {
        let nodes = &self.before?.history.nodes;
        nodes.binary_search_by_key(&node, |memory| memory.node).ok().and_then(|at| nodes.get(at))
    }

    /// What a sticking node is carried to: its displacement then, and the object's motion since they met. A node
    /// that was free then met the object on the way, where a straight way would have closed its gap.
    pub fn carried(&self, placed: &Placed, candidate: &Candidate) -> DVec3 {
        let was = candidate.was_mm;
        let p = candidate.at_mm + was;
        let motion = self.moved.point(p) - p;
        if candidate.touched {
            return was + motion;
        }
        let gap_now = placed.distance(p).0;
        let part = if gap_now < 0.0 {
            let gap_then = self.then.distance(p).0.max(0.0);
            -gap_now / (gap_then - gap_now)
        } else {
            0.0
        };
        was + motion * part
    }
}

/// Four places of the dome that have the second moments of a node's hat.
pub(super) fn hat_places(at_mm: DVec3, spread_mm: [DVec3; 2]) -> [DVec3; 4] {
    [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]].map(|[u, v]| {
        let beside = at_mm + spread_mm[0] * u + spread_mm[1] * v;
        // Back on the dome.
        beside * (at_mm.length() / beside.length())
    })
}

/// A face of the object as a plane of its own frame, and the place of the dome that sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Face {
    /// A point of the face and its outward normal, in the object's frame.
    pub at_object_mm: DVec3,
    pub normal_object: DVec3,
    /// The place that the gap is measured from: the middle of the node's hat, sensor frame.
    pub from_mm: DVec3,
}

impl Candidate {
    /// Lays the plane of its face where the object is; the plane goes with the object.
    pub fn follow_face(&mut self, sensor_from_object: &Rigid) {
        let Some(face) = self.face else { return };
        self.normal = sensor_from_object.vector(face.normal_object);
        self.rest_gap_mm = self.normal.dot(face.from_mm - sensor_from_object.point(face.at_object_mm));
    }

    /// A node at rest, on its first plane: where a walk along the dome's inward normal leaves the object.
    pub fn new(spot: Spot, placed: &Placed, way: &Way<'_>, sharing: f64) -> Result<Self, ContactError> {
        let Spot { node, parts, at_mm, area_mm2, spread_mm } = spot;
        let radius = at_mm.length();
        let memory = way.memory(node as u32);
        let mut candidate = Self {
            node,
            parts,
            at_mm,
            area_mm2,
            spread_mm,
            hat_mm: hat_places(at_mm, spread_mm),
            u_mm: DVec3::ZERO,
            // The old force turns with the object.
            force_n: memory.map_or(DVec3::ZERO, |memory| way.moved.vector(memory.force_n)),
            normal: DVec3::Z,
            rest_gap_mm: 0.0,
            gap_mm: 0.0,
            face: None,
            carried_mm: DVec3::ZERO,
            was_mm: match (memory, way.before) {
                (Some(memory), _) => memory.displacement_mm,
                (None, Some(state)) => state.displacement_mm(at_mm) * sharing,
                (None, None) => DVec3::ZERO,
            },
            touched: memory.is_some(),
        };
        candidate.carried_mm = way.carried(placed, &candidate);
        let inward = -at_mm / radius;
        let (walked, outward) = placed
            .walk_out(at_mm, inward, radius)
            .ok_or(ContactError::TooDeep { depth_mm: radius, limit_mm: DEEPEST * radius })?;
        let (distance, nearest) = placed.distance(at_mm);
        (candidate.normal, candidate.rest_gap_mm) = if distance > 0.0 {
            (nearest, distance)
        } else if outward.dot(inward) > 0.05 {
            (outward, -outward.dot(inward) * walked)
        } else {
            // The way out grazes a wall: the object's own nearest face is the better plane.
            (nearest, distance)
        };
        Ok(candidate)
    }

    /// Distance to the object and its outward direction as the node's hat sees them, moved: the mean over four
    /// places that have the hat's second moments. A node stands for a patch; measured at its middle alone, the gap of
    /// two round bodies would be short by a twelfth of their relative curvature times the patch's area.
    pub fn gap(&self, placed: &Placed) -> (f64, DVec3) {
        let (mut distance, mut outward) = (0.0, DVec3::ZERO);
        for place in self.hat_mm {
            let (d, n) = placed.distance(place + self.u_mm);
            distance += 0.25 * d;
            outward += n;
        }
        // Opposite faces leave no mean direction: the middle's then.
        let outward =
            if outward.length() > 0.4 { outward } else { placed.distance(self.at_mm + self.u_mm).1 };
        (distance, outward.normalize_or(DVec3::Z))
    }
}

/// The candidates of one frame.
pub(super) struct Touch<'a> {
    pub elastomer: &'a Elastomer,
    pub placed: Placed,
    /// 1 + the object's yield for the dome's 1: the gap closes by this times the dome's displacement.
    pub sharing: f64,
    pub candidates: Vec<Candidate>,
    /// Compliance of the gap between candidates, sensor frame, three rows by three columns each.
    pub blocks: Vec<f64>,
    pub work: f64,
}

/// How the rounds ended.
#[derive(Clone, Copy)]
pub(super) struct Rounds {
    pub count: u32,
    pub moved_mm: f64,
    pub settled: bool,
}

impl<'a> Touch<'a> {
    pub fn new(elastomer: &'a Elastomer, placed: Placed, sharing: f64) -> Self {
        Self { elastomer, placed, sharing, candidates: Vec::new(), blocks: Vec::new(), work: 0.0 }
    }

    /// Displacements of the candidates from their forces; the most that one moved, mm.
    fn displace(&mut self) -> f64 {
        let forces = self.forces();
        let width = forces.len();
        self.work += (width * width) as f64;
        let mut moved = 0.0_f64;
        for (rows, candidate) in self.blocks.chunks_exact(3 * width.max(1)).zip(&mut self.candidates) {
            let u = displacement(rows, &forces);
            moved = moved.max(u.distance(candidate.u_mm));
            candidate.u_mm = u;
        }
        moved
    }

    fn forces(&self) -> Vec<f64> {
        self.candidates.iter().flat_map(|c| c.force_n.to_array()).collect()
    }

    /// Distances where the nodes are now, and planes there, turned from the last ones by a part of the way.
    fn lay_planes(&mut self, part: f64) {
        for candidate in &mut self.candidates {
            if candidate.face.is_some() {
                candidate.gap_mm = candidate.rest_gap_mm + candidate.normal.dot(candidate.u_mm);
                continue;
            }
            let (distance, outward) = candidate.gap(&self.placed);
            candidate.gap_mm = distance;
            candidate.normal = candidate.normal.lerp(outward, part).normalize_or(outward);
            candidate.rest_gap_mm = distance - candidate.normal.dot(candidate.u_mm);
        }
        self.work += 160.0 * self.candidates.len() as f64;
    }

    /// Solves until no node moves by more than `settled_mm`, from the forces that the candidates have.
    pub fn run(&mut self, settled_mm: f64) -> Rounds {
        let radius = self.elastomer.dome_radius_mm;
        let settled_mm = settled_mm.max(SETTLED * radius);
        if self.candidates.iter().any(|c| c.force_n != DVec3::ZERO) {
            self.displace();
            self.lay_planes(1.0);
        }
        let mut moved_mm = FIRST_ROUND * radius;
        // Planes on an edge may flip between its faces; turned in part, they come to rest between.
        let (mut part, mut least_mm, mut stalled) = (1.0, f64::INFINITY, 0);
        for count in 1..=MOST_ROUNDS {
            // A round is solved as closely as the planes deserve: within what they still move.
            let swept = self.sweep((CLOSENESS * moved_mm).max(0.1 * settled_mm));
            moved_mm = self.displace();
            let settled = moved_mm <= settled_mm && swept.change_mm <= settled_mm;
            // Planes that the final forces were found on stay theirs.
            self.lay_planes(if settled { 0.0 } else { part });
            if settled {
                return Rounds { count, moved_mm, settled: true };
            }
            stalled += 1;
            if moved_mm < SHRINKS * least_mm {
                (least_mm, stalled) = (moved_mm, 0);
            } else if stalled == STALLED {
                (part, stalled) = (f64::max(0.6 * part, LEAST_PART), 0);
            }
        }
        Rounds { count: MOST_ROUNDS, moved_mm, settled: false }
    }

    /// Pressures and friction for the planes.
    fn sweep(&mut self, wanted_mm: f64) -> Settled {
        let mut forces = self.forces();
        let nodes: Vec<Node> = self
            .candidates
            .iter()
            .map(|c| Node { normal: c.normal, rest_gap_mm: c.rest_gap_mm, carried_mm: c.carried_mm })
            .collect();
        let ended =
            sweeps(&self.blocks, &nodes, self.elastomer.friction, &mut forces, wanted_mm, MOST_SWEEPS);
        self.work += ended.work;
        for (candidate, force) in self.candidates.iter_mut().zip(forces.chunks_exact(3)) {
            candidate.force_n = DVec3::from_slice(force);
        }
        ended
    }

    /// Writes what was found into a state, all but the field.
    pub fn finish(&self, state: &mut ContactState, ended: Rounds) {
        let radius = self.elastomer.dome_radius_mm;
        for candidate in &self.candidates {
            state.penetration_mm = state.penetration_mm.max(-candidate.gap_mm);
            let pressure_n = candidate.force_n.dot(candidate.normal);
            if pressure_n <= 0.0 {
                continue;
            }
            let friction_n = (candidate.force_n - candidate.normal * pressure_n).length();
            let most_n = self.elastomer.friction * pressure_n;
            state.nodes.push(TouchedNode {
                at_mm: candidate.at_mm,
                area_mm2: candidate.area_mm2,
                force_n: candidate.force_n,
                pressure_mpa: pressure_n / candidate.area_mm2,
                sticks: friction_n < most_n * (1.0 - 1e-9),
            });
            state.history.nodes.push(NodeMemory {
                node: candidate.node as u32,
                force_n: candidate.force_n,
                displacement_mm: candidate.u_mm,
            });
        }
        state.wrench = sum(&state.nodes);
        state.contact_radius_mm = self.radius_mm();
        state.peak_pressure_mpa = state.nodes.iter().map(|n| n.pressure_mpa).fold(0.0, f64::max);
        state.iterations = ended.count;
        state.residual_mm = ended.moved_mm;
        let good = ended.settled && state.penetration_mm <= PENETRATION * radius;
        state.status = match (state.nodes.is_empty(), good) {
            (_, false) => Status::BoundReached,
            (true, true) => Status::Free,
            (false, true) => Status::Solved,
        };
        state.work += self.work;
    }

    /// Radius of the disc whose half ellipsoid of pressure has the second moments of this one, mm.
    ///
    /// A node's force lies spread about it, and the moments of hats are exact; the squared pressure is not, nor the
    /// count of nodes. A half ellipsoid has a fifth of each half axis squared.
    fn radius_mm(&self) -> f64 {
        let loads = || {
            self.candidates
                .iter()
                .map(|c| (c, c.force_n.dot(c.normal)))
                .filter(|(_, pressure)| *pressure > 0.0)
        };
        let load: f64 = loads().map(|(_, pressure)| pressure).sum();
        if load <= 0.0 {
            return 0.0;
        }
        let middle = loads().map(|(c, pressure)| c.at_mm * (pressure / load)).sum::<DVec3>();
        let (u, v) = frame_of(middle.normalize_or(DVec3::Z));
        let (mut uu, mut vv, mut uv) = (0.0, 0.0, 0.0);
        for (candidate, pressure) in loads() {
            // A node without a hat of its own stands for a square.
            let side = (candidate.area_mm2 / 12.0).sqrt();
            let spread = candidate.spread_mm;
            let own = if spread[0] == DVec3::ZERO { [u * side, v * side] } else { spread };
            for arm in [candidate.at_mm - middle, own[0], own[1]] {
                let (x, y) = (arm.dot(u), arm.dot(v));
                uu += pressure / load * x * x;
                vv += pressure / load * y * y;
                uv += pressure / load * x * y;
            }
        }
        5.0_f64.sqrt() * (uu * vv - uv * uv).max(0.0).powf(0.25)
    }
}
