//! The file that says what a set is drawn from.
//!
//! # Example
//! ```
//! use domecast_dataset::Dataset;
//!
//! # const TINY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/datasets/tiny.json");
//! let dataset = Dataset::load(TINY.as_ref())?;
//! assert_eq!(dataset.spec().videos, 16);
//! // a pair has one video of each class
//! assert_ne!(dataset.hardness_of(0).0, dataset.hardness_of(1).0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use domecast_design::sections::Why;
use domecast_sim::scene::objects::ShapeSection;
use domecast_sim::scene::slow_gel::SlowGelTerm;

/// A set of simulated touches for learning.
///
/// A pair `[low, high]` is a range that is drawn from evenly; where the field says so, evenly in the logarithm. Lengths are mm,
/// angles degrees, forces N, times s, as the names say.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "domecast data set")]
pub struct DatasetSpec {
    /// Where editors find the schema of this file; not read.
    #[serde(rename = "$schema", default, skip_serializing_if = "Option::is_none")]
    pub schema: Option<String>,
    /// Version of the file's form; 1 is the only one.
    #[schemars(range(min = 1, max = 1))]
    pub version: u32,
    /// Name of the set: letters, digits, `-` and `_`; shards begin with it.
    pub name: String,
    /// What it is for, in a sentence or two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// The design file, relative to this file.
    pub design: String,
    /// Seed of all that is drawn.
    #[serde(default)]
    pub seed: u64,
    /// Number of videos, even: they come in pairs that share all but hardness and noise.
    #[schemars(range(min = 2, max = 1000000))]
    pub videos: u32,
    /// Frames of each video.
    pub frames: FramesSpec,
    /// What is to be distinguished.
    pub hardness: HardnessSpec,
    /// Poisson's ratio of the objects.
    pub poisson: [f64; 2],
    /// The objects, each of its splits.
    #[schemars(length(min = 1, max = 64))]
    pub shapes: Vec<ShapeSpec>,
    /// How they are pressed on.
    pub press: PressSpec,
    /// Coulomb's friction between membrane and object.
    pub friction: [f64; 2],
    /// How bright the lights are and what leaks in.
    pub light: LightSpec,
    /// The camera's noise and focus.
    pub camera: CameraSpec,
    /// The sensors as built.
    pub sensors: SensorsSpec,
    /// What stands beside the frames.
    pub readings: ReadingsSpec,
    /// Whether each dot's motion is written.
    #[serde(default = "yes")]
    pub dots: bool,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

fn yes() -> bool {
    true
}

/// The frames of each video.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FramesSpec {
    /// Their number.
    #[schemars(range(min = 3, max = 1000))]
    pub count: u32,
    /// Time from the first to the last, s.
    pub duration_s: [f64; 2],
    /// How many frames come before the contact, fewest and most.
    pub before_contact: [u32; 2],
    /// Width, px: the design's camera, coarser; the ratio of the sides must be the same.
    #[schemars(range(min = 16, max = 20000))]
    pub width: u32,
    /// Height, px.
    #[schemars(range(min = 16, max = 20000))]
    pub height: u32,
}

/// What is to be distinguished: either classes, or a range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HardnessSpec {
    /// Two classes; each pair has one video of each.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub classes: Option<[ClassSpec; 2]>,
    /// Range of Young's modulus, MPa, drawn evenly in the logarithm; a pair's two lie half of the range apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub young_mpa: Option<[f64; 2]>,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// A class of hardness.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClassSpec {
    /// Its name.
    pub name: String,
    /// Young's modulus, MPa.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e7))]
    pub young_mpa: f64,
}

/// Which part of the set a video belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// For training.
    Train,
    /// For choices made while training.
    Val,
    /// For the judgement: its shapes, loads and sensors are in no other split.
    Test,
}

impl Split {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Train, Self::Val, Self::Test];

    /// The name that files carry.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Val => "val",
            Self::Test => "test",
        }
    }
}

/// A family of objects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShapeSpec {
    /// A word for it.
    pub name: String,
    /// The split that it is of: a shape is in one split only.
    pub split: Split,
    /// The shape, its sizes as they are at a scale of 1.
    pub shape: ShapeSection,
    /// What its sizes are multiplied by, drawn evenly in the logarithm; left out: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<[f64; 2]>,
    /// Rotation vector that turns what shall touch towards -z of the object's frame, degrees; left out: none.
    #[serde(default)]
    pub turn_deg: [f64; 3],
    /// How far it is tilted out of that, degrees.
    #[serde(default)]
    pub tilt_deg: [f64; 2],
}

/// How objects are pressed on: by a force over time, the same for both videos of a pair.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PressSpec {
    /// Largest force, N, drawn evenly in the logarithm.
    pub peak_force_n: [f64; 2],
    /// Slices of that range, equal in the logarithm, that the splits share out among them: the third of each four is the
    /// test's, the fifth of each eight the validation's.
    #[schemars(range(min = 8, max = 64))]
    pub load_slices: u32,
    /// Exponent of the force over time.
    pub ramp_exponent: [f64; 2],
    /// Part of the contact's time for which the largest force is held at the end.
    pub hold_part: [f64; 2],
    /// Speed before the contact, mm/s.
    pub approach_mm_s: [f64; 2],
    /// Polar angle of the place on the dome, degrees: even over the area.
    pub polar_deg: [f64; 2],
    /// How far the direction leans from the dome's normal, degrees.
    pub lean_deg: [f64; 2],
    /// How far it is dragged along the skin while it is pressed on, mm.
    pub drag_mm: [f64; 2],
    /// Of a video in which the object gives way by more than this part of its thickness neither it nor its twin is taken.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1.0))]
    pub max_object_strain: f64,
}

/// The light of a video.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LightSpec {
    /// Brightness of all lights, of the design's.
    pub power: [f64; 2],
    /// As in a scene: level for each mW/mm^2 on a white surface.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e9))]
    pub level_per_mw_mm2: f64,
    /// Light from outside.
    pub stray_level: [f64; 2],
    /// What lies beside the dome.
    pub surround_level: f64,
}

/// The camera, at the size of the design.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    /// Electrons at full scale.
    pub full_scale_electrons: [f64; 2],
    /// Standard deviation of reading, electrons.
    pub read_electrons: [f64; 2],
    /// Whether each pixel sees one colour: then averaging over an area gathers a quarter of its pixels for each.
    #[serde(default = "yes")]
    pub bayer: bool,
    /// Diameter of the entrance pupil, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub pupil_diameter_mm: f64,
}

/// The sensors as built: each is drawn from the design's own `tolerances`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorsSpec {
    /// How many of the training split; each of all sensors has the same share of the videos.
    #[schemars(range(min = 0, max = 10000))]
    pub train: u32,
    /// Of the validation split.
    #[schemars(range(min = 0, max = 10000))]
    pub val: u32,
    /// Of the test split.
    #[schemars(range(min = 0, max = 10000))]
    pub test: u32,
    /// What the design's tolerances are multiplied by: pupil, camera's rotation, dome's radius, layers, indices, markers, print,
    /// springs; two standard deviations at most.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub tolerances: f64,
    /// Spread of the dome's Young's modulus from pour to pour, percent.
    #[schemars(range(min = 0.0, max = 50.0))]
    pub young_percent: f64,
    /// Spread of each light's flux, percent.
    #[schemars(range(min = 0.0, max = 50.0))]
    pub flux_percent: f64,
    /// Spread of the lights' distance from the axis and height, mm.
    #[schemars(range(min = 0.0, max = 5.0))]
    pub light_mm: f64,
    /// Spread of each light's azimuth and of their tilt, degrees.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub light_deg: f64,
    /// Distance at which the lens is sharp, mm.
    pub focus_mm: [f64; 2],
    /// What a channel takes of the neighbouring colour.
    pub crosstalk: [f64; 2],
    /// Gels that yield slowly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slow_gel: Option<SlowGelSpec>,
}

/// Gels that yield slowly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SlowGelSpec {
    /// Every so many-th sensor has one.
    #[schemars(range(min = 1, max = 1000))]
    pub every: u32,
    /// Its terms.
    #[schemars(length(min = 1, max = 16))]
    pub terms: Vec<SlowGelTerm>,
}

/// What is written beside the frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReadingsSpec {
    /// Where they come from.
    pub kind: ReadingsKind,
    /// Noise of the travel of the hand that presses, mm, as a robot's encoder has it; left out: nobody knows the travel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot_travel_sd_mm: Option<f64>,
    /// Noise of the model.
    #[serde(default)]
    pub noise: NoiseSpec,
}

/// Where readings come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ReadingsKind {
    /// The truth with the noise of `readings.noise`.
    Model,
    /// What `track` says of frames drawn at the design's own size: seconds a video.
    Tracked,
}

/// Noise of readings that are modelled, each as one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct NoiseSpec {
    /// Of each force, N.
    pub force_n: f64,
    /// Of each moment, N*mm.
    pub moment_nmm: f64,
    /// Of the platform's shift, mm.
    pub shift_mm: f64,
    /// Of its turn, rad.
    pub turn_rad: f64,
    /// What the springs' calibration leaves open, percent of the wrench, one number a sensor.
    pub spring_percent: f64,
    /// Of each dot on each axis, px of the design's camera.
    pub dots_px: f64,
    /// Of the contact's radius, mm.
    pub radius_mm: f64,
    /// The same, percent of it, one number a video.
    pub radius_percent: f64,
}

impl Default for NoiseSpec {
    /// Wrench and dots: what `track` was measured to leave under every effect of light and camera (README). Pose: that noise through
    /// the springs of thumb24. Radius: half of the spread of areas that `track --traction` was measured to give. Springs: an estimate
    /// of a calibration with weights.
    fn default() -> Self {
        Self {
            force_n: 0.002,
            moment_nmm: 0.015,
            shift_mm: 0.0005,
            turn_rad: 0.00005,
            spring_percent: 1.0,
            dots_px: 0.024,
            radius_mm: 0.05,
            radius_percent: 6.0,
        }
    }
}
