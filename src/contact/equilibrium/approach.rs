//! An approach: whether it can be pressed along, how far an object goes until it touches, and how far it was.

use glam::DVec3;

use super::pressed::Pressed;
use crate::elastomer::Indenter;
use crate::error::{ContactError, positive};
use crate::object::{Placed, deepest, deepest_from};
use crate::state::ContactState;
use domecast_optics::DomeShape;
use domecast_optics::numeric::Rigid;

/// An object counts as met when it is this near, as a part of the radius: closer than a search along its edges comes.
const MET: f64 = 1e-4;
/// How far the object goes along a way until it touches the dome at a platform's pose.
pub(super) fn touch_mm(
    dome: DomeShape,
    indenter: &Indenter,
    platform: &Rigid,
    rest_from_object: &Rigid,
    way: DVec3,
) -> Result<f64, ContactError> {
    let radius = dome.radius_mm();
    let (mut gone, mut near_mm) = (0.0, None);
    // The distance is a safe step forwards; from inside, its depth is one backwards.
    for _ in 0..64 {
        let mut object = *rest_from_object;
        object.translation_mm += way * gone;
        let placed = Placed::new(indenter.solid.clone(), platform.inverse().compose(&object));
        let (at_mm, distance_mm, _) = match near_mm {
            // From one step to the next the nearest place hardly moves; what it is taken for is checked at last.
            Some(near_mm) => deepest_from(&placed, dome, near_mm),
            None => deepest(&placed, dome),
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

/// The unit direction of an approach, and its force, both fit to be pressed with from that pose.
pub(super) fn checked_press(
    rest_from_object: &Rigid,
    approach: DVec3,
    force_n: f64,
) -> Result<(DVec3, f64), ContactError> {
    let way = approach
        .try_normalize()
        .ok_or_else(|| ContactError::BadPose(format!("{approach} is no direction of approach")))?;
    let force_n = positive("force_n", force_n)?;
    rest_from_object.check().map_err(|error| ContactError::BadPose(error.to_string()))?;
    Ok((way, force_n))
}

/// How far the object had gone along a way when it last touched, mm.
pub(super) fn gone_before_mm(before: Option<&Pressed>, rest_from_object: &Rigid, way: DVec3) -> Option<f64> {
    let pressed = before?;
    gone_on_mm(&pressed.state, &pressed.rest_from_object, rest_from_object, way)
}

/// The same of a contact and where its object was.
pub(super) fn gone_on_mm(
    state: &ContactState,
    was_rest_from_object: &Rigid,
    rest_from_object: &Rigid,
    way: DVec3,
) -> Option<f64> {
    let touched = !state.nodes.is_empty();
    touched.then(|| (was_rest_from_object.translation_mm - rest_from_object.translation_mm).dot(way))
}
