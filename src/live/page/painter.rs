//! Pictures of readings, as the page takes them.

use std::mem;
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use super::shared::{Sample, Shared};
use crate::decode::Picture;
use crate::reading::LiveReading;
use domecast_optics::SensorOptics;
use domecast_runtime::overlay::{depth_range_mm, traction_arrow_px, viridis};
use domecast_runtime::shape::ShapeMap;
use domecast_runtime::track::MarkState;
use domecast_runtime::traction::{DotTraction, ForceDistribution};

/// From picture to picture at least: what eyes need, and little of a core.
const STEP: Duration = Duration::from_millis(50);
const JPEG_QUALITY: u8 = 75;
/// Pixels of the frame along one of the skin's picture.
const SKIN_STEP: usize = 2;

/// The sensor whose readings are shown.
pub struct ShownSensor {
    /// Its optics at rest: forces are drawn as the camera sees them.
    pub optics: SensorOptics,
    /// What finds the forces on the skin in the frames that are shown; `None`: none are.
    pub forces: Option<ForceDistribution>,
}

/// What paints the readings.
pub(super) struct Painter {
    sensor: ShownSensor,
    /// So far: the colours' range does not jump.
    deepest_mm: f64,
}

impl Painter {
    pub fn new(sensor: ShownSensor) -> Self {
        Self { sensor, deepest_mm: 0.0 }
    }

    /// Paints the newest reading until the page is dropped.
    pub fn paint(&mut self, shared: &Arc<Shared>) {
        let mut last = 0;
        while !shared.is_stopped.load(Ordering::Relaxed) {
            let began = Instant::now();
            let Some((number, reading)) = shared.reading.newer(last, Duration::from_secs(1)) else {
                continue;
            };
            last = number;
            let samples = mem::take(&mut *shared.samples.lock().unwrap_or_else(PoisonError::into_inner));
            let samples: Vec<Sample> = samples.into();
            let touch = reading.skin.as_deref().and_then(|map| map.contact.as_ref());
            self.deepest_mm = touch.map_or(self.deepest_mm, |touch| self.deepest_mm.max(touch.depth_mm));
            let mut event = event(&reading, &samples, self.deepest_mm);
            let camera_from_rest = self.sensor.optics.rest_from_camera().inverse();
            let force_n = reading.tracked.wrench.map(|wrench| camera_from_rest.vector(wrench.force_n));
            event["camera_force_n"] = json!(force_n.map(|force_n| force_n.to_array()));
            event["tractions"] = json!(self.tractions(&reading));
            shared.event.set(event.to_string().into());
            if let Some(left) = STEP.checked_sub(began.elapsed()) {
                thread::sleep(left);
            }
        }
    }

    /// Arrows of the forces on the skin in the frame, px.
    fn tractions(&mut self, reading: &LiveReading) -> Vec<[[f64; 2]; 2]> {
        let tracked = &reading.tracked;
        let Some(forces) = &mut self.sensor.forces else { return Vec::new() };
        let found = forces.update(tracked, reading.skin.as_deref());
        let Some(optics) = tracked.pose.and_then(|pose| self.sensor.optics.at_pose(&pose).ok()) else {
            return Vec::new();
        };
        let arrow = |dot: &DotTraction| traction_arrow_px(&optics, dot.surface_mm, dot.traction_n_mm2);
        found.dots.iter().filter_map(arrow).map(|ends| ends.map(px)).collect()
    }
}

fn data_url(kind: &str, bytes: &[u8]) -> String {
    format!("data:image/{kind};base64,{}", STANDARD.encode(bytes))
}

/// Pixels to a hundredth: more is not seen.
fn px(at: glam::DVec2) -> [f64; 2] {
    [at.x, at.y].map(|v| (100.0 * v).round() / 100.0)
}

fn event(reading: &LiveReading, samples: &[Sample], deepest_mm: f64) -> Value {
    let map = reading.skin.as_deref();
    let tracked = &reading.tracked;
    let dots: Vec<Value> = tracked
        .black_dots
        .iter()
        .filter_map(|dot| Some(json!([px(dot.undeformed_px?), dot.image_px.map(px)])))
        .collect();
    let markers: Vec<_> = tracked.white_markers.iter().filter_map(|m| m.centroid_px.map(px)).collect();
    let problems: Vec<&str> = tracked.problems.iter().map(|problem| problem.as_str()).collect();
    let range_mm = depth_range_mm(deepest_mm);
    let outline = map.and_then(|map| map.contact.as_ref());
    json!({
        "frame": tracked.frame,
        "time_s": tracked.time_s,
        "status": tracked.status(),
        "problems": problems,
        "device": reading.device,
        "size": reading.picture.as_ref().map(|picture| [picture.width, picture.height]),
        "image": reading.picture.as_deref().and_then(jpeg).map(|bytes| data_url("jpeg", &bytes)),
        "dots": dots,
        "dots_ok": tracked.count(MarkState::Ok),
        "markers": markers,
        "wrench": tracked.wrench.map(|wrench| wrench.to_array()),
        "wrench_sd": tracked.wrench_sd.map(|wrench| wrench.to_array()),
        "samples": samples,
        "age_ms": reading.age_ms,
        "rate_hz": reading.rate_hz,
        "dropped": reading.dropped,
        "hardness": reading.hardness,
        "skin": map.and_then(|map| skin_png(map, range_mm)).map(|bytes| data_url("png", &bytes)),
        "skin_range_mm": map.map(|_| range_mm),
        "outline": outline.map(|touch| touch.outline_px.iter().map(|at| px(at.as_dvec2())).collect::<Vec<_>>()),
    })
}

fn jpeg(picture: &Picture) -> Option<Vec<u8>> {
    let (width, height) = (u16::try_from(picture.width).ok()?, u16::try_from(picture.height).ok()?);
    let color =
        if picture.channels == 3 { jpeg_encoder::ColorType::Rgb } else { jpeg_encoder::ColorType::Luma };
    let mut bytes = Vec::new();
    let encoder = jpeg_encoder::Encoder::new(&mut bytes, JPEG_QUALITY);
    encoder.encode(&picture.bytes, width, height, color).ok().map(|()| bytes)
}

/// The skin's depth in colours, clear where it is not pressed in or nothing is known, at half the frame's size.
fn skin_png(map: &ShapeMap, range_mm: f64) -> Option<Vec<u8>> {
    let (width, height) = (map.width / SKIN_STEP, map.height / SKIN_STEP);
    let mut rgba = Vec::with_capacity(4 * width * height);
    for y in 0..height {
        for x in 0..width {
            let pixel = SKIN_STEP * (y * map.width + x);
            let depth_mm = -f64::from(map.height_mm.get(pixel).copied().unwrap_or(f32::NAN));
            let sd_mm = f64::from(map.height_sd_mm.get(pixel).copied().unwrap_or(f32::NAN));
            // below a deviation nothing is shown, above three all of it
            let surety = ((depth_mm / sd_mm.max(1e-9) - 1.0) / 2.0).clamp(0.0, 1.0);
            let share = depth_mm / range_mm;
            let is_shown = share > 0.0 && surety > 0.0;
            let [red, green, blue] = if is_shown { viridis(share) } else { [0; 3] };
            let alpha = if is_shown { (255.0 * surety * (10.0 * share).min(1.0)).round() as u8 } else { 0 };
            rgba.extend([red, green, blue, alpha]);
        }
    }
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder.write_header().and_then(|mut writer| writer.write_image_data(&rgba)).ok()?;
    Some(bytes)
}
