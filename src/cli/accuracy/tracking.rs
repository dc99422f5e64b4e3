//! The runtime: what its options cost in time and give in exactness, on the scene's frames.

use super::clock::{TimeLimit, time_again};
use super::frames::Sequence;
use super::sweep::{Law, Sweep, SweepSample, sizes};
use domecast_runtime::constants::Constants;
use domecast_runtime::track::{CameraFrame, Channel, MarkState, TrackOptions, Tracker};

/// The sweep of options; `None` where the frames have no pictures or the constants fit no tracker.
pub fn sweep(constants: &Constants, frames: &Sequence, time_limit: TimeLimit) -> Option<Sweep> {
    let plain = TrackOptions::default();
    let options: [(&str, TrackOptions); 4] = [
        ("every frame searched as a whole", TrackOptions { search_every: 1, ..plain }),
        ("green alone", TrackOptions { channel: Channel::Green, ..plain }),
        ("points only, searched where one is lost", TrackOptions { search_every: 0, ..plain }),
        ("as it runs", plain),
    ];
    let half_way_px = half_way_px(frames)?;
    let mut samples = Vec::new();
    for (index, (label, options)) in options.into_iter().enumerate() {
        let mut tracker = Tracker::new(constants, options).ok()?;
        let (mut errors, mut seen, mut missed) = (Vec::new(), 0_usize, 0_usize);
        for (number, drawn) in (0_u64..).zip(&frames.drawn) {
            let image = drawn.image.as_ref()?;
            let frame = CameraFrame::new(image.width, image.height, image.channels, &image.bytes).ok()?;
            let tracked = tracker.track(number, &frame);
            for truth in drawn.truth.black_dots.iter().filter(|dot| dot.visible) {
                let Some(at) = truth.centroid_px else { continue };
                let found = tracked.black_dots.iter().find(|dot| dot.id == truth.id);
                seen += 1;
                match found.filter(|dot| dot.state == MarkState::Ok).and_then(|dot| dot.centroid_px) {
                    Some(px) => errors.push(px.distance(glam::DVec2::from_array(at))),
                    // farther than this it would pass for its neighbour
                    None => {
                        missed += 1;
                        errors.push(half_way_px);
                    }
                }
            }
        }
        let (max_error, rms_error, _) = sizes(errors.into_iter());
        let timing = time_again(time_limit, || {
            tracker.restart();
            for (number, drawn) in (0_u64..).zip(&frames.drawn) {
                if let Some(image) = &drawn.image
                    && let Ok(frame) =
                        CameraFrame::new(image.width, image.height, image.channels, &image.bytes)
                {
                    tracker.track(number, &frame);
                }
            }
        });
        samples.push(SweepSample {
            method: ["whole", "green", "points", "default"][index],
            label: label.to_owned(),
            setting: index as f64 + 1.0,
            max_error,
            rms_error,
            time: timing,
            per_item_s: timing.median_s / frames.drawn.len().max(1) as f64,
            notes: vec![("share of dots not seen".into(), missed as f64 / seen.max(1) as f64)],
            dominated: false,
        });
    }
    Some(sweep_of(samples, frames.drawn.len()))
}

/// The sweep of its samples.
fn sweep_of(samples: Vec<SweepSample>, items: usize) -> Sweep {
    let in_use = samples.len() - 1;
    Sweep {
            name: "tracker",
            title: "Dots in the runtime".into(),
            setting: "options",
            error: "distance of a dot's centroid from the truth; half way to the nearest dot for one that is not found",
            unit: "px",
            item: "frame",
            items,
            reference: "the simulator's own centroids".into(),
            floor: 1e-6,
            law: Law::Falls,
            observed: None,
            samples,
            in_use: Some(in_use),
            asked: None,
            meets: None,
            conclusion: "Searching the frame as a whole costs most and gives nothing while no dot is lost.".into(),
        }
        .finish()
}

/// Half of the smallest distance between two dots of the first frame, px.
fn half_way_px(frames: &Sequence) -> Option<f64> {
    let dots = &frames.drawn.first()?.truth.black_dots;
    let places: Vec<glam::DVec2> =
        dots.iter().filter_map(|dot| dot.centroid_px.map(glam::DVec2::from_array)).collect();
    let apart = |i: usize| places[..i].iter().map(move |other| (i, other));
    let distances = (0..places.len()).flat_map(apart).map(|(i, other)| places[i].distance(*other));
    distances.reduce(f64::min).map(|min| 0.5 * min)
}
