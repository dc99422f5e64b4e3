mod boards;
mod checks;
mod domes;
mod exactness;
mod hood;
mod mechanism;
mod random_designs;
mod rigid;
mod seats;
mod strokes;
mod sweep;
mod walls;

use std::path::Path;
use std::str::FromStr;

use glam::DVec3;

use super::*;
use crate::spec::Design;
use domecast_mesh::{Fit, Piece, RayTarget, Shape, Solid};

pub(crate) fn thumb24() -> Design {
    Design::load(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json"))).unwrap()
}

/// A sensor whose lights stand close under the sheet.
const NEAR_LIGHTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/common/near-lights.json");

fn passes() -> Vec<PrintPass> {
    vec![PrintPass::new(0.0, 0.0)]
}

fn solid(part: &Part) -> Solid {
    Solid::from_mesh(&part.mesh).unwrap()
}

#[test]
fn every_design_gives_sound_parts() {
    for entry in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "json") {
            let parts = build(&Measures::of(&Design::load(&path).unwrap()).unwrap(), &passes()).unwrap();
            assert!(parts.len() >= 4);
            for part in &parts {
                let found = part.inspect();
                assert!(found.is_one_solid(), "{}: {:?}", part.name, found.problem());
                assert_eq!(found.genus(), Some(part.genus), "{}", part.name);
                assert!((found.volume_mm3 / part.volume_mm3 - 1.0).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn files_are_the_same_bytes_on_any_number_of_threads() {
    let mut design: serde_json::Value = serde_json::from_str(
        &std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json")).unwrap(),
    )
    .unwrap();
    design["mesh"]["chord_tolerance_mm"] = 0.05.into();
    design["mesh"]["optical_chord_tolerance_mm"] = 0.05.into();
    let design = Design::from_str(&design.to_string()).unwrap();
    let bytes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let measures = Measures::of(&design).unwrap();
            let parts = build(&measures, &passes()).unwrap();
            let assembly = Assembly::of(&measures, &parts).unwrap();
            files(&design, &measures, &parts, &assembly).unwrap()
        })
    };
    let one = bytes(1);
    for (a, b, c) in one.iter().zip(bytes(3)).zip(bytes(1)).map(|((a, b), c)| (a, b, c)) {
        assert!(a.path == b.path && a.bytes == b.bytes && a.bytes == c.bytes, "{}", a.path);
    }
    assert!(one.len() > 30, "{}", one.len());
}

/// Every ray that the camera needs, at every position of the springs, passes
/// the platform; the same rays hit it if the platform is wrongly placed.
#[test]
fn window_lets_the_view_through() {
    let design = thumb24();
    let parts = build(&Measures::of(&design).unwrap(), &passes()).unwrap();
    let upper = RayTarget::new(&parts[0].mesh);
    let optics = design.optics();
    let marker_mm = design.sections().white_markers.diameter_mm;
    let mut rays = 0;
    for travel in [0.0, 0.7, 2.03] {
        let moved = optics
            .at_pose(&domecast_optics::numeric::Rigid::from_translation(DVec3::NEG_Z * travel))
            .unwrap();
        for marker in design.white_markers_mm() {
            for k in 0..16 {
                let edge =
                    glam::DVec2::from_angle(f64::from(k) * std::f64::consts::FRAC_PI_8) * (0.5 * marker_mm);
                let pixel = moved.project(marker + edge.extend(0.0)).unwrap();
                let direction = moved.sensor_from_camera().vector(moved.lens().unproject(pixel).unwrap());
                let from = moved.sensor_from_camera().translation_mm;
                let under_sheet = from + direction * ((-1.0 - from.z) / direction.z);
                assert_eq!(upper.first_hit(from, under_sheet), None, "travel {travel}, marker {marker}");
                // Twice the margin farther out there is the platform.
                let shift = under_sheet.truncate().normalize() * 0.4;
                let outside = under_sheet + shift.extend(0.0);
                rays += usize::from(upper.first_hit(from, outside).is_some());
            }
        }
    }
    assert!(rays > 10, "the window is not tight: {rays}");
}

/// The camera, the sheet and the dome as solids fit where the design says.
#[test]
fn purchased_parts_fit_their_seats() {
    let design = thumb24();
    let m = Measures::of(&design).unwrap();
    let parts = build(&m, &passes()).unwrap();
    let chord = domecast_mesh::Chord::new(0.001).unwrap();
    let overlap = |part: &Part, shape: Shape| {
        let tool = Piece::new("stand-in", shape).solid(chord).unwrap();
        solid(part).intersection(&tool).unwrap().map_or(0.0, |s| s.volume_mm3())
    };
    let (upper, lower) = (&parts[0], &parts[1]);
    // Camera: 7.5 mm in a bore of 7.7; 0.11 mm more on the radius bites.
    let camera = |r: f64| Shape::cylinder(r, -15.7, -9.2, Fit::Inside);
    assert!(overlap(lower, camera(3.75)) == 0.0);
    assert!(overlap(lower, camera(3.861)) > 0.01);
    // Sheet: in its recess with 0.15 mm on each side, lying on the seat.
    let sheet = |grow: f64, sink: f64| {
        let h = 10.8 + grow;
        Shape::cuboid(DVec3::new(-h, -h, -1.0 - sink), DVec3::new(h, h, 0.0))
    };
    assert!(overlap(upper, sheet(0.0, 0.0)) < 1e-6);
    assert!(overlap(upper, sheet(0.149, 0.0)) < 1e-3);
    assert!(overlap(upper, sheet(0.16, 0.0)) > 0.1);
    assert!(overlap(upper, sheet(0.0, 0.01)) > 0.1, "the sheet lies on its seat");
    // Magnets, flush, in both platforms.
    for axis in &m.spring_axes_mm {
        let (under, top) = (m.platforms.upper.underside_z_mm, m.lower_top_z_mm);
        for (part, low, high) in [(upper, under, under + 1.0), (lower, top - 1.0, top)] {
            let tool = Piece::new("magnet", Shape::cylinder(1.5, low, high, Fit::Inside)).at(axis.x, axis.y);
            let tool = tool.solid(chord).unwrap();
            assert!(solid(part).intersection(&tool).unwrap().is_none(), "{} at {axis}", part.name);
        }
    }
}

/// The silicone that fills the closed, sealed mould and shrinks is the dome.
#[test]
fn mould_casts_the_dome() {
    let design = thumb24();
    let m = Measures::of(&design).unwrap();
    let cavity = &build(&m, &passes()).unwrap()[2];
    let radius = m.cavity_radius_mm();
    let expected = design.sections().dome.radius_mm / (1.0 - m.shrinkage) + m.mould.sealer_thickness_mm;
    assert!((radius - expected).abs() < 1e-12);
    // The cavity's lowest point, measured on the mesh by a ray down the axis.
    let depth = -expected - m.mould.sealer_thickness_mm;
    let hit = RayTarget::new(&cavity.mesh)
        .first_hit(DVec3::new(0.01, 0.02, 1.0), DVec3::new(0.01, 0.02, -20.0))
        .unwrap()
        .0;
    assert!((1.0 - hit * 21.0 - depth).abs() < m.optical_chord.tolerance_mm(), "{hit}");
}

#[test]
fn contradictions_name_the_field() {
    let good = Measures::of(&thumb24()).unwrap();
    let mut bad = good.clone();
    bad.sheet_size_mm *= 0.8;
    let error = build(&bad, &passes()).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("sheet.size_mm"), "{error}");

    let mut bad = good.clone();
    bad.platforms.lower.clamp.azimuth_deg = vec![90.0];
    assert!(build(&bad, &passes()).map(|_| ()).unwrap_err().to_string().contains("lower_platform"));

    let mut bad = good;
    bad.mould.pins.chamfer_mm = 5.0;
    assert!(build(&bad, &passes()).map(|_| ()).unwrap_err().to_string().contains("mould.pins.chamfer_mm"));
}
