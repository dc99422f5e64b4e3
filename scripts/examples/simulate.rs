//! Simulates a scene in memory and tracks it at once: the true force beside the one that the sensor feels.
//!
//!     cargo run --release --example simulate -- designs/scenes/ball.json

use std::path::Path;

use domecast::sim::{Plan, Renderer};
use domecast::track::{CameraFrame, TrackOptions};
use domecast::{Scene, Tracker, constants};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene] = arguments.as_slice() else { return Err("usage: simulate SCENE".into()) };

    let scene = Scene::load(Path::new(scene))?;
    // the effects that the scene calls for; what is smaller than its tolerance is left out
    let renderer = Renderer::new(&scene, &Plan::of(&scene)?)?;
    let constants = constants::of(scene.design(), scene.layout())?;
    let mut tracker = Tracker::new(&constants, TrackOptions::default())?;

    println!("frame  true Fz, N  felt Fz, N  sd, N  status");
    for number in 0..scene.frame_count() {
        let drawn = renderer.frame(number)?;
        let image = drawn.image.ok_or("the scene draws no frames")?;
        let frame = CameraFrame::new(image.width, image.height, image.channels, &image.bytes)?;
        let tracked = tracker.track(u64::from(number), &frame);
        let [felt, sd] = [tracked.wrench, tracked.wrench_sd].map(|w| w.map_or(f64::NAN, |w| w.force_n.z));
        println!("{number:5}  {:10.4}  {felt:10.4}  {sd:5.3}  {}", drawn.truth.wrench[2], tracked.status());
    }
    Ok(())
}
