//! Candidates, their planes, pressures and friction: the part of a solve that the dome and its section on the pole share.
//!
//! Every candidate node sees the object as the plane that touches it where the node is now; pressures and friction
//! follow from sweeps over the nodes on these planes ([`super::gauss_seidel`]), and the planes are laid anew until nothing
//! moves. What is left at the end is the true distance of the moved nodes from the object.

use glam::DVec3;

use super::candidate::Candidate;
use super::gauss_seidel::{Node, SweepOutcome, displacement, sweeps};
use crate::elastomer::Elastomer;
use crate::object::Placed;
use crate::outcome::{NodeMemory, Status, TouchedNode};
use crate::state::ContactState;
use domecast_springs::Wrench;

/// Rounds of planes and sweeps.
const MAX_ROUNDS: u32 = 160;
/// Rounds are over when no node moves by more than this part of the radius.
pub(crate) const MIN_TOLERANCE: f64 = 1e-8;
/// A node may be left this part of the radius inside the object.
pub(crate) const PENETRATION: f64 = 1e-6;
/// What the first planes are taken to move by, as a part of the radius.
const FIRST_ROUND: f64 = 1e-3;
/// A round's own error over what the last one moved: planes laid anew gain about as much.
const CLOSENESS: f64 = 0.2;
/// Rounds that move less and less do so at least by this factor, and after this many others are damped.
const SHRINKS: f64 = 0.7;
const STALLED: u32 = 3;
/// A plane turns by this part of its way at least.
const MIN_PART: f64 = 1e-6;
/// Sweeps of one round.
const MAX_SWEEPS: u32 = 400;

/// The candidates of one frame.
pub(crate) struct Touch<'a> {
    pub elastomer: &'a Elastomer,
    pub placed: Placed,
    /// 1 + the object's yield for the dome's 1: the gap closes by this times the dome's displacement, and by what the object moves
    /// beyond that ([`Candidate::beyond`]).
    pub sharing: f64,
    pub candidates: Vec<Candidate>,
    /// Compliance of the gap between candidates, sensor frame, three rows by three columns each.
    pub blocks: Vec<f64>,
    pub work: f64,
}

/// How the rounds ended.
#[derive(Clone, Copy)]
pub(crate) struct Rounds {
    pub count: u32,
    pub moved_mm: f64,
    pub converged: bool,
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

    /// Forces on the dome at rest, three numbers a candidate.
    fn forces(&self) -> Vec<f64> {
        self.candidates.iter().flat_map(|c| c.rest_force_n().to_array()).collect()
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

    /// Solves until no node moves by more than `tolerance_mm`, from the forces that the candidates have.
    pub fn run(&mut self, tolerance_mm: f64) -> Rounds {
        let radius = self.elastomer.dome_radius_mm;
        let tolerance_mm = tolerance_mm.max(MIN_TOLERANCE * radius);
        if self.candidates.iter().any(|c| c.force_n != DVec3::ZERO) {
            self.displace();
            self.lay_planes(1.0);
        }
        let mut moved_mm = FIRST_ROUND * radius;
        // Planes on an edge may flip between its faces; turned in part, they come to rest between.
        let (mut part, mut min_mm, mut stalled) = (1.0, f64::INFINITY, 0);
        for count in 1..=MAX_ROUNDS {
            // A round is solved as closely as the planes deserve: within what they still move.
            let swept = self.sweep((CLOSENESS * moved_mm).max(0.1 * tolerance_mm));
            moved_mm = self.displace();
            let converged = moved_mm <= tolerance_mm && swept.change_mm <= tolerance_mm;
            // Planes that the final forces were found on stay theirs.
            self.lay_planes(if converged { 0.0 } else { part });
            if converged {
                return Rounds { count, moved_mm, converged: true };
            }
            stalled += 1;
            if moved_mm < SHRINKS * min_mm {
                (min_mm, stalled) = (moved_mm, 0);
            } else if stalled == STALLED {
                (part, stalled) = (f64::max(0.6 * part, MIN_PART), 0);
            }
        }
        Rounds { count: MAX_ROUNDS, moved_mm, converged: false }
    }

    /// Pressures and friction for the planes.
    fn sweep(&mut self, wanted_mm: f64) -> SweepOutcome {
        let mut forces = self.forces();
        let nodes: Vec<Node> = self
            .candidates
            .iter()
            .map(|c| Node {
                normal: c.normal,
                back: c.back(),
                rest_gap_mm: c.rest_gap_mm,
                carried_mm: c.carried_mm,
            })
            .collect();
        let ended = sweeps(&self.blocks, &nodes, self.elastomer.friction, &mut forces, wanted_mm, MAX_SWEEPS);
        self.work += ended.work;
        for ((candidate, node), force) in self.candidates.iter_mut().zip(&nodes).zip(forces.chunks_exact(3)) {
            candidate.force_n = node.back.transpose() * DVec3::from_slice(force);
        }
        ended
    }

    /// All forces on the dome at rest, N, and what the object moves beyond its share under them, mm.
    pub fn beyond(&self) -> (DVec3, DVec3) {
        let each = self.candidates.iter().map(|c| (c.rest_force_n(), c.beyond));
        each.fold((DVec3::ZERO, DVec3::ZERO), |(all_n, mm), (force_n, beyond)| {
            (all_n + force_n, mm + beyond * force_n)
        })
    }

    /// Writes what was found into a state, all but the field.
    pub fn finish(&self, state: &mut ContactState, ended: Rounds) {
        let radius = self.elastomer.dome_radius_mm;
        let mut wrench = Wrench::default();
        let (all_n, beyond_mm) = self.beyond();
        state.history.beyond_mm = beyond_mm;
        for candidate in &self.candidates {
            state.penetration_mm = state.penetration_mm.max(-candidate.gap_mm);
            let pressure_n = candidate.force_n.dot(candidate.normal);
            if pressure_n <= 0.0 {
                continue;
            }
            // Where the dome bears it now.
            let own_mm = candidate.u_mm - (candidate.beyond * all_n + beyond_mm) * 0.5;
            let place_mm = candidate.at_mm + own_mm / self.sharing;
            wrench.force_n += candidate.force_n;
            wrench.moment_nmm += place_mm.cross(candidate.force_n);
            let friction_n = (candidate.force_n - candidate.normal * pressure_n).length();
            let max_n = self.elastomer.friction * pressure_n;
            state.nodes.push(TouchedNode {
                at_mm: candidate.at_mm,
                area_mm2: candidate.area_mm2,
                force_n: candidate.force_n,
                pressure_mpa: pressure_n / candidate.area_mm2,
                place_mm,
                inward: candidate.normal,
                sticks: friction_n < max_n * (1.0 - 1e-9),
            });
            state.history.nodes.push(NodeMemory {
                node: candidate.node as u32,
                force_n: candidate.force_n,
                displacement_mm: candidate.u_mm,
            });
        }
        state.wrench = wrench;
        state.contact_radius_mm = self.radius_mm();
        state.peak_pressure_mpa = state.nodes.iter().map(|n| n.pressure_mpa).fold(0.0, f64::max);
        state.iterations = ended.count;
        state.residual_mm = ended.moved_mm;
        let good = ended.converged && state.penetration_mm <= PENETRATION * radius;
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
        let normal = self.elastomer.dome().outward_mm(middle).normalize_or(DVec3::Z);
        let (u, v) = normal.any_orthonormal_pair();
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
