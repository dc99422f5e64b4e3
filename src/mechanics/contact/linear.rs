//! The linear level: the elastic dome's own compliance under unilateral contact with Coulomb friction.

use glam::{DMat3, DVec3};

use super::elastomer::{Elastomer, Indenter};
use super::error::ContactError;
use super::fem::{Compliance, SurfaceField};
use super::field::Field;
use super::geometric::{Placed, deepest};
use super::local::DEEPEST;
use super::state::ContactState;
use super::touch::{Candidate, PENETRATION, Touch, Way};
use crate::numeric::Rigid;

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
    let mut solver = Solver { compliance, touch: Touch::new(elastomer, &placed, sharing) };
    solver.look(&way, margin)?;
    let mut ended = solver.touch.run();
    // Nodes beyond the first choice that were pressed into the object join it.
    for _ in 0..4 {
        if !solver.widen(&way, margin)? {
            break;
        }
        ended = solver.touch.run();
    }
    let field = solver.field();
    solver.touch.finish(&mut state, ended);
    state.field = Field::Elastic(field);
    Ok(state)
}

struct Solver<'a> {
    compliance: &'a Compliance,
    touch: Touch<'a>,
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
                let (distance, _) = self.touch.placed.distance(grid.place(grid.node(number)));
                self.touch.work += 30.0;
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
        let touch = &mut self.touch;
        for &number in numbers {
            let node = grid.node(number);
            let place = (number, grid.place(node), grid.areas_mm2[node.ring], grid.spread(node));
            touch.candidates.push(Candidate::new(place, touch.placed, way, touch.sharing)?);
        }
        touch.candidates.sort_by_key(|candidate| candidate.node);
        self.fill_blocks();
        Ok(())
    }

    fn fill_blocks(&mut self) {
        let n = self.touch.candidates.len();
        let width = 3 * n;
        let grid = &self.compliance.grid;
        let frames: Vec<DMat3> =
            self.touch.candidates.iter().map(|candidate| grid.frame(grid.node(candidate.node))).collect();
        self.touch.blocks = vec![0.0; width * width];
        for i in 0..n {
            let at = grid.node(self.touch.candidates[i].node);
            for j in 0..=i {
                let by = grid.node(self.touch.candidates[j].node);
                let local = self.compliance.between(at, by);
                let block = frames[i] * local * frames[j].transpose() * self.touch.sharing;
                for row in 0..3 {
                    for column in 0..3 {
                        let value = block.col(column)[row];
                        self.touch.blocks[(3 * i + row) * width + 3 * j + column] = value;
                        self.touch.blocks[(3 * j + column) * width + 3 * i + row] = value;
                    }
                }
            }
        }
        self.touch.work += 60.0 * (n * n) as f64;
    }

    fn field(&mut self) -> SurfaceField {
        let grid = &self.compliance.grid;
        let forces: Vec<(usize, DVec3)> = self
            .touch
            .candidates
            .iter()
            .filter(|c| c.force_n != DVec3::ZERO)
            .map(|c| (c.node, grid.frame(grid.node(c.node)).transpose() * c.force_n))
            .collect();
        let field = SurfaceField::new(self.compliance, &forces);
        self.touch.work += field.work;
        field
    }

    /// Looks for nodes that no plane held back; adds them.
    fn widen(&mut self, way: &Way<'_>, margin: f64) -> Result<bool, ContactError> {
        let grid = &self.compliance.grid;
        let known: Vec<usize> = self.touch.candidates.iter().map(|c| c.node).collect();
        let mut near = Vec::new();
        let mut field = None;
        for number in 0..grid.len() {
            if known.binary_search(&number).is_ok() {
                continue;
            }
            let at = grid.place(grid.node(number));
            // Only what lies within a few margins can have been pressed in by the bulge.
            let (distance, _) = self.touch.placed.distance(at);
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
            let moved = at + field.at(at) * self.touch.sharing;
            if self.touch.placed.distance(moved).0 < -PENETRATION * self.touch.elastomer.dome_radius_mm {
                found.push(number);
            }
        }
        if found.is_empty() {
            return Ok(false);
        }
        self.add(&found, way)?;
        Ok(true)
    }
}
