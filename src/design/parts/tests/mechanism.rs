//! Springs as they bend, the corners of the load envelope, and the mould as it opens.

use super::*;
use crate::parts::purchased;
use crate::parts::undercut::{Undercut, undercut};
use domecast_mesh::{Chord, Construction};
use domecast_optics::numeric::Rigid;

fn made(added: Vec<Piece>, cut: Vec<Piece>) -> domecast_mesh::TriMesh {
    Construction { added, cut }.solid(Chord::new(0.02).unwrap()).unwrap().to_mesh().welded_f32()
}

#[test]
fn cavity_that_closes_over_the_cast_is_an_undercut() {
    let block =
        || Piece::new("block", Shape::cuboid(DVec3::new(-14.0, -14.0, -16.0), DVec3::new(14.0, 14.0, 0.0)));
    let ball = |depth: f64| {
        let profile = domecast_mesh::Profile {
            points_mm: vec![
                glam::DVec2::new(0.0, depth - 10.0),
                glam::DVec2::new(10.0, depth),
                glam::DVec2::new(0.0, depth + 10.0),
            ],
            edges: vec![domecast_mesh::ProfileEdge::Arc { center_z_mm: depth }; 2],
        };
        Piece::new("ball", Shape::Turned { profile, fit: Fit::Area })
    };
    // Centre on the parting plane: the cast lifts out. 2 mm below it: the rim closes over it, as wide as the sphere
    // is deeper than its mirror image above the equator.
    assert_eq!(undercut(&made(vec![block()], vec![ball(0.0)]), 1.0), None);
    let Some(Undercut { at_mm, gap_mm }) = undercut(&made(vec![block()], vec![ball(-2.0)]), 1.0) else {
        panic!("the undercut is not seen")
    };
    assert!(at_mm.z > -2.0 && (3.0..=4.05).contains(&gap_mm), "{at_mm} {gap_mm}");
    // A pocket in the wall, reached from the cavity.
    let slot = Piece::new("slot", Shape::cuboid(DVec3::new(5.0, -1.0, -6.0), DVec3::new(12.0, 1.0, -5.0)));
    let found = undercut(&made(vec![block()], vec![ball(0.0), slot]), 1.0).unwrap();
    assert!((found.at_mm.z + 5.0).abs() < 1e-6 && found.gap_mm <= 1.0 + 1e-4, "{found:?}");
    // The other way round it is the pin's head that locks.
    let head = Piece::new("head", Shape::cylinder(2.0, -5.0, -4.0, Fit::Inside));
    let neck = Piece::new("neck", Shape::cylinder(1.0, -4.5, 1.0, Fit::Inside));
    let plate = Piece::new("plate", Shape::cuboid(DVec3::new(-9.0, -9.0, 0.0), DVec3::new(9.0, 9.0, 3.0)));
    let found = undercut(&made(vec![plate, neck, head], vec![]), -1.0).unwrap();
    assert!((found.gap_mm - 4.0).abs() < 1e-4, "{found:?}");
}

#[test]
fn both_halves_of_the_mould_open() {
    let parts = build(&Measures::of(&thumb24()).unwrap(), &passes()).unwrap();
    assert_eq!(undercut(&parts[2].mesh, 1.0), None);
    assert_eq!(undercut(&parts[3].mesh, -1.0), None);
}

#[test]
fn bent_springs_stand_flat_on_both_seats() {
    let m = Measures::of(&thumb24()).unwrap();
    let chord = Chord::new(0.01).unwrap();
    let tilt = Rigid::new(glam::DMat3::from_rotation_y(0.08), DVec3::new(0.5, -0.3, -0.9));
    for i in 0..m.spring_axes_mm.len() {
        let (tube, _) = purchased::spring_tube(&m, i, &tilt, chord).unwrap();
        assert!(domecast_mesh::inspect(&tube).is_one_solid());
        let [low, high] = purchased::spring_ends_mm(&m, i, &tilt);
        let up = tilt.vector(DVec3::Z);
        for &p in &tube.vertices_mm {
            assert!(p.z > low.z && (p - high).dot(up) < 0.0, "{p} digs into a seat");
        }
        // As wide as the coils, or a little wider: they grow when pressed.
        let volume = std::f64::consts::PI * (0.5 * m.spring_outer_mm).powi(2) * (high - low).length() * 0.96;
        assert!((1.0..1.1).contains(&(tube.volume_mm3() / volume)), "{}", tube.volume_mm3() / volume);
    }
}

#[test]
fn poses_reach_the_corners_of_the_envelope() {
    let m = Measures::of(&thumb24()).unwrap();
    let find = |word: &str| m.poses.iter().filter(|p| p.name.contains(word)).count();
    assert_eq!(m.poses[0].name, "at rest");
    assert_eq!(find("under the load"), thumb24().sections().loads.claims.len());
    // Press, pull, twist, and eight each of pushes, presses at 45 degrees and tilts.
    assert_eq!(find("end of the load envelope"), 3 + 3 * 8);
    let pull = m.poses.iter().find(|p| p.name.contains("pull")).unwrap();
    assert!(pull.rest_from_platform.translation_mm.z > 0.1, "{pull:?}");
}

/// What fits at rest and under the claims, but not where the envelope ends, is refused there.
#[test]
fn corners_of_the_envelope_are_checked() {
    let mut m = Measures::of(&thumb24()).unwrap();
    m.poses.retain(|p| p.name == "at rest" || p.name.contains("push at the pole"));
    m.camera_body.min_sheet_gap_mm = 8.15;
    let parts = build(&m, &passes()).unwrap();
    let assembly = Assembly::of(&m, &parts).unwrap();
    let said = check_assembly(&m, &parts, &assembly).unwrap_err().to_string();
    assert!(said.contains("gap") && said.contains("end of the load envelope, push"), "{said}");
}
