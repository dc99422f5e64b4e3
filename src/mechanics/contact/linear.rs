//! The linear level: elastic dome, unilateral contact on the object's true surface, Coulomb friction.
//!
//! Every candidate node sees the object as the plane that touches it where the node is now; the pressures follow
//! from a quadratic program on these planes (gap >= 0, pressure >= 0), the friction from another with the pressures
//! held (Panagiotopoulos' alternation), and the planes are laid anew until nothing moves. What is left at the end
//! is the true distance of the moved nodes from the object.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};

use super::elastomer::{Elastomer, Indenter};
use super::error::ContactError;
use super::fem::{Compliance, SurfaceField};
use super::field::Field;
use super::geometric::{Placed, deepest, frame_of};
use super::local::{DEEPEST, sum};
use super::state::{ContactState, History, NodeMemory, Status, TouchedNode};
use super::unilateral::{Bounds, Dense, dot, solve};
use crate::numeric::Rigid;

/// Rounds of planes, pressures and friction.
const MOST_ROUNDS: u32 = 60;
/// Rounds are over when no node moves by more than this part of the radius.
const SETTLED: f64 = 1e-9;
/// A node may be left this part of the radius inside the object.
pub(super) const PENETRATION: f64 = 1e-6;
/// Iterations of one quadratic program.
const MOST_STEPS: u32 = 2000;

/// A node that may touch.
struct Candidate {
    node: usize,
    at_mm: DVec3,
    /// Its local frame (r, z, phi), sensor frame.
    frame: DMat3,
    area_mm2: f64,
    /// Its displacement (with the object's, see `sharing`), its force, sensor frame.
    u_mm: DVec3,
    force_n: DVec3,
    /// The plane that it may not pass: outward normal of the object, signed distance of the resting node.
    normal: DVec3,
    rest_gap_mm: f64,
    /// Where it would be carried if it stuck: displacement before, and the object's since they met.
    carried_mm: DVec3,
}

/// One frame of the linear level.
pub(super) fn linear(
    elastomer: &Elastomer,
    compliance: &Compliance,
    indenter: &Indenter,
    sensor_from_object: &Rigid,
    before: Option<&ContactState>,
) -> Result<ContactState, ContactError> {
    let radius = elastomer.dome_radius_mm;
    let placed = Placed { solid: indenter.solid.clone(), sensor_from_object: *sensor_from_object };
    let (deepest_mm, distance_mm, queries) = deepest(&placed, radius);
    let mut state = ContactState::free(sensor_from_object);
    state.work = 30.0 * queries as f64;
    if distance_mm >= 0.0 {
        return Ok(state);
    }
    if -distance_mm > DEEPEST * radius {
        return Err(ContactError::TooDeep { depth_mm: -distance_mm, limit_mm: DEEPEST * radius });
    }
    let way = Way::new(&placed, before, deepest_mm, distance_mm);
    let sharing = 1.0 + indenter.yield_ratio(elastomer);
    let spacing = radius * std::f64::consts::FRAC_PI_2 / compliance.grid.elements as f64;
    let margin = spacing.max(0.15 * -distance_mm);
    let mut solver = Solver {
        elastomer,
        compliance,
        placed: &placed,
        sharing,
        candidates: Vec::new(),
        blocks: Vec::new(),
        work: 0.0,
    };
    solver.look(&way, margin)?;
    let mut ended = solver.run();
    // Nodes beyond the first choice that were pressed into the object join it.
    for _ in 0..4 {
        if !solver.widen(&way, margin)? {
            break;
        }
        ended = solver.run();
    }
    solver.finish(&mut state, ended);
    Ok(state)
}

/// How the object came: from the pose of the frame before, or along the normal from the first touch.
struct Way<'a> {
    then: Placed,
    moved: Rigid,
    before: Option<&'a ContactState>,
    memory: BTreeMap<u32, NodeMemory>,
}

impl<'a> Way<'a> {
    fn new(placed: &Placed, before: Option<&'a ContactState>, at_mm: DVec3, distance_mm: f64) -> Self {
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
    fn carried(&self, placed: &Placed, node: usize, at_mm: DVec3, sharing: f64) -> DVec3 {
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

struct Solver<'a> {
    elastomer: &'a Elastomer,
    compliance: &'a Compliance,
    placed: &'a Placed,
    /// 1 + the object's yield for the dome's 1: the gap closes by this times the dome's displacement.
    sharing: f64,
    candidates: Vec<Candidate>,
    /// Compliance of the gap between candidates, sensor frame, three rows by three columns each.
    blocks: Vec<f64>,
    work: f64,
}

/// How the rounds ended.
#[derive(Clone, Copy)]
struct Rounds {
    count: u32,
    moved_mm: f64,
    settled: bool,
}

impl Solver<'_> {
    /// Candidates: nodes in the object or nearer than the margin.
    fn look(&mut self, way: &Way<'_>, margin: f64) -> Result<(), ContactError> {
        let grid = &self.compliance.grid;
        let mut chosen = Vec::new();
        for ring in 0..grid.elements {
            let count = grid.counts[ring];
            let step_mm = grid.polar(ring).sin() * grid.radius_mm * std::f64::consts::TAU / count as f64;
            let mut k = 0;
            while k < count {
                let number = grid.first[ring] + k;
                let (distance, _) = self.placed.distance(grid.place(grid.node(number)));
                self.work += 30.0;
                if distance < margin {
                    chosen.push(number);
                    k += 1;
                } else {
                    // No node nearer than the distance's excess can be closer to the object.
                    k += if step_mm > 0.0 { (((distance - margin) / step_mm) as usize).max(1) } else { 1 };
                }
            }
        }
        self.add(&chosen, way)
    }

    fn add(&mut self, numbers: &[usize], way: &Way<'_>) -> Result<(), ContactError> {
        let grid = &self.compliance.grid;
        let radius = self.elastomer.dome_radius_mm;
        for &number in numbers {
            let node = grid.node(number);
            let at_mm = grid.place(node);
            let memory = way.memory.get(&(number as u32));
            let mut candidate = Candidate {
                node: number,
                at_mm,
                frame: grid.frame(node),
                area_mm2: grid.areas_mm2[node.ring],
                u_mm: DVec3::ZERO,
                // The old force turns with the object.
                force_n: memory.map_or(DVec3::ZERO, |memory| way.moved.vector(memory.force_n)),
                normal: DVec3::Z,
                rest_gap_mm: 0.0,
                carried_mm: way.carried(self.placed, number, at_mm, self.sharing),
            };
            // First plane: where a walk along the dome's inward normal leaves the object.
            let inward = -at_mm / radius;
            let (walked, outward) = self
                .placed
                .walk_out(at_mm, inward, radius)
                .ok_or(ContactError::TooDeep { depth_mm: radius, limit_mm: DEEPEST * radius })?;
            let (distance, _) = self.placed.distance(at_mm);
            candidate.normal = outward;
            candidate.rest_gap_mm = if distance > 0.0 { distance } else { -outward.dot(inward) * walked };
            if distance <= 0.0 && outward.dot(inward) <= 0.05 {
                // The way out grazes a wall: the object's own nearest face is the better plane.
                let (distance, outward) = self.placed.distance(at_mm);
                (candidate.normal, candidate.rest_gap_mm) = (outward, distance);
            }
            self.candidates.push(candidate);
        }
        self.candidates.sort_by_key(|candidate| candidate.node);
        self.fill_blocks();
        Ok(())
    }

    fn fill_blocks(&mut self) {
        let n = self.candidates.len();
        let width = 3 * n;
        let grid = &self.compliance.grid;
        self.blocks = vec![0.0; width * width];
        for i in 0..n {
            let at = grid.node(self.candidates[i].node);
            for j in 0..=i {
                let by = grid.node(self.candidates[j].node);
                let local = self.compliance.between(at, by);
                let (f, g) = (self.candidates[i].frame, self.candidates[j].frame);
                let block = f * local * g.transpose() * self.sharing;
                for row in 0..3 {
                    for column in 0..3 {
                        let value = block.col(column)[row];
                        self.blocks[(3 * i + row) * width + 3 * j + column] = value;
                        self.blocks[(3 * j + column) * width + 3 * i + row] = value;
                    }
                }
            }
        }
        self.work += 60.0 * (n * n) as f64;
    }

    /// Displacements of the candidates from their forces.
    fn displace(&mut self) -> f64 {
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
            );
            moved = moved.max(u.distance(candidate.u_mm));
            candidate.u_mm = u;
        }
        moved
    }

    /// Planes where the nodes are now.
    fn lay_planes(&mut self) {
        for candidate in &mut self.candidates {
            let here = candidate.at_mm + candidate.u_mm;
            let (distance, outward) = self.placed.distance(here);
            candidate.normal = outward;
            candidate.rest_gap_mm = distance - outward.dot(candidate.u_mm);
        }
        self.work += 40.0 * self.candidates.len() as f64;
    }

    fn run(&mut self) -> Rounds {
        let radius = self.elastomer.dome_radius_mm;
        let mut moved_mm = f64::INFINITY;
        for count in 1..=MOST_ROUNDS {
            let pressures = self.press();
            self.rub(&pressures);
            moved_mm = self.displace();
            if moved_mm <= SETTLED * radius {
                return Rounds { count, moved_mm, settled: true };
            }
            self.lay_planes();
        }
        Rounds { count: MOST_ROUNDS, moved_mm, settled: false }
    }

    /// Pressures for the planes, friction held; returns them.
    fn press(&mut self) -> Vec<f64> {
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
            c.push(self.candidates[i].rest_gap_mm + dot(&combined, &tangential));
            x.push(self.candidates[i].force_n.dot(ni).max(0.0));
        }
        let tolerance = 0.02 * SETTLED * self.elastomer.dome_radius_mm;
        let ended = solve(&a, &c, Bounds::Positive, &mut x, tolerance, MOST_STEPS);
        self.work += (6 * n * n) as f64 + f64::from(ended.iterations + 12) * (n * n) as f64;
        for (i, candidate) in self.candidates.iter_mut().enumerate() {
            let t = DVec3::new(tangential[3 * i], tangential[3 * i + 1], tangential[3 * i + 2]);
            candidate.force_n = candidate.normal * x[i] + t;
        }
        x
    }

    /// Friction for the pressures.
    fn rub(&mut self, pressures: &[f64]) {
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
                c.push(dot(&combined, &normal_forces) - t.dot(candidate.carried_mm));
                x.push(candidate.force_n.dot(*t));
            }
            radii.push(self.elastomer.friction * pressures[i]);
        }
        let tolerance = 0.1 * SETTLED * self.elastomer.dome_radius_mm;
        let ended = solve(&a, &c, Bounds::Discs(&radii), &mut x, tolerance, MOST_STEPS);
        self.work += (24 * n * n) as f64 + f64::from(ended.iterations + 12) * (4 * n * n) as f64;
        for (row, &i) in touched.iter().enumerate() {
            let [u, v] = axes[row];
            let candidate = &mut self.candidates[i];
            candidate.force_n = candidate.normal * pressures[i] + u * x[2 * row] + v * x[2 * row + 1];
        }
    }

    fn field(&mut self) -> SurfaceField {
        let forces: Vec<(usize, DVec3)> = self
            .candidates
            .iter()
            .filter(|c| c.force_n != DVec3::ZERO)
            .map(|c| (c.node, c.frame.transpose() * c.force_n))
            .collect();
        let field = SurfaceField::new(self.compliance, &forces);
        self.work += field.work;
        field
    }

    /// Looks for nodes that no plane held back; adds them.
    fn widen(&mut self, way: &Way<'_>, margin: f64) -> Result<bool, ContactError> {
        let grid = &self.compliance.grid;
        let known: Vec<usize> = self.candidates.iter().map(|c| c.node).collect();
        let mut near = Vec::new();
        let mut field = None;
        for number in 0..grid.len() {
            if known.binary_search(&number).is_ok() {
                continue;
            }
            let at = grid.place(grid.node(number));
            // Only what lies within a few margins can have been pressed in by the bulge.
            let (distance, _) = self.placed.distance(at);
            if distance < 4.0 * margin {
                near.push((number, at));
            }
        }
        let mut found = Vec::new();
        for (number, at) in near {
            if field.is_none() {
                field = Some(self.field());
            }
            let Some(field) = &field else { continue };
            let moved = at + field.at(at) * self.sharing;
            if self.placed.distance(moved).0 < -PENETRATION * self.elastomer.dome_radius_mm {
                found.push(number);
            }
        }
        if found.is_empty() {
            return Ok(false);
        }
        self.add(&found, way)?;
        Ok(true)
    }

    fn finish(mut self, state: &mut ContactState, ended: Rounds) {
        let field = self.field();
        let radius = self.elastomer.dome_radius_mm;
        let mut edge = 0.0;
        for candidate in &self.candidates {
            let here = candidate.at_mm + candidate.u_mm;
            state.penetration_mm = state.penetration_mm.max(-self.placed.distance(here).0);
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
            edge += candidate.area_mm2;
            state.history.nodes.push(NodeMemory {
                node: candidate.node as u32,
                force_n: candidate.force_n,
                displacement_mm: candidate.u_mm,
            });
        }
        state.wrench = sum(&state.nodes);
        state.contact_radius_mm = (edge / std::f64::consts::PI).sqrt();
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
        state.field = Field::Elastic(field);
    }
}
