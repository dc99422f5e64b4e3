//! Springs, magnets, and the loads that they carry.

use serde_json::{Value, json};

use super::board::{Pocket, has_board};
use super::geometry::{pocket_mm, wall_mm};
use super::known::{Known, down, tidy, up};
use super::room::{HOLE_IN_RECESS_MM, RING_STEP_MM, half_mm, is_clear, ring, ring_count, spring_count};
use super::rule::{Rule, fixed, follows};

/// So much of what the wire bears may the largest press use.
const MAX_USED: f64 = 0.9;

pub(super) const PURCHASED: &[Rule] = &[
    fixed("springs.outer_diameter_mm", "3.0", "a common size that fits beside the camera"),
    fixed("springs.free_length_mm", "5.0", "a common size; the camera's depth grows with it"),
    fixed("springs.active_coils", "3", "few coils leave travel before they bind"),
    fixed("springs.ends", "\"closed_ground\"", "ground ends stand flat on the magnets"),
    fixed("springs.wire.name", "\"music wire\"", "it bears the stress that stainless would set at"),
    fixed("springs.wire.shear_modulus_mpa", "81500", "music wire"),
    fixed("springs.wire.elastic_modulus_mpa", "206000", "music wire"),
    follows(
        "magnets.diameter_mm",
        "the springs' outer diameter, so that they stand on the whole face",
        |k| k.number(k.n("springs.outer_diameter_mm")),
    ),
    fixed("magnets.thickness_mm", "1.0", "the common disc; thicker ones would thin the platforms"),
    fixed("magnets.remanence_t", "1.2", "grade N35"),
    fixed("magnets.grip_force_n", "0.8", "to be measured on the built part with a thread and a scale"),
    fixed("magnets.facing", "\"attract\"", "so that they hold the springs at rest"),
    fixed("magnet_pockets.diameter_clearance_mm", "0.15", "room for glue in a printed pocket"),
    fixed("magnet_pockets.depth_clearance_mm", "0.1", "room for glue in a printed pocket"),
    follows("magnet_pockets.push_out_diameter_mm", "1 mm, or the smallest hole if that is larger", |k| {
        k.number(k.n("process.min_hole_diameter_mm").max(1.0))
    }),
];

pub(super) const LOADS: &[Rule] = &[follows(
    "loads.claims",
    "with R in mm: a press of 1.7 R N (17 N at 10 mm), 0.5 R off centre, pushes of 0.05 R up to 85 % of the magnets' \
     grip, and mixtures",
    claims,
)];

pub(super) const RING: &[Rule] = &[
    follows(
        "springs.places",
        "on a ring as far in as view, camera and lights allow, and moved out to the platforms' wall; six of them, two \
         between neighbouring lights, or three where six would need a ring half as wide again; their push-out holes clear of \
         the edge of a camera board's pocket, the ring turned by up to 20 degrees or widened where that asks for it",
        places,
    ),
    follows(
        "springs.wire_diameter_mm",
        "the largest claimed press takes 40 % of the length: k = F / (0.4 L n), d^4 = 8 D^3 n k / G, or as much thicker \
         as leaves it 90 % of what music wire bears, with Wahl's factor, and of the way until its coils touch, in steps \
         of 0.01 mm",
        wire,
    ),
    follows(
        "springs.wire.allowable_shear_mpa",
        "45 % of music wire's tensile strength, 0.45 * 2211 / d^0.145 MPa",
        |k| k.number(borne_mpa(k.n("springs.wire_diameter_mm"))),
    ),
];

fn claims(k: &Known<'_>) -> Option<Value> {
    // A rigid mount promises no net wrench.
    if k.is_rigid() {
        return Some(Value::Array(Vec::new()));
    }
    let dome = super::geometry::dome(k);
    let (radius, height) = (dome.rim_radius_mm(), dome.height_mm());
    // the press off centre acts half-way to the rim
    let (off_axis, off_height) = if dome.center_z_mm() < 0.0 {
        let above = (dome.radius_mm().powi(2) - 0.25 * radius * radius).sqrt();
        (0.5 * radius, dome.center_z_mm() + above)
    } else {
        (0.5 * radius, 0.866 * radius + dome.center_z_mm())
    };
    let (off_axis, off_height) = (tidy(off_axis), tidy(off_height));
    let of = |share: f64| tidy(share * radius);
    // the push tilts too, which adds to what the spring at the end has to hold
    let push = of(0.05).min(tidy(0.85 * k.n("magnets.grip_force_n")));
    Some(json!([
        { "name": "press", "force_n": [0, 0, -of(1.7)], "point_mm": [0, 0, height] },
        { "name": "press off centre", "force_n": [0, 0, -of(0.5)], "point_mm": [off_axis, 0, off_height] },
        { "name": "push along x", "force_n": [push, 0, 0], "point_mm": [0, 0, height] },
        { "name": "push along y", "force_n": [0, push, 0], "point_mm": [0, 0, height] },
        { "name": "press and push", "force_n": [of(0.08), 0, -of(0.8)], "point_mm": [0, 0, height] },
        { "name": "twist", "force_n": [0, 0, -of(0.2)], "moment_nmm": [0, 0, of(0.5)], "point_mm": [0, 0, height] }
    ]))
}

fn places(k: &Known<'_>) -> Option<Value> {
    let count = ring_count(k);
    let (first_deg, narrowest_mm) = ring(k, count);
    let wall = wall_mm(k) + pocket_mm(k);
    let half = half_mm(k, narrowest_mm + wall);
    let reach = k
        .value("platforms.outer_mm")
        .map_or(half, |_| 0.5 * k.at("platforms.outer_mm", 0).min(k.at("platforms.outer_mm", 1)));
    // the push-out holes lead up into the sheet's recess
    let recess = 0.5 * k.at("sheet.size_mm", 0).min(k.at("sheet.size_mm", 1)) + k.n("sheet.clearance_mm");
    let hole = 0.5 * k.n("magnet_pockets.push_out_diameter_mm");
    let widest_mm = down((reach - wall).min(recess - hole - HOLE_IN_RECESS_MM), 0.01);
    let mut radius_mm = widest_mm;
    if has_board(k) {
        let pocket = Pocket::of(k);
        let steps = (0..400).map(|step| down(widest_mm - RING_STEP_MM * f64::from(step), 0.01));
        let mut clear = steps
            .take_while(|radius| *radius >= narrowest_mm - 1e-9)
            .filter(|radius| is_clear(&pocket, count, first_deg, *radius, hole));
        radius_mm = clear.next().unwrap_or(narrowest_mm.min(widest_mm));
    }
    Some(json!({ "ring": { "count": count, "radius_mm": radius_mm, "first_azimuth_deg": tidy(first_deg) } }))
}

fn wire(k: &Known<'_>) -> Option<Value> {
    let claims = k.value("loads.claims").and_then(Value::as_array);
    let press = claims
        .into_iter()
        .flatten()
        .filter_map(|claim| claim.get("force_n")?.get(2)?.as_f64())
        .fold(0.0, |largest: f64, force| largest.max(-force));
    let stiffness = press.max(0.1) / (0.4 * k.n("springs.free_length_mm") * spring_count(k).max(1) as f64);
    let (outer, coils) = (k.n("springs.outer_diameter_mm"), k.n("springs.active_coils"));
    // the mean diameter depends on the wire: a few rounds bring it far below a step
    let mut wire = 0.1 * outer;
    for _ in 0..30 {
        let mean = (outer - wire).max(0.1 * outer);
        wire = (8.0 * mean.powi(3) * coils * stiffness / k.n("springs.wire.shear_modulus_mpa")).powf(0.25);
    }
    let force = press / spring_count(k).max(1) as f64;
    let mut wire = up(wire, 0.01);
    let shear = k.n("springs.wire.shear_modulus_mpa");
    let passes = |wire: f64| {
        let mean = outer - wire;
        let travel = force * 8.0 * mean.powi(3) * coils / (shear * wire.powi(4));
        // ground and closed ends, the common ones, stand in the solid height with two coils
        let room = k.n("springs.free_length_mm") - (coils + 2.0) * wire;
        stress_mpa(force, mean, wire) > MAX_USED * borne_mpa(wire) || travel > MAX_USED * room
    };
    while wire < 0.25 * outer && passes(wire) {
        wire = up(wire + 0.01, 0.01);
    }
    k.number(wire)
}

/// What music wire of a diameter bears, MPa.
fn borne_mpa(wire_mm: f64) -> f64 {
    down(0.45 * 2211.0 / wire_mm.powf(0.145), 10.0)
}

/// Shear stress in the wire of a spring of a mean diameter under an axial force, with Wahl's factor, MPa.
fn stress_mpa(force_n: f64, mean_mm: f64, wire_mm: f64) -> f64 {
    let index = mean_mm / wire_mm;
    let wahl = (4.0 * index - 1.0) / (4.0 * index - 4.0) + 0.615 / index;
    wahl * 8.0 * force_n * mean_mm / (std::f64::consts::PI * wire_mm.powi(3))
}
