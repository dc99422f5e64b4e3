//! The closed form: Hertz' ellipse or Sneddon's cone with the bonded base's correction, and Mindlin's friction.

use glam::DVec3;

use super::approach::Approach;
use super::drag::share_out;
use super::geometric::geometric;
use crate::elastomer::{Elastomer, Indenter};
use crate::error::ContactError;
use crate::field::{Field, Sunk};
use crate::half_space::{Disc, Patch, axes, cone, drag, ellipse};
use crate::object::{Feature, deepest, feature_at};
use crate::outcome::{History, Status, TouchedNode};
use crate::state::ContactState;
use domecast_optics::numeric::{Rigid, bracketed_newton};

/// The closed form's state; where it has none, the geometric level's with the reason in its status.
pub(crate) fn closed_form(
    elastomer: &Elastomer,
    indenter: &Indenter,
    sensor_from_object: &Rigid,
    before: Option<&History>,
) -> Result<ContactState, ContactError> {
    let approach = Approach::new(elastomer, indenter, sensor_from_object);
    let (radius, sharing, modulus) = (approach.radius_mm, approach.sharing, approach.modulus_mpa);
    let (at_mm, distance_mm, queries) = deepest(&approach.placed, elastomer.dome());
    let depth_mm = -distance_mm;
    if depth_mm <= 0.0 {
        return Ok(ContactState { work: 30.0 * queries as f64, ..ContactState::free(sensor_from_object) });
    }
    approach.check_depth(depth_mm, true)?;
    let instead = |why: &'static str| {
        let mut state = geometric(elastomer, indenter, sensor_from_object, before)?;
        if state.status == Status::Solved {
            state.status = Status::NotApplicable(why);
        }
        Ok(state)
    };
    let feature = match feature_at(&approach.placed, at_mm) {
        Ok(feature) => feature,
        Err(why) => return instead(why),
    };
    let normal = at_mm / radius;
    let back = approach.held_mm_per_n(at_mm);
    let (first, patch_at) = patches(&feature, normal, radius, modulus);
    // Half-space approach d with d - back F(d) = depth: the finite body's approach.
    let law = |d: f64| {
        let force = patch_at(d).map_or(0.0, |patch| patch.force_n);
        (d - back * force - depth_mm, f64::NAN)
    };
    let Some(patch) = bracketed_newton(law, 0.5 * depth_mm, 2.0 * depth_mm, 1.05 * depth_mm)
        .ok()
        .and_then(|root| patch_at(root.value))
    else {
        return instead("the contact is too large for the closed form");
    };
    let room_mm = match feature {
        Feature::Smooth { room_mm, .. } | Feature::Apex { room_mm, .. } => room_mm,
    };
    if patch.a_mm > room_mm {
        return instead("the contact reaches beyond the face that touches");
    }
    if patch.a_mm > 0.8 * radius || at_mm.z < patch.a_mm * (1.0 - normal.z * normal.z).sqrt() {
        return instead("the contact reaches the dome's rim");
    }
    let (first, second) = axes(normal, first);
    let mut state = ContactState::free(sensor_from_object);
    state.work = 30.0 * queries as f64 + 4000.0;
    state.nodes = pressure_nodes(&patch, normal, first, second, radius, modulus);
    state.contact_radius_mm = (patch.a_mm * patch.b_mm).sqrt();
    state.peak_pressure_mpa = patch.peak_mpa();
    let radius_mm = state.contact_radius_mm;
    let disc = Disc { at_mm, normal, radius_mm, force_n: patch.force_n, sharing };
    let drag = drag(elastomer, &disc, sensor_from_object, before);
    share_out(&mut state, &disc, &drag);
    state.field = Field::Sunk(Sunk {
        patch,
        normal,
        first,
        second,
        dome_radius_mm: radius,
        modulus_mpa: modulus,
        share: 1.0 / sharing,
        held_mm: back * patch.force_n,
        shift_mm: drag.shift_mm,
        turn_rad: drag.turn_rad,
    });
    Ok(state)
}

/// The first axis of the patch, and the patch at an approach of the half-spaces, mm.
type Patches = (DVec3, Box<dyn Fn(f64) -> Option<Patch>>);

/// The patches of a feature that touches along a normal.
fn patches(feature: &Feature, normal: DVec3, radius: f64, modulus: f64) -> Patches {
    match *feature {
        Feature::Smooth { along, across, first, .. } => {
            let gap = [0.5 * (1.0 / radius + along), 0.5 * (1.0 / radius + across)];
            // The first axis goes with the smaller curvature.
            let (gap, first) = if gap[0] <= gap[1] {
                (gap, first)
            } else {
                ([gap[1], gap[0]], normal.cross(first).normalize_or(first))
            };
            (first, Box::new(move |depth| ellipse(depth, gap, modulus)))
        }
        Feature::Apex { slope, .. } => {
            (DVec3::X, Box::new(move |depth| Some(cone(depth, 1.0 / radius, slope, modulus))))
        }
    }
}

/// Rings and spokes over the ellipse; the forces are scaled to the patch's own, exactly.
fn pressure_nodes(
    patch: &Patch,
    normal: DVec3,
    first: DVec3,
    second: DVec3,
    radius: f64,
    modulus: f64,
) -> Vec<TouchedNode> {
    const RINGS: usize = 8;
    const SPOKES: usize = 16;
    let mut nodes = Vec::with_capacity(RINGS * SPOKES);
    let mut total = 0.0;
    for ring in 0..RINGS {
        let q = (ring as f64 + 0.5) / RINGS as f64;
        for spoke in 0..SPOKES {
            let azimuth = (spoke as f64 + 0.5) * std::f64::consts::TAU / SPOKES as f64;
            let (sine, cosine) = azimuth.sin_cos();
            let (x, y) = (q * cosine * patch.a_mm, q * sine * patch.b_mm);
            let flat = first * x + second * y;
            let height = (radius * radius - flat.length_squared()).max(0.0).sqrt();
            let area_mm2 = std::f64::consts::TAU * patch.a_mm * patch.b_mm * q / (RINGS * SPOKES) as f64;
            let pressure_mpa = patch.pressure_mpa(x, y, modulus);
            total += pressure_mpa * area_mm2;
            let at_mm = (flat + normal * height).normalize_or(normal) * radius;
            nodes.push(TouchedNode {
                at_mm,
                area_mm2,
                force_n: normal * -(pressure_mpa * area_mm2),
                pressure_mpa,
                place_mm: at_mm,
                inward: -normal,
                sticks: false,
            });
        }
    }
    if total > 0.0 {
        let scale = patch.force_n / total;
        for node in &mut nodes {
            node.force_n *= scale;
        }
    }
    nodes
}
