use crate::numeric::SeededRandom;
use glam::{DVec2, DVec3};
use nalgebra::{Matrix6, Vector6};

use super::*;
use crate::camera::{LensModel, LensSpec};
use crate::numeric::{Rigid, rotation_from_vector, vector_from_rotation};
use crate::refraction::{FlatLayer, OpticsSpec, SensorOptics};

fn thumb(model: LensModel) -> SensorOptics {
    let f = 229.18;
    let distortion = match model {
        LensModel::Pinhole => vec![],
        LensModel::BrownConrady => vec![-0.2917, 0.0878, 0.0, 0.0, -0.01156],
        LensModel::KannalaBrandt => vec![0.0; 4],
    };
    let layer =
        |name: &str, index, thickness_mm| FlatLayer { name: name.into(), index: [index; 3], thickness_mm };
    SensorOptics::new(&OpticsSpec {
        lens: LensSpec {
            model,
            width: 640,
            height: 480,
            matrix: [[f, 0.0, 319.5], [0.0, f, 239.5], [0.0, 0.0, 1.0]],
            distortion,
            field_of_view_rad: 160_f64.to_radians(),
            pupil_shift_mm: vec![],
        },
        sensor_from_camera: Rigid::from_translation(DVec3::new(0.0, 0.0, -10.0)),
        layers: vec![layer("acrylic", 1.491, Some(1.0)), layer("silicone", 1.41, None)],
        dome: crate::DomeShape::hemisphere(10.0),
    })
    .unwrap()
}

fn square(half_mm: f64, diameter_mm: f64) -> Vec<Marker> {
    let signs = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
    let marker = |(id, [x, y]): (u32, [f64; 2])| Marker {
        id,
        position_mm: DVec3::new(half_mm * x, half_mm * y, 0.0),
        diameter_mm,
    };
    (0..4).zip(signs).map(marker).collect()
}

fn solver(model: LensModel) -> PoseSolver {
    PoseSolver::new(&thumb(model), &square(7.5, 0.8), PoseOptions::new(0.1, 5.0)).unwrap()
}

fn pose(x: [f64; 6]) -> Rigid {
    Rigid::new(rotation_from_vector(DVec3::new(x[3], x[4], x[5])), DVec3::new(x[0], x[1], x[2]))
}

fn sightings(solver: &PoseSolver, pose: &Rigid) -> Vec<Sighting> {
    let optics = solver.optics().at_pose(pose).unwrap();
    let see = |m: &Marker| Sighting { id: m.id, centroid_px: m.image(&optics).unwrap().centroid_px };
    solver.markers().iter().map(see).collect()
}

fn miss(a: &Rigid, b: &Rigid) -> (f64, f64) {
    let between = a.compose(&b.inverse());
    (between.translation_mm.length(), vector_from_rotation(&between.rotation).length())
}

#[test]
fn exact_pixels_give_the_pose_at_every_tilt() {
    for model in [LensModel::Pinhole, LensModel::BrownConrady, LensModel::KannalaBrandt] {
        let solver = solver(model);
        for tilt in [0.0, 1e-8, 1e-6, 1e-3, 0.05, 0.1] {
            for axis in [DVec3::X, DVec3::Y, -DVec3::X, DVec3::new(0.6, -0.8, 0.0), DVec3::Z] {
                for shift in [DVec3::ZERO, DVec3::new(0.3, -0.2, -1.5), DVec3::new(0.0, 0.0, 0.4)] {
                    let truth = Rigid::new(rotation_from_vector(axis * tilt), shift);
                    let found = solver.solve(&sightings(&solver, &truth)).unwrap();
                    let (mm, rad) = miss(&found.pose, &truth);
                    assert!(mm < 2e-8 && rad < 1e-9, "{model:?} {tilt} {axis} {shift}: {mm:e} {rad:e}");
                    assert!(found.iterations <= 8, "{}", found.iterations);
                    assert!(!found.is_ambiguous());
                }
            }
        }
    }
}

// The camera upside down under a plane that faces away in x: the other orientation of the plane.
#[test]
fn the_plane_may_be_turned_in_the_camera() {
    let base = thumb(LensModel::KannalaBrandt);
    for turn in [DVec3::new(0.0, 0.0, 3.1), DVec3::new(0.02, -0.03, 1.5), DVec3::new(1e-8, 0.0, -2.0)] {
        let spec = OpticsSpec {
            lens: base.lens().spec().clone(),
            sensor_from_camera: Rigid::new(rotation_from_vector(turn), DVec3::new(0.1, 0.0, -10.0)),
            layers: base.layers()[1..].to_vec(),
            dome: crate::DomeShape::hemisphere(10.0),
        };
        let optics = SensorOptics::new(&spec).unwrap();
        let solver = PoseSolver::new(&optics, &square(7.0, 0.8), PoseOptions::new(0.1, 5.0)).unwrap();
        for tilt in [0.0, 1e-8, 1e-6] {
            let truth = pose([0.0, 0.1, -0.5, tilt, -tilt, 0.0]);
            let found = solver.solve(&sightings(&solver, &truth)).unwrap();
            let (mm, rad) = miss(&found.pose, &truth);
            assert!(mm < 2e-8 && rad < 1e-9);
        }
    }
}

#[test]
fn noise_gives_the_bound_and_no_flips() {
    for model in [LensModel::BrownConrady, LensModel::KannalaBrandt] {
        let solver = solver(model);
        for x in [[0.0; 6], [0.2, 0.1, -1.5, 0.03, -0.02, 0.02]] {
            let truth = pose(x);
            let exact = sightings(&solver, &truth);
            let bound = solver.solve(&exact).unwrap().covariance();
            let (mut sum, mut noise) = (Matrix6::zeros(), SeededRandom::new(7));
            let count = 4000;
            for _ in 0..count {
                let mut seen = exact.clone();
                for s in &mut seen {
                    s.centroid_px += DVec2::new(noise.normal(), noise.normal()) * 0.1;
                }
                let found = solver.solve(&seen).unwrap();
                assert!(!found.is_ambiguous());
                let between = found.pose.compose(&truth.inverse());
                let (t, r) = (between.translation_mm, vector_from_rotation(&between.rotation));
                let e = Vector6::new(t.x, t.y, t.z, r.x, r.y, r.z);
                sum += e * e.transpose();
            }
            for i in 0..6 {
                let ratio = (sum[(i, i)] / f64::from(count) / bound[(i, i)]).sqrt();
                assert!((0.95..1.05).contains(&ratio), "axis {i}: {ratio}");
            }
        }
    }
}

#[test]
fn the_displacement_covariance_is_that_of_the_displacement() {
    let at = DVec3::new(0.3, -0.2, -7.5);
    let base = pose([0.2, -0.4, -1.0, 0.2, -0.3, 0.5]);
    let transfer = displacement_from_motion(&base, at);
    let of = |pose: &Rigid| {
        let (t, r) = (pose.point(at) - at, vector_from_rotation(&pose.rotation));
        Vector6::new(t.x, t.y, t.z, r.x, r.y, r.z)
    };
    let h = 1e-6;
    for j in 0..6 {
        let mut x = [0.0; 6];
        x[j] = h;
        let up = of(&pose(x).compose(&base));
        x[j] = -h;
        let down = of(&pose(x).compose(&base));
        assert!(((up - down) / (2.0 * h) - transfer.column(j)).norm() < 1e-8);
    }
}

#[test]
fn faults_have_names() {
    let solver = solver(LensModel::BrownConrady);
    let good = sightings(&solver, &pose([0.1, 0.0, -1.0, 0.02, 0.01, 0.0]));
    let name = |seen: &[Sighting]| solver.solve(seen).unwrap_err().as_str();
    assert_eq!(name(&good[..3]), "missing_marker");
    let mut bad = good.clone();
    bad[2].id = 1;
    assert_eq!(name(&bad), "duplicate_marker");
    let mut bad = good.clone();
    bad[2].centroid_px = bad[1].centroid_px;
    assert_eq!(name(&bad), "duplicate_marker");
    let mut bad = good.clone();
    bad[2].centroid_px = 0.5 * (bad[1].centroid_px + bad[3].centroid_px);
    bad[0].centroid_px = 0.25 * bad[1].centroid_px + 0.75 * bad[3].centroid_px;
    assert_ne!(solver.solve(&bad).map(|_| ()), Ok(()));
    let mut bad = good.clone();
    bad[0].centroid_px.x = f64::NAN;
    assert_eq!(name(&bad), "not_finite");
    bad[0].centroid_px = DVec2::new(1e4, 0.0);
    assert_eq!(name(&bad), "marker_not_visible");
    bad[0].id = 9;
    assert_eq!(name(&bad), "unknown_marker");
    let mut bad = good.clone();
    bad[0].centroid_px.x += 5.0;
    assert_eq!(name(&bad), "does_not_fit");
}

#[test]
fn swapped_markers_are_told() {
    let solver = solver(LensModel::BrownConrady);
    let good = sightings(&solver, &pose([0.1, 0.0, -1.0, 0.02, 0.01, 0.0]));
    for order in [[1, 0, 2, 3], [0, 1, 3, 2], [2, 1, 0, 3], [1, 2, 3, 0], [2, 3, 0, 1], [3, 1, 2, 0]] {
        let permuted: Vec<Sighting> =
            (0..4).map(|i| Sighting { id: i as u32, centroid_px: good[order[i]].centroid_px }).collect();
        let error = solver.solve(&permuted).unwrap_err();
        assert_eq!(error, PoseError::Swapped { ids: order.map(|i| i as u32).to_vec() });
    }
}

// Far away and noisy, a plane's tilt cannot be distinguished from its mirror: both poses, and the word.
#[test]
fn a_far_plane_is_ambiguous() {
    let base = thumb(LensModel::KannalaBrandt);
    let spec = OpticsSpec {
        lens: base.lens().spec().clone(),
        sensor_from_camera: Rigid::from_translation(DVec3::new(0.0, 0.0, -120.0)),
        layers: base.layers()[1..].to_vec(),
        dome: crate::DomeShape::hemisphere(10.0),
    };
    let optics = SensorOptics::new(&spec).unwrap();
    let solver = PoseSolver::new(&optics, &square(7.5, 0.8), PoseOptions::new(0.3, 30.0)).unwrap();
    let truth = pose([0.0, 0.0, 0.0, 0.4, 0.1, 0.0]);
    let found = solver.solve(&sightings(&solver, &truth)).unwrap();
    let other = found.other.expect("two poses fit");
    assert!(miss(&found.pose, &truth).1 < 1e-6);
    assert!(miss(&other, &truth).1 > 0.5);
}

#[test]
fn five_markers_use_all_five() {
    let mut markers = square(7.5, 0.8);
    markers.push(Marker { id: 4, position_mm: DVec3::new(3.0, -9.0, 0.0), diameter_mm: 0.8 });
    let solver =
        PoseSolver::new(&thumb(LensModel::BrownConrady), &markers, PoseOptions::new(0.1, 5.0)).unwrap();
    let truth = pose([0.1, 0.0, -1.0, 0.02, 0.01, 0.0]);
    let seen = sightings(&solver, &truth);
    assert!(miss(&solver.solve(&seen).unwrap().pose, &truth).0 < 2e-8);
    assert!(miss(&solver.solve(&seen[1..]).unwrap().pose, &truth).0 < 2e-8);
}

#[test]
fn bad_marker_sets_are_refused() {
    let optics = thumb(LensModel::BrownConrady);
    let options = PoseOptions::new(0.1, 5.0);
    let make = |markers: &[Marker]| PoseSolver::new(&optics, markers, options).unwrap_err().as_str();
    let mut line = square(7.5, 0.8);
    for (i, m) in line.iter_mut().enumerate() {
        m.position_mm = DVec3::new(i as f64 * 3.0, 1.0, 0.0);
    }
    assert_eq!(make(&line), "collinear_markers");
    let mut twin = square(7.5, 0.8);
    twin[3].position_mm = twin[0].position_mm;
    assert_eq!(make(&twin), "duplicate_marker");
    assert_eq!(make(&square(7.5, 0.8)[..3]), "missing_marker");
}

// The centroid of an oblique disc of 1 mm against a fine sum over its area.
#[test]
fn the_centroid_model_matches_a_sum_over_the_disc() {
    let optics = thumb(LensModel::BrownConrady).at_pose(&pose([0.1, 0.2, -1.0, 0.06, -0.04, 0.0])).unwrap();
    let marker = Marker { id: 0, position_mm: DVec3::new(7.5, 7.5, 0.0), diameter_mm: 1.0 };
    let image = marker.image(&optics).unwrap();
    let (mut moment, mut area) = (DVec2::ZERO, 0.0);
    let n = 60;
    for i in 0..n {
        for j in 0..n {
            let r = 0.5 * ((f64::from(i) + 0.5) / f64::from(n)).sqrt();
            let a = std::f64::consts::TAU * (f64::from(j) + 0.5) / f64::from(n);
            let point = marker.position_mm + DVec3::new(r * a.cos(), r * a.sin(), 0.0);
            let (px, jacobian) = optics.project_with_jacobian(point).unwrap();
            let weight = (jacobian[(0, 0)] * jacobian[(1, 1)] - jacobian[(0, 1)] * jacobian[(1, 0)]).abs();
            moment += px * weight;
            area += weight;
        }
    }
    let offset = image.centroid_px - image.center_px;
    assert!((moment / area - image.centroid_px).length() < 2e-4, "{}", moment / area - image.centroid_px);
    assert!(offset.length() > 0.02, "{offset}");
}
