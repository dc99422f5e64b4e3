//! What a pair of videos shares, drawn from the spec by the pair's number.

use glam::{DQuat, DVec3};

use crate::check::Dataset;
use crate::spec::Split;
use crate::splits::split_of_slice;
use domecast_optics::numeric::{SeededRandom, mix64};
use domecast_sim::scene::objects::ShapeSection;

/// Streams of random numbers, so that what one of them takes does not move the others.
const STREAM_PAIR: u64 = 1;
const STREAM_ORDER: u64 = 2;
const STREAM_NOISE: u64 = 3;

/// All that both videos of a pair share.
#[derive(Debug, Clone, PartialEq)]
pub struct PairDraw {
    /// Number of the pair.
    pub pair: u32,
    /// Its sensor.
    pub sensor: u32,
    /// Its split.
    pub split: Split,
    /// Which of the spec's shapes, and its sizes as drawn.
    pub shape_index: usize,
    /// The shape with those sizes.
    pub shape: ShapeSection,
    /// Rotation vector of the object in the rest frame, degrees.
    pub rotation_deg: DVec3,
    /// Place on the undeformed dome that it is pressed towards, rest frame, mm.
    pub place_mm: DVec3,
    /// The dome's normal there.
    pub normal: DVec3,
    /// Direction of the press.
    pub way: DVec3,
    /// How far it is dragged along the skin, and where to.
    pub drag_mm: DVec3,
    /// Poisson's ratio of the object.
    pub poisson: f64,
    /// Friction.
    pub friction: f64,
    /// Largest force, N.
    pub peak_force_n: f64,
    /// Exponent of the ramp, and the part of the time for which the peak is held.
    pub ramp: [f64; 2],
    /// Frames before the contact.
    pub before_contact: u32,
    /// Time from the first frame to the last, s.
    pub duration_s: f64,
    /// Speed before the contact, mm/s.
    pub approach_mm_s: f64,
    /// Brightness of the lights.
    pub power: f64,
    /// Light from outside.
    pub stray_level: f64,
    /// Electrons at full scale and of reading, at the design's size.
    pub electrons: [f64; 2],
}

/// Even between two numbers.
fn even(random: &mut SeededRandom, [low, high]: [f64; 2]) -> f64 {
    random.between(low, high)
}

/// Even in the logarithm.
fn log_even(random: &mut SeededRandom, [low, high]: [f64; 2]) -> f64 {
    random.between(low.ln(), high.ln()).exp()
}

impl Dataset {
    /// Split of a sensor.
    pub fn split_of_sensor(&self, sensor: u32) -> Split {
        self.splits.get(sensor as usize).copied().unwrap_or(Split::Train)
    }

    /// Sensor of a pair: each has a block of pairs.
    pub fn sensor_of(&self, pair: u32) -> u32 {
        (u64::from(pair) * u64::from(self.sensors()) / u64::from(self.pairs().max(1))) as u32
    }

    /// Number of a pair within its sensor's block, and how many that block has.
    fn place_in_block(&self, pair: u32) -> u32 {
        let sensor = self.sensor_of(pair);
        let (pairs, sensors) = (u64::from(self.pairs()), u64::from(self.sensors().max(1)));
        let first = (u64::from(sensor) * pairs).div_ceil(sensors);
        pair - first as u32
    }

    /// Which of the two, 0 or 1, the first video of a pair shows: the softer of the two classes or the lower of the two moduli is 0.
    pub fn first_of(&self, pair: u32) -> usize {
        (mix64(self.seed(STREAM_ORDER, pair, 0)) & 1) as usize
    }

    /// Class of a video, 0 or 1, and its Young's modulus, MPa.
    pub fn hardness_of(&self, video: u32) -> (usize, f64) {
        let (pair, second) = (video / 2, (video % 2) as usize);
        let class = self.first_of(pair) ^ second;
        if let Some(classes) = &self.spec.hardness.classes {
            return (class, classes.get(class).map_or(f64::NAN, |class| class.young_mpa));
        }
        let [low, high] = self.spec.hardness.young_mpa.unwrap_or([1.0, 1.0]).map(f64::ln);
        // multiples of the golden ratio fill the lower half evenly, whatever the number of pairs
        let part = 0.5 * (f64::from(pair) * 0.618_033_988_749_894_9 + 0.5 * self.offset()).fract();
        (class, (low + (high - low) * (part + 0.5 * class as f64)).exp())
    }

    fn offset(&self) -> f64 {
        SeededRandom::stream(self.spec.seed, STREAM_ORDER).uniform()
    }

    fn seed(&self, stream: u64, number: u32, attempt: u32) -> u64 {
        mix64(self.spec.seed ^ mix64((stream << 58) ^ (u64::from(attempt) << 34) ^ u64::from(number)))
    }

    /// Seed of a video's noise.
    pub fn noise_seed(&self, video: u32) -> u64 {
        self.seed(STREAM_NOISE, video, 0)
    }

    /// What a pair shares, on a try.
    pub fn draw(&self, pair: u32, attempt: u32) -> PairDraw {
        let spec = &self.spec;
        let random = &mut SeededRandom::new(self.seed(STREAM_PAIR, pair, attempt));
        let sensor = self.sensor_of(pair);
        let split = self.split_of_sensor(sensor);
        let own: Vec<usize> = (0..spec.shapes.len()).filter(|k| spec.shapes[*k].split == split).collect();
        // each shape in turn: a pair that is drawn again keeps its own
        let shape_index = own[self.place_in_block(pair) as usize % own.len().max(1)];
        let family = &spec.shapes[shape_index];
        let scale = family.scale.map_or(1.0, |range| log_even(random, range));
        let press = &spec.press;
        let [near, far] = press.polar_deg.map(|deg| deg.to_radians().cos());
        let polar_cos = random.between(far, near);
        let azimuth = random.between(0.0, std::f64::consts::TAU);
        let sin = (1.0 - polar_cos * polar_cos).max(0.0).sqrt();
        let normal = DVec3::new(sin * azimuth.cos(), sin * azimuth.sin(), polar_cos);
        let side = normal.any_orthonormal_vector();
        let around = |angle: f64| DQuat::from_axis_angle(normal, angle) * side;
        let lean = even(random, press.lean_deg).to_radians();
        let lean_axis = around(random.between(0.0, std::f64::consts::TAU));
        let way = -(DQuat::from_axis_angle(lean_axis, lean) * normal);
        let drag_mm = around(random.between(0.0, std::f64::consts::TAU)) * even(random, press.drag_mm);
        let tilt = DQuat::from_axis_angle(
            around(random.between(0.0, std::f64::consts::TAU)),
            even(random, family.tilt_deg).to_radians(),
        );
        let spin = DQuat::from_axis_angle(normal, random.between(0.0, std::f64::consts::TAU));
        let turn = DQuat::from_scaled_axis(DVec3::from_array(family.turn_deg.map(f64::to_radians)));
        let rotation = tilt * spin * DQuat::from_rotation_arc(DVec3::Z, normal) * turn;
        let dome = self.design.optics().dome();
        let [min_count, max_count] = spec.frames.before_contact;
        let before_contact = min_count + (random.uniform() * f64::from(max_count - min_count + 1)) as u32;
        PairDraw {
            pair,
            sensor,
            split,
            shape_index,
            shape: scaled(&family.shape, scale),
            rotation_deg: rotation.to_scaled_axis() * 1f64.to_degrees(),
            place_mm: dome.center_mm() + normal * dome.radius_mm(),
            normal,
            way,
            drag_mm,
            poisson: even(random, spec.poisson),
            friction: even(random, spec.friction),
            peak_force_n: self.peak_force(split, random),
            ramp: [even(random, press.ramp_exponent), even(random, press.hold_part)],
            before_contact: before_contact.min(max_count),
            duration_s: log_even(random, spec.frames.duration_s),
            approach_mm_s: even(random, press.approach_mm_s),
            power: even(random, spec.light.power),
            stray_level: even(random, spec.light.stray_level),
            electrons: [
                log_even(random, spec.camera.full_scale_electrons),
                even(random, spec.camera.read_electrons),
            ],
        }
    }

    /// A largest force from the slices of the split.
    fn peak_force(&self, split: Split, random: &mut SeededRandom) -> f64 {
        let slices = self.spec.press.load_slices;
        let own: Vec<u32> = (0..slices).filter(|slice| split_of_slice(*slice) == split).collect();
        let slice = own.get((random.uniform() * own.len() as f64) as usize).copied().unwrap_or(0);
        let [low, high] = self.spec.press.peak_force_n.map(f64::ln);
        let part = (f64::from(slice) + random.uniform()) / f64::from(slices);
        (low + (high - low) * part).exp()
    }
}

/// A shape of another size.
fn scaled(shape: &ShapeSection, by: f64) -> ShapeSection {
    match shape.clone() {
        ShapeSection::Sphere { radius_mm } => ShapeSection::Sphere { radius_mm: radius_mm * by },
        ShapeSection::Cylinder { radius_mm, length_mm } => {
            ShapeSection::Cylinder { radius_mm: radius_mm * by, length_mm: length_mm * by }
        }
        ShapeSection::Box { size_mm } => ShapeSection::Box { size_mm: size_mm.map(|side| side * by) },
        ShapeSection::Cone { radius_mm, height_mm } => {
            ShapeSection::Cone { radius_mm: radius_mm * by, height_mm: height_mm * by }
        }
        ShapeSection::Mesh { file, scale } => ShapeSection::Mesh { file, scale: scale * by },
    }
}
