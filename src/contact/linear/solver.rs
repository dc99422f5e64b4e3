//! The linear level: the elastic dome's own compliance under unilateral contact with Coulomb friction.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::beyond::Beyond;
use super::candidate::{Candidate, Spot, Way, check_seen};
use super::faces::{Faces, fine};
use super::rounds::{PENETRATION, Rounds, Touch};
use crate::elastomer::{Elastomer, Indenter};
use crate::error::ContactError;
use crate::field::Field;
use crate::level::DEEPEST;
use crate::object::{Placed, deepest, deepest_from};
use crate::outcome::Status;
use crate::state::ContactState;
use domecast_elastic::{Compliance, GridNode, NodeParts, SurfaceField};
use domecast_optics::numeric::Rigid;

/// Looks for nodes that no plane held back.
const MAX_LOOKS: u32 = 8;

/// One frame of the linear level, for one pose or for the many poses of a balance: nodes, their compliance and their
/// forces stay from pose to pose.
pub(crate) struct Solver<'a> {
    elastomer: &'a Elastomer,
    compliance: &'a Arc<Compliance>,
    before: Option<&'a ContactState>,
    touch: Touch<'a>,
    /// Object, place of the deepest node, and the margin that the candidates were chosen for.
    looked: Option<(Rigid, DVec3, f64)>,
    /// What takes part instead of the nodes near by where the object is finer than they are.
    fine: Option<Faces>,
    beyond: Beyond,
}

impl<'a> Solver<'a> {
    /// A solver for an object; `before` is the state of the frame before.
    pub fn new(
        elastomer: &'a Elastomer,
        compliance: &'a Arc<Compliance>,
        indenter: &Indenter,
        before: Option<&'a ContactState>,
    ) -> Self {
        let placed = Placed::new(indenter.solid.clone(), Rigid::identity());
        let touch = Touch::new(elastomer, placed, 1.0 + indenter.yield_ratio(elastomer));
        Self { elastomer, compliance, before, touch, looked: None, fine: None, beyond: Beyond::default() }
    }

    /// The contact at a pose, until nothing moves by more than `tolerance_mm`. Only with `whole` are nodes looked for
    /// that were pressed in beside the candidates.
    pub fn solve(
        &mut self,
        sensor_from_object: &Rigid,
        tolerance_mm: f64,
        whole: bool,
    ) -> Result<ContactState, ContactError> {
        let solved = self.solve_at(sensor_from_object, tolerance_mm, whole);
        if solved.is_err() {
            // Nodes that were chosen halfway have no compliance: the next pose starts anew.
            self.looked = None;
            self.touch.candidates.clear();
        }
        solved
    }

    fn solve_at(
        &mut self,
        sensor_from_object: &Rigid,
        tolerance_mm: f64,
        whole: bool,
    ) -> Result<ContactState, ContactError> {
        self.touch.placed.move_to(*sensor_from_object);
        let mut state = ContactState::free(sensor_from_object);
        let near = self.is_near(sensor_from_object);
        if !near && !self.look_anew()? {
            state.work = self.touch.work;
            return Ok(state);
        }
        let way = self.way(near);
        if near {
            for candidate in &mut self.touch.candidates {
                candidate.carried_mm = way.carried(&self.touch.placed, candidate);
                candidate.follow_face(sensor_from_object);
            }
        } else {
            let chosen = self.choose();
            self.add(&chosen, &way)?;
        }
        let mut ended = self.touch.run(tolerance_mm);
        if near && self.touch.candidates.iter().all(|c| c.force_n == DVec3::ZERO) {
            // Lost, or met elsewhere.
            self.looked = None;
            return self.solve_at(sensor_from_object, tolerance_mm, whole);
        }
        if !whole {
            // A trial's forces are all that its balance looks at: no field.
            self.touch.finish(&mut state, ended);
            if state.status == Status::Free {
                self.check_seen()?;
            }
            return Ok(state);
        }
        let mut field = self.field();
        for look in 0..if self.fine.is_none() { MAX_LOOKS } else { 0 } {
            let missed = self.missed(&field);
            if missed.is_empty() {
                break;
            }
            self.add(&missed, &way)?;
            ended = self.touch.run(tolerance_mm);
            field = self.field();
            // The last ones were not looked at again.
            ended.converged &= look + 1 < MAX_LOOKS;
        }
        let state = self.state(state, ended, field);
        if state.status == Status::Free {
            self.check_seen()?;
        }
        Ok(state)
    }

    /// Where nothing bears a force, the object must not reach far into the dome.
    fn check_seen(&self) -> Result<(), ContactError> {
        let Some((_, deepest_mm, spacing_mm)) = self.looked else { return Ok(()) };
        check_seen(&self.touch.placed, self.elastomer.dome(), deepest_mm, spacing_mm)
    }

    fn state(&self, mut state: ContactState, ended: Rounds, field: SurfaceField) -> ContactState {
        self.touch.finish(&mut state, ended);
        state.work += field.work();
        if state.status != Status::Free {
            state.field = Field::Elastic(field);
            state.bearing = Field::Elastic(self.field_of(|candidate| candidate.force_n));
        }
        state
    }

    /// Whether the candidates chosen for another pose serve this one.
    fn is_near(&self, sensor_from_object: &Rigid) -> bool {
        let Some((looked, at_mm, margin_mm)) = &self.looked else { return false };
        let moved = sensor_from_object.compose(&looked.inverse());
        let turn = domecast_optics::numeric::vector_from_rotation(&moved.rotation).length();
        let way = moved.point(*at_mm).distance(*at_mm) + turn * 0.5 * self.elastomer.dome_radius_mm;
        !self.touch.candidates.is_empty() && way < 0.5 * margin_mm
    }

    /// Looks for the deepest point; false if nothing touches.
    fn look_anew(&mut self) -> Result<bool, ContactError> {
        let placed = &self.touch.placed;
        let (deepest_mm, distance_mm, queries) = deepest(placed, self.elastomer.dome());
        self.touch.work += 30.0 * queries as f64;
        let limit_mm = DEEPEST * self.elastomer.depth_scale_mm();
        if -distance_mm > limit_mm {
            return Err(ContactError::TooDeep { depth_mm: -distance_mm, limit_mm });
        }
        let spacing = self.compliance.grid.spacing_mm();
        self.looked = Some((placed.sensor_from_object(), deepest_mm, spacing));
        if distance_mm >= 0.0 {
            self.looked = None;
            self.touch.candidates.clear();
        }
        Ok(distance_mm < 0.0)
    }

    /// How the object came. Without a frame before, along the normal where it is deepest.
    fn way(&mut self, near: bool) -> Way<'a> {
        let dome = self.elastomer.dome();
        let placed = &self.touch.placed;
        let mut at_mm = self.looked.map_or(dome.pole_mm(), |looked| looked.1);
        let mut distance_mm = placed.distance(at_mm).0;
        if near && self.before.is_none() {
            let queries;
            (at_mm, distance_mm, queries) = deepest_from(placed, dome, at_mm);
            self.touch.work += 30.0 * queries as f64;
        }
        Way::new(placed, dome, self.before, (at_mm, distance_mm))
    }

    /// Candidates: nodes that touched before, and those that are likely to. Under an object that lies d deep, the
    /// dome gives way as far as about half of d (Hertz' edge lies there); what is wrongly left out is found later.
    fn choose(&mut self) -> Vec<usize> {
        let grid = &self.compliance.grid;
        let Some((_, deepest_mm, spacing)) = self.looked else { return Vec::new() };
        let queries;
        (self.fine, queries) = fine(&self.touch.placed, self.compliance);
        self.touch.work += 30.0 * queries;
        if let Some(fine) = &self.fine {
            let chosen: Vec<usize> = fine.keys().copied().collect();
            let sensor_from_object = self.touch.placed.sensor_from_object();
            self.touch.candidates.retain_mut(|candidate| {
                candidate.face = fine.get(&candidate.node).copied();
                candidate.follow_face(&sensor_from_object);
                candidate.face.is_some()
            });
            return chosen;
        }
        for candidate in &mut self.touch.candidates {
            candidate.face = None;
        }
        let depth_mm = -self.touch.placed.distance(deepest_mm).0;
        let max_mm = 0.25 * spacing - 0.45 * depth_mm;
        let mut chosen = self.nearer_than(max_mm);
        if let Some(before) = self.before {
            chosen.extend(before.history.nodes.iter().map(|memory| memory.node as usize));
        }
        // From another pose of this frame: those that bear a force now.
        chosen.extend(self.touch.candidates.iter().filter(|c| c.force_n != DVec3::ZERO).map(|c| c.node));
        chosen.sort_unstable();
        chosen.dedup();
        chosen.retain(|number| *number < grid.len());
        self.touch.candidates.retain(|c| chosen.binary_search(&c.node).is_ok());
        chosen
    }

    /// Nodes of the undeformed dome nearer to the object than a distance.
    fn nearer_than(&mut self, max_mm: f64) -> Vec<usize> {
        let grid = &self.compliance.grid;
        let mut near = Vec::new();
        for ring in 0..grid.elements {
            let count = grid.counts[ring];
            let around_mm = grid.dome.ring_radius_mm(grid.meridian_rad(ring)) * std::f64::consts::TAU;
            let step_mm = around_mm / count as f64;
            let mut k = 0;
            while k < count {
                let number = grid.first[ring] + k;
                let (distance, _) = self.touch.placed.distance(grid.place(grid.node(number)));
                self.touch.work += 30.0;
                if distance < max_mm {
                    near.push(number);
                    k += 1;
                } else {
                    // No node nearer than the distance's excess can be closer to the object.
                    k += if step_mm > 0.0 { (((distance - max_mm) / step_mm) as usize).max(1) } else { 1 };
                }
            }
        }
        near
    }

    /// Adds nodes to the candidates, and lays out their compliance.
    fn add(&mut self, numbers: &[usize], way: &Way<'_>) -> Result<(), ContactError> {
        let grid = &self.compliance.grid;
        let touch = &mut self.touch;
        for candidate in &mut touch.candidates {
            candidate.carried_mm = way.carried(&touch.placed, candidate);
        }
        let known: Vec<usize> = touch.candidates.iter().map(|c| c.node).collect();
        let mut last_ring = 0;
        for &number in numbers.iter().filter(|number| known.binary_search(number).is_err()) {
            let parts = self.compliance.places.parts(grid, number);
            last_ring =
                parts.as_slice().iter().fold(last_ring, |last, (node, _)| last.max(grid.node(*node).ring));
            let area = |&(node, part): &(usize, f64)| part * grid.areas_mm2[grid.node(node).ring];
            let area_mm2 = parts.as_slice().iter().map(area).sum();
            let spread_mm =
                if number < grid.len() { grid.spread(grid.node(number)) } else { [DVec3::ZERO; 2] };
            let at_mm = self.compliance.places.place(grid, number);
            let mut beyond = DMat3::ZERO;
            for &(node, share) in parts.as_slice() {
                beyond += self.beyond.at(self.compliance, touch.sharing - 1.0, node)? * share;
            }
            let spot = Spot { node: number, parts, at_mm, area_mm2, spread_mm, beyond };
            let mut candidate = Candidate::new(spot, touch.elastomer, &touch.placed, way, touch.sharing)?;
            candidate.face = self.fine.as_ref().and_then(|fine| fine.get(&number)).copied();
            candidate.follow_face(&touch.placed.sensor_from_object());
            touch.candidates.push(candidate);
        }
        touch.candidates.sort_by_key(|candidate| candidate.node);
        self.compliance.reach(last_ring)?;
        self.fill_blocks()
    }

    fn fill_blocks(&mut self) -> Result<(), ContactError> {
        let touch = &mut self.touch;
        let n = touch.candidates.len();
        let width = 3 * n;
        let grid = &self.compliance.grid;
        // The nodes that take part, in order, and the compliance between them.
        let mut numbers: Vec<usize> = Vec::with_capacity(n);
        numbers.extend(touch.candidates.iter().flat_map(|c| c.parts.as_slice()).map(|(number, _)| *number));
        numbers.sort_unstable();
        numbers.dedup();
        let sharing = touch.sharing;
        let mut framed: Vec<(GridNode, DMat3, DMat3)> = Vec::with_capacity(numbers.len());
        for &number in &numbers {
            let node = grid.node(number);
            let beyond = self.beyond.at(self.compliance, sharing - 1.0, number)?;
            framed.push((node, grid.frame(node), beyond * 0.5));
        }
        let compliance = self.compliance;
        let between = |i: usize, j: usize| {
            let ((at, frame, beyond), (by, other, and)) = (&framed[i], &framed[j]);
            *frame * compliance.between(*at, *by) * other.transpose() * sharing + *beyond + *and
        };
        touch.blocks.clear();
        touch.blocks.resize(width * width, 0.0);
        let blocks = &mut touch.blocks;
        let mut lay = |i: usize, j: usize, block: DMat3| {
            let block = block.to_cols_array();
            for row in 0..3 {
                for column in 0..3 {
                    let value = block[3 * column + row];
                    blocks[(3 * i + row) * width + 3 * j + column] = value;
                    blocks[(3 * j + column) * width + 3 * i + row] = value;
                }
            }
        };
        if touch.candidates.iter().all(|c| c.parts == NodeParts::whole(c.node)) {
            // Nodes alone: each is its own list's.
            for i in 0..n {
                for j in 0..i {
                    lay(i, j, between(i, j));
                }
                lay(i, i, between(i, i).transpose());
            }
        } else {
            let nodes = numbers.len();
            let mut table = vec![DMat3::ZERO; nodes * nodes];
            for i in 0..nodes {
                for j in 0..=i {
                    let block = between(i, j);
                    table[i * nodes + j] = block;
                    table[j * nodes + i] = block.transpose();
                }
            }
            // Each candidate's shares by the nodes' places in that list.
            let place = |(number, share): (usize, f64)| (numbers.binary_search(&number).unwrap_or(0), share);
            let shares: Vec<NodeParts> = touch.candidates.iter().map(|c| c.parts.map(place)).collect();
            for i in 0..n {
                for j in 0..=i {
                    let mut block = DMat3::ZERO;
                    for (a, share_a) in shares[i].as_slice() {
                        for (b, share_b) in shares[j].as_slice() {
                            block += table[a * nodes + b] * (share_a * share_b);
                        }
                    }
                    lay(i, j, block);
                }
            }
        }
        touch.work += 60.0 * (n * n) as f64;
        Ok(())
    }

    /// What the forces move, turned back to how the dome lay at rest.
    fn field(&self) -> SurfaceField {
        self.field_of(Candidate::rest_force_n)
    }

    fn field_of(&self, force_n: impl Fn(&Candidate) -> DVec3) -> SurfaceField {
        let grid = &self.compliance.grid;
        let mut forces: BTreeMap<usize, DVec3> = BTreeMap::new();
        for candidate in self.touch.candidates.iter().filter(|c| c.force_n != DVec3::ZERO) {
            for &(node, share) in candidate.parts.as_slice() {
                let local = grid.frame(grid.node(node)).transpose() * (force_n(candidate) * share);
                *forces.entry(node).or_insert(DVec3::ZERO) += local;
            }
        }
        let forces = forces.into_iter().collect();
        SurfaceField::new(Arc::clone(self.compliance), forces)
    }

    /// Nodes beside the candidates that were pressed into the object.
    fn missed(&mut self, field: &SurfaceField) -> Vec<usize> {
        let max_mm = PENETRATION * self.elastomer.dome_radius_mm;
        let (_, beyond_mm) = self.touch.beyond();
        // A node beside moves less than the most moved candidate.
        let reach_mm = self.touch.candidates.iter().map(|c| c.u_mm.length()).fold(0.0, f64::max);
        let mut near = self.nearer_than(reach_mm);
        let (grid, touch) = (&self.compliance.grid, &mut self.touch);
        near.retain(|number| touch.candidates.binary_search_by_key(number, |c| c.node).is_err());
        touch.work += 60.0 * near.len() as f64;
        near.retain(|number| {
            let at = grid.place(grid.node(*number));
            touch.placed.distance(at + field.at(at) * touch.sharing + beyond_mm).0 < -max_mm
        });
        near
    }
}

/// One frame of the linear level.
pub(crate) fn linear(
    elastomer: &Elastomer,
    compliance: &Arc<Compliance>,
    indenter: &Indenter,
    sensor_from_object: &Rigid,
    before: Option<&ContactState>,
) -> Result<ContactState, ContactError> {
    Solver::new(elastomer, compliance, indenter, before).solve(sensor_from_object, 0.0, true)
}
