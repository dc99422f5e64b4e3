//! The sections of a design file, as they are written.
//!
//! Their doc comments are the descriptions in the JSON schema, and the bounds given here are the
//! bounds of a single field; rules between fields are checked when the design is resolved.
//!
//! # Example
//! ```
//! use domecast_design::Design;
//!
//! # const THUMB24: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json");
//! let design = Design::load(THUMB24.as_ref())?;
//! assert_eq!(design.sections().dome.radius_mm, 10.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod accuracy;
mod body;
mod camera;
mod electrical;
mod light;
mod loads;
mod making;
mod mount;
mod optics;
mod pattern;
mod platforms;
mod print;
mod springs;
mod tolerances;
mod why;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use accuracy::AccuracySection;
pub use body::{CameraBoardSection, CameraBodyKind, CameraBodySection, MIN_BEND_DIAMETERS};
pub use camera::{CameraSection, ModelName, RuntimeSection};
pub use electrical::{ElectricalSection, LedBoardSection, LedDrive, ValueRgbw};
pub use light::{DiffuserSection, ExposureSection, PowerRgb, ReflectanceRgb};
pub use loads::{CentroidNoiseSection, LoadClaim, LoadsSection, WhiteMarkersSection};
pub use making::{
    CouponSection, FillSection, JigSection, MeshSection, MouldSection, PinsSection, ProcessSection,
    StencilSection, VentsSection,
};
pub use mount::{MountKind, MountSection};
pub use optics::{DomeSection, IndexRgb, IndexValue, LayerSection, OpticsSection};
pub use pattern::{
    CentredOn, EvenIn, ImageDiscSection, KeepOutSection, KeyKind, OnLost, PatternCentre, PatternKind,
    PatternSection,
};
pub use platforms::{
    CableExitSection, ClampSection, LedColor, LedSection, LedsSection, LowerPlatform, MagnetPocketsSection,
    MountingSection, PlatformsSection, SheetSection, UpperPlatform,
};
pub use print::{MeasuredTransferSection, PrintPasses, PrintSection, TransferMapName};
pub use springs::{
    GravitySection, MagnetFacing, MagnetsSection, SpringEnds, SpringPlaces, SpringRing, SpringsSection,
    WireSection,
};
pub use tolerances::TolerancesSection;
pub use why::Why;

/// A dome-shaped camera tactile sensor, complete: everything that domecast makes comes from this file.
///
/// Lengths are mm, angles degrees, forces N, pixels px, as the names say.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "domecast design")]
pub struct DesignFile {
    /// Where editors find the schema of this file; not read.
    #[serde(rename = "$schema", default, skip_serializing_if = "Option::is_none")]
    pub schema: Option<String>,
    /// Version of the design file's form; 1 is the only one.
    #[schemars(range(min = 1, max = 1))]
    pub version: u32,
    /// Name of the design: letters, digits, `-` and `_`; results go to `output/<name>`.
    pub name: String,
    /// What it is, in a sentence or two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// Where the design comes from, and the facts of that source that no other section holds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<SourceSection>,
    /// The camera's intrinsics and place.
    pub camera: CameraSection,
    /// The camera's housing.
    pub camera_body: CameraBodySection,
    /// The flat layers between camera and membrane.
    pub optics: OpticsSection,
    /// The dome.
    pub dome: DomeSection,
    /// What the dome is cast from and coated with.
    pub elastomer: ElastomerSection,
    /// The room that the whole sensor may take.
    pub envelope: EnvelopeSection,
    /// The frame of the paper's runtime.
    pub runtime: RuntimeSection,
    /// The black dots, as they should appear in the image.
    pub pattern: PatternSection,
    /// How they are printed.
    pub print: PrintSection,
    /// The markers on the sheet; a rigid mount may leave them out.
    #[serde(default, skip_serializing_if = "WhiteMarkersSection::is_none")]
    pub white_markers: WhiteMarkersSection,
    /// How the upper platform stands on the lower one: on springs where it is left out.
    #[serde(default, skip_serializing_if = "MountSection::is_default")]
    pub mount: MountSection,
    /// The springs between the platforms; left out of a rigid mount.
    #[serde(default, skip_serializing_if = "SpringsSection::is_none")]
    pub springs: SpringsSection,
    /// The magnets that hold the springs; left out of a rigid mount.
    #[serde(default, skip_serializing_if = "MagnetsSection::is_none")]
    pub magnets: MagnetsSection,
    /// The pockets of those magnets; left out of a rigid mount.
    #[serde(default, skip_serializing_if = "MagnetPocketsSection::is_none")]
    pub magnet_pockets: MagnetPocketsSection,
    /// Weight of what the springs carry; left out where it must not count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity: Option<GravitySection>,
    /// The loads that the design claims to carry.
    pub loads: LoadsSection,
    /// What the image processing can measure.
    pub noise: CentroidNoiseSection,
    /// How far a built sensor may be off.
    pub tolerances: TolerancesSection,
    /// The printed platforms.
    pub platforms: PlatformsSection,
    /// The sheet's outline.
    pub sheet: SheetSection,
    /// The lights.
    pub leds: LedsSection,
    /// How the camera is exposed under them; may be left out.
    #[serde(default)]
    pub exposure: ExposureSection,
    /// The mould.
    pub mould: MouldSection,
    /// The pad-print jig.
    pub jig: JigSection,
    /// The stencil for the white markers.
    pub stencil: StencilSection,
    /// The fit coupon.
    pub coupon: CouponSection,
    /// What the printing process can make.
    pub process: ProcessSection,
    /// How exact the meshes are; may be left out where `accuracy` says it.
    #[serde(default)]
    pub mesh: MeshSection,
    /// How exact the results must be; left out where every setting is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<AccuracySection>,
}

/// What tracing and projecting need of a design file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpticsFile {
    /// Name of the design.
    pub name: String,
    /// The camera's intrinsics and place.
    pub camera: CameraSection,
    /// The flat layers between camera and membrane.
    pub optics: OpticsSection,
    /// The dome.
    pub dome: DomeSection,
}

/// The publication or device that a design follows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SourceSection {
    /// Title.
    pub title: String,
    /// Where it is found: an arXiv number, a DOI, an address.
    pub reference: String,
    /// Facts that it gives, by subject, word for number as it gives them; they inform, nothing computes with them.
    #[serde(default)]
    pub facts: BTreeMap<String, String>,
}

/// What the dome is cast from and coated with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ElastomerSection {
    /// What it is, in a word or two.
    pub material: String,
    /// Thickness of the reflective membrane outside the dome, mm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub membrane_thickness_mm: f64,
    /// Share of the light that the membrane gives back into the dome, by Lambert's law.
    pub membrane_reflectance: ReflectanceRgb,
    /// Linear shrinkage on curing, percent of the length.
    #[schemars(range(min = 0.0, max = 20.0))]
    pub shrinkage_percent: f64,
    /// Young's modulus at small strain, MPa.
    #[schemars(range(min = 0.001, max = 100000.0))]
    pub young_modulus_mpa: f64,
    /// Poisson's ratio; silicone is nearly incompressible, 0.5 itself has no finite bulk modulus.
    #[schemars(range(min = 0.0, max = 0.4999))]
    pub poisson_ratio: f64,
    /// Coulomb's coefficient of friction between the membrane and what touches it.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub friction: f64,
    /// Density, g/cm^3; as data sheets give it for platinum silicone where it is left out.
    #[serde(default = "silicone_density")]
    #[schemars(range(min = 0.1, max = 25.0))]
    pub density_g_per_cm3: f64,
    /// Key of a part whose numbers stand for the fields that are left out here: `domecast list silicones`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

fn silicone_density() -> f64 {
    1.07
}

/// The room that the whole sensor may take at rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EnvelopeSection {
    /// Along x, y and z, mm.
    pub size_mm: [f64; 3],
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}
