//! The runtime on frames: pictures drawn from the constants, and sequences of the simulator.

mod render;

use std::path::Path;
use std::sync::LazyLock;

use domecast::constants::Constants;
use domecast::design::Design;
use domecast::layout::Layout;
use domecast::mechanics::{Displacement, Suspension, limits_of, standard_directions, suspension_of};
use domecast::numeric::Rigid;
use domecast::track::{Frame, MarkState, Springs, TrackOptions, Tracked, Tracker};
use glam::{DVec2, DVec3};
use render::{draw, still};

struct Sensor {
    design: Design,
    constants: Constants,
}

static SENSOR: LazyLock<Sensor> = LazyLock::new(|| {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("designs/thumb24.json");
    let design = domecast::design::load(&path).expect("the design");
    let layout = Layout::of_design(&design).expect("its layout");
    let constants = domecast::constants::of(&design, &layout).expect("its constants");
    // As a runtime gets them.
    let constants = Constants::parse(&constants.to_json()).expect("its own file");
    Sensor { design, constants }
});

fn suspension() -> Suspension {
    suspension_of(&SENSOR.design).expect("its springs")
}

fn pose(t: [f64; 3], r: [f64; 3]) -> Rigid {
    let d = Displacement { translation_mm: DVec3::from_array(t), rotation_rad: DVec3::from_array(r) };
    d.to_pose(suspension().at_mm())
}

fn tracker(options: TrackOptions) -> Tracker {
    Tracker::new(&SENSOR.constants, options).expect("a tracker")
}

fn frame(bytes: &[u8]) -> Frame<'_> {
    let camera = &SENSOR.constants.camera;
    Frame::new(camera.width as usize, camera.height as usize, 1, bytes).expect("a frame")
}

struct Score {
    ok: usize,
    wanted: usize,
    rms_px: f64,
    worst_px: f64,
    markers_px: f64,
    bias_px: DVec2,
}

fn score(tracked: &Tracked, drawn: &render::Drawn) -> Score {
    let (mut sum, mut worst, mut ok, mut wanted, mut bias) = (0.0, 0.0_f64, 0, 0, DVec2::ZERO);
    for (dot, truth) in tracked.black_dots.iter().zip(&drawn.dots) {
        let Some([center, _]) = truth else {
            assert_ne!(dot.state, MarkState::Ok, "dot {} is not printed", dot.id);
            continue;
        };
        wanted += 1;
        if let Some(at) = dot.image_px {
            let miss = at.distance(*center);
            ok += 1;
            sum += miss * miss;
            bias += at - *center;
            worst = worst.max(miss);
        }
    }
    let mut markers = 0.0_f64;
    for (marker, truth) in tracked.white_markers.iter().zip(&drawn.markers) {
        let away = marker.centroid_px.zip(*truth).map_or(f64::INFINITY, |(at, [_, c])| at.distance(c));
        markers = markers.max(away);
    }
    let n = f64::from(ok as u32).max(1.0);
    // rms on each axis
    Score { ok, wanted, rms_px: (sum / n / 2.0).sqrt(), worst_px: worst, markers_px: markers, bias_px: bias / n }
}

#[test]
fn explore_first_frame() {
    for (t, r) in [
        ([0.0; 3], [0.0; 3]),
        ([0.05, -0.02, -2.0], [0.0, 0.0, 0.0]),
        ([0.1, 0.1, -0.5], [0.03, -0.04, 0.03]),
        ([0.3, 0.0, -1.0], [0.0, 0.05, -0.08]),
    ] {
        let picture = still(pose(t, r));
        let mut tracker = tracker(TrackOptions::default());
        let drawn = draw(&SENSOR.constants, tracker.optics(), &picture);
        let began = std::time::Instant::now();
        let tracked = tracker.track(0, &frame(&drawn.bytes)).clone();
        let first = began.elapsed();
        let again = std::time::Instant::now();
        for i in 1..200 {
            tracker.track(i, &frame(&drawn.bytes));
        }
        let each = again.elapsed() / 199;
        let s = score(&tracked, &drawn);
        println!(
            "{:?} dots {}/{} rms {:.4} worst {:.3} bias {:?} markers {:.3} first {first:?} each {each:?}",
            tracked.problems.iter().map(|p| p.as_str()).collect::<Vec<_>>(),
            s.ok, s.wanted, s.rms_px, s.worst_px, s.bias_px, s.markers_px
        );
        let at = suspension().at_mm();
        if let Some(found) = tracked.pose {
            let truth = Displacement::of_pose(&picture.pose, at);
            let d = Displacement::of_pose(&found, at);
            println!("   dt {:?} dr {:?} sd {:?} rms {:?}", d.translation_mm - truth.translation_mm, d.rotation_rad - truth.rotation_rad, tracked.pose_sd, tracked.pose_rms_px);
            let w = suspension().wrench_at(&truth).unwrap().to_array();
            let f = tracked.wrench.unwrap();
            println!("   wrench {w:?}\n   found  {f:?}\n   sd {:?}", tracked.wrench_sd);
        }
        if let Ok(dir) = std::env::var("TRACK_PICTURES") {
            let png = domecast::track::overlay_png(&frame(&drawn.bytes), &tracked, tracker.optics(), 1.0).unwrap();
            std::fs::write(format!("{dir}/overlay_{}.png", t[2]), png).unwrap();
        }
    }
}

// The constants' table, read as springs that are conservative, against the design's own law over all that it carries.
#[test]
fn the_table_gives_the_wrench() {
    let suspension = suspension();
    let springs = Springs::new(SENSOR.constants.springs.as_ref().unwrap()).unwrap();
    let limits = limits_of(&SENSOR.design);
    let mut worst = [[0.0_f64; 6]; 2];
    for direction in standard_directions(suspension.at_mm(), 10.0, 8) {
        let reached = domecast::mechanics::reach(&suspension, &limits, &|_| vec![], &direction);
        for part in [0.25, 0.5, 0.75, 1.0] {
            let wrench = direction.wrench.scaled(reached.factor.min(1e3) * part);
            let case = domecast::mechanics::try_load(&suspension, &limits, &wrench);
            let Ok(equilibrium) = &case.equilibrium else { continue };
            let d = Displacement::of_pose(&equilibrium.pose, suspension.at_mm());
            let by_law = springs.wrench(&d);
            let by_table = domecast::constants::wrench_by_table(SENSOR.constants.springs.as_ref().unwrap(), &d);
            for axis in 0..6 {
                let truth = wrench.to_array()[axis];
                worst[0][axis] = worst[0][axis].max((by_law[axis] - truth).abs());
                worst[1][axis] = worst[1][axis].max((by_table[axis] - truth).abs());
            }
            if part == 1.0 {
                println!("{} {:?} d {:?} miss {:?}", direction.name, wrench.to_array(), d.to_array(),
                    std::array::from_fn::<f64, 6, _>(|i| by_law[i] - wrench.to_array()[i]));
            }
        }
    }
    println!("conservative {:?}\nproduct {:?}", worst[0], worst[1]);
}
