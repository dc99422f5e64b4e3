//! From what was drawn to the scene of one video.

use glam::DVec3;
use serde_json::{Value, json};

use crate::check::Dataset;
use crate::draw::PairDraw;
use crate::sensor_draw::SensorDraw;
use domecast_sim::scene::SceneFile;
use domecast_sim::scene::electronics::{ElectronicsSection, FocusSection, NoiseSection};
use domecast_sim::scene::file::{
    ContactSection, FramesSection, InkSection, LevelName, OutputSection, ToleranceSection,
};
use domecast_sim::scene::light::{LedLight, LightSection};
use domecast_sim::scene::objects::{ForceKey, ObjectKey, ObjectSection, PressSection, ShapeSection};
use domecast_sim::scene::slow_gel::{ModulusName, SlowGelSection};

/// How far before the place an object starts, mm, of a dome of 10 mm radius: further than any object reaches.
const START_RADII: f64 = 6.0;
/// Pixels that are filled in between rays may be off by this many grey levels: a bound, and below what the camera's noise hides.
const GREY: f64 = 1.0;
/// Bits of the converter behind an average over pixels: finer than the code of the picture.
const BITS: u8 = 12;
/// When a pair's frames are, and how hard the object is pressed on there.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// Time of each frame, s.
    pub times_s: Vec<f64>,
    /// Force in each frame, N; 0 before the contact.
    pub force_n: Vec<f64>,
    /// The first frame in contact.
    pub first_contact: u32,
}

impl Course {
    /// Of a pair.
    pub fn of(dataset: &Dataset, draw: &PairDraw) -> Self {
        let count = dataset.spec().frames.count;
        let step_s = draw.duration_s / f64::from(count - 1);
        let [exponent, hold] = draw.ramp;
        let before = draw.before_contact.min(count - 2);
        let contact = f64::from(count - before);
        let force = |frame: u32| {
            if frame < before {
                return 0.0;
            }
            let part = f64::from(frame + 1 - before) / contact;
            draw.peak_force_n * (part / (1.0 - hold)).min(1.0).powf(exponent)
        };
        Self {
            times_s: (0..count).map(|frame| f64::from(frame) * step_s).collect(),
            force_n: (0..count).map(force).collect(),
            first_contact: before,
        }
    }
}

/// What is the same in all scenes of a sensor; the object stands away from the dome.
pub fn template(dataset: &Dataset, own: &SensorDraw, element_mm: f64, scale: f64) -> SceneFile {
    let spec = dataset.spec();
    let middle = |[low, high]: [f64; 2]| 0.5 * (low + high);
    let away = ObjectSection {
        name: "object".into(),
        shape: ShapeSection::Sphere { radius_mm: dataset.design.optics().dome_radius_mm() },
        young_mpa: Some(1.0),
        poisson: middle(spec.poisson),
        path: vec![key(0.0, DVec3::Z * 10.0 * dataset.design.optics().dome_radius_mm(), DVec3::ZERO)],
        press: Some(PressSection {
            direction: [0.0, 0.0, -1.0],
            force: vec![ForceKey { time_s: 0.0, force_n: 0.0 }],
        }),
        why: None,
    };
    let terms = own.gel.clone();
    SceneFile {
        schema: None,
        version: 1,
        name: spec.name.clone(),
        description: None,
        design: spec.design.clone(),
        frames: FramesSection { count: 1, rate_hz: 1.0, images: true, colour: true },
        tolerance: ToleranceSection { px: 0.05, grey: GREY, force_n: None },
        seed: 0,
        motion: None,
        objects: vec![away],
        contact: ContactSection { level: LevelName::Linear, element_mm, ..ContactSection::default() },
        slow_gel: (!terms.is_empty()).then_some(SlowGelSection {
            terms,
            modulus: ModulusName::Relaxed,
            why: None,
        }),
        light: LightSection {
            surround_level: spec.light.surround_level,
            leds: Some(LedLight {
                power: middle(spec.light.power),
                each: own.each.clone(),
                moved: Vec::new(),
                level_per_mw_mm2: spec.light.level_per_mw_mm2,
                stray_level: middle(spec.light.stray_level),
                gloss: false,
                crosstalk: own.crosstalk,
                why: None,
            }),
            ..LightSection::default()
        },
        electronics: ElectronicsSection {
            focus: Some(FocusSection {
                pupil_diameter_mm: spec.camera.pupil_diameter_mm,
                distance_mm: own.focus_mm,
            }),
            noise: Some(noise(
                dataset,
                [middle(spec.camera.full_scale_electrons), middle(spec.camera.read_electrons)],
                scale,
            )),
            ..ElectronicsSection::default()
        },
        ink: InkSection::default(),
        uneven_membrane: None,
        dust: None,
        effects: Default::default(),
        output: OutputSection::default(),
        why: None,
    }
}

/// The noise of a picture that is averaged over areas of the camera's own: a pixel gathers the electrons of all pixels that it
/// stands for, and their readings' errors add up as squares. Behind a mosaic of colours red and blue have a quarter of the
/// pixels; green, which has half, is taken for as noisy.
fn noise(dataset: &Dataset, [full_scale, read]: [f64; 2], scale: f64) -> NoiseSection {
    let area = 1.0 / (scale * scale);
    let mosaic = dataset.spec().camera.bayer && scale < 0.75;
    let count = if mosaic { (0.25 * area).max(1.0) } else { area };
    NoiseSection {
        full_scale_electrons: full_scale * count,
        read_electrons: read * count.sqrt(),
        bits: if scale < 1.0 { BITS } else { 10 },
    }
}

fn key(time_s: f64, at_mm: DVec3, rotation_deg: DVec3) -> ObjectKey {
    ObjectKey { time_s, position_mm: at_mm.to_array(), rotation_deg: rotation_deg.to_array() }
}

/// The scene of one video, from the sensor's own; after the video's frames comes one more, of the sensor at rest.
pub fn video_scene(
    dataset: &Dataset,
    sensor: &SceneFile,
    draw: &PairDraw,
    (young_mpa, seed, scale): (f64, u64, f64),
) -> SceneFile {
    let course = Course::of(dataset, draw);
    let count = course.times_s.len();
    let step_s = draw.duration_s / (count - 1) as f64;
    let start = draw.place_mm - draw.way * START_RADII * dataset.design.optics().dome_radius_mm();
    let last_s = course.times_s.last().copied().unwrap_or(0.0);
    let touch_s = f64::from(course.first_contact.saturating_sub(1)) * step_s;
    let path =
        vec![key(touch_s, start, draw.rotation_deg), key(last_s, start + draw.drag_mm, draw.rotation_deg)];
    let keys = course.times_s.iter().zip(&course.force_n);
    let mut force: Vec<ForceKey> =
        keys.map(|(time, force)| ForceKey { time_s: *time, force_n: *force }).collect();
    force.push(ForceKey { time_s: last_s + step_s, force_n: 0.0 });
    let mut file = sensor.clone();
    file.frames =
        FramesSection { count: count as u32 + 1, rate_hz: 1.0 / step_s, images: true, colour: true };
    file.seed = seed;
    if let Some(leds) = &mut file.light.leds {
        leds.power = draw.power;
        leds.stray_level = draw.stray_level;
    }
    file.electronics.noise = Some(noise(dataset, draw.electrons, scale));
    file.objects = vec![ObjectSection {
        name: "object".into(),
        shape: draw.shape.clone(),
        young_mpa: Some(young_mpa),
        poisson: draw.poisson,
        path,
        press: Some(PressSection { direction: draw.way.to_array(), force }),
        why: None,
    }];
    file
}

/// A shape as labels tell it.
pub fn shape_label(dataset: &Dataset, draw: &PairDraw) -> Value {
    let family = dataset.spec().shapes.get(draw.shape_index);
    let mut label = json!({ "name": family.map(|family| family.name.as_str()) });
    if let (Some(label), Value::Object(sizes)) = (label.as_object_mut(), json!(draw.shape)) {
        label.extend(sizes);
    }
    label
}
