//! Contact against closed forms and itself.

mod domes;
mod faces;
mod reference;
mod small;
mod tasks;
mod together;

use glam::DVec3;

use crate::contact::Prepared;
use crate::*;
use domecast_mesh::TriMesh;
use domecast_optics::numeric::Rigid;
use domecast_springs::{EndType, Spring, SpringSpec, Suspension, SuspensionSpec};

fn silicone() -> Elastomer {
    Elastomer { dome_radius_mm: 10.0, center_z_mm: 0.0, young_mpa: 0.56, poisson: 0.49, friction: 0.6 }
}

fn above(z_mm: f64) -> Rigid {
    Rigid::from_translation(DVec3::new(0.0, 0.0, z_mm))
}

/// Six springs on a ring, as the paper's sensor has them.
fn suspension() -> Suspension {
    let spring = Spring::new(SpringSpec {
        wire_diameter_mm: 0.3,
        outer_diameter_mm: 3.0,
        free_length_mm: 5.0,
        active_coils: 3.0,
        ends: EndType::ClosedGround,
        shear_modulus_mpa: 81_500.0,
        elastic_modulus_mpa: 206_000.0,
        allowable_shear_mpa: 1180.0,
    })
    .unwrap();
    let upper_ends_mm = (0..6)
        .map(|k| {
            let (sine, cosine) = f64::from(30 + 60 * k).to_radians().sin_cos();
            DVec3::new(9.7 * cosine, 9.7 * sine, -5.2)
        })
        .collect();
    let (weight_n, center_of_mass_mm, at_mm) = (DVec3::ZERO, DVec3::ZERO, None);
    Suspension::new(SuspensionSpec {
        spring,
        upper_ends_mm,
        magnets: None,
        weight_n,
        center_of_mass_mm,
        at_mm,
    })
    .unwrap()
}

fn ball(radius_mm: f64) -> Indenter {
    Indenter::rigid(ContactSolid::sphere(radius_mm).unwrap())
}

/// A ball that reaches `depth_mm` into the dome at a polar angle.
fn ball_at(radius_mm: f64, polar: f64, depth_mm: f64) -> Rigid {
    Rigid::from_translation(DVec3::new(polar.sin(), 0.0, polar.cos()) * (10.0 + radius_mm - depth_mm))
}

/// Points all over the dome.
fn dome_points(count: u32) -> Vec<DVec3> {
    (0..count)
        .map(|i| {
            let z = 1.0 - (f64::from(i) + 0.5) / f64::from(count);
            let (sine, cosine) = (2.399_963 * f64::from(i)).sin_cos();
            let r = (1.0 - z * z).sqrt();
            DVec3::new(r * cosine, r * sine, z) * 10.0
        })
        .collect()
}

/// Hertz' contact radius and peak pressure for a force.
fn hertz(elastomer: &Elastomer, radius_mm: f64, force_n: f64) -> (f64, f64) {
    let relative = 10.0 * radius_mm / (10.0 + radius_mm);
    let a = (0.75 * force_n * relative / elastomer.plane_strain_mpa()).cbrt();
    (a, 1.5 * force_n / (std::f64::consts::PI * a * a))
}

#[test]
fn hertz_holds_between_force_radius_and_pressure() {
    let smooth = Elastomer { friction: 0.0, ..silicone() };
    let contact = Contact::new(smooth, Level::Linear { element_mm: 0.5 }).unwrap();
    // Elements a quarter of the contact's radius and less.
    for polar in [0.0, 0.2, 0.4, 0.6, 0.8] {
        for depth in [0.35, 0.5, 0.6] {
            let pose = ball_at(40.0, polar, depth);
            let state = solved_anywhere(&contact, &ball(40.0), &pose);
            let (a, p) = hertz(&smooth, 40.0, state.wrench.force_n.length());
            let (radius, peak) = (state.contact_radius_mm / a - 1.0, state.peak_pressure_mpa / p - 1.0);
            assert!(radius.abs() < 0.03 && peak.abs() < 0.03, "{polar} {depth}: {radius} {peak}");
            assert!(state.penetration_mm <= 1e-5);
        }
    }
}

/// A linear solve without the sheet, which a large ball beside the pole would meet.
fn solved_anywhere(contact: &Contact, indenter: &Indenter, pose: &Rigid) -> ContactState {
    let Prepared::Compliance(compliance) = &contact.prepared else { panic!("a linear level") };
    let state = linear::linear(contact.elastomer(), compliance, indenter, pose, None).unwrap();
    assert_eq!(state.status, Status::Solved);
    state
}

#[test]
fn forces_and_fields_of_the_local_levels_stay_within_their_estimates() {
    for elastomer in [silicone(), Elastomer { poisson: 0.3, friction: 0.0, ..silicone() }] {
        let contact = Contact::new(elastomer, Level::Linear { element_mm: 0.5 }).unwrap();
        for radius in [5.0, 40.0] {
            for polar in [0.0, 0.4, 0.8, 1.1] {
                for depth in [0.3, 1.0] {
                    let (object, pose) = (ball(radius), ball_at(radius, polar, depth));
                    let exact = solved_anywhere(&contact, &object, &pose);
                    for (level, found) in [
                        (Level::Geometric, levels::geometric(&elastomer, &object, &pose, None).unwrap()),
                        (Level::ClosedForm, levels::closed_form(&elastomer, &object, &pose, None).unwrap()),
                    ] {
                        let bound = estimate(level, &elastomer, &object, depth);
                        let off = dome_points(300)
                            .into_iter()
                            .map(|p| exact.displacement_mm(p).distance(found.displacement_mm(p)))
                            .fold(0.0, f64::max);
                        let part = found.wrench.force_n.length() / exact.wrench.force_n.length() - 1.0;
                        assert!(off < bound.displacement_mm && part.abs() < bound.force_part);
                        let off_n = found.wrench.force_n.length() - exact.wrench.force_n.length();
                        let bound_n = bound.force_part * max_force_n(&elastomer, &object, depth);
                        assert!(off_n.abs() < bound_n && bound_n < 1e3);
                    }
                }
            }
        }
    }
}

#[test]
fn no_object_presses_harder_than_is_said() {
    let contact = Contact::new(silicone(), Level::Linear { element_mm: 1.0 }).unwrap();
    let rigid = |solid| Indenter { solid, young_mpa: None, poisson: 0.3 };
    for depth in [0.2, 1.0] {
        let raised = |height: f64| Rigid::from_translation(DVec3::Z * (10.0 - depth + height));
        for (object, pose) in [
            (rigid(ContactSolid::cuboid(DVec3::new(30.0, 30.0, 8.0)).unwrap()), raised(4.0)),
            (rigid(ContactSolid::cylinder(3.0, 8.0).unwrap()), raised(4.0)),
            (rigid(ContactSolid::sphere(60.0).unwrap()), raised(60.0)),
        ] {
            let force_n = contact.solve(&object, &pose, None).unwrap().wrench.force_n.length();
            let max_n = max_force_n(&silicone(), &object, depth);
            assert!(force_n < max_n && force_n > 0.05 * max_n, "{force_n} {max_n}");
        }
    }
}

#[test]
fn friction_stays_in_its_cone_and_gives_way() {
    let contact = Contact::new(silicone(), Level::Linear { element_mm: 1.0 }).unwrap();
    let object = ball(5.0);
    let mut before: Option<ContactState> = None;
    let mut sideways = Vec::new();
    for step in 0..8 {
        let mut pose = ball_at(5.0, 0.0, 0.8);
        pose.translation_mm.x = 0.25 * f64::from(step);
        let state = contact.solve(&object, &pose, before.as_ref()).unwrap();
        assert_eq!(state.status, Status::Solved, "{step}");
        for node in &state.nodes {
            let normal = node.pressure_mpa * node.area_mm2;
            let along = (node.force_n.length_squared() - normal * normal).max(0.0).sqrt();
            assert!(along <= 0.6 * normal * (1.0 + 1e-9), "{along} {normal}");
        }
        sideways.push(state.wrench.force_n.x / -state.wrench.force_n.z);
        before = Some(state);
    }
    assert!(sideways[0].abs() < 1e-9 && sideways[1] > 0.05, "the dome is dragged along +x");
    assert!(sideways.iter().all(|s| *s < 1.2));
    assert!(before.unwrap().nodes.iter().any(|n| !n.sticks), "some of it slips at last");
}

#[test]
fn the_force_is_the_slope_of_the_energy() {
    let smooth = Elastomer { friction: 0.0, ..silicone() };
    let contact = Contact::new(smooth, Level::Linear { element_mm: 1.0 }).unwrap();
    let energy = |depth: f64| {
        let state = contact.solve(&ball(8.0), &ball_at(8.0, 0.0, depth), None).unwrap();
        let memory = state.history.nodes.iter();
        (0.5 * memory.map(|m| m.force_n.dot(m.displacement_mm)).sum::<f64>(), -state.wrench.force_n.z)
    };
    let (h, depth) = (1e-3, 0.7);
    let slope = (energy(depth + h).0 - energy(depth - h).0) / (2.0 * h);
    let force = energy(depth).1;
    assert!((slope / force - 1.0).abs() < 1e-3, "{slope} {force}");
}

#[test]
fn nearly_incompressible_domes_do_not_lock() {
    let force = |poisson: f64| {
        let elastomer = Elastomer { poisson, friction: 0.0, ..silicone() };
        let contact = Contact::new(elastomer, Level::Linear { element_mm: 1.0 }).unwrap();
        let state = contact.solve(&ball(8.0), &ball_at(8.0, 0.0, 0.7), None).unwrap();
        state.wrench.force_n.length() / elastomer.plane_strain_mpa()
    };
    let (soft, hard) = (force(0.49), force(0.4999));
    assert!((hard / soft - 1.0).abs() < 0.05, "{soft} {hard}");
}

#[test]
fn a_press_balances_at_every_level() {
    let suspension = suspension();
    for solid in [ContactSolid::sphere(5.0).unwrap(), ContactSolid::cuboid(DVec3::splat(12.0)).unwrap()] {
        let object = Indenter::rigid(solid);
        for level in [Level::Geometric, Level::ClosedForm, Level::Linear { element_mm: 1.0 }] {
            let contact = Contact::new(silicone(), level).unwrap();
            let mut before: Option<Pressed> = None;
            for x in [0.0, 0.5, 1.5] {
                let mut pose = above(20.0);
                pose.translation_mm.x = x;
                let pressed = contact
                    .press_with_force(&object, &suspension, &pose, -DVec3::Z, 3.0, before.as_ref())
                    .unwrap();
                assert_eq!(pressed.status, PressStatus::Balanced, "{level:?} {x}");
                assert!((pressed.wrench.force_n.z + 3.0).abs() < 3e-6);
                let displacement =
                    domecast_springs::Displacement::of_pose(&pressed.rest_from_platform, suspension.at_mm());
                let carried = suspension.wrench_at(&displacement).unwrap();
                assert!((carried.force_n - pressed.wrench.force_n).length() < 3e-6);
                assert!((carried.moment_nmm - pressed.wrench.moment_nmm).length() < 3e-5);
                let held =
                    contact.press(&object, &suspension, &pressed.rest_from_object, before.as_ref()).unwrap();
                assert_eq!(held.status, PressStatus::Balanced);
                assert!((held.wrench.force_n - pressed.wrench.force_n).length() < 2e-4);
                before = Some(pressed);
            }
        }
    }
}

#[test]
fn a_balance_that_goes_on_from_the_last_frame_is_the_one_found_afresh() {
    let smooth = Elastomer { friction: 0.0, ..silicone() };
    let contact = Contact::new(smooth, Level::Linear { element_mm: 1.0 }).unwrap();
    let suspension = suspension();
    for solid in
        [ContactSolid::sphere(5.0).unwrap(), ContactSolid::mesh(&box_mesh(DVec3::splat(9.0))).unwrap()]
    {
        let object = Indenter::rigid(solid);
        let mut before: Option<Pressed> = None;
        for x in [0.0, 0.2, 0.4, 1.5] {
            let mut pose = above(25.0);
            pose.translation_mm.x = x;
            let press = |before| {
                contact.press_with_force(&object, &suspension, &pose, -DVec3::Z, 2.0, before).unwrap()
            };
            let (afresh, onwards) = (press(None), press(before.as_ref()));
            assert_eq!((afresh.status, onwards.status), (PressStatus::Balanced, PressStatus::Balanced));
            assert!((afresh.wrench.moment_nmm - onwards.wrench.moment_nmm).length() < 1e-4);
            for point in dome_points(40) {
                let apart = afresh.state.displacement_mm(point) - onwards.state.displacement_mm(point);
                assert!(apart.length() < 2e-6, "{x}: {apart}");
            }
            before = Some(onwards);
        }
    }
}

#[test]
fn edges_with_much_friction_come_to_rest() {
    let rough = Elastomer { friction: 2.0, ..silicone() };
    let contact = Contact::new(rough, Level::Linear { element_mm: 1.0 }).unwrap();
    let object = Indenter::rigid(ContactSolid::cuboid(DVec3::new(5.0, 7.0, 6.0)).unwrap());
    let mut before: Option<ContactState> = None;
    for step in 0..12 {
        let turn = DVec3::new(0.9 + 0.03 * f64::from(step), 0.5, 0.1 * f64::from(step));
        let rotation = domecast_optics::numeric::rotation_from_vector(turn);
        let down = object.solid.support(rotation.transpose() * -DVec3::Z);
        let pose = Rigid { rotation, translation_mm: DVec3::Z * (9.3 - (rotation * down).z) };
        let state = contact.solve(&object, &pose, before.as_ref()).unwrap();
        assert!(state.penetration_mm <= 1e-5, "{step}: {}", state.penetration_mm);
        assert!(state.residual_mm <= 1e-6, "{step}: {} {:?}", state.residual_mm, state.status);
        before = Some(state);
    }
}

#[test]
fn binding_springs_are_said() {
    let contact = Contact::new(Elastomer { young_mpa: 5.0, ..silicone() }, Level::ClosedForm).unwrap();
    let pressed =
        contact.press_with_force(&ball(10.0), &suspension(), &above(30.0), -DVec3::Z, 31.0, None).unwrap();
    assert!(matches!(pressed.status, PressStatus::SpringsBind { .. }), "{:?}", pressed.status);
}

#[test]
fn soft_objects_yield_their_share() {
    let contact = Contact::new(silicone(), Level::Linear { element_mm: 1.0 }).unwrap();
    let hard = ball(8.0);
    let soft = Indenter { young_mpa: Some(0.56), poisson: 0.49, ..hard.clone() };
    let pose = ball_at(8.0, 0.0, 0.6);
    let (a, b) = (contact.solve(&hard, &pose, None).unwrap(), contact.solve(&soft, &pose, None).unwrap());
    let ratio = b.wrench.force_n.z / a.wrench.force_n.z;
    assert!((0.4..0.6).contains(&ratio), "half of the modulus, nearly half of the force: {ratio}");
    let pole = DVec3::Z * 10.0;
    assert!((b.displacement_mm(pole).z / a.displacement_mm(pole).z - 0.5).abs() < 0.06);
}

/// A gap that closes several times as fast as the dome moves, on springs: held, then dragged on, then pressed with a force.
#[test]
fn long_soft_objects_are_balanced_at_finite_strain() {
    let contact = Contact::new(silicone(), Level::FiniteStrain { across: 4 }).unwrap();
    let soft = Indenter { young_mpa: Some(0.1), poisson: 0.47, ..ball(5.0) };
    let suspension = suspension();
    let at = |x_mm: f64, z_mm: f64| Rigid::from_translation(DVec3::new(x_mm, 0.0, z_mm));
    let first = contact.press(&soft, &suspension, &at(0.5, 14.3), None).unwrap();
    let second = contact.press(&soft, &suspension, &at(0.8, 14.0), Some(&first)).unwrap();
    let way = -DVec3::Z;
    let third =
        contact.press_with_force(&soft, &suspension, &at(0.8, 14.0), way, 0.3, Some(&second)).unwrap();
    for pressed in [&first, &second, &third] {
        assert_eq!(pressed.status, PressStatus::Balanced, "{}", pressed.residual_n);
        assert!(pressed.residual_n < 1e-6 && pressed.iterations < 30, "{pressed:?}");
    }
    assert!(second.wrench.force_n.x > 0.0, "dragged along: {}", second.wrench.force_n);
    assert!((third.wrench.force_n.dot(way) - 0.3).abs() < 1e-6, "{}", third.wrench.force_n);
}

/// A box of twelve triangles.
fn box_mesh(size: DVec3) -> TriMesh {
    let corner = |i: u32| {
        let sign = |bit: u32| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
        DVec3::new(sign(0), sign(1), sign(2)) * size
    };
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    TriMesh {
        vertices_mm: (0..8).map(corner).collect(),
        triangles: quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect(),
    }
}
