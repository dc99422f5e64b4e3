//! The geometric level: what lies inside the object is pushed out of it.
//!
//! A point of the dome inside the object moves along the dome's own inward normal until it lies on the object's
//! surface; every other point stays. The force is that of an elastic foundation, p = K d for a push-out d, with
//! K = (4 sqrt 2 / 3 pi) E* / a, a the radius of a disc of the touched area, measured as 4/3 (int d)^2 / int d^2 so
//! that it changes smoothly: then a ball gets Hertz' force exactly (its push-out is a paraboloid of radius
//! sqrt(2 Re d)), a cone Sneddon's to 5 %, a flat punch its own to 19 %.

use super::approach::Approach;
use super::drag::share_out;
use super::overlap::{FOUNDATION, Overlap, nodes_of, overlap};
use crate::elastomer::{Elastomer, Indenter};
use crate::error::ContactError;
use crate::field::{Field, PushedOut};
use crate::half_space::{Disc, drag};
use crate::outcome::History;
use crate::state::ContactState;
use domecast_optics::numeric::{Rigid, bracketed_newton};

/// The geometric level's state.
pub(crate) fn geometric(
    elastomer: &Elastomer,
    indenter: &Indenter,
    sensor_from_object: &Rigid,
    before: Option<&History>,
) -> Result<ContactState, ContactError> {
    let approach = Approach::new(elastomer, indenter, sensor_from_object);
    let (radius, sharing, modulus) = (approach.radius_mm, approach.sharing, approach.modulus_mpa);
    let found = overlap(&approach.placed, radius);
    let depth_mm = -found.distance_mm;
    approach.check_depth(depth_mm, found.all_out)?;
    let mut state = ContactState::free(sensor_from_object);
    state.work = 30.0 * found.queries as f64;
    if found.samples.is_empty() {
        return Ok(state);
    }
    let radius_mm = (found.area_mm2 / std::f64::consts::PI).sqrt();
    // Half-space foundation first; the finite body then stiffens it by what its base holds back.
    let soft: f64 = normal_force(&found, FOUNDATION * modulus / radius_mm);
    let back = approach.held_mm_per_n(found.deepest_mm);
    let stiffening = stiffen(soft, depth_mm, back);
    state.nodes = nodes_of(&found, FOUNDATION * modulus / radius_mm * stiffening);
    state.contact_radius_mm = radius_mm;
    state.peak_pressure_mpa = state.nodes.iter().map(|n| n.pressure_mpa).fold(0.0, f64::max);
    let normal = found.deepest_mm / radius;
    let pushed = state.nodes.iter().map(|n| -n.force_n.dot(normal)).sum::<f64>().max(0.0);
    let disc = Disc { at_mm: found.deepest_mm, normal, radius_mm, force_n: pushed, sharing };
    let drag = drag(elastomer, &disc, sensor_from_object, before);
    share_out(&mut state, &disc, &drag);
    state.field = Field::PushedOut(PushedOut {
        placed: approach.placed,
        dome_radius_mm: radius,
        axis: normal,
        angle_rad: (found.angle_rad * 1.1).min(std::f64::consts::PI),
        shift_mm: drag.shift_mm,
        turn_rad: drag.turn_rad,
    });
    Ok(state)
}

fn normal_force(found: &Overlap, k_mpa_per_mm: f64) -> f64 {
    let normal = found.deepest_mm.normalize_or_zero();
    found.samples.iter().map(|(_, area, way, outward)| k_mpa_per_mm * way * area * -outward.dot(normal)).sum()
}

/// Factor on a half-space's force F0 at a depth d when the base holds back c F: F = F0 ((d + c F) / d)^(3/2), a
/// ball's law, solved by bisection-safe Newton steps from the half-space's force.
fn stiffen(force_n: f64, depth_mm: f64, back_mm_per_n: f64) -> f64 {
    let lever = back_mm_per_n * force_n / depth_mm;
    let law = |x: f64| {
        let base = (1.0 + lever * x).max(0.0);
        (x - base.powf(1.5), 1.0 - 1.5 * lever * base.sqrt())
    };
    // Beyond the first stationary point the law has run away from the small-contact theory.
    let limit = if lever > 0.0 { ((1.5 * lever).powi(-2) - 1.0) / lever } else { 2.0 };
    if limit.is_nan() || limit <= 1.0 {
        return 1.5;
    }
    bracketed_newton(law, 0.0, limit.min(4.0), 1.0).map_or(1.5, |root| root.value.clamp(0.2, 4.0))
}
