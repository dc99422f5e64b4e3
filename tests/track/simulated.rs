//! The scenes of `designs/scenes`, drawn by the simulator in memory: what the tracker says beside what is true.

use std::path::PathBuf;

use domecast::sim::{Drawn, Plan, Renderer, Scene};
use domecast::track::{Frame, MarkState, TrackOptions, Tracked};
use glam::DVec2;
use rayon::prelude::*;

use super::{names, tracker};

fn scenes() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("designs/scenes")
}

/// What came of a sequence.
#[derive(Default)]
struct Told {
    frames: usize,
    /// Squared errors of centroids and how many; the largest error.
    square: f64,
    dots: usize,
    wanted: usize,
    worst_px: f64,
    markers_px: f64,
    /// Sums of wrench errors, of their squares, and of the variances that were said.
    wrench: [[f64; 3]; 6],
    wrenches: f64,
}

impl Told {
    fn add(&mut self, tracked: &Tracked, drawn: &Drawn) {
        self.frames += 1;
        for (dot, truth) in tracked.black_dots.iter().zip(&drawn.truth.black_dots) {
            assert_eq!(dot.id, truth.id);
            let Some(at) = truth.centroid_px.filter(|_| truth.visible) else { continue };
            self.wanted += 1;
            if let Some(found) = dot.centroid_px {
                let miss = found.distance(DVec2::from_array(at));
                self.square += miss * miss;
                self.dots += 1;
                self.worst_px = self.worst_px.max(miss);
            }
        }
        for (marker, truth) in tracked.white_markers.iter().zip(&drawn.truth.white_markers) {
            if let (Some(found), Some(at)) = (marker.centroid_px, truth.centroid_px) {
                self.markers_px = self.markers_px.max(found.distance(DVec2::from_array(at)));
            }
        }
        if let (Some(wrench), Some(sd)) = (tracked.wrench, tracked.wrench_sd) {
            self.wrenches += 1.0;
            for axis in 0..6 {
                let miss = wrench[axis] - drawn.truth.wrench[axis];
                let sums = &mut self.wrench[axis];
                *sums = [sums[0] + miss, sums[1] + miss * miss, sums[2] + sd[axis] * sd[axis]];
            }
        }
    }

    /// On each axis.
    fn rms_px(&self) -> f64 {
        (0.5 * self.square / self.dots.max(1) as f64).sqrt()
    }

    /// Mean error of the wrench, its standard deviation, and the one that was said.
    fn wrench(&self) -> [[f64; 3]; 6] {
        self.wrench.map(|[sum, square, said]| {
            let mean = sum / self.wrenches;
            let n = (self.wrenches - 1.0).max(1.0);
            [
                mean,
                ((square - self.wrenches * mean * mean) / n).max(0.0).sqrt(),
                (said / self.wrenches).sqrt(),
            ]
        })
    }

    fn line(&self) -> String {
        let wrench: Vec<String> = self
            .wrench()
            .iter()
            .map(|[mean, sd, said]| format!("{mean:+.4} ({sd:.4}, said {said:.4})"))
            .collect();
        format!(
            "{} frames, dots {}/{} rms {:.4} worst {:.3}, markers {:.3}, wrench {}",
            self.frames,
            self.dots,
            self.wanted,
            self.rms_px(),
            self.worst_px,
            self.markers_px,
            wrench.join(" ")
        )
    }
}

fn frames_of(scene: &Scene, plan: &Plan, numbers: impl IntoParallelIterator<Item = u32>) -> Vec<Drawn> {
    let renderer = Renderer::new(scene, plan).expect("the plan's effects");
    let mut drawn: Vec<Drawn> =
        numbers.into_par_iter().map(|number| renderer.frame(number).expect("a frame")).collect();
    drawn.sort_by_key(|drawn| drawn.truth.frame);
    drawn
}

fn track_all(drawn: &[Drawn]) -> Told {
    let mut tracker = tracker(TrackOptions::default());
    let mut told = Told::default();
    for drawn in drawn {
        let image = drawn.image.as_ref().expect("a picture");
        let frame = Frame::new(image.width, image.height, image.channels, &image.bytes).expect("a frame");
        let number = drawn.truth.frame;
        let tracked = tracker.track(number.into(), &frame);
        assert!(tracked.pose.is_some(), "frame {number}: {:?}", names(tracked));
        assert_eq!(tracked.count(MarkState::Merged), 0, "frame {number}");
        told.add(tracked, drawn);
    }
    told
}

#[test]
fn scenes_of_the_tree_are_tracked() {
    for (name, frames) in [("still", 2), ("push", 30), ("twist", 30), ("lit", 1)] {
        let path = scenes().join(name).with_extension("json");
        let scene = Scene::load(&path).expect("a scene");
        let plan = Plan::of(&scene).expect("a plan");
        let count = scene.frame_count();
        let drawn = frames_of(&scene, &plan, 0..count.min(frames));
        let told = track_all(&drawn);
        println!("{}: {}", scene.name(), told.line());
        assert!(told.rms_px() < 0.05 && told.worst_px < 1.0, "{}: {}", scene.name(), told.line());
        assert!(told.dots as f64 > 0.99 * told.wanted as f64, "{}: {}", scene.name(), told.line());
    }
}
