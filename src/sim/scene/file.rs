//! The scene file, as it is written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::dust::DustSection;
use super::electronics::ElectronicsSection;
use super::light::LightSection;
use super::objects::ObjectSection;
use super::slow_gel::SlowGelSection;
use super::uneven::{UnevenInkSection, UnevenMembraneSection};
use crate::effect_name::EffectChoices;
use domecast_design::sections::Why;

/// Frames at most of a sequence.
pub(super) const MAX_FRAMES: u32 = 1_000_000;

/// What the sensor is made to feel, how it is lit and recorded, and how exact the frames must be.
///
/// Lengths are mm, angles degrees, forces N, torques N*mm, times s, pixels px, as the names say.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "domecast scene")]
pub struct SceneFile {
    /// Where editors find the schema of this file; not read.
    #[serde(rename = "$schema", default, skip_serializing_if = "Option::is_none")]
    pub schema: Option<String>,
    /// Version of the scene file's form; 1 is the only one.
    #[schemars(range(min = 1, max = 1))]
    pub version: u32,
    /// Name of the scene: letters, digits, `-` and `_`; frames go to `output/<name>`.
    pub name: String,
    /// What happens, in a sentence or two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// The design file, relative to this file.
    pub design: String,
    /// How many frames, and how often.
    pub frames: FramesSection,
    /// How far the frames may be from those with every effect.
    pub tolerance: ToleranceSection,
    /// Seed of everything random (noise).
    #[serde(default)]
    pub seed: u64,
    /// What moves the platform besides objects; left out: nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionSection>,
    /// What touches the dome: nothing, or objects that do not meet each other.
    #[serde(default)]
    #[schemars(length(max = 16))]
    pub objects: Vec<ObjectSection>,
    /// How contact is computed.
    #[serde(default)]
    pub contact: ContactSection,
    /// An elastomer that yields slowly; left out: it is elastic.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slow_gel: Option<SlowGelSection>,
    /// How bright things are; left out: evenly lit.
    #[serde(default)]
    pub light: LightSection,
    /// The image sensor behind the lens; left out: an ideal one.
    #[serde(default)]
    pub electronics: ElectronicsSection,
    /// The printed dots as they came out.
    #[serde(default)]
    pub ink: InkSection,
    /// A membrane whose reflectance varies from place to place; left out: it is even.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uneven_membrane: Option<UnevenMembraneSection>,
    /// Dust and scratches on sheet and lens; left out: they are clean.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dust: Option<DustSection>,
    /// Effects that must be used, or not, whatever the plan says.
    #[serde(default)]
    pub effects: EffectChoices,
    /// What is written besides frames and truth.
    #[serde(default)]
    pub output: OutputSection,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// The frames that are wanted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FramesSection {
    /// Number of frames.
    #[schemars(range(min = 1, max = MAX_FRAMES))]
    pub count: u32,
    /// Frames a second; the first is at 0 s.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e6))]
    pub rate_hz: f64,
    /// Whether images are drawn, or only the truth is written.
    #[serde(default = "yes")]
    pub images: bool,
    /// Whether the images have colour.
    #[serde(default = "yes")]
    pub colour: bool,
}

fn yes() -> bool {
    true
}

/// How far frames may be from those in which every effect takes part.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToleranceSection {
    /// Of every dot's and marker's centroid, px.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e6))]
    pub px: f64,
    /// Of every pixel, in grey levels of 8 bits.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 255.0))]
    pub grey: f64,
    /// Of the force between dome and object, N; left out: any, as long as the frames are right.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e6))]
    pub force_n: Option<f64>,
}

/// A motion of the platform, by what causes it or as it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum MotionSection {
    /// Loads over time; the springs answer.
    Wrench(WrenchMotion),
    /// Poses over time; the springs' load stands in the truth.
    Pose(PoseMotion),
}

/// Loads over time, linear in between, constant before the first and after the last.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WrenchMotion {
    /// The loads in order of time.
    #[schemars(length(min = 1, max = 100000))]
    pub wrench: Vec<WrenchKey>,
}

/// A load that the world puts on the dome or platform, in the rest frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WrenchKey {
    /// When, s.
    pub time_s: f64,
    /// Force, N; a push on the pole has z < 0.
    pub force_n: [f64; 3],
    /// Moment besides that of the force, N*mm.
    #[serde(default)]
    pub moment_nmm: [f64; 3],
    /// Where the force acts, in the rest frame, mm.
    #[serde(default)]
    pub point_mm: [f64; 3],
}

/// Poses over time, linear in between (the rotation as a rotation vector), constant before and after.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PoseMotion {
    /// The poses in order of time.
    #[schemars(length(min = 1, max = 100000))]
    pub pose: Vec<PoseKey>,
}

/// A displacement of the platform about the springs' reference point, in the rest frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PoseKey {
    /// When, s.
    pub time_s: f64,
    /// Translation of the platform's point at the springs' reference point, mm.
    #[serde(default)]
    pub translation_mm: [f64; 3],
    /// Rotation vector, degrees.
    #[serde(default)]
    pub rotation_deg: [f64; 3],
}

/// How contact is computed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ContactSection {
    /// The level that counts as exact for this scene; the plan takes none above it.
    pub level: LevelName,
    /// Length of a finite element of the linear level on the dome, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub element_mm: f64,
    /// Elements of the finite-strain level across the part of the dome that the object touches.
    #[schemars(range(min = 4, max = 16))]
    pub elements_across: u32,
}

impl Default for ContactSection {
    fn default() -> Self {
        Self { level: LevelName::Linear, element_mm: 1.0, elements_across: 8 }
    }
}

impl LevelName {
    /// The name that files carry.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Geometric => "geometric",
            Self::ClosedForm => "closed_form",
            Self::Linear => "linear",
            Self::FiniteStrain => "finite_strain",
        }
    }
}

/// How closely contact is modelled, from coarse to fine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LevelName {
    /// The membrane is pushed out of the object.
    Geometric,
    /// Hertz and kin.
    ClosedForm,
    /// Linear finite elements.
    Linear,
    /// Neo-Hookean finite elements at large strain: seconds a pose, on springs some ten poses a frame.
    FiniteStrain,
}

/// The printed dots as they came out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct InkSection {
    /// How much of the membrane's light the ink gives back, 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub reflectance: f64,
    /// Width over which the ink fades out at a dot's edge, mm on the dome.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub edge_mm: f64,
    /// How unlike the dots are; left out: all alike.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uneven: Option<UnevenInkSection>,
    /// Dots that came out broken or not at all.
    #[schemars(length(max = 10000))]
    pub broken: Vec<BrokenDot>,
}

impl Default for InkSection {
    fn default() -> Self {
        Self { reflectance: 0.05, edge_mm: 0.0, uneven: None, broken: Vec::new() }
    }
}

/// A dot of which a part is missing: what lies beyond a straight cut.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BrokenDot {
    /// Its number.
    pub id: u32,
    /// Part of the dot's width that is left, measured across the cut: 1 is whole, 0 is gone.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub left: f64,
    /// Direction in which the missing part lies, in the image at rest, from +x towards +y, degrees.
    #[serde(default)]
    pub direction_deg: f64,
}

/// What is written besides frames and truth.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputSection {
    /// The membrane's shape for each frame: `heights_NNNN.tif`, 200 x 200 samples (32-bit float, mm) over the base's
    /// square, row by row from -y, each the height of the dome's point above it after it has moved.
    pub heights: bool,
    /// The contact pressure for each frame: `pressure_NNNN.json`, by node of the dome's surface.
    pub pressure: bool,
    /// What each pixel sees, for each frame: surface, normal, displacement, pressure and traction (`simulate --depth`).
    pub depth: bool,
}
