//! Contact and springs in balance.
//!
//! The unknowns are the platform's displacement and, where a force is asked for, the object's way along its
//! approach; the equations say that the springs carry the contact's wrench, and that its force is the one asked
//! for ([`search`]).

mod approach;
mod held;
mod meeting;
mod predicted;
mod pressed;
mod roots;
mod search;
mod together;

use glam::DVec3;
use nalgebra::DVector;

use crate::contact::Contact;
use crate::elastomer::Indenter;
use crate::error::ContactError;
use approach::{checked_press, gone_before_mm, touch_mm};
use domecast_optics::numeric::Rigid;
use domecast_springs::{Displacement, Suspension};
use predicted::Predicting;
pub use pressed::{PressStatus, Pressed};
use search::Task;
pub use together::{PressedObject, PressedTogether, Push};

/// The platform's displacement of the frame before, as a start.
fn start(suspension: &Suspension, before: Option<&Pressed>, unknowns: usize) -> DVector<f64> {
    let mut x = DVector::zeros(unknowns);
    if let Some(pressed) = before {
        let then = Displacement::of_pose(&pressed.rest_from_platform, suspension.at_mm());
        for (i, value) in then.to_array().into_iter().enumerate() {
            x[i] = value;
        }
    }
    x
}

/// A load missed by more than this part of it is tried in steps.
const FAR_OFF: f64 = 1e-3;

impl Contact {
    /// The object held at a pose of the rest frame: where the platform comes to rest on its springs.
    ///
    /// # Errors
    /// As [`Contact::solve`], and where the springs have no force at rest. A balance that is not found, or binds
    /// the springs, is a [`PressStatus`].
    pub fn press(
        &self,
        indenter: &Indenter,
        suspension: &Suspension,
        rest_from_object: &Rigid,
        before: Option<&Pressed>,
    ) -> Result<Pressed, ContactError> {
        let task = Task {
            contact: self,
            indenter,
            suspension,
            rest_from_object: *rest_from_object,
            before: before.map(|pressed| &pressed.state),
            force: None,
        };
        let mut x = start(suspension, before, 6);
        if let Some(predicting) = Predicting::new(self, indenter, suspension, rest_from_object) {
            predicting.held(&mut x, before);
        }
        task.run(x, before.and_then(|pressed| pressed.learnt.as_ref()))
    }

    /// The object moved along `approach` (rest frame) from a start pose until the contact's force along it is
    /// `force_n`, the platform at rest on its springs.
    ///
    /// # Errors
    /// As [`Contact::press`]; [`ContactError::Dimension`] for a force that is not positive,
    /// [`ContactError::BadPose`] for an approach without direction.
    pub fn press_with_force(
        &self,
        indenter: &Indenter,
        suspension: &Suspension,
        rest_from_object: &Rigid,
        approach: DVec3,
        force_n: f64,
        before: Option<&Pressed>,
    ) -> Result<Pressed, ContactError> {
        let (way, force_n) = checked_press(rest_from_object, approach, force_n)?;
        let mut task = Task {
            contact: self,
            indenter,
            suspension,
            rest_from_object: *rest_from_object,
            before: before.map(|pressed| &pressed.state),
            force: Some((way, force_n)),
        };
        let mut x = start(suspension, before, 7);
        let platform = before.map_or(Rigid::identity(), |pressed| pressed.rest_from_platform);
        x[6] = match gone_before_mm(before, rest_from_object, way) {
            Some(gone_mm) => gone_mm,
            None => {
                touch_mm(self.elastomer().dome(), indenter, &platform, rest_from_object, way)?
                    + self.first_depth_mm(indenter, force_n)
            }
        };
        if let Some(predicting) = Predicting::new(self, indenter, suspension, rest_from_object) {
            predicting.forced(&mut x, (way, force_n), before);
        }
        // Loading in steps where the whole force is not found at once.
        let whole = task.run(x.clone(), before.and_then(|pressed| pressed.learnt.as_ref()))?;
        if !matches!(whole.status, PressStatus::NotBalanced { residual_n } if residual_n > FAR_OFF * force_n)
        {
            return Ok(whole);
        }
        let (mut best, mut iterations) = (whole, 0);
        for part in [0.1, 0.25, 0.45, 0.7, 1.0] {
            task.force = Some((way, force_n * part));
            let found = task.run(x.clone(), None)?;
            iterations += found.iterations;
            let then = Displacement::of_pose(&found.rest_from_platform, suspension.at_mm());
            for (i, value) in then.to_array().into_iter().enumerate() {
                x[i] = value;
            }
            x[6] = (found.rest_from_object.translation_mm - rest_from_object.translation_mm).dot(way);
            best = found;
        }
        best.iterations += iterations;
        Ok(best)
    }

    /// Hertz' depth for the force of a ball of the object's size: a start, no result.
    fn first_depth_mm(&self, indenter: &Indenter, force_n: f64) -> f64 {
        let elastomer = self.elastomer();
        let modulus = elastomer.plane_strain_mpa() / (1.0 + indenter.yield_ratio(elastomer));
        let curvature = 1.0 / elastomer.dome_radius_mm + 1.0 / indenter.solid.bounding_sphere().1;
        let depth = (0.75 * force_n / modulus * curvature.sqrt()).powf(2.0 / 3.0);
        depth.min(0.2 * elastomer.depth_scale_mm())
    }
}
