//! Candidates, their planes, pressures and friction: the part of a solve that every elastic level shares.
//!
//! Every candidate node sees the object as the plane that touches it where the node is now; the pressures follow
//! from a quadratic program on these planes (gap >= 0, pressure >= 0), the friction from another with the pressures
//! held (Panagiotopoulos' alternation), and the planes are laid anew until nothing moves. What is left at the end
//! is the true distance of the moved nodes from the object.

use std::collections::BTreeMap;

use glam::DVec3;

use super::elastomer::Elastomer;
use super::error::ContactError;
use super::geometric::{Placed, frame_of};
use super::local::{DEEPEST, sum};
use super::state::{ContactState, History, NodeMemory, Status, TouchedNode};
use super::unilateral::{Bounds, Dense, dot, solve};
use crate::numeric::Rigid;

/// Rounds of planes, pressures and friction.
const MOST_ROUNDS: u32 = 60;
/// Rounds are over when no node moves by more than this part of the radius.
pub(super) const SETTLED: f64 = 1e-8;
/// A node may be left this part of the radius inside the object.
pub(super) const PENETRATION: f64 = 1e-6;
/// What the first planes are taken to move by, as a part of the radius.
const FIRST_ROUND: f64 = 1e-3;
/// A round's own error over what the last one moved.
const CLOSENESS: f64 = 0.01;
/// Iterations of one quadratic program.
const MOST_STEPS: u32 = 2000;

/// A node that may touch.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    pub node: usize,
    pub at_mm: DVec3,
    pub area_mm2: f64,
    /// Standard deviations of its hat along the meridian and along the ring, mm.
    pub spread_mm: [DVec3; 2],
    /// Its displacement (with the object's, see `sharing`), its force, sensor frame.
    pub u_mm: DVec3,
    /// Its displacement without forces on any candidate.
    pub offset_mm: DVec3,
    pub force_n: DVec3,
    /// The plane that it may not pass: outward normal of the object, signed distance of the resting node.
    pub normal: DVec3,
    pub rest_gap_mm: f64,
    /// Where it would be carried if it stuck: displacement before, and the object's since they met.
    pub carried_mm: DVec3,
}

/// How the object came: from the pose of the frame before, or along the normal from the first touch.
pub(super) struct Way<'a> {
    then: Placed,
    pub moved: Rigid,
    before: Option<&'a ContactState>,
    pub memory: BTreeMap<u32, NodeMemory>,
}

impl<'a> Way<'a> {
    pub fn new(placed: &Placed, before: Option<&'a ContactState>, at_mm: DVec3, distance_mm: f64) -> Self {
        let history: Option<&History> = before.map(|state| &state.history);
        let then = match history.and_then(|history| history.sensor_from_object) {
            Some(pose) => pose,
            None => {
                let mut pose = placed.sensor_from_object;
                pose.translation_mm += at_mm.normalize_or(DVec3::Z) * -distance_mm;
                pose
            }
        };
        Self {
            then: Placed { solid: placed.solid.clone(), sensor_from_object: then },
            moved: placed.sensor_from_object.compose(&then.inverse()),
            before,
            memory: history
                .map(|history| history.nodes.iter().map(|memory| (memory.node, *memory)).collect())
                .unwrap_or_default(),
        }
    }

    /// What a sticking node is carried to: its displacement then, and the object's motion since they met. A node
    /// that was free then met the object on the way, where a straight way would have closed its gap.
    pub fn carried(&self, placed: &Placed, node: usize, at_mm: DVec3, sharing: f64) -> DVec3 {
        let motion = |p: DVec3| self.moved.point(p) - p;
        if let Some(memory) = self.memory.get(&(node as u32)) {
            return memory.displacement_mm + motion(at_mm + memory.displacement_mm);
        }
        let was = self.before.map_or(DVec3::ZERO, |state| state.displacement_mm(at_mm) * sharing);
        let p = at_mm + was;
        let (gap_then, gap_now) = (self.then.distance(p).0.max(0.0), placed.distance(p).0);
        let part = if gap_now < 0.0 { -gap_now / (gap_then - gap_now) } else { 0.0 };
        was + motion(p) * part
    }
}

impl Candidate {
    /// A node at rest, on its first plane: where a walk along the dome's inward normal leaves the object.
    pub fn new(
        (node, at_mm, area_mm2, spread_mm): (usize, DVec3, f64, [DVec3; 2]),
        placed: &Placed,
        way: &Way<'_>,
        sharing: f64,
    ) -> Result<Self, ContactError> {
        let radius = at_mm.length();
        let memory = way.memory.get(&(node as u32));
        let mut candidate = Self {
            node,
            at_mm,
            area_mm2,
            spread_mm,
            u_mm: DVec3::ZERO,
            offset_mm: DVec3::ZERO,
            // The old force turns with the object.
            force_n: memory.map_or(DVec3::ZERO, |memory| way.moved.vector(memory.force_n)),
            normal: DVec3::Z,
            rest_gap_mm: 0.0,
            carried_mm: way.carried(placed, node, at_mm, sharing),
        };
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
        for [u, v] in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
            let beside = self.at_mm + self.spread_mm[0] * u + self.spread_mm[1] * v;
            // Back on the dome.
            let place = beside * (self.at_mm.length() / beside.length());
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
    pub placed: &'a Placed,
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
    pub fn new(elastomer: &'a Elastomer, placed: &'a Placed, sharing: f64) -> Self {
        Self { elastomer, placed, sharing, candidates: Vec::new(), blocks: Vec::new(), work: 0.0 }
    }

    /// Displacements of the candidates from their forces.
    pub fn displace(&mut self) -> f64 {
        let forces: Vec<f64> = self.candidates.iter().flat_map(|c| c.force_n.to_array()).collect();
        let width = forces.len();
        self.work += (width * width) as f64;
        let mut moved = 0.0_f64;
        for (i, candidate) in self.candidates.iter_mut().enumerate() {
            let rows = &self.blocks[3 * i * width..3 * (i + 1) * width];
            let u = DVec3::new(
                dot(&rows[..width], &forces),
                dot(&rows[width..2 * width], &forces),
                dot(&rows[2 * width..], &forces),
            ) + candidate.offset_mm;
            moved = moved.max(u.distance(candidate.u_mm));
            candidate.u_mm = u;
        }
        moved
    }

    /// Planes where the nodes are now.
    pub fn lay_planes(&mut self) {
        for candidate in &mut self.candidates {
            let (distance, outward) = candidate.gap(self.placed);
            candidate.normal = outward;
            candidate.rest_gap_mm = distance - outward.dot(candidate.u_mm);
        }
        self.work += 160.0 * self.candidates.len() as f64;
    }

    pub fn run(&mut self) -> Rounds {
        let radius = self.elastomer.dome_radius_mm;
        let mut moved_mm = FIRST_ROUND * radius;
        for count in 1..=MOST_ROUNDS {
            // A round is solved as closely as the planes deserve: well within what they still move.
            let wanted = (CLOSENESS * moved_mm).max(0.02 * SETTLED * radius);
            let pressures = self.press(wanted);
            self.rub(&pressures, wanted);
            moved_mm = self.displace();
            if moved_mm <= SETTLED * radius {
                return Rounds { count, moved_mm, settled: true };
            }
            self.lay_planes();
        }
        Rounds { count: MOST_ROUNDS, moved_mm, settled: false }
    }

    /// Pressures for the planes, friction held; returns them.
    fn press(&mut self, wanted_mm: f64) -> Vec<f64> {
        let n = self.candidates.len();
        let width = 3 * n;
        let mut a = Dense { n, values: vec![0.0; n * n] };
        let mut c = Vec::with_capacity(n);
        let mut x = Vec::with_capacity(n);
        let tangential: Vec<f64> = self
            .candidates
            .iter()
            .flat_map(|c| (c.force_n - c.normal * c.force_n.dot(c.normal)).to_array())
            .collect();
        for i in 0..n {
            let ni = self.candidates[i].normal;
            let rows = &self.blocks[3 * i * width..3 * (i + 1) * width];
            let combined: Vec<f64> = (0..width)
                .map(|k| ni.x * rows[k] + ni.y * rows[width + k] + ni.z * rows[2 * width + k])
                .collect();
            for (j, other) in self.candidates.iter().enumerate() {
                let nj = other.normal;
                a.values[i * n + j] =
                    combined[3 * j] * nj.x + combined[3 * j + 1] * nj.y + combined[3 * j + 2] * nj.z;
            }
            c.push(
                self.candidates[i].rest_gap_mm
                    + ni.dot(self.candidates[i].offset_mm)
                    + dot(&combined, &tangential),
            );
            x.push(self.candidates[i].force_n.dot(ni).max(0.0));
        }
        let ended = solve(&a, &c, Bounds::Positive, &mut x, wanted_mm, MOST_STEPS);
        self.work += (6 * n * n) as f64 + f64::from(ended.iterations + 12) * (n * n) as f64;
        for (i, candidate) in self.candidates.iter_mut().enumerate() {
            let t = DVec3::new(tangential[3 * i], tangential[3 * i + 1], tangential[3 * i + 2]);
            candidate.force_n = candidate.normal * x[i] + t;
        }
        x
    }

    /// Friction for the pressures.
    fn rub(&mut self, pressures: &[f64], wanted_mm: f64) {
        let touched: Vec<usize> = (0..pressures.len()).filter(|i| pressures[*i] > 0.0).collect();
        for (i, candidate) in self.candidates.iter_mut().enumerate() {
            if pressures[i] <= 0.0 || self.elastomer.friction == 0.0 {
                candidate.force_n = candidate.normal * pressures[i];
            }
        }
        if self.elastomer.friction == 0.0 || touched.is_empty() {
            return;
        }
        let n = touched.len();
        let width = 3 * self.candidates.len();
        let normal_forces: Vec<f64> =
            self.candidates.iter().zip(pressures).flat_map(|(c, p)| (c.normal * *p).to_array()).collect();
        let axes: Vec<[DVec3; 2]> = touched
            .iter()
            .map(|i| {
                let (u, v) = frame_of(self.candidates[*i].normal);
                [u, v]
            })
            .collect();
        let mut a = Dense { n: 2 * n, values: vec![0.0; 4 * n * n] };
        let (mut c, mut x, mut radii) = (Vec::new(), Vec::new(), Vec::new());
        for (row, &i) in touched.iter().enumerate() {
            let rows = &self.blocks[3 * i * width..3 * (i + 1) * width];
            let candidate = &self.candidates[i];
            for (k, t) in axes[row].iter().enumerate() {
                let combined: Vec<f64> = (0..width)
                    .map(|q| t.x * rows[q] + t.y * rows[width + q] + t.z * rows[2 * width + q])
                    .collect();
                let out = &mut a.values[(2 * row + k) * 2 * n..(2 * row + k + 1) * 2 * n];
                for (column, &j) in touched.iter().enumerate() {
                    let block = DVec3::new(combined[3 * j], combined[3 * j + 1], combined[3 * j + 2]);
                    out[2 * column] = block.dot(axes[column][0]);
                    out[2 * column + 1] = block.dot(axes[column][1]);
                }
                c.push(dot(&combined, &normal_forces) + t.dot(candidate.offset_mm - candidate.carried_mm));
                x.push(candidate.force_n.dot(*t));
            }
            radii.push(self.elastomer.friction * pressures[i]);
        }
        let ended = solve(&a, &c, Bounds::Discs(&radii), &mut x, wanted_mm, MOST_STEPS);
        self.work += (24 * n * n) as f64 + f64::from(ended.iterations + 12) * (4 * n * n) as f64;
        for (row, &i) in touched.iter().enumerate() {
            let [u, v] = axes[row];
            let candidate = &mut self.candidates[i];
            candidate.force_n = candidate.normal * pressures[i] + u * x[2 * row] + v * x[2 * row + 1];
        }
    }

    /// Writes what was found into a state, all but the field.
    pub fn finish(&self, state: &mut ContactState, ended: Rounds) {
        let radius = self.elastomer.dome_radius_mm;
        let (mut load, mut square) = (0.0, 0.0);
        for candidate in &self.candidates {
            state.penetration_mm = state.penetration_mm.max(-candidate.gap(self.placed).0);
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
            load += pressure_n;
            square += pressure_n * pressure_n / candidate.area_mm2;
            state.history.nodes.push(NodeMemory {
                node: candidate.node as u32,
                force_n: candidate.force_n,
                displacement_mm: candidate.u_mm,
            });
        }
        state.wrench = sum(&state.nodes);
        // 9/8 of the squared force over the sum of the squared pressure is the area of a half ellipsoid's base.
        state.contact_radius_mm =
            if square > 0.0 { load * (1.125 / (std::f64::consts::PI * square)).sqrt() } else { 0.0 };
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
}
