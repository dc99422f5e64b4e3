//! Caps, and hemispheres on cylinders.

use domecast_optics::DomeShape;
use serde_json::Value;

use super::*;
use crate::OnPole;
use crate::object::{Placed, deepest};

fn dome(radius_mm: f64, center_z_mm: f64) -> Elastomer {
    Elastomer { dome_radius_mm: radius_mm, center_z_mm, ..silicone() }
}

/// Caps and cylinders that the tests take.
fn domes() -> [Elastomer; 4] {
    [dome(11.5, -5.75), dome(14.0, -9.9), dome(8.0, 4.0), dome(5.0, 3.5)]
}

#[test]
fn a_ball_on_the_pole_is_as_scikit_fem_has_it() {
    let text = include_str!("../../../tests/cases/golden_domes.json");
    let table: Value = serde_json::from_str(text).unwrap();
    for case in table["cases"].as_array().unwrap() {
        let number = |name: &str| case[name].as_f64().unwrap();
        let elastomer = Elastomer {
            dome_radius_mm: number("radius_mm"),
            center_z_mm: number("center_z_mm"),
            young_mpa: number("young_mpa"),
            poisson: number("poisson"),
            friction: 0.0,
        };
        let ball_mm = number("ball_radius_mm");
        for answer in case["answers"].as_array().unwrap() {
            let (depth_mm, force_n) =
                (answer["depth_mm"].as_f64().unwrap(), answer["force_n"].as_f64().unwrap());
            let fine = OnPole::new(&elastomer, ball_mm, depth_mm, 256).unwrap();
            assert_eq!(fine.status, Status::Solved);
            let part = -fine.force_n / force_n - 1.0;
            println!("{elastomer:?} {depth_mm} mm: {force_n} N, off by {part}");
            assert!(part.abs() < 0.006, "{elastomer:?}: {part}");
            let places = answer["at_mm"].as_array().unwrap().iter();
            for (at, u) in places.zip(answer["displacement_mm"].as_array().unwrap()) {
                let of = |pair: &Value| DVec3::new(pair[0].as_f64().unwrap(), 0.0, pair[1].as_f64().unwrap());
                let (at, u) = (of(at), of(u));
                let off_mm = fine.displacement_mm(at).distance(u);
                assert!(off_mm < 0.008 * depth_mm, "{elastomer:?} {at}: {off_mm}");
            }
        }
    }
}

#[test]
fn the_estimated_error_holds_on_other_domes() {
    let text = include_str!("../../../tests/cases/golden_domes.json");
    let table: Value = serde_json::from_str(text).unwrap();
    let mut beyond = 0;
    for case in table["large"].as_array().unwrap() {
        let number = |name: &str| case[name].as_f64().unwrap();
        let elastomer = Elastomer { friction: 0.0, ..dome(number("radius_mm"), number("center_z_mm")) };
        let contact = Contact::new(elastomer, Level::default_linear(&elastomer)).unwrap();
        let (size_mm, is_ball) = (number("object_radius_mm"), case["object"] == "ball");
        let solid = if is_ball {
            ContactSolid::sphere(size_mm).unwrap()
        } else {
            ContactSolid::cuboid(DVec3::new(60.0, 60.0, 2.0)).unwrap()
        };
        let up_mm = elastomer.dome().height_mm() + if is_ball { size_mm } else { 1.0 };
        for answer in case["answers"].as_array().unwrap() {
            let (depth_mm, force_n) =
                (answer["depth_mm"].as_f64().unwrap(), answer["force_n"].as_f64().unwrap());
            let at = Rigid::from_translation(DVec3::Z * (up_mm - depth_mm));
            let state = contact.solve(&Indenter::rigid(solid.clone()), &at, None).unwrap();
            let off_n = (-state.wrench.force_n.z - force_n).abs();
            let places = answer["at_mm"].as_array().unwrap().iter();
            let off_mm = places
                .zip(answer["displacement_mm"].as_array().unwrap())
                .map(|(at, u)| {
                    let of =
                        |pair: &Value| DVec3::new(pair[0].as_f64().unwrap(), 0.0, pair[1].as_f64().unwrap());
                    state.displacement_mm(of(at)).distance(of(u))
                })
                .fold(0.0, f64::max);
            let said = state.deviation;
            println!(
                "{} {depth_mm} mm on {} {}: {force_n} N; off by {off_n:.4} N, {off_mm:.4} mm; said {:.4} N, {:.4} mm",
                case["object"],
                elastomer.dome_radius_mm,
                elastomer.center_z_mm,
                said.force_n,
                said.displacement_mm
            );
            beyond += usize::from(off_n > said.force_n || off_mm > said.displacement_mm);
        }
    }
    assert_eq!(beyond, 0);
}

#[test]
fn a_dome_that_is_hardly_a_cap_or_hardly_on_a_cylinder_is_a_hemisphere() {
    let ball = Indenter::rigid(ContactSolid::sphere(4.0).unwrap());
    let pressed = |center_z_mm: f64| {
        let elastomer = dome(10.0, center_z_mm);
        let contact = Contact::new(elastomer, Level::Linear { element_mm: 1.0 }).unwrap();
        let at_mm = elastomer.dome().center_mm() + DVec3::new(0.5, 0.2, 0.8).normalize() * 13.5;
        let state = contact.solve(&ball, &Rigid::from_translation(at_mm), None).unwrap();
        (state.wrench.force_n, state.displacement_mm(elastomer.dome().point_mm(0.4, 0.3)))
    };
    let (force_n, moved_mm) = pressed(0.0);
    for center_z_mm in [-1e-6, 1e-6] {
        let (near_n, near_mm) = pressed(center_z_mm);
        assert!(near_n.distance(force_n) < 1e-5 * force_n.length(), "{near_n} {force_n}");
        assert!(near_mm.distance(moved_mm) < 1e-5 * moved_mm.length());
    }
}

#[test]
fn forces_balance_turn_with_the_object_and_fall_towards_the_free_side() {
    for elastomer in domes() {
        let contact = Contact::new(elastomer, Level::default_linear(&elastomer)).unwrap();
        let shape = elastomer.dome();
        let ball = Indenter::rigid(ContactSolid::sphere(0.4 * elastomer.dome_radius_mm).unwrap());
        let press = |part: f64, azimuth_rad: f64, depth_mm: f64| {
            let at_mm = shape.point_mm(part * shape.meridian_end_rad(), azimuth_rad);
            let center_mm = at_mm + shape.normal(at_mm) * (0.4 * elastomer.dome_radius_mm - depth_mm);
            contact.solve(&ball, &Rigid::from_translation(center_mm), None).unwrap()
        };
        let depth_mm = 0.04 * elastomer.depth_scale_mm();
        for part in [0.3, 0.55] {
            let state = press(part, 0.4, depth_mm);
            assert_eq!(state.status, Status::Solved, "{elastomer:?} {part}");
            let normal = shape.normal(shape.point_mm(part * shape.meridian_end_rad(), 0.4));
            let along = -state.wrench.force_n.normalize().dot(normal);
            assert!(along > 0.97, "{elastomer:?} {part}: {along}");
            // A turn by what the grid has maps onto itself; another one nearly.
            let turned = press(part, 1.7, depth_mm);
            let back = glam::DQuat::from_rotation_z(-1.3) * turned.wrench.force_n;
            assert!(back.distance(state.wrench.force_n) < 0.03 * back.length(), "{elastomer:?} {part}");
            // Nothing moves at the rim, and the touched place moves by nearly the depth.
            let at = |part: f64| state.displacement_mm(shape.point_mm(part * shape.meridian_end_rad(), 0.4));
            assert!(at(1.0).length() < 1e-12);
            assert!((at(part).dot(normal) + depth_mm).abs() < 0.15 * depth_mm, "{elastomer:?} {}", at(part));
            assert!(press(part, 0.4, 1.5 * depth_mm).wrench.force_n.length() > 1.5 * back.length());
        }
    }
}

#[test]
fn the_deepest_place_is_found_on_every_shape() {
    let solids =
        [ContactSolid::sphere(3.0).unwrap(), ContactSolid::cuboid(DVec3::new(2.0, 1.0, 1.5)).unwrap()];
    for shape in domes().map(|elastomer| elastomer.dome()) {
        for solid in &solids {
            for k in 0..20 {
                let k = f64::from(k);
                let at_mm = shape.point_mm(0.045 * k * shape.meridian_end_rad(), 2.4 * k);
                let mut pose = Rigid::from_translation(at_mm + shape.normal(at_mm) * 1.2);
                pose.rotation = glam::DMat3::from_rotation_x(0.7 * k) * glam::DMat3::from_rotation_y(0.3 * k);
                let placed = Placed::new(solid.clone(), pose);
                let (found_mm, distance_mm, _) = deepest(&placed, shape);
                assert!((placed.distance(found_mm).0 - distance_mm).abs() < 1e-9);
                let on_face = shape.distance_mm(found_mm).abs() < 1e-9 && found_mm.z >= -1e-9;
                assert!(on_face && found_mm.z < shape.height_mm() + 1e-9, "{shape:?} {found_mm}");
                let all = (0..60).flat_map(|i| (0..90).map(move |j| (f64::from(i), f64::from(j))));
                let smallest_mm = all
                    .map(|(i, j)| {
                        shape.point_mm(i / 59.0 * shape.meridian_end_rad(), j / 90.0 * std::f64::consts::TAU)
                    })
                    .map(|at_mm| placed.distance(at_mm).0)
                    .fold(f64::INFINITY, f64::min);
                assert!(distance_mm < smallest_mm + 1e-3, "{shape:?} {pose:?}: {distance_mm} {smallest_mm}");
            }
        }
    }
}

#[test]
fn levels_without_elements_refuse_other_domes_by_name() {
    let cap = dome(11.5, -5.75);
    for level in [Level::Geometric, Level::ClosedForm, Level::FiniteStrain { across: 6 }] {
        let ball = Indenter::rigid(ContactSolid::sphere(4.0).unwrap());
        let contact = Contact::new(cap, level).unwrap();
        let refused = contact.solve(&ball, &Rigid::from_translation(DVec3::Z * 9.5), None).unwrap_err();
        assert!(
            matches!(refused, ContactError::HemisphereOnly { .. }) && refused.to_string().contains("linear")
        );
    }
    for center_z_mm in [-11.0, f64::NAN, 30.0] {
        let none = Contact::new(dome(11.5, center_z_mm), Level::Linear { element_mm: 1.0 });
        assert!(matches!(none, Err(ContactError::Dimension { field: "elastomer.center_z_mm", .. })));
    }
    // No deeper than the cap is high.
    let contact = Contact::new(cap, Level::Linear { element_mm: 1.0 }).unwrap();
    let ball = Indenter::rigid(ContactSolid::sphere(20.0).unwrap());
    let deep = contact.solve(&ball, &Rigid::from_translation(DVec3::Z * 20.5), None);
    assert!(matches!(deep, Err(ContactError::TooDeep { .. })), "{deep:?}");
    assert_eq!(cap.dome(), DomeShape::new(11.5, -5.75));
}

/// An elastic object is a half-space whatever dome it bears on: it has no base of its own.
#[test]
fn long_soft_balls_are_half_spaces_on_every_dome() {
    let table: Value = serde_json::from_str(include_str!("../../../tests/cases/golden_soft.json")).unwrap();
    for case in table["cases"].as_array().unwrap() {
        let number = |name: &str| case[name].as_f64().unwrap();
        let (radius_mm, ball_mm) = (number("dome_radius_mm"), number("ball_radius_mm"));
        let elastomer = Elastomer { friction: 0.0, ..dome(radius_mm, number("center_z_mm")) };
        let element_mm = 0.035 * elastomer.depth_scale_mm();
        let mut levels = vec![(Level::Linear { element_mm }, 0.02)];
        if elastomer.dome().is_hemisphere() {
            levels.extend([(Level::ClosedForm, 0.015), (Level::FiniteStrain { across: 6 }, 0.045)]);
        }
        for (level, allowed) in levels {
            let contact = Contact::new(elastomer, level).unwrap();
            let presses = case["presses"].as_array().unwrap();
            // The finite-strain level takes seconds each.
            let all = if matches!(level, Level::FiniteStrain { .. }) { 1 } else { presses.len() };
            for press in &presses[..all] {
                let number = |name: &str| press[name].as_f64().unwrap();
                let ball = Indenter {
                    young_mpa: Some(number("young_mpa")),
                    poisson: table["ball_poisson"].as_f64().unwrap(),
                    ..ball(ball_mm)
                };
                let (depth_mm, force_n) = (number("depth_mm"), number("force_n"));
                let at = above(elastomer.dome().height_mm() + ball_mm - depth_mm);
                let state = contact.solve(&ball, &at, None).unwrap();
                let part = -state.wrench.force_n.z / force_n - 1.0;
                println!("{level:?} {:?} {depth_mm} mm: {force_n} N, off by {part:.4}", ball.young_mpa);
                // Deeper, strain and turns count, which scikit-fem leaves out here.
                let allowed = if depth_mm < 0.06 * radius_mm { allowed } else { allowed + 0.06 };
                assert!(part.abs() < allowed, "{level:?} {elastomer:?} {ball:?} {depth_mm}: {part}");
            }
        }
    }
}

/// Sideways as well: a dome sways under a drag, a half-space gives way by Mindlin's law.
#[test]
fn soft_balls_are_dragged_as_half_spaces() {
    for elastomer in [dome(10.0, 0.0), dome(11.5, -5.75)].map(|dome| Elastomer { friction: 10.0, ..dome }) {
        let contact = Contact::new(elastomer, Level::Linear { element_mm: 0.5 }).unwrap();
        let height_mm = elastomer.dome().height_mm();
        // Way by force of a small drag, and the contact's radius.
        let dragged = |ball: &Indenter, depth_mm: f64| {
            let at = |x_mm: f64| Rigid::from_translation(DVec3::new(x_mm, 0.0, height_mm + 6.0 - depth_mm));
            let first = contact.solve(ball, &at(0.0), None).unwrap();
            let next = contact.solve(ball, &at(0.02), Some(&first)).unwrap();
            (0.02 / (next.wrench.force_n.x - first.wrench.force_n.x), first.contact_radius_mm)
        };
        let soft = Indenter { young_mpa: Some(0.08), poisson: 0.49, ..ball(6.0) };
        let (soft_mm_per_n, radius_mm) = dragged(&soft, 0.9);
        // A rigid ball with as wide a contact.
        let (mut low, mut high) = (0.01, 1.0);
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            if dragged(&ball(6.0), middle).1 < radius_mm { low = middle } else { high = middle }
        }
        let (dome_mm_per_n, _) = dragged(&ball(6.0), low);
        let shear_mpa = 0.08 / (2.0 * 1.49);
        let half_space = (2.0 - 0.49) / (8.0 * radius_mm * shear_mpa);
        let part = (soft_mm_per_n - dome_mm_per_n) / half_space - 1.0;
        println!("{elastomer:?}: {soft_mm_per_n} {dome_mm_per_n} {half_space} {part}");
        assert!(part.abs() < 0.15, "{part}");
    }
}
