//! A video as the entries of its key.

use serde_json::{Value, json};

use crate::check::Dataset;
use crate::draw::PairDraw;
use crate::readings::Readings;
use crate::scene::shape_label;
use crate::tar::Archive;
use crate::video::Video;
use domecast_files::{npy_f32, npy_u8};
use domecast_hardness::COLUMNS;

/// Bytes of a label for each ten frames: all of a set have the same, so that no size tells anything.
const LABEL_BYTES: usize = 2048;

/// A number with six digits, as labels hold it.
fn short(value: f64) -> Value {
    if value == 0.0 || !value.is_finite() {
        return json!(if value == 0.0 { Some(0.0) } else { None });
    }
    let digits = 5 - value.abs().log10().floor() as i32;
    // digits of a decimal number, not of the power that rounds it
    let scale = 10_f64.powi(digits.abs());
    let rounded = if digits >= 0 { (value * scale).round() / scale } else { (value / scale).round() * scale };
    json!(rounded)
}

fn list(values: impl IntoIterator<Item = f64>) -> Value {
    Value::Array(values.into_iter().map(short).collect())
}

/// The label of a video, padded to the size that all have.
pub fn label(dataset: &Dataset, draw: &PairDraw, video: &Video, number: u32) -> Vec<u8> {
    let spec = dataset.spec();
    let (class, young_mpa) = dataset.hardness_of(number);
    let named = spec.hardness.classes.as_ref().and_then(|classes| classes.get(class));
    let course = &video.course;
    let keys: Vec<Value> =
        course.times_s.iter().zip(&course.force_n).map(|(time, force)| list([*time, *force])).collect();
    let force =
        |truth: &domecast_sim::FrameTruth| truth.wrench.iter().take(3).map(|f| f * f).sum::<f64>().sqrt();
    let label = json!({
        "key": key(number),
        "class": named.map(|class| class.name.as_str()),
        "label": named.map(|_| class),
        "youngs_modulus_mpa": short(young_mpa),
        "log10_youngs_modulus_mpa": short(young_mpa.log10()),
        "poisson": short(draw.poisson),
        "shape": shape_label(dataset, draw),
        "split": draw.split.as_str(),
        "sensor": draw.sensor,
        "twin": draw.pair,
        "seed": dataset.noise_seed(number).to_string(),
        "first_contact_frame": course.first_contact,
        "peak_force_n": short(draw.peak_force_n),
        "duration_s": short(draw.duration_s),
        "friction": short(draw.friction),
        "light_power": short(draw.power),
        "path": {
            "direction": list(draw.way.to_array()),
            "place_mm": list(draw.place_mm.to_array()),
            "polar_deg": short(draw.normal.z.clamp(-1.0, 1.0).acos().to_degrees()),
            "azimuth_deg": short(draw.normal.y.atan2(draw.normal.x).to_degrees()),
            "rotation_deg": list(draw.rotation_deg.to_array()),
            "drag_mm": list(draw.drag_mm.to_array()),
            "approach_mm_s": short(draw.approach_mm_s),
            "keys": keys,
        },
        "truth": {
            "force_n": list(video.truth.iter().map(force)),
            "contact_radius_mm": list(video.radius_mm.iter().copied()),
            "robot_travel_mm": list(video.travel_mm.iter().copied()),
            "platform_travel_mm": list(video.platform.iter().map(|p| -p[2])),
        },
    });
    let mut bytes = label.to_string().into_bytes();
    let frames = course.times_s.len();
    let size = LABEL_BYTES * frames.div_ceil(10);
    bytes.resize(size.max(bytes.len()), b' ');
    bytes
}

/// The key of a video.
pub fn key(number: u32) -> String {
    format!("{number:06}")
}

/// Puts a video into an archive.
pub fn add(archive: &mut Archive, dataset: &Dataset, number: u32, made: &Made) {
    let spec = dataset.spec();
    let (frames, [height, width]) = (spec.frames.count as usize, [spec.frames.height, spec.frames.width]);
    let size = [height as usize, width as usize, 3];
    let key = key(number);
    let mut put = |name: &str, bytes: &[u8]| archive.add(&format!("{key}.{name}"), bytes);
    let pictures = made.video.frames.iter().take(frames).flatten().copied();
    put("frames.npy", &npy_u8(&[frames, size[0], size[1], size[2]], pictures));
    put("rest.npy", &npy_u8(&size, made.video.frames.last().into_iter().flatten().copied()));
    let rows = made.readings.rows.iter().flatten().copied();
    put("readings.npy", &npy_f32(&[frames, COLUMNS.len()], rows));
    if spec.dots {
        let count = made.readings.dots.first().map_or(0, Vec::len);
        let dots = made.readings.dots.iter().flatten().flat_map(|dot| dot.to_array());
        put("dots.npy", &npy_f32(&[frames, count, 3], dots));
    }
    put("json", &made.label);
}

/// A video, its readings and its label.
#[derive(Debug, Clone)]
pub struct Made {
    /// The video.
    pub video: Video,
    /// Its readings.
    pub readings: Readings,
    /// Its label.
    pub label: Vec<u8>,
}
