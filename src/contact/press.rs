//! Contact and springs in balance.
//!
//! The unknowns are the platform's displacement and, where a force is asked for, the object's way along its
//! approach; the equations say that the springs carry the contact's wrench, and that its force is the one asked
//! for ([`super::trials`]).

use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use super::geometric::{Placed, deepest, deepest_from};
use super::trials::Task;
use super::{Contact, ContactError, ContactState, Indenter};
use domecast_optics::numeric::Rigid;
use domecast_springs::{Displacement, Suspension, Wrench};

/// How a balance ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PressStatus {
    /// Balanced, every spring within its travel.
    Balanced,
    /// Balanced, but this spring (by number) is pressed beyond its coils: the true platform stops there.
    SpringsBind {
        /// Number of the spring, from 0.
        spring: usize,
    },
    /// The bound on iterations, or the end of the springs' law, was reached with this residual, N.
    NotBalanced {
        /// Residual, N (moments counted over the springs' reach).
        residual_n: f64,
    },
}

/// An object pressed on the sprung dome.
#[derive(Debug, Clone, PartialEq)]
pub struct Pressed {
    /// Where the platform is.
    pub rest_from_platform: Rigid,
    /// Where the object is.
    pub rest_from_object: Rigid,
    /// The contact, in the moved sensor frame.
    pub state: ContactState,
    /// What the contact puts on the platform: rest frame, about [`Suspension::at_mm`].
    pub wrench: Wrench,
    /// What the balance is off, N (moments counted over the springs' reach).
    pub residual_n: f64,
    /// Contact solves.
    pub iterations: u32,
    /// How the balance ended.
    pub status: PressStatus,
    /// Derivative of the residual, as the search knew it at last: a start for the next frame's.
    pub(super) learnt: Option<DMatrix<f64>>,
}

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

/// An object counts as met when it is this near, as a part of the radius: closer than a search along its edges comes.
const MET: f64 = 1e-4;
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
        task.run(start(suspension, before, 6), before.and_then(|pressed| pressed.learnt.as_ref()))
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
        let way = approach
            .try_normalize()
            .ok_or_else(|| ContactError::BadPose(format!("{approach} is no direction of approach")))?;
        let force_n = super::error::positive("force_n", force_n)?;
        rest_from_object.check().map_err(|error| ContactError::BadPose(error.to_string()))?;
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
        x[6] = match before {
            // Where the object was, as far as it lies on this way.
            Some(pressed) if !pressed.state.nodes.is_empty() => {
                (pressed.rest_from_object.translation_mm - rest_from_object.translation_mm).dot(way)
            }
            _ => {
                self.touch_mm(indenter, &platform, rest_from_object, way)?
                    + self.first_depth_mm(indenter, force_n)
            }
        };
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

    /// How far the object goes along a way until it touches the dome at a platform's pose.
    pub(super) fn touch_mm(
        &self,
        indenter: &Indenter,
        platform: &Rigid,
        rest_from_object: &Rigid,
        way: DVec3,
    ) -> Result<f64, ContactError> {
        let radius = self.elastomer().dome_radius_mm;
        let (mut gone, mut near_mm) = (0.0, None);
        // The distance is a safe step forwards; from inside, its depth is one backwards.
        for _ in 0..64 {
            let mut object = *rest_from_object;
            object.translation_mm += way * gone;
            let placed = Placed::new(indenter.solid.clone(), platform.inverse().compose(&object));
            let (at_mm, distance_mm, _) = match near_mm {
                // From one step to the next the nearest place hardly moves; what it is taken for is checked at last.
                Some(near_mm) => deepest_from(&placed, radius, near_mm),
                None => deepest(&placed, radius),
            };
            gone += distance_mm;
            if distance_mm.abs() < MET * radius {
                if near_mm.is_none() {
                    return Ok(gone);
                }
                near_mm = None;
                continue;
            }
            near_mm = Some(at_mm);
            if gone.abs() > 1e3 * radius {
                break;
            }
        }
        Err(ContactError::BadPose(format!("the object does not meet the dome along {way}")))
    }

    /// Hertz' depth for the force of a ball of the object's size: a start, no result.
    fn first_depth_mm(&self, indenter: &Indenter, force_n: f64) -> f64 {
        let elastomer = self.elastomer();
        let modulus = elastomer.plane_strain_mpa() / (1.0 + indenter.yield_ratio(elastomer));
        let curvature = 1.0 / elastomer.dome_radius_mm + 1.0 / indenter.solid.bounding_sphere().1;
        let depth = (0.75 * force_n / modulus * curvature.sqrt()).powf(2.0 / 3.0);
        depth.min(0.2 * elastomer.dome_radius_mm)
    }
}
