//! A frame of 640 x 480 with the paper's dots, steady: what a runtime has to do thirty times a second.

#[path = "../tests/track/render.rs"]
mod render;

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use domecast::springs::Displacement;
use domecast::track::{CameraFrame, TrackOptions, Tracker};
use glam::DVec3;

fn frames(criterion: &mut Criterion) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("designs/thumb24.json");
    let design = domecast::design::Design::load(&path).expect("the design");
    let layout = domecast::layout::Layout::of_design(&design).expect("its layout");
    let constants = domecast::constants::of(&design, &layout).expect("its constants");
    let optics = constants.sensor().expect("its optics");
    // A press and its release, a tenth of a millimetre a frame, as RGB frames come from a camera.
    let drawn: Vec<Vec<u8>> = (0..16_i32)
        .map(|k| {
            let down = f64::from(8 - (k - 8).abs()) * 0.1;
            let moved =
                Displacement { translation_mm: DVec3::new(0.0, 0.0, -down), rotation_rad: DVec3::ZERO };
            let picture = render::Picture { seed: k as u64, ..render::still(moved.to_pose(DVec3::ZERO)) };
            render::draw(&constants, &optics, &picture).bytes.iter().flat_map(|v| [*v; 3]).collect()
        })
        .collect();
    for (name, options) in [
        ("steady", TrackOptions::default()),
        ("searched", TrackOptions { search_every: 1, ..TrackOptions::default() }),
    ] {
        let mut tracker = Tracker::new(&constants, options).expect("a tracker");
        let mut number = 0;
        criterion.bench_function(&format!("track/{name}"), |bencher| {
            bencher.iter(|| {
                let frame = CameraFrame::new(640, 480, 3, &drawn[number as usize % 16]).expect("a frame");
                let found = tracker.track(number, black_box(&frame)).pose.is_some();
                number += 1;
                found
            });
        });
    }
}

criterion_group!(benches, frames);
criterion_main!(benches);
