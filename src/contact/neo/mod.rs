//! The reference: neo-Hookean bricks, Newton's method, contact by the same candidates as the linear level.
//!
//! At each Newton step the tangent is factored and condensed on the candidates: their displacements are an offset
//! (the step that balances the elements without contact) and the tangent's compliance times the contact forces.
//! [`Touch`] finds the forces on the object's true surface; the step is taken as far as no brick collapses and the
//! balance improves.

mod body;
mod brick;
mod mesh;

use std::sync::Arc;

use faer::Mat;
use glam::DVec3;

use super::elastomer::{Elastomer, Indenter};
use super::error::ContactError;
use super::fem::Parts;
use super::field::Field;
use super::geometric::{Placed, deepest};
use super::local::DEEPEST;
use super::state::{ContactState, Extent, Status};
use super::touch::{Candidate, Rounds, Spot, Touch, Way, check_seen};
pub(super) use body::Body;
use domecast_optics::numeric::Rigid;

#[cfg(test)]
mod tests;

/// Newton steps.
const MOST_NEWTON: u32 = 40;
/// The elements are in balance when no free node is off by more than this part of E R^2.
const BALANCED: f64 = 1e-10;

/// The displacement of the surface nodes.
#[derive(Debug, Clone)]
pub(crate) struct BrickField {
    body: Arc<Body>,
    u_mm: Vec<DVec3>,
}

impl PartialEq for BrickField {
    fn eq(&self, other: &Self) -> bool {
        self.u_mm == other.u_mm
    }
}

impl BrickField {
    /// Displacement of a point of the dome, bilinear between the nodes.
    pub fn at(&self, at_mm: DVec3) -> DVec3 {
        self.body.mesh.surround(at_mm).iter().map(|(node, weight)| self.u_mm[*node] * *weight).sum()
    }

    /// The whole dome may move, by no more than its most moved node.
    pub fn extent(&self) -> Extent {
        let beyond_mm = self.u_mm.iter().map(|u| u.length()).fold(0.0, f64::max);
        Extent { direction: DVec3::Z, angle_rad: std::f64::consts::FRAC_PI_2, beyond_mm }
    }
}

/// One frame of the reference level. With `linearised`, the first step alone: small-strain elasticity on the same
/// bricks.
pub(super) fn neo_hookean(
    elastomer: &Elastomer,
    body: &Arc<Body>,
    indenter: &Indenter,
    sensor_from_object: &Rigid,
    before: Option<&ContactState>,
    linearised: bool,
) -> Result<ContactState, ContactError> {
    let radius = elastomer.dome_radius_mm;
    let placed = Placed::new(indenter.solid.clone(), *sensor_from_object);
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
    let mut touch = Touch::new(elastomer, placed.clone(), sharing);
    // All that can come to touch: the elements are large beside what an outer node bulges.
    let margin = 0.6 * largest_edge(body) + 0.15 * -distance_mm;
    for (number, (_, node, area_mm2)) in body.mesh.surface.iter().enumerate() {
        let at_mm = body.mesh.nodes_mm[*node as usize];
        if body.is_fixed(*node as usize) || placed.distance(at_mm).0 > margin {
            continue;
        }
        // A brick's corner has a displacement of its own: the gap is measured there.
        let parts = Parts::whole(number);
        let spot = Spot { node: number, parts, at_mm, area_mm2: *area_mm2, spread_mm: [DVec3::ZERO; 2] };
        touch.candidates.push(Candidate::new(spot, &placed, &way, sharing)?);
    }
    let (u_mm, ended, good) = newton(elastomer, body, &mut touch, &mut state, linearised);
    let steps = state.iterations;
    touch.finish(&mut state, ended);
    state.iterations = steps.max(1);
    // Also where nothing bears a force: bricks out of balance have no shape to be trusted.
    if !good {
        state.status = Status::BoundReached;
    }
    if state.status == Status::Free {
        check_seen(&placed, deepest_mm, largest_edge(body))?;
    }
    let surface = body.mesh.surface.iter().map(|(_, node, _)| u_mm[*node as usize]).collect();
    state.field = Field::Bricks(BrickField { body: Arc::clone(body), u_mm: surface });
    Ok(state)
}

fn largest_edge(body: &Body) -> f64 {
    body.mesh.surface.iter().map(|(_, _, area)| area.sqrt()).fold(0.0, f64::max)
}

/// Newton's method; gives the displacement, how the last contact rounds ended, and whether the bricks balance.
fn newton(
    elastomer: &Elastomer,
    body: &Arc<Body>,
    touch: &mut Touch<'_>,
    state: &mut ContactState,
    linearised: bool,
) -> (Vec<DVec3>, Rounds, bool) {
    let nodes = body.nodes();
    let surface = |candidate: &Candidate| body.mesh.surface[candidate.node].1 as usize;
    let mut u = vec![DVec3::ZERO; nodes];
    let mut forces = vec![DVec3::ZERO; touch.candidates.len()];
    let mut ended = Rounds { count: 0, moved_mm: f64::INFINITY, settled: false };
    let limit = BALANCED * elastomer.young_mpa * elastomer.dome_radius_mm.powi(2);
    let mut miss = f64::INFINITY;
    for step in 0..if linearised { 1 } else { MOST_NEWTON } {
        let (Some(inner), Some(factors)) = (body.inner(&u), body.factor(&u)) else { break };
        state.work += 40.0 * body.entries() as f64;
        // Columns: the balance without contact, then each candidate's three unit forces.
        let columns = 1 + 3 * touch.candidates.len();
        let mut rhs = Mat::<f64>::zeros(3 * nodes, columns);
        for (node, force) in inner.iter().enumerate() {
            if !body.is_fixed(node) {
                for (axis, value) in force.to_array().into_iter().enumerate() {
                    rhs[(3 * node + axis, 0)] = -value;
                }
            }
        }
        for (k, candidate) in touch.candidates.iter().enumerate() {
            for axis in 0..3 {
                rhs[(3 * surface(candidate) + axis, 1 + 3 * k + axis)] = 1.0;
            }
        }
        Body::solve(&factors, &mut rhs);
        state.work += (columns * body.entries()) as f64;
        condense(touch, &rhs, &u, body);
        ended = touch.run(0.0);
        let wanted: Vec<DVec3> = touch.candidates.iter().map(|c| c.force_n).collect();
        let direction: Vec<DVec3> = (0..nodes)
            .map(|node| {
                let row = |axis: usize| {
                    let mut sum = rhs[(3 * node + axis, 0)];
                    for (k, force) in wanted.iter().enumerate() {
                        for (b, value) in force.to_array().into_iter().enumerate() {
                            sum += rhs[(3 * node + axis, 1 + 3 * k + b)] * value;
                        }
                    }
                    sum
                };
                DVec3::new(row(0), row(1), row(2))
            })
            .collect();
        if linearised {
            return (direction, ended, true);
        }
        // The longest step that keeps every brick and does not lose the balance.
        let mut part = 1.0;
        let mut taken = None;
        while part > 1e-3 {
            let there: Vec<DVec3> = u.iter().zip(&direction).map(|(u, d)| *u + *d * part).collect();
            let load: Vec<DVec3> = forces.iter().zip(&wanted).map(|(a, b)| *a + (*b - *a) * part).collect();
            if let Some(off) = imbalance(body, touch, &there, &load)
                && (step == 0 || off < 2.0 * miss || off <= limit)
            {
                taken = Some((there, load, off));
                break;
            }
            part *= 0.5;
        }
        let Some((there, load, off)) = taken else { break };
        let moved = u.iter().zip(&there).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        (u, forces, miss) = (there, load, off);
        state.iterations = step + 1;
        if part == 1.0 && miss <= limit && moved <= 1e-7 * elastomer.dome_radius_mm {
            break;
        }
    }
    for (candidate, force) in touch.candidates.iter_mut().zip(&forces) {
        candidate.force_n = *force;
    }
    state.imbalance_n = Some(miss).filter(|miss| miss.is_finite());
    let good = miss <= limit;
    (u, ended, good)
}

/// Offsets and compliance of the candidates from the solved columns: where they go as the elements balance without
/// contact, and what the contact's whole forces add.
fn condense(touch: &mut Touch<'_>, rhs: &Mat<f64>, u: &[DVec3], body: &Body) {
    let n = touch.candidates.len();
    let width = 3 * n;
    touch.blocks = vec![0.0; width * width];
    let nodes: Vec<usize> = touch.candidates.iter().map(|c| body.mesh.surface[c.node].1 as usize).collect();
    let sharing = touch.sharing;
    for (i, node) in nodes.iter().enumerate() {
        let at = |axis: usize, column: usize| rhs[(3 * node + axis, column)];
        touch.candidates[i].offset_mm = u[*node] + DVec3::new(at(0, 0), at(1, 0), at(2, 0));
        for axis in 0..3 {
            for column in 0..width {
                touch.blocks[(3 * i + axis) * width + column] = at(axis, 1 + column);
            }
        }
    }
    if sharing > 1.0 {
        // The object yields as the dome's surface does, without the dome's own bending.
        for value in &mut touch.blocks {
            *value *= sharing;
        }
    }
}

/// Largest force by which a free node is off.
fn imbalance(body: &Body, touch: &Touch<'_>, u: &[DVec3], load: &[DVec3]) -> Option<f64> {
    let mut inner = body.inner(u)?;
    for (candidate, force) in touch.candidates.iter().zip(load) {
        inner[body.mesh.surface[candidate.node].1 as usize] -= *force;
    }
    let off = inner.iter().enumerate().filter(|(node, _)| !body.is_fixed(*node));
    Some(off.map(|(_, force)| force.length()).fold(0.0, f64::max))
}
