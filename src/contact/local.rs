//! The two levels without equations to solve: geometric and closed form.

use glam::DVec3;

use super::elastomer::{Elastomer, Indenter};
use super::error::ContactError;
use super::field::{Field, PushedOut, Sunk};
use super::finite_body::held;
use super::geometric::{FOUNDATION, Overlap, Placed, deepest, nodes_of, overlap};
use super::hertz::{Feature, Patch, axes, cone, ellipse, feature_at};
use super::state::{ContactState, History, Status, TouchedNode};
use super::tangential::{Disc, Drag, drag};
use domecast_optics::numeric::{Rigid, bracketed_newton};
use domecast_springs::Wrench;

/// Deepest push-out that is modelled, as a part of the radius: beyond, an object would near the sheet.
pub(super) const DEEPEST: f64 = 0.8;

/// The geometric level's state.
pub(super) fn geometric(
    elastomer: &Elastomer,
    indenter: &Indenter,
    sensor_from_object: &Rigid,
    before: Option<&History>,
) -> Result<ContactState, ContactError> {
    let radius = elastomer.dome_radius_mm;
    let placed = Placed::new(indenter.solid.clone(), *sensor_from_object);
    let found = overlap(&placed, radius);
    let depth_mm = -found.distance_mm;
    if depth_mm > DEEPEST * radius || !found.all_out {
        return Err(ContactError::TooDeep { depth_mm, limit_mm: DEEPEST * radius });
    }
    let mut state = ContactState::free(sensor_from_object);
    state.work = 30.0 * found.queries as f64;
    if found.samples.is_empty() {
        return Ok(state);
    }
    let sharing = 1.0 + indenter.yield_ratio(elastomer);
    let modulus = elastomer.plane_strain_mpa() / sharing;
    let radius_mm = (found.area_mm2 / std::f64::consts::PI).sqrt();
    // Half-space foundation first; the finite body then stiffens it by what its base holds back.
    let soft: f64 = normal_force(&found, FOUNDATION * modulus / radius_mm);
    let polar = (found.deepest_mm.z / radius).clamp(-1.0, 1.0).acos();
    let back = held(elastomer, polar) / (elastomer.plane_strain_mpa() * radius);
    let stiffening = stiffen(soft, depth_mm, back);
    state.nodes = nodes_of(&found, FOUNDATION * modulus / radius_mm * stiffening);
    state.contact_radius_mm = radius_mm;
    state.peak_pressure_mpa = state.nodes.iter().map(|n| n.pressure_mpa).fold(0.0, f64::max);
    let normal = found.deepest_mm / radius;
    let pushed = state.nodes.iter().map(|n| -n.force_n.dot(normal)).sum::<f64>().max(0.0);
    let disc = Disc { at_mm: found.deepest_mm, normal, radius_mm, force_n: pushed, sharing };
    let drag = drag(elastomer, &disc, sensor_from_object, before);
    finish(&mut state, &disc, &drag);
    state.field = Field::PushedOut(PushedOut {
        placed,
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
    let most = if lever > 0.0 { ((1.5 * lever).powi(-2) - 1.0) / lever } else { 2.0 };
    if most.is_nan() || most <= 1.0 {
        return 1.5;
    }
    bracketed_newton(law, 0.0, most.min(4.0), 1.0).map_or(1.5, |root| root.value.clamp(0.2, 4.0))
}

/// Sums the nodes and the drag into a wrench, shares the drag among the nodes by their pressure.
fn finish(state: &mut ContactState, disc: &Disc, drag: &Drag) {
    let pressed: f64 = state.nodes.iter().map(|n| n.pressure_mpa * n.area_mm2).sum();
    let twist: f64 = state
        .nodes
        .iter()
        .map(|n| n.pressure_mpa * n.area_mm2 * (n.at_mm - disc.at_mm).cross(disc.normal).length_squared())
        .sum();
    for node in &mut state.nodes {
        let load = node.pressure_mpa * node.area_mm2;
        if pressed > 0.0 {
            node.force_n += drag.force_n * (load / pressed);
        }
        if twist > 0.0 {
            let arm = node.at_mm - disc.at_mm;
            node.force_n += disc.normal.cross(arm) * (drag.torsion_nmm * load / twist);
        }
        node.sticks = drag.sticks;
    }
    state.wrench = sum(&state.nodes);
    state.status = Status::Solved;
    state.iterations = 1;
    state.history.tangential_n = drag.force_n;
    state.history.torsion_nmm = drag.torsion_nmm;
}

/// Forces of the nodes about the base's centre.
pub(super) fn sum(nodes: &[TouchedNode]) -> Wrench {
    nodes.iter().fold(Wrench::default(), |sum, node| Wrench {
        force_n: sum.force_n + node.force_n,
        moment_nmm: sum.moment_nmm + node.at_mm.cross(node.force_n),
    })
}

/// The closed form's state; where it has none, the geometric level's with the reason in its status.
pub(super) fn closed_form(
    elastomer: &Elastomer,
    indenter: &Indenter,
    sensor_from_object: &Rigid,
    before: Option<&History>,
) -> Result<ContactState, ContactError> {
    let radius = elastomer.dome_radius_mm;
    let placed = Placed::new(indenter.solid.clone(), *sensor_from_object);
    let (at_mm, distance_mm, queries) = deepest(&placed, radius);
    let depth_mm = -distance_mm;
    if depth_mm <= 0.0 {
        return Ok(ContactState { work: 30.0 * queries as f64, ..ContactState::free(sensor_from_object) });
    }
    if depth_mm > DEEPEST * radius {
        return Err(ContactError::TooDeep { depth_mm, limit_mm: DEEPEST * radius });
    }
    let instead = |why: &'static str| {
        let mut state = geometric(elastomer, indenter, sensor_from_object, before)?;
        if state.status == Status::Solved {
            state.status = Status::NotApplicable(why);
        }
        Ok(state)
    };
    let feature = match feature_at(&placed, at_mm) {
        Ok(feature) => feature,
        Err(why) => return instead(why),
    };
    let sharing = 1.0 + indenter.yield_ratio(elastomer);
    let modulus = elastomer.plane_strain_mpa() / sharing;
    let normal = at_mm / radius;
    let polar = normal.z.clamp(-1.0, 1.0).acos();
    let back = held(elastomer, polar) / (elastomer.plane_strain_mpa() * radius);
    let (first, patch_at): (DVec3, Box<dyn Fn(f64) -> Option<Patch>>) = match feature {
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
    };
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
    finish(&mut state, &disc, &drag);
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
