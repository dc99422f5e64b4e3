//! Several contacts at once, and a slow gel.

use super::{above, ball, ball_at, silicone, suspension};
use crate::*;
use domecast_optics::numeric::Rigid;
use glam::DVec3;

fn linear(friction: f64) -> Contact {
    Contact::new(Elastomer { friction, ..silicone() }, Level::Linear { element_mm: 1.0 }).unwrap()
}

/// A ball held on both sides of the pole, `apart_mm` from centre to centre of the contacts.
fn pair(radius_mm: f64, apart_mm: f64, depth_mm: f64) -> [Push; 2] {
    let polar = 0.5 * apart_mm / 10.0;
    [ball_at(radius_mm, polar, depth_mm), ball_at(radius_mm, -polar, depth_mm)].map(Push::At)
}

#[test]
fn one_object_is_pressed_as_it_was_alone() {
    for friction in [0.0, 0.6] {
        let contact = linear(friction);
        let springs = suspension();
        let object = ball(5.0);
        let alone = contact.press(&object, &springs, &above(14.2), None).unwrap();
        let objects = [(&object, Some(Push::At(above(14.2))))];
        let together = contact.press_together(&objects, Some(&springs), &Beside::default(), None).unwrap();
        assert_eq!(together.status, PressStatus::Balanced, "{together:?}");
        let off = alone.wrench.force_n.distance(together.wrench.force_n);
        assert!(off < 1e-5 * alone.wrench.force_n.length(), "{off}");
        assert!(
            together
                .state
                .displacement_mm(DVec3::Z * 10.0)
                .distance(alone.state.displacement_mm(DVec3::Z * 10.0))
                < 1e-5
        );
    }
}

#[test]
fn two_contacts_are_one_problem() {
    // The joint law itself: no node of the dome that all forces move lies in a ball, and mirror images have mirrored forces.
    let contact = linear(0.0);
    let object = ball(3.0);
    let (apart_mm, depth_mm) = (6.5, 0.9);
    let pushes = pair(3.0, apart_mm, depth_mm);
    let objects = [(&object, Some(pushes[0])), (&object, Some(pushes[1]))];
    let found = contact.press_together(&objects, None, &Beside::default(), None).unwrap();
    assert_eq!(found.status, PressStatus::Balanced);
    let [a, b] = [0, 1].map(|k| found.objects[k].as_ref().unwrap().state.wrench.force_n);
    // Mirror images.
    assert!((a.x + b.x).abs() < 1e-6 && (a.z - b.z).abs() < 1e-6 && a.y.abs() < 1e-6, "{a} {b}");
    // No node of the moved dome lies in a ball: the field is that of all forces.
    for (push, object) in pushes.iter().zip(&found.objects) {
        let Push::At(pose) = push else { panic!() };
        for node in &object.as_ref().unwrap().state.nodes {
            let at = node.at_mm + found.state.displacement_mm(node.at_mm);
            let gap = at.distance(pose.translation_mm) - 3.0;
            // A node's gap is the mean over its hat.
            assert!(gap.abs() < 0.12, "{apart_mm}: {gap}");
        }
    }
    let alone = contact.solve(&object, &ball_at(3.0, 0.05 * apart_mm, depth_mm), None).unwrap();
    let part = a.length() / alone.wrench.force_n.length();
    println!("{apart_mm} mm apart: {part:.4} of the force alone, {} solves", found.iterations);
    assert!((part - 1.0).abs() > 1e-4 && (part - 1.0).abs() < 0.3);
}

#[test]
fn far_apart_contacts_add() {
    let contact = linear(0.6);
    let object = ball(3.0);
    let pushes = pair(3.0, 18.0, 0.3);
    let objects = [(&object, Some(pushes[0])), (&object, Some(pushes[1]))];
    let found = contact.press_together(&objects, None, &Beside::default(), None).unwrap();
    for (k, push) in pushes.iter().enumerate() {
        let Push::At(pose) = push else { panic!() };
        let alone = contact.solve(&object, pose, None).unwrap();
        let [own, other] = [k, 1 - k].map(|k| &found.objects[k].as_ref().unwrap().state);
        let way = pose.translation_mm.normalize();
        let change = (own.wrench.force_n - alone.wrench.force_n).dot(-way) / alone.wrench.force_n.dot(-way);
        // What the other moves the dome there is missing from the depth: Hertz' power.
        let moved_mm = other.displacement_mm(way * 10.0).dot(way);
        let expected = (1.0 + moved_mm / 0.3).powf(1.5) - 1.0;
        println!("{change:.4} {expected:.4}");
        assert!(change.abs() < 0.08 && (change - expected).abs() < 0.3 * expected.abs() + 1e-4);
    }
}

#[test]
fn forces_of_two_are_found_on_springs() {
    for level in [Level::ClosedForm, Level::Linear { element_mm: 1.0 }] {
        let contact = Contact::new(silicone(), level).unwrap();
        let springs = suspension();
        let (first, second) = (ball(2.0), ball(2.5));
        let press = |x: f64, force_n| Push::Pressed {
            from: Rigid::from_translation(DVec3::new(x, 0.0, 14.0)),
            way: -DVec3::Z,
            force_n,
        };
        let mut before: Option<PressedTogether> = None;
        // The first one hardly touches, and far down the dome.
        for (x, force_n) in [(8.0, 0.02), (4.0, 0.3), (4.0, 0.6)] {
            if x == 8.0 && level == Level::ClosedForm {
                continue;
            }
            let objects = [(&first, Some(press(x, force_n))), (&second, Some(press(-4.0, 0.5)))];
            let found = contact
                .press_together(&objects, Some(&springs), &Beside::default(), before.as_ref())
                .unwrap();
            assert_eq!(found.status, PressStatus::Balanced, "{level:?} {}", found.residual_n);
            let along = |k: usize| -found.objects[k].as_ref().unwrap().wrench.force_n.z;
            assert!((along(0) - force_n).abs() < 1e-6 && (along(1) - 0.5).abs() < 1e-6, "{level:?}");
            let displacement =
                domecast_springs::Displacement::of_pose(&found.rest_from_platform, springs.at_mm());
            let carried = springs.wrench_at(&displacement).unwrap();
            let off = (carried - found.wrench).to_array();
            assert!(
                off[..3].iter().all(|f| f.abs() < 1e-6) && off[3..].iter().all(|m| m.abs() < 2e-5),
                "{off:?}"
            );
            println!("{level:?}: {} solves, {:.1e} N", found.iterations, found.residual_n);
            before = Some(found).filter(|_| x == 4.0);
        }
    }
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let contact = linear(0.6);
    let object = ball(3.0);
    let pushes = pair(3.0, 3.0, 0.4);
    let objects = [(&object, Some(pushes[0])), (&object, Some(pushes[1]))];
    let met = contact.press_together(&objects, None, &Beside::default(), None);
    assert!(matches!(met, Err(ContactError::ObjectsMeet { objects: [0, 1], .. })), "{met:?}");
    let cuboid = Indenter::rigid(ContactSolid::cuboid(DVec3::splat(4.0)).unwrap());
    let at = |x: f64| Push::At(Rigid::from_translation(DVec3::new(x, 0.0, 11.5)));
    let objects = [(&cuboid, Some(at(1.8))), (&cuboid, Some(at(-1.9)))];
    let met = contact.press_together(&objects, None, &Beside::default(), None);
    assert!(matches!(met, Err(ContactError::ObjectsMeet { .. })), "{met:?}");
    // Closed forms know no other contact.
    let contact = Contact::new(silicone(), Level::ClosedForm).unwrap();
    let object = ball(1.2);
    let pushes = pair(1.2, 2.6, 0.9);
    let objects = [(&object, Some(pushes[0])), (&object, Some(pushes[1]))];
    let near = contact.press_together(&objects, None, &Beside::default(), None);
    let near = near.map(|found| found.wrench);
    assert!(
        matches!(&near, Err(ContactError::OfObject { error, .. }) if matches!(**error, ContactError::TooNear { .. })),
        "{near:?}"
    );
}

const STEP_S: f64 = 0.02;

fn relaxation() -> Relaxation {
    let term = |part, time_s| RelaxationTerm { part, time_s };
    Relaxation::new(vec![term(0.2, 0.1), term(0.15, 1.0)]).unwrap()
}

/// Forces (downwards) of a ball on a rigid mount that goes the depths, frame by frame, and the pole's displacement.
fn forces(friction: f64, depths_mm: impl Iterator<Item = f64>, step_s: f64) -> Vec<(f64, f64)> {
    let elastomer = Elastomer { friction, ..silicone() };
    let level = Level::Linear { element_mm: 1.0 };
    let (mut gel, contact) = GelMemory::new(relaxation(), step_s, &elastomer, level).unwrap();
    let object = ball(5.0);
    let mut before: Option<PressedTogether> = None;
    depths_mm
        .map(|depth_mm| {
            let objects = [(&object, Some(Push::At(above(15.0 - depth_mm))))];
            let found = contact.press_together(&objects, None, &gel.beside(), before.as_ref()).unwrap();
            assert_ne!(found.state.status, Status::BoundReached, "{depth_mm}");
            gel.take(found.objects.iter().flatten().map(|object| &object.state));
            let answer = (-found.wrench.force_n.z, -found.state.displacement_mm(DVec3::Z * 10.0).z);
            before = Some(found);
            answer
        })
        .collect()
}

#[test]
fn a_held_ball_loses_force_as_the_modulus_relaxes() {
    for friction in [0.0, 0.6] {
        let held = forces(friction, (0..60).map(|_| 0.7), STEP_S);
        let instant = linear(friction).solve(&ball(5.0), &above(14.3), None).unwrap().wrench.force_n.length();
        // The ramp of the first frame, exactly: int E(t - s) ds / dt over it.
        let (mut worst, mut worst_n) = (0.0_f64, 0.0_f64);
        for (k, (force_n, pole_mm)) in held.iter().enumerate() {
            let expected: f64 = 1.0
                - relaxation()
                    .terms()
                    .iter()
                    .map(|t| {
                        let x = STEP_S / t.time_s;
                        let gamma = -(-x).exp_m1() / x;
                        t.part * (1.0 - gamma * (-x * k as f64).exp())
                    })
                    .sum::<f64>();
            worst_n = worst_n.max((force_n / instant - expected).abs());
            worst = worst.max((pole_mm - held[0].1).abs());
        }
        println!("friction {friction}: {worst_n:.2e} of the force, {worst:.2e} mm of the shape");
        // Hats lie on a sphere through the moved node.
        assert!(worst_n < 2e-3 && worst < 1e-3);
    }
}

#[test]
fn unloading_lags_and_leaves_nothing_at_last() {
    let up_down =
        (0..=40).map(|k: i32| 0.7 * (1.0 - f64::from((k - 20).abs()) / 20.0)).chain((0..400).map(|_| 0.0));
    let found = forces(0.0, up_down, STEP_S);
    let work = |from: usize, to: usize| (from..to).map(|k| 0.5 * (found[k].0 + found[k + 1].0)).sum::<f64>();
    let (in_, out) = (work(0, 20), work(20, 40));
    println!("{in_} {out}");
    assert!(out < 0.95 * in_ && out > 0.3 * in_);
    assert!(found[39].0 == 0.0 && found[39].1 > 0.02, "free before it is back: {:?}", found[39]);
    assert!(found.last().unwrap().1 < 2e-3, "{:?}", found.last());
}

#[test]
fn a_slow_gel_needs_the_linear_level() {
    for level in [Level::Geometric, Level::ClosedForm] {
        let made = GelMemory::new(relaxation(), 0.1, &silicone(), level);
        assert!(matches!(made, Err(ContactError::NoSlowGel { .. })));
    }
    let term = |part, time_s| vec![RelaxationTerm { part, time_s }];
    for terms in [term(-0.1, 1.0), term(0.5, 0.0), term(0.5, f64::NAN), term(1.0, 1.0), term(f64::NAN, 1.0)] {
        assert!(Relaxation::new(terms).is_err());
    }
}
