//! The wall check against walls of known thickness.

use glam::{DAffine3, DVec3};

use super::*;
use crate::parts::{Blueprint, Feature, walls};

const LIMIT_MM: f64 = 0.6;

fn slab() -> Blueprint {
    let mut b = Blueprint::new("slab", "test piece", domecast_mesh::Chord::new(0.05).unwrap());
    let plate = Shape::cuboid(DVec3::new(-12.0, -9.0, 0.0), DVec3::new(12.0, 9.0, 5.0));
    b.added.push(Feature::new("plate", "plate.size", plate));
    b
}

fn hole(radius_mm: f64) -> Shape {
    Shape::cylinder(radius_mm, -1.0, 6.0, Fit::Outside)
}

/// Passes a hundredth of a millimetre above the limit, and is refused as much below it; by a mesh of its own and by
/// the part's.
#[track_caller]
fn turns_at_the_limit(field: &str, make: impl Fn(f64) -> Blueprint) {
    turns(field, &make, false);
    turns(field, &make, true);
}

#[track_caller]
fn turns(field: &str, make: &dyn Fn(f64) -> Blueprint, by_the_parts_mesh: bool) {
    let mut m = Measures::of(&thumb24()).unwrap();
    m.process.min_wall_mm = LIMIT_MM;
    let check = |wall_mm: f64| {
        let mut b = make(wall_mm);
        b.chord = domecast_mesh::Chord::new(0.01).unwrap();
        let made = by_the_parts_mesh.then(|| b.construction().solid(b.chord).unwrap().to_mesh());
        walls::check(&b, &m, made.as_ref())
    };
    assert_eq!(check(LIMIT_MM + 0.01), Ok(()));
    match check(LIMIT_MM - 0.01) {
        Err(PartError::Infeasible { value_mm, limit_mm, field: named, .. }) => {
            assert!((value_mm - (LIMIT_MM - 0.01)).abs() < 0.003, "{value_mm}");
            assert_eq!(limit_mm, LIMIT_MM);
            assert!(named.contains(field), "{named}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn between_two_holes() {
    // Along a line that no corner of the polygons lies on.
    turns_at_the_limit("hole.a", |wall| {
        let way = glam::DVec2::from_angle(0.3) * (2.0 + 1.5 + wall);
        let mut b = slab();
        b.cut.push(Feature::new("hole a", "hole.a", hole(2.0)).at(0.0, 0.0));
        b.cut.push(Feature::new("hole b", "hole.b", hole(1.5)).at(way.x, way.y));
        b
    });
}

#[test]
fn between_a_hole_and_the_outside() {
    turns_at_the_limit("hole", |wall| {
        let mut b = slab();
        b.cut.push(Feature::new("hole", "hole", hole(0.4)).at(3.0, 9.0 - 0.4 - wall));
        b
    });
    // Lying, turned by an angle that puts no corner of its polygon on top.
    turns_at_the_limit("hole", |wall| {
        let lying = DAffine3::from_translation(DVec3::new(0.0, 0.0, 5.0 - 0.7 - wall))
            * DAffine3::from_rotation_x(std::f64::consts::FRAC_PI_2)
            * DAffine3::from_rotation_z(0.2);
        let shape = Shape::cylinder(0.7, -20.0, 20.0, Fit::Outside);
        let mut b = slab();
        b.cut.push(Feature::new("hole", "hole", shape).placed(lying));
        b
    });
}

#[test]
fn floor_under_a_slanting_pocket() {
    // Thinnest under one corner of its floor alone.
    turns_at_the_limit("pocket", |wall| {
        let tilt: f64 = 0.2;
        let (half, depth) = (1.0, 2.0);
        let lowest = half * tilt.sin() + depth * tilt.cos();
        let placed =
            DAffine3::from_translation(DVec3::new(0.0, 0.0, lowest + wall)) * DAffine3::from_rotation_y(tilt);
        let shape = Shape::cuboid(DVec3::new(-half, -half, -depth), DVec3::new(half, half, 8.0));
        let mut b = slab();
        b.cut.push(Feature::new("pocket", "pocket", shape).placed(placed));
        b
    });
}

#[test]
fn all_thin_walls_come_together() {
    let mut m = Measures::of(&thumb24()).unwrap();
    m.process.min_wall_mm = LIMIT_MM;
    let mut b = slab();
    b.cut.push(Feature::new("hole a", "hole.a", hole(2.0)).at(0.0, 0.0));
    b.cut.push(Feature::new("hole b", "hole.b", hole(1.5)).at(3.5 + 0.3, 0.0));
    b.cut.push(Feature::new("hole b", "hole.b", hole(1.5)).at(-3.5 - 0.2, 0.0));
    b.cut.push(Feature::new("hole c", "hole.c", hole(1.0)).at(0.0, 3.4));
    let Err(PartError::Several(walls)) = walls::check(&b, &m, None) else { panic!("two kinds of walls") };
    let named: Vec<(&str, f64)> = walls
        .iter()
        .map(|wall| match wall {
            PartError::Infeasible { field, value_mm, .. } => (field.as_str(), *value_mm),
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(named.len(), 2, "{named:?}");
    assert!(named[0].0 == "hole.a or hole.b" && (named[0].1 - 0.2).abs() < 0.003, "the thinnest: {named:?}");
    assert!(named[1].0 == "hole.a or hole.c" && (named[1].1 - 0.4).abs() < 0.003, "{named:?}");
}
