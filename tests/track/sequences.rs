//! Many frames: missing, hidden and false dots, fast motion, long runs.

use domecast::numeric::rotation_from_vector;
use domecast::track::{MarkState, Reference, TrackOptions};
use glam::{DVec2, DVec3};

use super::render::{Picture, still};
use super::{SENSOR, drawn, frame, names, pose, score, tracker};
use domecast::numeric::Rigid;

fn ids(state: MarkState, tracked: &domecast::track::Tracked) -> Vec<u32> {
    tracked.black_dots.iter().filter(|d| d.state == state).map(|d| d.id).collect()
}

#[test]
fn missing_and_false_dots_are_named() {
    let missing = [3, 40, 41, 119];
    // Two false dots, each in the middle of four true ones.
    let dots = &SENSOR.constants.black_dots;
    let between = |id: usize| {
        let at = |id: usize| DVec2::from_array(dots[id].image_px);
        let beside: Vec<DVec2> = dots[id].neighbors.iter().map(|n| at(*n) - at(id)).collect();
        let largest = |along: DVec2| {
            let best = beside.iter().copied().max_by(|a, b| along.dot(*a).total_cmp(&along.dot(*b)));
            best.expect("a neighbour")
        };
        at(id) + 0.5 * (largest(DVec2::X) + largest(DVec2::Y))
    };
    let extra = [(between(0), 3.4), (between(69), 3.0)];
    let mut tracker = tracker(TrackOptions::default());
    for number in 0..40 {
        let down = -0.05 * number as f64;
        let picture = Picture {
            missing: &missing,
            extra: &extra,
            seed: number,
            ..still(pose([0.0, 0.0, down], [0.0; 3]))
        };
        let drawn = drawn(&picture);
        let tracked = tracker.track(number, &frame(&drawn.bytes));
        let s = score(tracked, &drawn);
        assert_eq!(names(tracked), Vec::<&str>::new(), "frame {number}");
        assert_eq!(ids(MarkState::Missing, tracked), missing, "frame {number}");
        // A dot that a false one all but touches may be let go, or be off by a part of it; none may be mistaken.
        assert!(
            s.wanted - s.ok <= 2 && s.worst_px < 0.6 && s.rms_px < 0.05,
            "frame {number}: {} of {}, {}",
            s.ok,
            s.wanted,
            s.worst_px
        );
        assert_eq!(tracked.searched, number == 0 || number == 30, "frame {number}");
        if tracked.searched {
            for (at, _) in extra {
                let told = tracked.false_dots.iter().any(|p| p.distance(at) < 1.0);
                let alone = drawn.dots.iter().flatten().all(|[p, _]| p.distance(at) > 9.0);
                assert!(told || !alone, "frame {number}: {:?}", tracked.false_dots);
            }
            assert!(tracked.false_dots.len() <= extra.len());
        }
    }
}

#[test]
fn lost_dots_are_found_again_under_their_own_names() {
    let hidden: Vec<u32> = SENSOR
        .constants
        .black_dots
        .iter()
        .filter(|d| d.surface_mm[0] > 2.0 && d.surface_mm[1].abs() < 3.0)
        .map(|d| d.id as u32)
        .collect();
    assert!(hidden.len() > 10);
    let mut tracker = tracker(TrackOptions::default());
    for number in 0..12_u64 {
        let gone = (4..8).contains(&number);
        let turn = 0.01 * number as f64;
        let picture = Picture {
            missing: if gone { &hidden } else { &[] },
            seed: number,
            ..still(pose([0.02 * number as f64, 0.0, -0.1 * number as f64], [0.0, 0.0, turn.min(0.05)]))
        };
        let drawn = drawn(&picture);
        let tracked = tracker.track(number, &frame(&drawn.bytes));
        let s = score(tracked, &drawn);
        // Bare skin where dots were: those beside it may be them.
        let unsure = ids(MarkState::IdentityUnsure, tracked);
        assert_eq!(s.ok + unsure.len(), s.wanted, "frame {number}");
        assert!(
            unsure.iter().all(|dot| gone && hidden.iter().any(|other| is_beside(*dot, *other))),
            "{unsure:?}"
        );
        assert!(s.worst_px < 0.15, "frame {number} {}", s.worst_px);
        assert_eq!(
            ids(MarkState::Lost, tracked),
            if gone { hidden.clone() } else { vec![] },
            "frame {number}"
        );
        let named = names(tracked).into_iter().filter(|name| *name != "identity_unsure").collect::<Vec<_>>();
        assert_eq!(named, if gone { vec!["dots_lost"] } else { vec![] }, "frame {number}");
    }
}

/// Whether two dots are neighbours in the image of the sensor at rest.
fn is_beside(one: u32, other: u32) -> bool {
    let at =
        |id: u32| SENSOR.constants.black_dots.iter().find(|dot| dot.id as u32 == id).map(|dot| dot.image_px);
    at(one).zip(at(other)).is_some_and(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]) < 30.0)
}

#[test]
fn a_blot_over_two_dots_makes_neither() {
    let rest = drawn(&still(Rigid::identity()));
    let [a, b] = [0, 1].map(|i| rest.dots[i].unwrap()[0]);
    let blot = [(0.5 * (a + b), 0.5 * a.distance(b) + 2.0)];
    let mut tracker = tracker(TrackOptions::default());
    tracker.track(0, &frame(&rest.bytes));
    let drawn = drawn(&Picture { extra: &blot, ..still(Rigid::identity()) });
    let tracked = tracker.track(1, &frame(&drawn.bytes));
    for index in [0, 1] {
        let dot = tracked.black_dots[index];
        assert!(matches!(dot.state, MarkState::Merged | MarkState::Lost), "{:?}", dot.state);
        assert_eq!((dot.image_px, dot.displacement_mm), (None, None));
    }
    assert!(score(tracked, &drawn).worst_px < 0.5);
}

/// The dome's upper part sheared aside by `px` at the pole, none at the rim.
fn sheared(mm: f64) -> impl Fn(DVec3) -> DVec3 {
    move |p| {
        let radius = p.length();
        let moved = p + DVec3::new(mm * (p.z / radius).powi(2), 0.0, 0.0);
        moved * (radius / moved.length())
    }
}

#[test]
fn motion_of_half_a_pitch_is_followed() {
    // 18 px of pitch are 1.3 mm on the dome at the pole.
    let mut tracker = tracker(TrackOptions::default());
    let mut at = 0.0;
    for (number, step) in [0.0, 0.3, 0.62, -0.62, -0.62, 0.5, 0.62, 0.0].into_iter().enumerate() {
        at += step;
        let displace = sheared(at);
        let picture = Picture { displace: &displace, seed: number as u64, ..still(Rigid::identity()) };
        let drawn = drawn(&picture);
        let tracked = tracker.track(number as u64, &frame(&drawn.bytes));
        let s = score(tracked, &drawn);
        assert_eq!(s.ok, s.wanted, "frame {number}");
        assert!(s.worst_px < 0.25, "frame {number}: {}", s.worst_px);
        let pole = tracked.black_dots[0];
        assert!((pole.displacement_mm.unwrap().x - at).abs() < 0.03, "{number} {:?}", pole.displacement_mm);
    }
}

#[test]
fn a_platform_that_jumps_by_half_a_pitch_is_followed() {
    let mut tracker = tracker(TrackOptions::default());
    for (number, (t, r)) in [
        ([0.0; 3], [0.0; 3]),
        ([0.5, 0.0, 0.0], [0.0; 3]),
        ([0.0, 0.2, -1.0], [0.0, 0.0, 0.05]),
        ([0.0; 3], [0.0; 3]),
    ]
    .into_iter()
    .enumerate()
    {
        let drawn = drawn(&still(pose(t, r)));
        let tracked = tracker.track(number as u64, &frame(&drawn.bytes));
        let s = score(tracked, &drawn);
        assert_eq!((s.ok, names(tracked)), (s.wanted, vec![]), "frame {number}");
        assert!(s.worst_px < 0.15 && s.markers_px < 0.1);
    }
}

#[test]
fn a_reference_takes_out_what_the_constants_are_off() {
    // The sensor was put together a little off: at rest it looks loaded.
    let off = pose([0.03, 0.0, -0.1], [0.0; 3]);
    let mut tracker = tracker(TrackOptions { reference: Reference::Frames(3), ..TrackOptions::default() });
    for number in 0..5_u64 {
        let drawn = drawn(&Picture { seed: number, ..still(off) });
        let tracked = tracker.track(number, &frame(&drawn.bytes));
        let force = tracked.wrench.unwrap().force_n;
        assert!(force.abs().max_element() < 0.05, "{force}");
        assert!(tracked.black_dots.iter().all(|d| d.displacement_mm.unwrap().length() < 0.02));
    }
}

// Steady state: no allocation, whatever the frame shows; after one frame of everything.
#[test]
fn nothing_is_allocated_once_it_runs() {
    let frames: Vec<_> = (0..4_u64)
        .map(|k| {
            let gone: &[u32] = if k == 2 { &[5, 6, 7, 60, 61] } else { &[] };
            drawn(&Picture { missing: gone, seed: k, ..still(pose([0.0, 0.0, -0.2 * k as f64], [0.0; 3])) })
        })
        .collect();
    let mut tracker = tracker(TrackOptions { search_every: 3, ..TrackOptions::default() });
    for (number, drawn) in frames.iter().enumerate() {
        tracker.track(number as u64, &frame(&drawn.bytes));
    }
    let counted = allocation_counter::measure(|| {
        for number in 4..40 {
            tracker.track(number, &frame(&frames[number as usize % 4].bytes));
        }
    });
    assert_eq!(counted.count_total, 0);
}

/// A finger that presses, shears and twists: pose and shear at a time.
fn manoeuvre(number: u64) -> (Rigid, f64, f64) {
    let t = number as f64 / 30.0;
    let wave = |period: f64, phase: f64| (std::f64::consts::TAU * t / period + phase).sin();
    let down = -0.8 + 0.8 * wave(3.1, 1.5);
    let pose = pose(
        [0.12 * wave(2.3, 0.0), 0.12 * wave(2.9, 1.0), down],
        [0.02 * wave(3.7, 0.5), 0.02 * wave(2.6, 0.2), 0.03 * wave(1.9, 0.0)],
    );
    (pose, 0.9 * wave(1.3, 0.0), 0.15 * wave(1.7, 0.3))
}

/// So many frames, or as many as the environment's DOMECAST_FRAMES asks for.
pub fn frames_or(default: u64) -> u64 {
    std::env::var("DOMECAST_FRAMES").map_or(default, |n| n.parse().expect("a number of frames"))
}

// Pressing, shearing, twisting: every dot that is seen is the one that it is called. Also run over 10,000 frames.
#[test]
fn long_none_is_mislabelled_over_thousands_of_frames() {
    let missing = [3, 40, 41, 120];
    let mut tracker = tracker(TrackOptions::default());
    let (mut square, mut count, mut wanted) = (0.0, 0.0, 0.0);
    for number in 0..frames_or(1_500) {
        let (pose, shear, twist) = manoeuvre(number);
        let shear = sheared(shear);
        let displace = |p: DVec3| {
            // The pole's cap turns, the rim stays.
            let turn = twist * (p.z / p.length()).powi(2);
            rotation_from_vector(DVec3::Z * turn) * shear(p)
        };
        let picture = Picture { displace: &displace, missing: &missing, seed: number, ..still(pose) };
        let drawn = drawn(&picture);
        let tracked = tracker.track(number, &frame(&drawn.bytes));
        assert!(tracked.pose.is_some() && names(tracked).is_empty(), "frame {number}: {:?}", names(tracked));
        let s = score(tracked, &drawn);
        assert!(s.worst_px < 1.0, "frame {number}: a dot is {} px from itself", s.worst_px);
        square += s.rms_px * s.rms_px * s.ok as f64;
        count += s.ok as f64;
        wanted += s.wanted as f64;
    }
    let rms: f64 = square / count;
    println!("rms {:.4} px on each axis, {:.5} of the dots seen", rms.sqrt(), count / wanted);
    assert!(rms.sqrt() < 0.05 && count > 0.999 * wanted, "{} {}", rms.sqrt(), count / wanted);
}

// Memory: the buffers of the first frames are those of the last. Also run over 100,000 frames.
#[test]
fn long_memory_is_flat_over_thousands_of_frames() {
    let frames: Vec<_> = (0..6)
        .map(|k| drawn(&Picture { seed: k, ..still(pose([0.0, 0.0, -0.1 * k as f64], [0.0; 3])) }))
        .collect();
    let mut tracker = tracker(TrackOptions::default());
    for number in 0..12_u64 {
        tracker.track(number, &frame(&frames[number as usize % 6].bytes));
    }
    // Asking the environment allocates: that is no frame's.
    let last = frames_or(10_000);
    let counted = allocation_counter::measure(|| {
        for number in 12..last {
            tracker.track(number, &frame(&frames[number as usize % 6].bytes));
        }
    });
    assert_eq!((counted.count_total, counted.bytes_current), (0, 0));
}
