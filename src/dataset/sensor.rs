//! A sensor as built: the design's numbers within their tolerances, its dots as they were printed, seen by a coarser camera.

use glam::{DMat3, DQuat, DVec3};

use crate::check::Dataset;
use crate::frame_reader::FrameReader;
use crate::sensor_draw::SensorDraw;
use domecast_contact::{Contact, Level};
use domecast_design::sections::{DesignFile, IndexRgb, IndexValue};
use domecast_design::{Design, DesignError};
use domecast_optics::numeric::SeededRandom;
use domecast_sim::scene::SceneFile;
use domecast_sim::{Plan, Renderer, Scene, SimError, elastomer_of};

/// Streams of the sensors' random numbers.
const STREAM_SENSOR: u64 = 1 << 40;
/// Draws of a sensor: what the rules of designs forbid (a marker under the dome's rim) no maker ships.
const MAX_ATTEMPTS: u64 = 8;
/// No sensor is further off than this many standard deviations: makers measure what they ship.
const MAX_SD: f64 = 2.0;
/// What sensors as built may be larger than the room that their design has, mm.
const ROOM_MM: f64 = 5.0;
/// Length of a finite element on the dome, mm of a dome of 10 mm radius.
const ELEMENT_PART: f64 = 0.1;

/// What is kept of a sensor for all of its videos.
pub struct BuiltSensor {
    /// A scene of it, at rest: dots, markers and lights as they came out.
    pub scene: Scene,
    /// The effects of its videos: all that such a scene calls for.
    pub plan: Plan,
    /// Its dome, ready for contact.
    pub dome: Contact,
    /// What is this sensor's own besides its design.
    pub own: SensorDraw,
    /// The same at the design's size, where frames are tracked.
    pub full: Option<Box<FullSensor>>,
}

/// A sensor at the design's own size.
pub struct FullSensor {
    /// As [`BuiltSensor::scene`].
    pub scene: Scene,
    /// As [`BuiltSensor::plan`].
    pub plan: Plan,
    /// What reads its frames, with the constants of the design as it was meant.
    pub reader: FrameReader,
}

/// Normal numbers that end at [`MAX_SD`].
struct Deviations(SeededRandom);

impl Deviations {
    fn next(&mut self, sd: f64) -> f64 {
        sd * self.0.normal().clamp(-MAX_SD, MAX_SD)
    }

    fn vector(&mut self, sd: [f64; 3]) -> DVec3 {
        DVec3::from_array(sd.map(|sd| self.next(sd)))
    }

    fn factor(&mut self, percent: f64) -> f64 {
        1.0 + self.next(0.01 * percent)
    }
}

/// How the print of a sensor lies.
struct Print {
    /// Rotation of the whole print about the dome's centre.
    whole: DQuat,
    /// What each dot is turned by besides.
    dots: Vec<DQuat>,
}

impl Dataset {
    /// Builds a sensor by its number; one that cannot be is drawn again.
    ///
    /// # Errors
    /// A design whose tolerances make sensors that cannot be; lights or an elastomer that cannot be computed.
    pub fn build_sensor(&self, sensor: u32) -> Result<BuiltSensor, SimError> {
        let mut attempt = 0;
        loop {
            attempt += 1;
            match self.attempt_sensor(sensor, attempt - 1) {
                Err(SimError::Input(_)) if attempt < MAX_ATTEMPTS => {}
                built => return built,
            }
        }
    }

    fn attempt_sensor(&self, sensor: u32, attempt: u64) -> Result<BuiltSensor, SimError> {
        let stream = STREAM_SENSOR | attempt << 32 | u64::from(sensor);
        let mut deviations = Deviations(SeededRandom::stream(self.spec.seed, stream));
        let built = self.built_file(&mut deviations);
        let own = self.own(sensor, &built, &mut deviations);
        let meant = self.scene_of(self.design.sections(), self.scale(), &own)?;
        let print = self.print(meant.dots().iter().map(|dot| dot.center_mm), &mut deviations);
        let (scene, plan) = self.built_scene(meant, &built, self.scale(), &print)?;
        let element_mm = ELEMENT_PART * scene.optics().dome_radius_mm();
        let dome = Contact::new(elastomer_of(scene.design()), Level::Linear { element_mm });
        let dome =
            dome.map_err(|error| DesignError::at("elastomer", "", error.to_string(), "an elastomer"))?;
        let full = match self.spec.readings.kind {
            crate::spec::ReadingsKind::Model => None,
            crate::spec::ReadingsKind::Tracked => {
                let meant = self.scene_of(self.design.sections(), 1.0, &own)?;
                let (scene, plan) = self.built_scene(meant, &built, 1.0, &print)?;
                Some(Box::new(FullSensor { scene, plan, reader: FrameReader::new(&self.design)? }))
            }
        };
        // its light is computed here, once, and not by each of its first videos side by side
        Renderer::new(&scene, &plan)?;
        Ok(BuiltSensor { scene, plan, dome, own, full })
    }

    /// Pixels of the small picture for one of the design's.
    pub fn scale(&self) -> f64 {
        f64::from(self.spec.frames.width) / f64::from(self.design.sections().camera.width)
    }

    /// The design's numbers as they came out.
    fn built_file(&self, deviations: &mut Deviations) -> DesignFile {
        let mut file = self.design.sections().clone();
        let (times, spec) = (self.spec.sensors.tolerances, &self.spec.sensors);
        let t = file.tolerances.clone();
        let camera = &mut file.camera;
        let pupil = deviations.vector(t.pupil_mm.map(|sd| times * sd));
        let turned = deviations.vector(t.camera_rotation_deg.map(|sd| times * sd));
        camera.position_mm = (DVec3::from_array(camera.position_mm) + pupil).to_array();
        camera.rotation_deg = (DVec3::from_array(camera.rotation_deg) + turned).to_array();
        file.dome.radius_mm += deviations.next(times * t.dome_radius_mm);
        for layer in &mut file.optics.layers {
            if let Some(thickness_mm) = &mut layer.thickness_mm {
                *thickness_mm = (*thickness_mm + deviations.next(times * t.layer_thickness_mm)).max(0.0);
            }
            let [r, g, b] = layer.index.rgb();
            let by = deviations.next(times * t.index);
            let [r, g, b] = [r, g, b].map(|index| (index + by).clamp(1.0, 4.0));
            layer.index = IndexValue::PerChannel(IndexRgb { r, g, b });
        }
        for place in &mut file.white_markers.positions_mm {
            *place = place.map(|at| at + deviations.next(times * t.white_marker_mm));
        }
        if !file.mount.is_rigid() {
            let springs = &mut file.springs;
            springs.wire_diameter_mm += deviations.next(times * t.wire_diameter_mm);
            springs.outer_diameter_mm += deviations.next(times * t.spring_diameter_mm);
            springs.active_coils += deviations.next(times * t.active_coils);
            let stiffer = deviations.factor(times * t.modulus_percent);
            springs.wire.shear_modulus_mpa *= stiffer;
            springs.wire.elastic_modulus_mpa *= stiffer;
        }
        file.elastomer.young_modulus_mpa *= deviations.factor(spec.young_percent);
        // the room that a sensor may take is asked of the design, not of what came out
        file.envelope.size_mm = file.envelope.size_mm.map(|side| side + ROOM_MM);
        let leds = &mut file.leds;
        leds.center_radius_mm += deviations.next(spec.light_mm);
        leds.center_z_mm += deviations.next(spec.light_mm);
        leds.tilt_deg = (leds.tilt_deg + deviations.next(spec.light_deg)).clamp(30.0, 90.0);
        for led in &mut leds.list {
            led.azimuth_deg = (led.azimuth_deg + deviations.next(spec.light_deg)).clamp(-360.0, 360.0);
        }
        file
    }

    fn own(&self, sensor: u32, built: &DesignFile, deviations: &mut Deviations) -> SensorDraw {
        let spec = &self.spec.sensors;
        let each = (0..built.leds.list.len()).map(|_| deviations.factor(spec.flux_percent)).collect();
        let [focus_mm, crosstalk] =
            [spec.focus_mm, spec.crosstalk].map(|[low, high]| deviations.0.between(low, high));
        let spring_gain = deviations.factor(self.spec.readings.noise.spring_percent);
        let gel = spec.slow_gel.as_ref().filter(|gel| sensor % gel.every == gel.every - 1);
        let gel = gel.map(|gel| gel.terms.clone()).unwrap_or_default();
        SensorDraw { sensor, each, focus_mm, crosstalk, spring_gain, gel }
    }

    /// How the print lies: registration and rotation of the whole, scatter of each dot, as the design's tolerances have them.
    fn print(&self, centers_mm: impl Iterator<Item = DVec3>, deviations: &mut Deviations) -> Print {
        let (times, t) = (self.spec.sensors.tolerances, &self.design.sections().tolerances);
        let dome = *self.design.optics().dome();
        let registration = deviations.vector([times * t.print_registration_mm; 3]) / dome.radius_mm();
        let turned = deviations.next(times * t.print_rotation_deg).to_radians();
        let whole = DQuat::from_scaled_axis(DVec3::new(registration.x, registration.y, turned));
        let scatter = times * t.print_scatter_mm / dome.radius_mm();
        let dots = centers_mm.map(|center_mm| {
            let normal = dome.normal(center_mm);
            let side = normal.any_orthonormal_vector();
            let axis = side * deviations.next(scatter) + normal.cross(side) * deviations.next(scatter);
            DQuat::from_scaled_axis(axis)
        });
        Print { whole, dots: dots.collect() }
    }

    /// A scene of the design, at rest, with the objects' level of contact.
    fn scene_of(&self, file: &DesignFile, scale: f64, own: &SensorDraw) -> Result<Scene, SimError> {
        let design = design_of(file, scale)?;
        let element_mm = ELEMENT_PART * design.optics().dome_radius_mm();
        let scene = self.scene_file(own, element_mm, scale);
        Scene::new(scene, &self.folder, design)
    }

    fn built_scene(
        &self,
        meant: Scene,
        built: &DesignFile,
        scale: f64,
        print: &Print,
    ) -> Result<(Scene, Plan), SimError> {
        let center_mm = self.design.optics().dome().center_mm();
        let printed = |index: usize, at_mm: DVec3| {
            let own = print.dots.get(index).copied().unwrap_or(DQuat::IDENTITY);
            center_mm + DMat3::from_quat(own * print.whole) * (at_mm - center_mm)
        };
        let scene = meant.as_built(design_of(built, scale)?, &printed)?;
        let plan = Plan::everything(&scene)?;
        Ok((scene, plan))
    }

    /// Any touch of the sensor, for its plan; videos replace what happens.
    fn scene_file(&self, own: &SensorDraw, element_mm: f64, scale: f64) -> SceneFile {
        crate::scene::template(self, own, element_mm, scale)
    }
}

/// The design of a coarser camera that sees the same, and its dots as large in the picture as they are there.
fn design_of(file: &DesignFile, scale: f64) -> Result<Design, DesignError> {
    let mut file = file.clone();
    let camera = &mut file.camera;
    // what the design took from elsewhere stands in it now
    (camera.calibration, camera.calibration_camera) = (None, None);
    camera.width = (f64::from(camera.width) * scale).round() as u32;
    camera.height = (f64::from(camera.height) * scale).round() as u32;
    let [[fx, _, cx], [_, fy, cy], _] = camera.matrix;
    // the corner of the top-left pixel, at -0.5, stays
    let center = |at: f64| (at + 0.5) * scale - 0.5;
    camera.matrix = [[fx * scale, 0.0, center(cx)], [0.0, fy * scale, center(cy)], [0.0, 0.0, 1.0]];
    file.runtime.mask_radius_px *= scale;
    let pattern = &mut file.pattern;
    for px in [&mut pattern.pitch_px, &mut pattern.dot_diameter_px, &mut pattern.image_radius_px] {
        *px = px.map(|px| px * scale);
    }
    let keep_out = &mut pattern.keep_out;
    keep_out.white_marker_margin_px = keep_out.white_marker_margin_px.map(|px| px * scale);
    for disc in &mut keep_out.image_discs {
        disc.center_px = disc.center_px.map(center);
        disc.radius_px *= scale;
    }
    // numbers, strings and lists only: nothing here can fail to be written
    serde_json::to_string(&file).unwrap_or_default().parse()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sensor_with_a_marker_under_the_dome_is_drawn_again() {
        let tiny = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/datasets/tiny.json");
        let dataset = Dataset::load(tiny.as_ref()).expect("a spec");
        let drawn = |sensor: u32, attempt: u64| {
            let stream = STREAM_SENSOR | attempt << 32 | u64::from(sensor);
            let mut deviations = Deviations(SeededRandom::stream(dataset.spec.seed, stream));
            design_of(&dataset.built_file(&mut deviations), dataset.scale())
        };
        let forbidden = |built: &Result<Design, DesignError>| {
            built.as_ref().is_err_and(|error| error.to_string().contains("lies under the dome"))
        };
        let sensor = (0..1000).find(|sensor| forbidden(&drawn(*sensor, 0)));
        let sensor = sensor.expect("one of a thousand has a marker under the dome");
        assert!(matches!(dataset.attempt_sensor(sensor, 0), Err(SimError::Input(_))));
        let allowed = (1..MAX_ATTEMPTS).find_map(|attempt| drawn(sensor, attempt).ok());
        let built = dataset.build_sensor(sensor).expect("another draw");
        assert_eq!(Some(built.scene.design().text()), allowed.as_ref().map(Design::text));
    }
}
