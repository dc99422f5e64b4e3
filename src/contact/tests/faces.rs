//! The same object as a mesh and by its formulas, and walls thinner than the nodes are apart.

use glam::DVec3;

use super::{box_mesh, silicone};
use crate::*;
use domecast_optics::numeric::Rigid;

fn smooth(element_mm: f64) -> Contact {
    let elastomer = Elastomer { friction: 0.0, ..silicone() };
    Contact::new(elastomer, Level::Linear { element_mm }).unwrap()
}

fn force(contact: &Contact, solid: &ContactSolid, at_mm: DVec3) -> DVec3 {
    let object = Indenter::rigid(solid.clone());
    let state = contact.solve(&object, &Rigid::from_translation(at_mm), None).unwrap();
    assert_eq!(state.status, Status::Solved, "{at_mm}: {} {}", state.residual_mm, state.penetration_mm);
    state.wrench.force_n
}

#[test]
fn a_box_is_a_box_as_a_mesh_too() {
    let contact = smooth(1.0);
    let size = DVec3::new(5.0, 6.0, 7.0);
    let (exact, mesh) = (ContactSolid::cuboid(size).unwrap(), ContactSolid::mesh(&box_mesh(size)).unwrap());
    for (x, depth) in [(0.0, 0.2), (0.3, 0.7), (3.0, 0.5)] {
        let at = DVec3::new(x, 0.1, 10.0 - depth + 3.5);
        let apart = force(&contact, &exact, at) - force(&contact, &mesh, at);
        assert!(apart.length() < 1e-6, "{x} {depth}: {apart}");
    }
}

#[test]
fn long_a_thin_wall_is_met_wherever_it_comes_down() {
    let wall = ContactSolid::cuboid(DVec3::new(10.0, 0.4, 6.0)).unwrap();
    let fine = smooth(0.3);
    for depth in [0.4, 1.0] {
        let expected = -force(&fine, &wall, DVec3::new(0.0, 0.07, 13.0 - depth)).z;
        // A wall of less than an element presses on whole ones: it is taken for wider than it is.
        for (element_mm, within) in [(1.0, 0.6), (0.5, 0.25)] {
            let contact = smooth(element_mm);
            for y in [0.0, 0.07, 0.2, 0.33, 0.5, 0.77] {
                // As deep at its place as on the pole.
                let z = 13.0 - depth - (10.0 - (100.0_f64 - y * y).sqrt());
                let found = force(&contact, &wall, DVec3::new(0.0, y, z));
                let off = -found.z / expected - 1.0;
                println!("{element_mm} {depth} {y}: {off}");
                assert!(off.abs() < within, "{element_mm} {depth} {y}: {off}");
                // The wall and the grid are the same on both sides of x = 0.
                assert!(found.x.abs() < 1e-6 && found.y.abs() < 0.02 * expected, "{found}");
            }
        }
    }
}

#[test]
fn a_little_more_depth_is_a_little_more_force() {
    let wall = ContactSolid::cuboid(DVec3::new(10.0, 0.4, 6.0)).unwrap();
    let contact = smooth(0.5);
    let mut last = 0.0;
    for step in 0..16 {
        let depth = 0.6 + 0.01 * f64::from(step);
        let found = -force(&contact, &wall, DVec3::new(0.0, 0.13, 13.0 - depth)).z;
        assert!(step == 0 || (found > last && found < 1.05 * last), "{depth}: {last} {found}");
        last = found;
    }
}

#[test]
fn a_needle_between_the_nodes_is_said() {
    let contact = smooth(1.0);
    let needle = Indenter::rigid(ContactSolid::cylinder(0.05, 6.0).unwrap());
    let pose = Rigid::from_translation(DVec3::new(0.29, 0.17, 12.0));
    let reported = contact.solve(&needle, &pose, None).unwrap_err();
    assert!(matches!(reported, ContactError::Unseen { .. }), "{reported}");
}
