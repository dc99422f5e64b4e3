//! Meshes against the exact shapes: deviation, volume, a second kernel.

use std::f64::consts::PI;

use super::*;
use domecast_mesh::{Chord, Construction, TriMesh, write_step};

const SWEEP_MM: [f64; 5] = [0.1, 0.03, 0.01, 0.003, 0.001];

/// Distance from the surface of united material less united tools, near it.
fn distance_mm(c: &Construction, p: DVec3) -> f64 {
    let nearest =
        |pieces: &[Piece]| pieces.iter().map(|x| x.signed_distance_mm(p)).fold(f64::INFINITY, f64::min);
    nearest(&c.added).max(-nearest(&c.cut)).abs()
}

fn at_tolerance(tolerance: f64) -> Vec<Part> {
    let mut m = Measures::of(&thumb24()).unwrap();
    // Walls are checked elsewhere; here only the meshes count.
    m.process.min_wall_mm = 0.0;
    m.chord = Chord::new(tolerance).unwrap();
    m.optical_chord = m.chord;
    build(&m, &[PrintPass::new(0.0, 0.0), PrintPass::new(0.6, 1.0)]).unwrap()
}

fn worst_deviation_mm(part: &Part) -> f64 {
    let mut worst = 0.0_f64;
    // The mesh before rounding has the same triangles; f32 moves a vertex by
    // less than 2e-6 mm here.
    for (i, [a, b, c]) in part.mesh.iter_mm().enumerate() {
        worst = worst.max(distance_mm(&part.construction, (a + b + c) / 3.0));
        // Corners and edges are shared: every third triangle is enough.
        if i % 3 == 0 {
            for p in [a, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)] {
                worst = worst.max(distance_mm(&part.construction, p));
            }
        }
    }
    worst
}

/// Closed form of the mould's halves: block less cavity less pin holes, plate
/// with pins less holes.
fn exact_volumes(m: &Measures) -> [f64; 2] {
    let (r, s) = (m.cavity_radius_mm(), m.mould.sealer_thickness_mm);
    let side = 2.0 * (r + m.mould.wall_mm);
    let pins = &m.mould.pins;
    let n = pins.at_mm.len() as f64;
    let hole = PI
        * (0.5 * pins.diameter_mm + pins.clearance_mm).powi(2)
        * (pins.height_mm + pins.depth_clearance_mm);
    let cavity =
        side * side * (s + r + m.mould.floor_mm) - 2.0 / 3.0 * PI * r.powi(3) - PI * r * r * s - n * hole;
    let (p, c) = (0.5 * pins.diameter_mm, pins.chamfer_mm);
    let tip = PI * c / 3.0 * (p * p + p * (p - c) + (p - c).powi(2));
    let pin = PI * p * p * (pins.height_mm - c) + tip;
    let (f, t) = (&m.mould.fill, m.mould.base_thickness_mm);
    let (a, b) = (0.5 * f.diameter_mm, 0.5 * f.funnel_diameter_mm);
    let fill = PI * a * a * (t - f.funnel_depth_mm) + PI * f.funnel_depth_mm / 3.0 * (a * a + a * b + b * b);
    let vents = f64::from(m.mould.vents.count) * PI * (0.5 * m.mould.vents.diameter_mm).powi(2) * t;
    [cavity, side * side * t + n * pin - fill - vents]
}

#[test]
fn volumes_converge_to_the_closed_form() {
    let m = Measures::of(&thumb24()).unwrap();
    let exact = exact_volumes(&m);
    let errors = |tolerance: f64| {
        let parts = at_tolerance(tolerance);
        [(2, exact[0]), (3, exact[1])].map(|(i, v)| {
            let off = (parts[i].volume_mm3 - v).abs();
            // Never more than the tolerance times the surface.
            assert!(off <= tolerance * parts[i].area_mm2, "{}: {off}", parts[i].name);
            off
        })
    };
    let (coarse, fine) = (errors(0.1), errors(0.001));
    // At least first order: a hundredth, with room for whole numbers of sides.
    // (In the cavity's block, pin holes that are cut wide and a sphere that
    // keeps its volume cancel in part, so the coarse one may be good by luck.)
    assert!(fine[1] < coarse[1] / 40.0, "{coarse:?} -> {fine:?}");
    assert!(fine[0] < 1e-5 * exact[0], "{coarse:?} -> {fine:?}");
}

#[test]
fn meshes_stay_within_the_tolerance_of_the_exact_shapes() {
    for tolerance in [0.1, 0.01] {
        for part in at_tolerance(tolerance) {
            let worst = worst_deviation_mm(&part);
            assert!(worst <= tolerance + 4e-6, "{} at {tolerance}: {worst}", part.name);
            // The check can fail: the mesh does use the tolerance up.
            if ["mould_cavity", "lower_platform"].contains(&part.name.as_str()) {
                assert!(worst > 0.3 * tolerance, "{} at {tolerance}: {worst}", part.name);
            }
        }
    }
}

#[test]
fn long_every_part_is_sound_at_every_tolerance() {
    let finest = at_tolerance(SWEEP_MM[4]);
    for tolerance in SWEEP_MM {
        for (part, reference) in at_tolerance(tolerance).iter().zip(&finest) {
            // `build` has looked at the welded mesh; the volume belongs to it.
            let found = part.inspect();
            assert!(
                found.is_one_solid() && found.genus() == Some(part.genus),
                "{} at {tolerance}",
                part.name
            );
            let off = (part.volume_mm3 - reference.volume_mm3).abs();
            assert!(off <= tolerance * part.area_mm2, "{} at {tolerance}: {off}", part.name);
            assert!(worst_deviation_mm(part) <= tolerance + 4e-6, "{} at {tolerance}", part.name);
        }
    }
}

/// A piece, as `scripts/exact_volumes.py` reads it.
fn piece_json(piece: &Piece) -> serde_json::Value {
    let map = piece.part_from_shape;
    let rows = [map.matrix3.row(0), map.matrix3.row(1), map.matrix3.row(2)].map(|row| row.to_array());
    let shape = match &piece.shape {
        Shape::Turned { profile, .. } => serde_json::json!({
            "points": profile.points_mm.iter().map(|p| p.to_array()).collect::<Vec<_>>(),
            "arc_centers": profile.edges.iter().map(|edge| match edge {
                domecast_mesh::ProfileEdge::Line => None,
                domecast_mesh::ProfileEdge::Arc { center_z_mm } => Some(*center_z_mm),
            }).collect::<Vec<_>>(),
        }),
        Shape::Prism { outline_mm, corner_radius_mm, bottom_z_mm, top_z_mm } => serde_json::json!({
            "outline": outline_mm.iter().map(|p| p.to_array()).collect::<Vec<_>>(),
            "radius": corner_radius_mm, "heights": [bottom_z_mm, top_z_mm],
        }),
    };
    serde_json::json!({ "shape": shape, "matrix": rows, "origin": map.translation.to_array() })
}

/// Volumes of the exact solids by OpenCASCADE, whose shapes have no facets; `None` where it is not at hand.
fn exact_volumes_by_opencascade(parts: &[Part]) -> Option<Vec<f64>> {
    let python = std::env::var_os("DOMECAST_PYTHON")?;
    let pieces = |list: &[Piece]| list.iter().map(piece_json).collect::<Vec<_>>();
    let all: Vec<_> = parts
        .iter()
        .map(|p| serde_json::json!({ "added": pieces(&p.construction.added), "cut": pieces(&p.construction.cut) }))
        .collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("constructions.json");
    std::fs::write(&path, serde_json::to_vec(&all).unwrap()).unwrap();
    let said = std::process::Command::new(python)
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scripts/exact_volumes.py"))
        .arg(&path)
        .output()
        .unwrap();
    if said.status.code() == Some(3) {
        println!("skipped: OpenCASCADE (cadquery-ocp) is not installed");
        return None;
    }
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    Some(serde_json::from_slice(&said.stdout).unwrap())
}

/// Every part's volume goes to that of the exact solid, at least as fast as the tolerance: no step of the sweep
/// is worse, for its tolerance, than the coarse ones.
#[test]
fn long_every_volume_converges_to_the_exact_solid() {
    let Some(exact) = exact_volumes_by_opencascade(&at_tolerance(SWEEP_MM[0])) else { return };
    let m = Measures::of(&thumb24()).unwrap();
    for (i, closed_form) in [(2, exact_volumes(&m)[0]), (3, exact_volumes(&m)[1])] {
        assert!((exact[i] / closed_form - 1.0).abs() < 1e-9, "{}: {} {closed_form}", i, exact[i]);
    }
    let mut off = vec![Vec::new(); exact.len()];
    for tolerance in SWEEP_MM {
        for ((part, volume), list) in at_tolerance(tolerance).iter().zip(&exact).zip(&mut off) {
            let error = (part.volume_mm3 - volume).abs();
            assert!(error <= tolerance * part.area_mm2, "{} at {tolerance}: {error}", part.name);
            list.push((part.name.clone(), tolerance, error));
        }
    }
    for ((steps, volume), i) in off.iter().zip(&exact).zip(0..) {
        let line: Vec<String> = steps.iter().map(|(_, t, e)| format!("{t}: {e:.2e}")).collect();
        println!("{:16} {volume:12.5} mm3, off by {}", steps[0].0, line.join(", "));
        // What OpenCASCADE's own integration is sure of.
        let floor = 1e-8 * volume;
        let worst = |part: &[(String, f64, f64)]| part.iter().map(|(_, t, e)| e / t).fold(0.0, f64::max);
        let (coarse, fine) = (worst(&steps[..3]), worst(&steps[3..]));
        let allowed = coarse * 1.5 + floor / SWEEP_MM[4];
        assert!(
            fine <= allowed,
            "{i} {}: {fine} mm2 of error by tolerance, coarse ones {coarse}",
            steps[0].0
        );
    }
}

/// Another kernel, which shares no code with ours, gets the same volume.
#[test]
fn second_kernel_agrees() {
    use boolmesh::prelude::{Manifold, OpType, compute_boolean};
    fn other(mesh: &TriMesh) -> Manifold {
        let positions: Vec<f64> = mesh.vertices_mm.iter().flat_map(|v| v.to_array()).collect();
        let indices: Vec<usize> = mesh.triangles.iter().flatten().map(|&i| i as usize).collect();
        Manifold::new(&positions, &indices).unwrap()
    }
    for part in at_tolerance(0.05).iter().take(6) {
        let chord = Chord::new(0.05).unwrap();
        let mesh = |p: &Piece| {
            let chord = p.chord.unwrap_or(chord);
            p.shape.triangulate(&p.name, chord).unwrap().transformed(&p.part_from_shape)
        };
        let join = |pieces: &[Piece]| {
            pieces
                .iter()
                .map(|p| other(&mesh(p)))
                .reduce(|a, b| compute_boolean(&a, &b, OpType::Add).unwrap())
        };
        let mut body = join(&part.construction.added).unwrap();
        if let Some(tools) = join(&part.construction.cut) {
            body = compute_boolean(&body, &tools, OpType::Subtract).unwrap();
        }
        let result = TriMesh {
            vertices_mm: body.ps.iter().map(|p| DVec3::new(p.x, p.y, p.z)).collect(),
            triangles: body
                .hs
                .chunks(3)
                .map(|t| [t[0].tail as u32, t[1].tail as u32, t[2].tail as u32])
                .collect(),
        };
        let relative = (result.volume_mm3() / part.volume_mm3 - 1.0).abs();
        assert!(relative < 1e-9, "{}: {relative}", part.name);
    }
}

#[test]
fn step_keeps_exact_faces_where_it_can() {
    let parts = at_tolerance(0.1);
    let exact: Vec<&str> =
        parts.iter().filter(|p| p.exact_solid().is_some()).map(|p| p.name.as_str()).collect();
    assert_eq!(exact, ["mould_cavity", "mould_base", "acrylic_sheet", "marker_stencil", "fit_coupon"]);
    // Block: 6 faces; cavity: the thirds of a half sphere and of a cylinder; three blind holes of three thirds of a
    // cylinder and a floor.
    let cavity = parts[2].exact_solid().unwrap();
    assert_eq!(cavity.face_iter().count(), 6 + 6 + 3 * 4);
    let step = write_step(&cavity, "mould_cavity").unwrap();
    assert_eq!(step.matches("=SPHERICAL_SURFACE(").count(), 3);
    assert_eq!(step.matches("=CYLINDRICAL_SURFACE(").count(), 3 + 3 * 3);
    assert_eq!(step.matches("=ADVANCED_FACE(").count(), 24);
    let faceted = parts[0].mesh.faceted_solid();
    assert_eq!(faceted.face_iter().count(), parts[0].mesh.triangles.len());
}
