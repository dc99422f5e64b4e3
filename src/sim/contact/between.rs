//! The touched dome at times between frames.

use glam::DVec3;

use crate::contact::stepper::Touch;
use crate::scene::State;
use domecast_contact::{ContactState, Extent};
use domecast_optics::DomeShape;
use domecast_optics::numeric::Rigid;
use domecast_springs::Displacement;

/// The touched dome in a frame, and in the ones before and after it.
#[derive(Debug, Clone)]
pub struct Around {
    /// The frame before, or the frame itself where it is the first.
    pub before: Touch,
    /// The frame.
    pub now: Touch,
    /// The frame after, or the frame itself where it is the last.
    pub after: Touch,
}

impl Around {
    /// About one frame of a sequence.
    pub fn of(touches: &[Touch], index: usize) -> Option<Self> {
        let now = touches.get(index)?.clone();
        let before = index.checked_sub(1).and_then(|i| touches.get(i)).unwrap_or(&now).clone();
        let after = touches.get(index + 1).unwrap_or(&now).clone();
        Some(Self { before, now, after })
    }

    /// At a time of so many frames after the frame.
    pub(crate) fn at(&self, frames: f64) -> Between {
        if frames < 0.0 {
            let part = (1.0 + frames).clamp(0.0, 1.0);
            Between { from: self.before.clone(), to: self.now.clone(), part }
        } else if frames > 0.0 {
            Between { from: self.now.clone(), to: self.after.clone(), part: frames.clamp(0.0, 1.0) }
        } else {
            Between::at_frame(self.now.clone())
        }
    }
}

/// The dome at a time between two frames: shape and pose in between, too.
#[derive(Debug, Clone)]
pub struct Between {
    /// The frame before.
    pub from: Touch,
    /// The frame after.
    pub to: Touch,
    /// How far between, 0 to 1.
    pub part: f64,
}

impl Between {
    /// The frame itself.
    pub fn at_frame(touch: Touch) -> Self {
        Self { from: touch.clone(), to: touch, part: 0.0 }
    }

    /// Pose and load of the platform.
    pub fn state(&self, about_mm: DVec3) -> State {
        if self.part == 0.0 {
            return self.from.state.clone();
        }
        let [a, b] = [&self.from.state, &self.to.state];
        let [da, db] = [a, b].map(|state| Displacement::of_pose(&state.pose, about_mm));
        let pose: Rigid = Displacement {
            translation_mm: da.translation_mm.lerp(db.translation_mm, self.part),
            rotation_rad: da.rotation_rad.lerp(db.rotation_rad, self.part),
        }
        .to_pose(about_mm);
        let mut wrench = a.wrench;
        wrench.force_n = a.wrench.force_n.lerp(b.wrench.force_n, self.part);
        wrench.moment_nmm = a.wrench.moment_nmm.lerp(b.wrench.moment_nmm, self.part);
        State { pose, wrench, held: a.held.clone() }
    }

    /// Whether the membrane is out of shape.
    pub fn is_deformed(&self) -> bool {
        self.parts().into_iter().any(|(_, weight)| weight > 0.0)
    }

    /// The contact states with their weights; weight 0 where there is none.
    fn parts(&self) -> [(Option<&ContactState>, f64); 2] {
        let of =
            |touch: &'_ Touch, weight: f64| -> f64 { if touch.contact.is_some() { weight } else { 0.0 } };
        [
            (self.from.contact.as_deref(), of(&self.from, 1.0 - self.part)),
            (self.to.contact.as_deref(), of(&self.to, self.part)),
        ]
    }

    /// Displacements of points of the undeformed dome, sensor frame, mm.
    pub fn displacements_mm(&self, at_mm: &[DVec3]) -> Vec<DVec3> {
        let mut sum = vec![DVec3::ZERO; at_mm.len()];
        let mut one = vec![DVec3::ZERO; at_mm.len()];
        for (contact, weight) in self.parts() {
            let Some(contact) = contact.filter(|_| weight > 0.0) else { continue };
            // The slices have one length.
            if contact.displacements_mm(at_mm, &mut one).is_ok() {
                sum.iter_mut().zip(&one).for_each(|(sum, u)| *sum += *u * weight);
            }
        }
        sum
    }

    /// The pressed part of the dome: direction of its middle from the sphere's centre and half the angle of a cap about it;
    /// `None` where nothing bears a load.
    pub fn pressed_cap(&self, dome: DomeShape) -> Option<(DVec3, f64)> {
        pressed_cap(self.contacts(), dome)
    }

    /// The region that moves: direction of its middle, half its angle, and the most that anything moves outside.
    pub fn extents(&self) -> Vec<Extent> {
        extents(self.contacts())
    }

    fn contacts(&self) -> impl Iterator<Item = &ContactState> + Clone {
        self.parts().into_iter().filter(|(_, weight)| *weight > 0.0).filter_map(|(contact, _)| contact)
    }
}

/// The cap that holds what bears a load in any of some contacts: direction of its middle, half its angle.
pub(crate) fn pressed_cap<'c>(
    contacts: impl Iterator<Item = &'c ContactState> + Clone,
    dome: DomeShape,
) -> Option<(DVec3, f64)> {
    let nodes =
        || contacts.clone().flat_map(|contact| &contact.nodes).map(|node| node.at_mm - dome.center_mm());
    let middle = nodes().map(DVec3::normalize_or_zero).sum::<DVec3>().try_normalize()?;
    let angle_of = |at: DVec3| middle.dot(at.normalize_or(middle)).clamp(-1.0, 1.0).acos();
    Some((middle, nodes().map(angle_of).fold(0.0, f64::max)))
}

/// The regions that move in some contacts.
pub(crate) fn extents<'c>(contacts: impl Iterator<Item = &'c ContactState>) -> Vec<Extent> {
    contacts.map(ContactState::extent).collect()
}
