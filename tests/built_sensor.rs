//! A sensor built with every nominal number off by its tolerance, and what its frames bring back.

#![allow(clippy::unwrap_used, reason = "a sensor that cannot be made fails the test")]

use domecast::numeric::SeededRandom;
use std::path::Path;

use glam::{DVec2, DVec3};

use domecast::calibrate::detect::{DetectError, Detector};
use domecast::calibrate::optics::{Kind, Observation, fit};
use domecast::constants::{self, Constants};
use domecast::frames::Gray;
use domecast::layout::Layout;
use domecast::numeric::{Rigid, rotation_from_vector};
use domecast::optics::SensorOptics;
use domecast::pose::{Marker, PoseOptions, PoseSolver, Sighting, outline_centroid_offset};
use domecast::springs::Displacement;

fn nominal() -> Constants {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("designs/thumb24.json");
    let design = domecast::design::Design::load(&path).unwrap();
    let layout = Layout::of_design(&design).unwrap();
    constants::of(&design, &layout).unwrap()
}

/// Constants of a sensor whose numbers are all off by one tolerance, with random signs.
fn built(nominal: &Constants, random: &mut SeededRandom) -> Constants {
    let priors = nominal.tolerances.unwrap();
    let mut sign = || if random.uniform() < 0.5 { -1.0 } else { 1.0 };
    let mut spec = nominal.optics_spec().unwrap();
    for i in 0..3 {
        spec.sensor_from_camera.translation_mm[i] += sign() * priors.pupil_mm[i];
    }
    let turn = DVec3::from_array(priors.camera_rotation_rad.map(|v| v * sign()));
    spec.sensor_from_camera.rotation *= rotation_from_vector(turn);
    let mut made = nominal.clone();
    for layer in &mut made.optics.layers[1..] {
        layer.thickness_mm = layer.thickness_mm.map(|d| d + sign() * priors.layer_thickness_mm);
        let step = sign() * priors.index;
        layer.index += step;
        layer.index_rgb = layer.index_rgb.map(|rgb| rgb.map(|n| n + step));
    }
    made.camera.camera_from_sensor = spec.sensor_from_camera.inverse().to_rows_4x4();
    for marker in &mut made.white_markers {
        for axis in 0..2 {
            marker.position_mm[axis] += sign() * priors.white_marker_mm;
        }
    }
    for dot in &mut made.black_dots {
        let at = DVec3::from_array(dot.surface_mm);
        let east = DVec3::new(-at.y, at.x, 0.0).normalize();
        let moved = at + (east * sign() + at.cross(east).normalize() * sign()) * priors.black_dot_mm;
        dot.surface_mm = (moved * (at.length() / moved.length())).to_array();
    }
    made
}

fn frames(built: &Constants, poses: &[Rigid], random: &mut SeededRandom) -> Vec<Observation> {
    let rest = built.sensor().unwrap();
    let mut seen = Vec::new();
    for (frame, pose) in poses.iter().enumerate() {
        let optics = rest.at_pose(pose).unwrap();
        let mut add = |kind, id, px: DVec2| {
            let noise = DVec2::new(random.normal(), random.normal()) * 0.1;
            seen.push(Observation { frame, kind, id, centroid_px: px + noise });
        };
        for marker in built.markers() {
            add(Kind::White, marker.id as usize, marker.image(&optics).unwrap().centroid_px);
        }
        for dot in &built.black_dots {
            let at = DVec3::from_array(dot.surface_mm);
            let east = DVec3::new(-at.y, at.x, 0.0).normalize();
            let north = at.cross(east).normalize();
            let center = optics.project(at).unwrap();
            let offset = outline_centroid_offset(center, |c, s| {
                let there = at + (east * c + north * s) * (0.5 * dot.diameter_mm);
                optics.project(there * (at.length() / there.length())).ok()
            });
            add(Kind::Black, dot.id, center + offset.unwrap());
        }
    }
    seen
}

fn poses(random: &mut SeededRandom, count: usize, at: DVec3) -> Vec<Rigid> {
    let mut all = vec![Rigid::identity()];
    for _ in 1..count {
        let mut u = || 2.0 * random.uniform() - 1.0;
        let displacement = Displacement {
            translation_mm: DVec3::new(0.15 * u(), 0.15 * u(), -1.0 - u()),
            rotation_rad: DVec3::new(0.03 * u(), 0.03 * u(), 0.02 * u()),
        };
        all.push(displacement.to_pose(at));
    }
    all
}

/// Root mean square wrench error (N, N*mm) over poses of a runtime that believes `believed`.
fn wrench_error(
    truth: &Constants,
    believed: &Constants,
    poses: &[Rigid],
    random: &mut SeededRandom,
) -> [f64; 6] {
    let springs = truth.springs.as_ref().unwrap();
    let at = DVec3::from_array(springs.at_mm);
    let optics = truth.sensor().unwrap();
    let sensor: SensorOptics = believed.sensor().unwrap();
    let markers: Vec<Marker> = believed.markers();
    let solver = PoseSolver::new(&sensor, &markers, PoseOptions::new(5.0, 10.0)).unwrap();
    let mut sums = [0.0; 6];
    for pose in poses {
        let placed = optics.at_pose(pose).unwrap();
        let sightings: Vec<Sighting> = truth
            .markers()
            .iter()
            .map(|m| {
                let noise = DVec2::new(random.normal(), random.normal()) * 0.1;
                Sighting { id: m.id, centroid_px: m.image(&placed).unwrap().centroid_px + noise }
            })
            .collect();
        let found = solver.solve(&sightings).unwrap().pose;
        let wrench = |p: &Rigid| constants::wrench_by_table(springs, &Displacement::of_pose(p, at));
        let (w, t) = (wrench(&found), wrench(pose));
        for i in 0..6 {
            sums[i] += (w[i] - t[i]).powi(2) / poses.len() as f64;
        }
    }
    sums.map(f64::sqrt)
}

/// Paints the inside of a convex outline: each pixel by the part of it that is covered.
fn paint(values: &mut [f32], [width, height]: [usize; 2], outline: &[DVec2], value: f32) {
    const LINES: usize = 8;
    let low = outline.iter().fold(f64::INFINITY, |m, p| m.min(p.y)).round().max(0.0) as usize;
    let high = outline.iter().fold(f64::NEG_INFINITY, |m, p| m.max(p.y)).round().max(0.0) as usize;
    for y in low..=high.min(height - 1) {
        let mut covered = vec![0.0; width];
        for line in 0..LINES {
            let level = y as f64 - 0.5 + (line as f64 + 0.5) / LINES as f64;
            let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
            for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
                if (a.y <= level) != (b.y <= level) {
                    let x = a.x + (b.x - a.x) * (level - a.y) / (b.y - a.y);
                    (left, right) = (left.min(x), right.max(x));
                }
            }
            let first = (left.round().max(0.0)) as usize;
            for (x, part) in covered.iter_mut().enumerate().skip(first) {
                let overlap = (right.min(x as f64 + 0.5) - left.max(x as f64 - 0.5)).clamp(0.0, 1.0);
                if x as f64 - 0.5 > right {
                    break;
                }
                *part += overlap / LINES as f64;
            }
        }
        for (x, part) in covered.iter().enumerate() {
            let pixel = &mut values[y * width + x];
            *pixel += *part as f32 * (value - *pixel);
        }
    }
}

/// What the camera of a sensor sees: a shaded dome with dark dots, white markers beside it, some blur and noise.
fn picture(built: &Constants, pose: &Rigid, random: &mut SeededRandom) -> Gray {
    let optics = built.sensor().unwrap().at_pose(pose).unwrap();
    let size = [built.camera.width as usize, built.camera.height as usize];
    let mut values = vec![0.2_f32; size[0] * size[1]];
    let round = |count: u32, see: &dyn Fn(f64, f64) -> DVec2| -> Vec<DVec2> {
        let angle = |k: u32| std::f64::consts::TAU * f64::from(k) / f64::from(count);
        (0..count).map(|k| see(angle(k).cos(), angle(k).sin())).collect()
    };
    let radius = built.optics.dome_radius_mm;
    let rim = round(180, &|c, s| optics.project(DVec3::new(radius * c, radius * s, 0.0)).unwrap());
    paint(&mut values, size, &rim, 0.55);
    for (i, value) in values.iter_mut().enumerate() {
        *value *= 0.85 + 0.3 * (i % size[0]) as f32 / size[0] as f32;
    }
    for dot in &built.black_dots {
        let at = DVec3::from_array(dot.surface_mm);
        let east = DVec3::new(-at.y, at.x, 0.0).normalize();
        let north = at.cross(east).normalize();
        let outline = round(24, &|c, s| {
            let there = at + (east * c + north * s) * (0.5 * dot.diameter_mm);
            optics.project(there * (at.length() / there.length())).unwrap()
        });
        paint(&mut values, size, &outline, 0.08);
    }
    for marker in built.markers() {
        let half = 0.5 * marker.diameter_mm;
        let see = |c: f64, s: f64| {
            optics.project(marker.position_mm + DVec3::new(half * c, half * s, 0.0)).unwrap()
        };
        paint(&mut values, size, &round(48, &see), 0.95);
    }
    let mut frame = Gray::new(size[0], size[1], values).unwrap().blurred(0.6);
    let noisy = frame.values().iter().map(|v| v + 0.008 * random.normal() as f32).collect();
    frame = Gray::new(size[0], size[1], noisy).unwrap();
    frame
}

/// Marks that are found in pictures, and how far from where they are (rms over both axes, px).
fn seen_in(
    nominal: &Constants,
    truth: &Constants,
    poses: &[Rigid],
    random: &mut SeededRandom,
) -> (Vec<Observation>, [f64; 2]) {
    let detector = Detector::new(nominal).unwrap();
    let exact = frames(truth, poses, &mut SeededRandom::new(1));
    let (mut all, mut sums, mut missing) = (Vec::new(), [[0.0; 2]; 2], 0);
    for (number, pose) in poses.iter().enumerate() {
        let found = detector.observe(&picture(truth, pose, random), number).unwrap();
        missing += found.black_missing;
        for mark in &found.observations {
            let same = |o: &&Observation| (o.frame, o.kind, o.id) == (mark.frame, mark.kind, mark.id);
            let miss = exact.iter().find(same).unwrap().centroid_px - mark.centroid_px;
            let kind = usize::from(mark.kind == Kind::Black);
            sums[kind][0] += miss.length_squared();
            sums[kind][1] += 2.0;
            assert!(miss.length() < 1.0, "{mark:?} is {miss} off");
        }
        all.extend(found.observations);
    }
    let dots = nominal.black_dots.len() * poses.len();
    assert!(missing * 50 <= dots, "{missing} of {dots} dots were not found");
    (all, sums.map(|[square, count]| (square / count).sqrt()))
}

#[test]
fn frames_bring_a_sensor_that_is_off_back() {
    let nominal = nominal();
    let mut random = SeededRandom::new(3);
    let truth = built(&nominal, &mut random);
    let at = DVec3::from_array(nominal.springs.as_ref().unwrap().at_mm);
    let mut shown = vec![Rigid::identity(); 11];
    shown.extend(poses(&mut random, 20, at));
    let seen = frames(&truth, &shown, &mut random);
    let found = fit(&nominal, &seen, &nominal.tolerances.unwrap(), 12).unwrap();
    assert!(found.rms_px[0] > 1.0 && found.rms_px[1] < 0.11, "{:?}", found.rms_px);
    let tries = poses(&mut random, 200, at);
    let perfect = wrench_error(&truth, &truth, &tries, &mut SeededRandom::new(11));
    let fitted = wrench_error(&truth, &found.constants, &tries, &mut SeededRandom::new(11));
    let before = wrench_error(&truth, &nominal, &tries, &mut SeededRandom::new(11));
    for i in 0..6 {
        assert!(fitted[i] <= 1.5 * perfect[i], "{}: {} {}", constants::WRENCH_AXES[i], fitted[i], perfect[i]);
    }
    assert!(before[2] > 3.0 * perfect[2]);
    let observed = |name: &str| found.parameters.iter().find(|p| p.name == name).unwrap().observed;
    assert!(observed("camera_rotation.x") && observed("pupil.z"));
}

// The camera's own numbers are off by what its calibration left open: without their covariance the rest is bent to fit.
#[test]
fn intrinsics_are_fitted_where_their_covariance_is_known() {
    let nominal = nominal();
    let mut random = SeededRandom::new(8);
    let mut truth = built(&nominal, &mut random);
    truth.camera.matrix[0][0] += 1.5;
    truth.camera.matrix[1][1] += 1.4;
    truth.camera.matrix[0][2] -= 1.2;
    let at = DVec3::from_array(nominal.springs.as_ref().unwrap().at_mm);
    let mut shown = vec![Rigid::identity(); 4];
    shown.extend(poses(&mut random, 9, at).into_iter().skip(1));
    let seen = frames(&truth, &shown, &mut random);
    let mut calibrated = nominal.clone();
    let count = 4 + nominal.camera.distortion.len();
    let variance = |i: usize, j: usize| match (i, j) {
        (0, 1) | (1, 0) => 0.95,
        (i, j) if i == j && i < 4 => 1.0,
        _ => 0.0,
    };
    calibrated.camera.intrinsics_covariance =
        (0..count).map(|i| (0..count).map(|j| variance(i, j)).collect()).collect();
    let found = fit(&calibrated, &seen, &nominal.tolerances.unwrap(), 4).unwrap();
    for (name, off) in [("camera.fx", 1.5), ("camera.fy", 1.4), ("camera.cx", -1.2)] {
        let p = found.parameters.iter().find(|p| p.name == name).unwrap();
        assert!((p.value - p.nominal - off).abs() < 4.0 * p.sd && p.sd <= p.prior_sd, "{p:?}");
    }
    assert!(found.constants.camera.intrinsics_covariance[0][0] < 1.0);
    let mut broken = calibrated.clone();
    broken.camera.intrinsics_covariance[0][1] = 3.0;
    assert!(fit(&broken, &seen, &nominal.tolerances.unwrap(), 4).is_err());
}

// From pictures to wrenches: the detector finds the marks of a sensor that is off in every number, under load too.
#[test]
fn pictures_bring_a_sensor_that_is_off_back() {
    let nominal = nominal();
    let mut random = SeededRandom::new(5);
    let truth = built(&nominal, &mut random);
    let at = DVec3::from_array(nominal.springs.as_ref().unwrap().at_mm);
    let mut shown = vec![Rigid::identity(); 6];
    shown.extend(poses(&mut random, 7, at).into_iter().skip(1));
    let (seen, rms_px) = seen_in(&nominal, &truth, &shown, &mut random);
    // `frames` adds 0.1 px of noise to what is exact.
    assert!(rms_px[0] < 0.11 && rms_px[1] < 0.13, "{rms_px:?}");
    let found = fit(&nominal, &seen, &nominal.tolerances.unwrap(), 6).unwrap();
    let tries = poses(&mut random, 200, at);
    let perfect = wrench_error(&truth, &truth, &tries, &mut SeededRandom::new(11));
    let fitted = wrench_error(&truth, &found.constants, &tries, &mut SeededRandom::new(11));
    for i in 0..6 {
        let name = constants::WRENCH_AXES[i];
        assert!(fitted[i] <= 1.5 * perfect[i], "{name}: {} {}", fitted[i], perfect[i]);
    }
}

#[test]
fn a_frame_without_markers_is_told() {
    let nominal = nominal();
    let detector = Detector::new(&nominal).unwrap();
    let dark = Gray::new(640, 480, vec![0.3; 640 * 480]).unwrap();
    assert_eq!(detector.observe(&dark, 0), Err(DetectError::NoWhiteMarker { id: 0 }));
    let small = Gray::new(64, 48, vec![0.3; 64 * 48]).unwrap();
    assert!(matches!(detector.observe(&small, 0), Err(DetectError::Size { .. })));
}
