//! One contact beside others: what else bears on the dome moves its surface before an object meets it.

use std::sync::Arc;

use glam::DVec3;

use crate::contact::{Contact, Prepared};
use crate::elastomer::Indenter;
use crate::error::ContactError;
use crate::field::Field;
use crate::missed::missed;
use crate::object::{Placed, deepest};
use crate::outcome::Status;
use crate::state::ContactState;
use domecast_elastic::{Compliance, NodeParts, SurfaceField};
use domecast_optics::numeric::Rigid;

/// Nodes this far from an object, as a part of the dome's radius, cannot be touched by it.
const NEAR: f64 = 0.3;
/// A level that takes contacts one by one sees what others move as one shift of the object; what that leaves out may be
/// this part of the object's depth.
const MAX_UNEVEN: f64 = 0.1;

/// What moves the dome besides an object: other contacts, and what a slow gel remembers.
#[derive(Debug, Clone)]
pub struct Beside(pub(crate) Field);

impl Default for Beside {
    fn default() -> Self {
        Self(Field::Still)
    }
}

impl Beside {
    /// Other contacts and what was there before them.
    pub(crate) fn with<'s>(&self, states: impl Iterator<Item = &'s ContactState>) -> Self {
        let parts: Vec<(f64, &Field)> =
            std::iter::once(&self.0).chain(states.map(|s| &s.field)).map(|f| (1.0, f)).collect();
        Self(Field::sum(&parts))
    }

    /// Whether nothing moves.
    pub fn is_still(&self) -> bool {
        self.0 == Field::Still
    }

    /// The displacement of a point of the dome, sensor frame, mm.
    pub fn at(&self, at_mm: DVec3) -> DVec3 {
        self.0.at(at_mm)
    }

    /// The nodes' forces that it comes of, where it is of finite elements alone.
    fn forces(&self) -> Option<&[(usize, DVec3)]> {
        match &self.0 {
            Field::Still => Some(&[]),
            Field::Elastic(field) => Some(field.forces()),
            _ => None,
        }
    }
}

impl Contact {
    /// [`Contact::solve`] on a dome that others move, too. The linear level has their displacement at each of its nodes:
    /// solved in turn until nothing changes, contacts are those of one problem with all of them. The other levels see
    /// it as one shift of the object.
    ///
    /// # Errors
    /// As [`Contact::solve`]; [`ContactError::TooNear`] where a level that takes contacts one by one would leave out more than
    /// a tenth of the depth.
    pub fn solve_beside(
        &self,
        indenter: &Indenter,
        sensor_from_object: &Rigid,
        before: Option<&ContactState>,
        beside: &Beside,
    ) -> Result<ContactState, ContactError> {
        let was_still = before.is_none_or(|before| before.beside == Field::Still);
        if beside.is_still() && was_still {
            return self.solve(indenter, sensor_from_object, before);
        }
        let mut state = match (&self.prepared, beside.forces()) {
            (Prepared::Compliance(compliance), Some(forces)) => {
                self.on_moved_nodes(compliance, (indenter, sensor_from_object), before, forces, beside)?
            }
            _ => self.shifted(indenter, sensor_from_object, before, beside)?,
        };
        state.beside = beside.0.clone();
        Ok(state)
    }

    /// The linear level on nodes that lie elsewhere.
    fn on_moved_nodes(
        &self,
        compliance: &Compliance,
        (indenter, sensor_from_object): (&Indenter, &Rigid),
        before: Option<&ContactState>,
        forces: &[(usize, DVec3)],
        beside: &Beside,
    ) -> Result<ContactState, ContactError> {
        let (center, reach_mm) = indenter.solid.bounding_sphere();
        let center_mm = sensor_from_object.point(center);
        let near_mm = reach_mm + NEAR * self.elastomer().dome_radius_mm;
        let moved = compliance.displaced(forces, |at_mm| at_mm.distance(center_mm) < near_mm);
        let sharing = 1.0 + indenter.yield_ratio(self.elastomer());
        let before = before.map(|before| own_alone(before, compliance, beside, sharing));
        let grid = &moved.grid;
        let offset = |number: usize| -> DVec3 {
            let parts: NodeParts = moved.places.parts(grid, number);
            parts.as_slice().iter().map(|(node, share)| grid.offset(*node) * *share).sum()
        };
        let contact = self.with_prepared(Prepared::Compliance(Arc::new(moved.clone())));
        // The dome at rest reaches into the object; moved, it may not.
        let free = || {
            let placed = Placed::new(indenter.solid.clone(), *sensor_from_object);
            let (at_mm, _, _) = deepest(&placed, self.elastomer().dome());
            let shift_mm = beside.at(at_mm);
            let mut pose = *sensor_from_object;
            pose.translation_mm -= shift_mm;
            let deviation = missed(self.elastomer(), indenter, &pose, grid.spacing_mm(), (0.0, 0.0));
            (-placed.distance(at_mm + shift_mm).0, deviation)
        };
        match contact.solve(indenter, sensor_from_object, before.as_ref()) {
            Ok(state) if state.status == Status::Free => Ok(ContactState { deviation: free().1, ..state }),
            Ok(mut state) => {
                // Nodes are named by where they lie at rest, as those of a dome that nothing else moves.
                for (node, memory) in state.nodes.iter_mut().zip(&state.history.nodes) {
                    node.at_mm -= offset(memory.node as usize);
                }
                Ok(state)
            }
            Err(ContactError::Unseen { depth_mm, spacing_mm }) => {
                let (reaches_mm, deviation) = free();
                if reaches_mm < 0.5 * spacing_mm {
                    return Ok(ContactState { deviation, ..ContactState::free(sensor_from_object) });
                }
                Err(ContactError::Unseen { depth_mm, spacing_mm })
            }
            Err(error) => Err(error),
        }
    }

    /// A level that knows no other contact: the object is nearer or farther by what the others move the dome under it.
    fn shifted(
        &self,
        indenter: &Indenter,
        sensor_from_object: &Rigid,
        before: Option<&ContactState>,
        beside: &Beside,
    ) -> Result<ContactState, ContactError> {
        let dome = self.elastomer().dome();
        let mut pose = *sensor_from_object;
        let (at_mm, _, _) = deepest(&Placed::new(indenter.solid.clone(), pose), dome);
        let shift_mm = beside.at(at_mm);
        pose.translation_mm -= shift_mm;
        let state = self.solve(indenter, &pose, before)?;
        let depth_mm = -deepest(&Placed::new(indenter.solid.clone(), pose), dome).1;
        let uneven = |at_mm: DVec3| beside.at(at_mm).distance(shift_mm);
        let moved_mm = state.nodes.iter().map(|node| uneven(node.at_mm)).fold(0.0, f64::max);
        if moved_mm > MAX_UNEVEN * depth_mm.max(0.0) {
            return Err(ContactError::TooNear { moved_mm, depth_mm });
        }
        Ok(state)
    }
}

/// A state of the frame before as the linear level must see it: nodes that stick are carried by the object less what
/// others have moved them since.
fn own_alone(before: &ContactState, compliance: &Compliance, beside: &Beside, sharing: f64) -> ContactState {
    let mut own = before.clone();
    let since = Field::sum(&[(1.0, &before.beside), (-1.0, &beside.0)]);
    let Field::Elastic(field) = &since else { return own };
    for memory in &mut own.history.nodes {
        memory.displacement_mm += moved_mm(compliance, field, memory.node as usize);
    }
    own.field = Field::sum(&[(1.0, &before.field), (1.0 / sharing, &since)]);
    own
}

/// What the forces of a field move a node or place, as the nodes see it, mm.
fn moved_mm(compliance: &Compliance, field: &SurfaceField, number: usize) -> DVec3 {
    let grid = &compliance.grid;
    let of_node = |number: usize| -> DVec3 {
        let node = grid.node(number);
        let moved: DVec3 =
            field.forces().iter().map(|(by, f)| compliance.between(node, grid.node(*by)) * *f).sum();
        grid.frame(node) * moved
    };
    compliance.places.parts(grid, number).as_slice().iter().map(|(node, share)| of_node(*node) * *share).sum()
}
