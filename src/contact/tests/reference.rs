//! The levels against the truth: axisymmetric solutions of scikit-fem (tests/cases/golden_neo_hookean.json), and contacts drawn
//! at random, by the finite-strain level (tests/cases/contact_reference.json).
//!
//! `DOMECAST_REFERENCE=from..to` or `a,b,c` with the ignored test below solves the drawn contacts anew and prints their lines. Those
//! that were tried and have no reference are named in the table's `not_solved`.

use glam::{DMat3, DVec3};
use serde_json::{Value, json};

use crate::object::{Placed, deepest};
use crate::*;
use domecast_optics::DomeShape;
use domecast_optics::numeric::{Rigid, SeededRandom};

/// One contact drawn at random.
struct Case {
    object: &'static str,
    elastomer: Elastomer,
    indenter: Indenter,
    /// Where the object is, frame by frame; what is compared is the last one.
    poses: Vec<Rigid>,
    /// How deep the object lies in the undeformed dome, over the radius.
    depth: f64,
}

/// Frames of an object that goes sideways.
const FRAMES: u32 = 4;

fn mesh(name: &str, scale: f64) -> ContactSolid {
    let path = format!("{}/../../designs/scenes/meshes/{name}.stl", env!("CARGO_MANIFEST_DIR"));
    let mut mesh = domecast_mesh::read_stl(&std::fs::read(path).unwrap()).unwrap();
    mesh.vertices_mm.iter_mut().for_each(|vertex| *vertex *= scale);
    ContactSolid::mesh(&mesh).unwrap()
}

/// A turn, as the contacts of the stored table were drawn with.
const TURN_RAD: f64 = 628.0 / 100.0;

/// The objects, and how they are turned before they are put on the dome from above.
fn object(name: &'static str, radius: f64, random: &mut SeededRandom) -> (ContactSolid, DMat3) {
    let size = 0.6 + 0.8 * random.uniform();
    let about = |axis: DVec3, angle: f64| DMat3::from_axis_angle(axis, angle);
    let any = about(DVec3::Z, TURN_RAD * random.uniform());
    let half = std::f64::consts::FRAC_PI_2;
    let solid = |made: Result<ContactSolid, ContactError>| made.unwrap();
    match name {
        "ball" => (solid(ContactSolid::sphere(0.5 * radius * size)), any),
        "small ball" => (solid(ContactSolid::sphere(0.2 * radius * size)), any),
        "rod" => {
            (solid(ContactSolid::cylinder(0.35 * radius * size, 3.0 * radius)), any * about(DVec3::X, half))
        }
        "punch" => (solid(ContactSolid::cylinder(0.3 * radius * size, radius)), any),
        "plate" => (solid(ContactSolid::cuboid(DVec3::new(3.0, 3.0, 1.0) * radius)), any),
        "block" => (solid(ContactSolid::cuboid(DVec3::new(1.2, 1.2, 0.8) * radius * size)), any),
        "edge" => (
            solid(ContactSolid::cuboid(DVec3::new(1.2, 2.4, 1.2) * radius)),
            any * about(DVec3::Y, 0.5 * half),
        ),
        "cone" => (solid(ContactSolid::cone(1.5 * radius, 1.2 * radius * size)), any),
        "nut" => (mesh("nut", 0.1 * radius), any),
        "bolt" => (mesh("bolt", 0.1 * radius), any * about(DVec3::Y, half)),
        _ => (mesh("usb_plug", 0.1 * radius), any),
    }
}

const OBJECTS: [&str; 11] =
    ["ball", "plate", "rod", "punch", "ball", "block", "small ball", "edge", "nut", "bolt", "usb_plug"];
/// From this seed on objects go sideways as well, and a cone is among them.
const SIDEWAYS: u64 = 200;

fn case(seed: u64) -> Case {
    let mut random = SeededRandom::new(7000 + seed);
    let number = (seed % OBJECTS.len() as u64) as usize;
    let name = if seed >= SIDEWAYS && number == 4 { "cone" } else { OBJECTS[number] };
    let radius = [10.0, 5.0, 10.0, 20.0][(seed / OBJECTS.len() as u64 % 4) as usize];
    let (solid, turned) = object(name, radius, &mut random);
    let poisson = [0.49, 0.45, 0.48, 0.495][(random.uniform() * 4.0) as usize];
    // From seed 100 on with friction, up to SIDEWAYS under objects that come along the dome's normal.
    let friction = random.uniform() * f64::from(u8::from(seed >= 100));
    let young_mpa = 0.1 + random.uniform();
    let elastomer = Elastomer { dome_radius_mm: radius, center_z_mm: 0.0, young_mpa, poisson, friction };
    let soft = random.uniform() < 0.2;
    let indenter = Indenter {
        solid,
        young_mpa: soft.then_some(young_mpa * (0.5 + 3.0 * random.uniform())),
        poisson: 0.45,
    };
    let (polar, azimuth) = (0.7 * random.uniform().powf(1.5), TURN_RAD * random.uniform());
    let normal = DVec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos());
    let deep =
        if seed.is_multiple_of(2) { 0.02 + 0.1 * random.uniform() } else { 0.04 + 0.2 * random.uniform() };
    let depth = if name == "small ball" { deep.min(0.15) } else { deep };
    let rotation = DMat3::from_quat(glam::DQuat::from_rotation_arc(DVec3::Z, normal)) * turned;
    let mut pose = Rigid::new(rotation, DVec3::ZERO);
    let (center, reach) = indenter.solid.bounding_sphere();
    let mut way = radius + reach;
    for _ in 0..60 {
        pose.translation_mm = normal * way - rotation * center;
        let (_, distance, _) =
            deepest(&Placed::new(indenter.solid.clone(), pose), DomeShape::hemisphere(radius));
        way -= distance + depth * radius;
    }
    if seed < SIDEWAYS {
        return Case { object: name, elastomer, indenter, poses: vec![pose], depth };
    }
    // Half of them slide at their depth, half are pressed in on the way.
    let aside =
        glam::DQuat::from_axis_angle(normal, TURN_RAD * random.uniform()) * normal.any_orthonormal_vector();
    let lifted = if random.uniform() < 0.5 { 0.0 } else { 0.5 * depth };
    let back = (normal * lifted - aside * (0.02 + 0.13 * random.uniform())) * radius;
    let at = |frame: u32| pose.translation_mm + back * (1.0 - f64::from(frame) / f64::from(FRAMES));
    let poses = (0..=FRAMES).map(|frame| Rigid::new(rotation, at(frame))).collect();
    Case { object: name, elastomer, indenter, poses, depth }
}

/// The state after all frames.
fn state_after(
    contact: &Contact,
    indenter: &Indenter,
    poses: &[Rigid],
) -> Result<ContactState, ContactError> {
    let mut state = None;
    for pose in poses {
        state = Some(contact.solve(indenter, pose, state.as_ref())?);
    }
    Ok(state.unwrap())
}

/// Places of the dome at which displacements are compared, about the object and all over.
fn places(case: &Case) -> Vec<DVec3> {
    let radius = case.elastomer.dome_radius_mm;
    let (at, _, _) = deepest(
        &Placed::new(case.indenter.solid.clone(), case.poses[case.poses.len() - 1]),
        DomeShape::hemisphere(radius),
    );
    let turn = glam::DQuat::from_rotation_arc(DVec3::Z, at / radius);
    let spiral = |count: u32, low: f64| {
        (0..count).map(move |i| {
            let z = 1.0 - (1.0 - low) * (f64::from(i) + 0.5) / f64::from(count);
            let (sine, cosine) = (2.399_963 * f64::from(i)).sin_cos();
            let flat = (1.0 - z * z).sqrt();
            DVec3::new(flat * cosine, flat * sine, z) * radius
        })
    };
    let near = spiral(60, 0.75).map(|p| turn * p).filter(|p| p.z > 0.0);
    near.chain(spiral(40, 0.05)).collect()
}

fn rounded(value: f64) -> f64 {
    (value * 1e5).round() / 1e5
}

/// The reference's line of a contact.
fn solved(seed: u64, across: usize) -> Result<Value, ContactError> {
    let case = case(seed);
    let contact = Contact::new(case.elastomer, Level::FiniteStrain { across })?;
    // Its steps are its own: the frames between first and last would only be more of them.
    let mut poses = case.poses.clone();
    poses.drain(1..case.poses.len().max(2) - 1);
    let state = state_after(&contact, &case.indenter, &poses)?;
    let moved: Vec<[f64; 3]> =
        places(&case).iter().map(|p| state.displacement_mm(*p).to_array().map(rounded)).collect();
    Ok(json!({
        "seed": seed,
        "object": case.object,
        "dome_radius_mm": case.elastomer.dome_radius_mm,
        "depth_over_radius": rounded(case.depth),
        "force_n": state.wrench.force_n.to_array().map(rounded),
        "steps": state.iterations,
        "displacements_mm": moved,
    }))
}

#[test]
#[ignore = "writes the table's lines and asserts nothing"]
fn reference_is_solved_anew() {
    let asked = std::env::var("DOMECAST_REFERENCE").unwrap_or_else(|_| "0..2".into());
    let across = std::env::var("DOMECAST_ACROSS").map_or(8, |v| v.parse().unwrap());
    let number = |text: &str| text.parse::<u64>().unwrap();
    let seeds: Vec<u64> = match asked.split_once("..") {
        Some((from, to)) => (number(from)..number(to)).collect(),
        None => asked.split(',').map(number).collect(),
    };
    for seed in seeds {
        let start = std::time::Instant::now();
        match solved(seed, across) {
            Ok(line) => println!("{line}"),
            Err(error) => println!("# {seed} {}: {error}", case(seed).object),
        }
        eprintln!("{seed} {} {:.2}: {:?}", case(seed).object, case(seed).depth, start.elapsed());
    }
}

/// A contact whose truth is known.
struct Known {
    name: String,
    elastomer: Elastomer,
    indenter: Indenter,
    poses: Vec<Rigid>,
    force_n: DVec3,
    places_mm: Vec<DVec3>,
    displacements_mm: Vec<DVec3>,
    /// Whether the estimates' constants were made from it.
    is_fitted: bool,
}

fn table(name: &str) -> Value {
    let path = format!("{}/../../tests/cases/{name}", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn vector(v: &Value) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|k| v[k].as_f64().unwrap()))
}

/// The axisymmetric solutions of scikit-fem; those whose two meshes agree.
fn golden() -> Vec<Known> {
    let table = table("golden_neo_hookean.json");
    let polar: Vec<f64> =
        table["polar_deg"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap().to_radians()).collect();
    let mut known = Vec::new();
    for case in table["cases"].as_array().unwrap() {
        let number = |name: &str| case[name].as_f64().unwrap();
        let (size, radius) = (number("object_radius_mm"), number("dome_radius_mm"));
        let (young_mpa, poisson) = (number("young_mpa"), number("poisson"));
        let elastomer =
            Elastomer { dome_radius_mm: radius, center_z_mm: 0.0, young_mpa, poisson, friction: 0.0 };
        let object = case["object"].as_str().unwrap();
        let (solid, middle_mm) = match object {
            "ball" => (ContactSolid::sphere(size), size),
            "punch" => (ContactSolid::cylinder(size, radius), 0.5 * radius),
            _ => (ContactSolid::cuboid(DVec3::new(4.0, 4.0, 1.0) * radius), 0.5 * radius),
        };
        for frame in case["frames"].as_array().unwrap() {
            let of = |name: &str| frame[name].as_f64().unwrap();
            if of("force_between_meshes") > 0.01 {
                continue;
            }
            let moved = |name: &str| frame[name].as_array().unwrap();
            let displacements_mm = moved("outwards_mm")
                .iter()
                .zip(moved("up_mm"))
                .map(|(out, up)| DVec3::new(out.as_f64().unwrap(), 0.0, up.as_f64().unwrap()))
                .collect();
            known.push(Known {
                name: format!("{object} {size} on {radius}, nu {poisson}, {}", of("depth_mm")),
                elastomer,
                indenter: Indenter::rigid(solid.clone().unwrap()),
                poses: vec![Rigid::from_translation(DVec3::Z * (radius + middle_mm - of("depth_mm")))],
                force_n: DVec3::Z * of("force_n"),
                places_mm: polar.iter().map(|p| DVec3::new(p.sin(), 0.0, p.cos()) * radius).collect(),
                displacements_mm,
                is_fitted: radius == 10.0,
            });
        }
    }
    known
}

/// The contacts drawn at random.
fn drawn() -> Vec<Known> {
    let table = table("contact_reference.json");
    let lines = table["contacts"].as_array().unwrap();
    lines
        .iter()
        .map(|line| {
            let seed = line["seed"].as_u64().unwrap();
            let case = case(seed);
            Known {
                name: format!("seed {seed}, {}", case.object),
                elastomer: case.elastomer,
                places_mm: places(&case),
                indenter: case.indenter,
                poses: case.poses,
                force_n: vector(&line["force_n"]),
                displacements_mm: line["displacements_mm"].as_array().unwrap().iter().map(vector).collect(),
                is_fitted: line["fitted"].as_bool().unwrap(),
            }
        })
        .collect()
}

#[test]
fn a_deep_touch_is_near_large_strain() {
    let mut seen = 0;
    for known in golden().iter().filter(|known| !known.name.starts_with("punch")) {
        let radius = known.elastomer.dome_radius_mm;
        let force_n = known.force_n.length();
        // Wide contacts need no small elements.
        let is_wide = force_n > 0.06 * known.elastomer.plane_strain_mpa() * radius * radius;
        let element_mm = if is_wide { 0.1 } else { 0.05 } * radius;
        let contact = Contact::new(known.elastomer, Level::Linear { element_mm }).unwrap();
        let state = state_after(&contact, &known.indenter, &known.poses).unwrap();
        let (elements, part) =
            (state.contact_radius_mm / element_mm, state.wrench.force_n.length() / force_n - 1.0);
        if elements < 2.4 {
            continue;
        }
        seen += 1;
        assert_eq!(state.status, Status::Solved);
        let depth_mm =
            -deepest(&Placed::new(known.indenter.solid.clone(), known.poses[0]), known.elastomer.dome()).1;
        let off_mm = off_mm(known, &state);
        println!("{}: {:+.1} %, {off_mm:.3} mm, {elements:.1} elements", known.name, 100.0 * part);
        assert!(part.abs() < if elements < 3.3 { 0.07 } else { 0.055 }, "{}: {part}", known.name);
        assert!(off_mm < 0.09 * depth_mm + 1e-3 * radius, "{}: {off_mm}", known.name);
    }
    assert!(seen > 15, "{seen}");
}

/// The largest distance between a state's displacements and the true ones, mm.
fn off_mm(known: &Known, state: &ContactState) -> f64 {
    let apart = |(place, u): (&DVec3, &DVec3)| state.displacement_mm(*place).distance(*u);
    known.places_mm.iter().zip(&known.displacements_mm).map(apart).fold(0.0, f64::max)
}

/// Estimate over deviation, of force and displacement; deviations below a hundredth of the whole count as that.
fn ratios(known: &Known, level: Level) -> Option<[f64; 2]> {
    let contact = Contact::new(known.elastomer, level).unwrap();
    let state = state_after(&contact, &known.indenter, &known.poses).ok()?;
    let off_mm = off_mm(known, &state);
    let whole_mm = known.displacements_mm.iter().map(|u| u.length()).fold(0.0, f64::max);
    let off_n = state.wrench.force_n.distance(known.force_n);
    println!(
        "{}, {}: force {:+.1} %, {:.4} of the radius off",
        known.name,
        level.name(),
        100.0 * (state.wrench.force_n.length() / known.force_n.length() - 1.0),
        off_mm / known.elastomer.dome_radius_mm
    );
    let stated = state.deviation;
    Some([
        stated.force_n / off_n.max(0.01 * known.force_n.length()),
        stated.displacement_mm / off_mm.max(0.01 * whole_mm),
    ])
}

#[test]
fn long_every_level_says_how_far_it_is_off() {
    let known: Vec<Known> = golden().into_iter().chain(drawn()).collect();
    let mut below = Vec::new();
    for (name, level) in [
        ("geometric", (|_| Level::Geometric) as fn(f64) -> Level),
        ("closed form", |_| Level::ClosedForm),
        ("linear, R/10", |radius| Level::Linear { element_mm: 0.1 * radius }),
        ("linear, R/20", |radius| Level::Linear { element_mm: 0.05 * radius }),
    ] {
        for is_fitted in [true, false] {
            let mut found = [Vec::new(), Vec::new()];
            for known in known.iter().filter(|known| known.is_fitted == is_fitted) {
                let Some(ratios) = ratios(known, level(known.elastomer.dome_radius_mm)) else { continue };
                if ratios.iter().any(|ratio| *ratio < 0.5) {
                    below.push(format!("{name}: {ratios:?} times, {}", known.name));
                }
                found.iter_mut().zip(ratios).for_each(|(found, ratio)| found.push(ratio));
            }
            for (what, found) in ["force", "displacement"].into_iter().zip(&mut found) {
                found.sort_by(f64::total_cmp);
                let at = |part: f64| found[((found.len() - 1) as f64 * part) as usize];
                let (low, middle, high) = (at(0.0), at(0.5), at(0.95));
                println!(
                    "{name}, {what}, {} contacts, fitted {is_fitted}: {low:.2}, {middle:.2}, {high:.2} times",
                    found.len()
                );
                if !(0.9..4.0).contains(&middle) {
                    below.push(format!("{name} {what}: {middle}"));
                }
            }
        }
    }
    assert!(below.is_empty(), "{below:#?}");
}
