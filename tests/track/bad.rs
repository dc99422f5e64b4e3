//! Frames and constants that are not what they should be: a name for each, and the stream goes on.

use domecast::constants::Constants;
use domecast::numeric::Rigid;
use domecast::track::{CameraFrame, MarkState, Problem, TrackOptions, Tracked, Tracker};
use serde_json::{Value, json};
use std::str::FromStr;

use super::render::{Picture, noise, still};
use super::{SENSOR, drawn, frame, names, pose, score, tracker};

/// Whether every number of wrench, its deviations and those of the pose is finite.
fn is_finite(tracked: &Tracked) -> bool {
    let wrenches = [tracked.wrench, tracked.wrench_sd].into_iter().flatten().map(|w| w.to_array());
    let numbers = wrenches.chain(tracked.pose_sd.map(|d| d.to_array()));
    numbers.flatten().all(f64::is_finite)
}

const PIXELS: usize = 640 * 480;

#[test]
fn bad_frames_have_names_and_the_stream_goes_on() {
    let good = |seed: u64| drawn(&Picture { seed, ..still(Rigid::identity()) });
    let random: Vec<u8> = (0..PIXELS).map(|i| (128.0 + 60.0 * noise(9, i)) as u8).collect();
    let mut soft = good(3);
    soft.blur(640, 3);
    soft.code(1.0, 3);
    let mut mush = good(3);
    mush.blur(640, 12);
    mush.code(1.0, 3);
    let bad: [(&str, Vec<u8>, Problem); 6] = [
        ("black", vec![0; PIXELS], Problem::Dark),
        ("nearly black", (0..PIXELS).map(|i| (3.0 + noise(1, i)) as u8).collect(), Problem::Dark),
        ("white", vec![255; PIXELS], Problem::Saturated),
        ("grey", vec![90; PIXELS], Problem::NoMarks),
        ("soft", soft.bytes, Problem::Blurred),
        ("mush", mush.bytes, Problem::Blurred),
    ];
    let mut tracker = tracker(TrackOptions::default());
    let mut number = 0;
    let mut next = || {
        number += 1;
        number
    };
    for (name, bytes, problem) in bad {
        let first = good(11);
        let tracked = tracker.track(next(), &frame(&first.bytes));
        let s = score(tracked, &first);
        assert_eq!((s.ok, names(tracked)), (s.wanted, vec![]), "before {name}");
        let tracked = tracker.track(next(), &frame(&bytes));
        assert!(tracked.problems.has(problem), "{name}: {:?}", names(tracked));
        assert_ne!(tracked.status(), "ok");
    }
    let tracked = tracker.track(next(), &frame(&random));
    assert_ne!(tracked.status(), "ok");
    assert_eq!(tracked.count(MarkState::Ok), 0, "{:?}", names(tracked));
    let tracked = tracker.skip(next());
    assert_eq!(names(tracked), ["unreadable"]);
    let small = vec![90; 320 * 240];
    let tracked = tracker.track(next(), &CameraFrame::new(320, 240, 1, &small).unwrap());
    assert_eq!(names(tracked), ["wrong_size"]);
    let last = good(12);
    let tracked = tracker.track(next(), &frame(&last.bytes));
    assert_eq!(names(tracked), Vec::<&str>::new());
    let tracked = tracker.track(next(), &frame(&last.bytes));
    assert_eq!(names(tracked), ["frozen"]);
    assert!(tracked.pose.is_some());
    let after = good(13);
    let tracked = tracker.track(next() + 5, &frame(&after.bytes));
    assert_eq!(names(tracked), ["gap"]);
    let s = score(tracked, &after);
    assert_eq!(s.ok, s.wanted);
}

#[test]
fn a_white_marker_that_is_covered_is_told() {
    let clean = drawn(&still(Rigid::identity()));
    let mut tracker = tracker(TrackOptions::default());
    tracker.track(0, &frame(&clean.bytes));
    let mut covered = drawn(&Picture { seed: 5, ..still(Rigid::identity()) });
    let at = clean.markers[2].unwrap()[1];
    for y in -12..=12_i32 {
        for x in -12..=12_i32 {
            let pixel = (at.y as i32 + y) * 640 + at.x as i32 + x;
            covered.bytes[pixel as usize] = 38;
        }
    }
    let tracked = tracker.track(1, &frame(&covered.bytes));
    assert_eq!(names(tracked), ["three_markers"]);
    assert_eq!(tracked.white_markers[2].state, MarkState::Lost);
    assert!(tracked.pose.unwrap().translation_mm.length() < 0.05);
    // From nothing, three are enough: the dots say which pose it is.
    let mut fresh = super::tracker(TrackOptions::default());
    let tracked = fresh.track(0, &frame(&covered.bytes));
    assert_eq!(names(tracked), ["three_markers"]);
    assert!(tracked.pose.unwrap().translation_mm.length() < 0.05);
}

#[test]
fn constants_of_another_camera_are_told() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("designs/thumb24-pinhole.json");
    let design = domecast::design::Design::load(&path).unwrap();
    let layout = domecast::layout::Layout::of_design(&design).unwrap();
    let other = domecast::constants::of(&design, &layout).unwrap();
    let mut longer = SENSOR.constants.clone();
    longer.camera.matrix[0][0] *= 1.12;
    longer.camera.matrix[1][1] *= 1.12;
    let mut aside = SENSOR.constants.clone();
    aside.camera.matrix[0][2] += 25.0;
    // Four markers hardly tell this from a shear; calibrated constants know their markers well enough.
    aside.calibrations.push(json!({ "kind": "optics" }));
    for (name, constants) in [("pinhole", other), ("longer", longer), ("aside", aside)] {
        let mut tracker = Tracker::new(&constants, TrackOptions::default()).unwrap();
        for number in 0..3 {
            let drawn = drawn(&Picture { seed: number, ..still(pose([0.0, 0.0, -0.2], [0.0; 3])) });
            let tracked = tracker.track(number, &frame(&drawn.bytes));
            let told = [
                Problem::ForeignConstants,
                Problem::BeyondSprings,
                Problem::MarkersDoNotFit,
                Problem::MarkersMissing,
            ];
            assert!(told.iter().any(|p| tracked.problems.has(*p)), "{name}: {:?}", names(tracked));
        }
    }
}

/// Every number and list of a JSON value, by path.
fn places(value: &Value, path: String, found: &mut Vec<String>) {
    match value {
        Value::Object(map) => {
            for (key, inner) in map {
                found.push(format!("{path}/{key}"));
                places(inner, format!("{path}/{key}"), found);
            }
        }
        Value::Array(list) => {
            // The first of each list stands for the others.
            if let Some(inner) = list.first() {
                places(inner, format!("{path}/0"), found);
            }
        }
        _ => found.push(path),
    }
}

#[test]
fn absurd_constants_give_an_error_or_a_named_status() {
    let whole = serde_json::to_value(&SENSOR.constants).unwrap();
    let mut paths = Vec::new();
    places(&whole, String::new(), &mut paths);
    paths.sort();
    paths.dedup();
    assert!(paths.len() > 60, "{}", paths.len());
    let drawn = drawn(&still(Rigid::identity()));
    let values =
        [json!(null), json!(-1e300), json!(1e300), json!(0), json!(4_000_000_000_u32), json!([]), json!("x")];
    let mut refused = 0;
    for path in &paths {
        for value in &values {
            let mut changed = whole.clone();
            *changed.pointer_mut(path).unwrap() = value.clone();
            let Ok(constants) = Constants::from_str(&changed.to_string()) else {
                refused += 1;
                continue;
            };
            // Masks of a changed size cost a second each and are no different from each other.
            match Tracker::new(&constants, TrackOptions::default()) {
                Err(error) => {
                    refused += 1;
                    assert!(!error.field.is_empty() && !error.problem.is_empty());
                }
                Ok(mut tracker) => {
                    let tracked = tracker.track(0, &frame(&drawn.bytes));
                    assert!(is_finite(tracked), "{path} {value}");
                }
            }
        }
    }
    assert!(refused > 3 * paths.len(), "{refused} of {}", 7 * paths.len());
    for path in ["camera", "optics", "mask", "white_markers", "black_dots"] {
        let mut changed = whole.clone();
        changed.as_object_mut().unwrap().remove(path);
        let error = Constants::from_str(&changed.to_string()).unwrap_err();
        assert!(error.problem.contains(path), "{error}");
    }
}

// Any bytes in any part of a frame: no panic, nothing but finite numbers, and the tracker still tracks after.
#[test]
fn fuzzed_frames_do_no_harm() {
    let clean = drawn(&still(Rigid::identity()));
    let mut tracker = tracker(TrackOptions { search_every: 2, ..TrackOptions::default() });
    let mut state = 88_172_645_463_325_252_u64;
    let mut random = move |end: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % end as u64) as usize
    };
    for number in 0..150_u64 {
        let mut bytes = clean.bytes.clone();
        for _ in 0..random(12) {
            let (x, y, w, h) = (random(640), random(480), 1 + random(200), 1 + random(200));
            let kind = random(4);
            let level = random(256) as u8;
            for row in y..(y + h).min(480) {
                for column in x..(x + w).min(640) {
                    bytes[row * 640 + column] = match kind {
                        0 => level,
                        1 => random(256) as u8,
                        2 => bytes[row * 640 + column].wrapping_add(level),
                        _ => clean.bytes[(row * 640 + column + 640 * random(30)) % PIXELS],
                    };
                }
            }
        }
        let tracked = tracker.track(number, &frame(&bytes));
        for dot in &tracked.black_dots {
            assert!(
                dot.image_px.is_none_or(|p| p.is_finite())
                    && dot.displacement_mm.is_none_or(|p| p.is_finite())
            );
        }
        assert!(is_finite(tracked));
    }
    for number in 150..153 {
        let drawn = drawn(&Picture { seed: number, ..still(Rigid::identity()) });
        let s = score(tracker.track(number, &frame(&drawn.bytes)), &drawn);
        assert_eq!(s.ok, s.wanted, "after fuzzing");
        assert!(s.worst_px < 0.15);
    }
}

// Digits and signs of the constants' text changed at random: an error with a name, or a tracker that does no harm.
#[test]
fn mutated_constants_do_no_harm() {
    let text = SENSOR.constants.to_json();
    let picture = drawn(&still(Rigid::identity()));
    let mut state = 2_463_534_242_u64;
    let mut random = move |end: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % end as u64) as usize
    };
    let digits: Vec<usize> =
        text.bytes().enumerate().filter(|(_, b)| b.is_ascii_digit() || *b == b'-').map(|(i, _)| i).collect();
    let mut made = 0;
    for round in 0..160 {
        let mut bytes = text.clone().into_bytes();
        // Few changes, and of them many in the first part: camera, optics, mask.
        for _ in 0..1 + random(6) {
            let end = if round % 2 == 0 { 150 } else { digits.len() };
            bytes[digits[random(end)]] = b"0123456789-eE.+"[random(15)];
        }
        let Ok(constants) = Constants::from_str(&String::from_utf8(bytes).unwrap()) else { continue };
        let Ok(mut tracker) = Tracker::new(&constants, TrackOptions::default()) else { continue };
        let tracked = tracker.track(0, &frame(&picture.bytes));
        assert!(is_finite(tracked));
        made += 1;
    }
    assert!(made > 20, "{made}");
}
