//! The numbers beside the frames: what a tracker says, modelled from the truth.

use glam::{DVec2, Vec3};

use crate::check::Dataset;
use crate::sensor::BuiltSensor;
use crate::video::Video;
use domecast_hardness::{COLUMNS, SeenDot, dots_features};
use domecast_optics::numeric::SeededRandom;

/// Stream of the readings' noise, apart from the frames'.
const STREAM_READINGS: u64 = 0x7ead;
/// Readings of a video and its dots.
#[derive(Debug, Clone)]
pub struct Readings {
    /// Row by row.
    pub rows: Vec<[f32; COLUMNS.len()]>,
    /// Of each frame, of each dot: motion that the skin's shape makes, px at the design's size, and whether it is found.
    pub dots: Vec<Vec<Vec3>>,
}

/// The readings of a video with the noise of the spec.
pub fn modelled(dataset: &Dataset, sensor: &BuiltSensor, video: &Video, seed: u64) -> Readings {
    let n = &dataset.spec().readings.noise;
    let mut random = SeededRandom::stream(seed, STREAM_READINGS);
    let radius_gain = 1.0 + 0.01 * n.radius_percent * random.normal().clamp(-3.0, 3.0);
    let per_px = 1.0 / dataset.scale();
    let (mut rows, mut dots) = (Vec::new(), Vec::new());
    for (frame, truth) in video.truth.iter().enumerate() {
        let seen = truth.black_dots.iter().zip(&video.undeformed_px[frame]).map(|(dot, rest)| {
            // every dot takes its numbers, found or not, so that one that is lost moves no other's
            let noise = random.normal_pair() * n.dots_px;
            let (at, rest) = (dot.image_px.filter(|_| dot.visible)?, (*rest)?);
            let [at, rest] = [at, rest].map(DVec2::from_array);
            let full = (rest + 0.5) * per_px - 0.5;
            Some(SeenDot { at_px: full, moved_px: (at - rest) * per_px + noise })
        });
        let seen: Vec<Option<SeenDot>> = seen.collect();
        let mut wrench = truth.wrench.map(|value| value * sensor.own.spring_gain);
        let mut platform = video.platform[frame];
        for k in 0..6 {
            let [force, shift] = if k < 3 { [n.force_n, n.shift_mm] } else { [n.moment_nmm, n.turn_rad] };
            let noise = random.normal_pair();
            wrench[k] += force * noise.x;
            platform[k] += shift * noise.y;
        }
        let noise = random.normal_pair();
        let travel_mm = match dataset.spec().readings.robot_travel_sd_mm {
            Some(sd_mm) => video.travel_mm[frame] + sd_mm * noise.x,
            None => f64::NAN,
        };
        let radius_mm = match video.radius_mm[frame] {
            radius_mm if radius_mm > 0.0 => (radius_mm * radius_gain + n.radius_mm * noise.y).max(0.0),
            _ => 0.0,
        };
        let time_s = video.course.times_s[frame];
        let height = f64::from(dataset.design.sections().camera.height);
        rows.push(row(time_s, &wrench, &platform, travel_mm, &seen, radius_mm, height));
        dots.push(seen.into_iter().map(written).collect());
    }
    Readings { rows, dots }
}

/// A dot as it is written.
pub fn written(dot: Option<SeenDot>) -> Vec3 {
    dot.map_or(Vec3::ZERO, |dot| Vec3::new(dot.moved_px.x as f32, dot.moved_px.y as f32, 1.0))
}

/// A row of the readings.
pub fn row(
    time_s: f64,
    wrench: &[f64; 6],
    platform: &[f64; 6],
    travel_mm: f64,
    seen: &[Option<SeenDot>],
    radius_mm: f64,
    height_px: f64,
) -> [f32; COLUMNS.len()] {
    let [mean, radial, divergence, found] = dots_features(seen, height_px);
    let mut out = [0.0; COLUMNS.len()];
    let all = std::iter::once(time_s).chain(*wrench).chain(*platform);
    let all = all.chain([travel_mm, mean, radial, divergence, radius_mm, found]);
    for (to, value) in out.iter_mut().zip(all) {
        *to = value as f32;
    }
    out
}
