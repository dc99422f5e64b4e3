//! Springs, their magnets, and the weight that they carry.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Why;

/// The compression springs that carry the upper platform.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpringsSection {
    /// Wire diameter, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub wire_diameter_mm: f64,
    /// Outer diameter of the coil, mm; more than twice the wire.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1000.0))]
    pub outer_diameter_mm: f64,
    /// Length of the unloaded spring, mm; more than its solid height.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1000.0))]
    pub free_length_mm: f64,
    /// Coils that deform; need not be whole.
    #[schemars(range(min = 0.5, max = 1000.0))]
    pub active_coils: f64,
    /// How the ends are made: it fixes the dead coils and the solid height.
    pub ends: SpringEnds,
    /// The wire.
    pub wire: WireSection,
    /// Where the springs' axes stand.
    pub places: SpringPlaces,
    /// Point in the sensor frame at rest about which stiffness and moments are stated, mm; left out:
    /// the middle of the springs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference_point_mm: Option<[f64; 3]>,
    /// Clearance below the upper platform at which a purpose-made stop is met, mm; left out: the platforms
    /// themselves are the stop.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub stop_clearance_mm: Option<f64>,
    /// Key of a part whose numbers stand for the fields that are left out here: `domecast list springs`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// What stands for the section where a rigid mount leaves it out.
impl Default for SpringsSection {
    fn default() -> Self {
        Self {
            wire_diameter_mm: 0.0,
            outer_diameter_mm: 0.0,
            free_length_mm: 0.0,
            active_coils: 0.0,
            ends: SpringEnds::ClosedGround,
            wire: WireSection {
                name: String::new(),
                shear_modulus_mpa: 0.0,
                elastic_modulus_mpa: 0.0,
                allowable_shear_mpa: 0.0,
                temperature: None,
            },
            places: SpringPlaces::Listed(Vec::new()),
            reference_point_mm: None,
            stop_clearance_mm: None,
            from: None,
            why: None,
        }
    }
}

impl SpringsSection {
    /// Whether the section is left out.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

/// The two ends of a compression spring.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpringEnds {
    /// Cut and left: no dead coil, solid height (n + 1) d.
    Open,
    /// Cut and ground: one dead coil in all, solid height (n + 1) d.
    OpenGround,
    /// Last coil closed: two dead coils in all, solid height (n + 3) d.
    Closed,
    /// Last coil closed and ground flat: two dead coils in all, solid height (n + 2) d.
    ClosedGround,
}

/// The spring's wire.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WireSection {
    /// What it is made of, in a word.
    pub name: String,
    /// Shear modulus G, MPa.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1.0e6))]
    pub shear_modulus_mpa: f64,
    /// Young's modulus E, MPa.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1.0e6))]
    pub elastic_modulus_mpa: f64,
    /// Shear stress (Wahl's, at the inside of the coil) that the wire bears without setting, MPa:
    /// 45 % of the tensile strength for music wire, 35 % for 302 stainless.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1.0e5))]
    pub allowable_shear_mpa: f64,
    /// How the moduli follow the temperature; left out: `track --temperature` is refused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<WireTemperature>,
}

/// How the wire's moduli follow the temperature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WireTemperature {
    /// Temperature that the moduli are of, degrees C.
    #[schemars(range(min = -100.0, max = 200.0))]
    pub at_c: f64,
    /// Change of the moduli by a kelvin, part of them: negative, for metals soften.
    #[schemars(range(min = -0.01, max = 0.01))]
    pub modulus_per_k: f64,
    /// How far that may be off, as one standard deviation.
    #[schemars(range(min = 0.0, max = 0.01))]
    pub modulus_per_k_sd: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// Where the springs' axes stand: on a ring, or one by one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpringPlaces {
    /// Evenly on a circle about the sensor's axis.
    Ring(SpringRing),
    /// One by one: x, y of each axis, mm.
    Listed(#[schemars(length(min = 1, max = 64))] Vec<[f64; 2]>),
}

/// Springs evenly on a circle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpringRing {
    /// How many.
    #[schemars(range(min = 1, max = 64))]
    pub count: u32,
    /// Radius of the circle of the springs' axes, mm.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub radius_mm: f64,
    /// Azimuth of the first spring from +x towards +y, degrees.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub first_azimuth_deg: f64,
}

/// The disc magnets that hold the springs, one in each platform for each spring (pocket sizes belong to the parts).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MagnetsSection {
    /// Diameter, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub diameter_mm: f64,
    /// Thickness, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub thickness_mm: f64,
    /// Remanence, T; N35 has 1.17-1.22.
    #[schemars(range(min = 0.0, max = 2.0))]
    pub remanence_t: f64,
    /// Pull at which a spring's end leaves its magnet, N; measure it with a thread and a scale.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub grip_force_n: f64,
    /// Which way the two magnets of a pair face each other.
    pub facing: MagnetFacing,
    /// Key of a part whose numbers stand for the fields that are left out here: `domecast list magnets`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// What stands for the section where a rigid mount leaves it out.
impl Default for MagnetsSection {
    fn default() -> Self {
        Self {
            diameter_mm: 0.0,
            thickness_mm: 0.0,
            remanence_t: 0.0,
            grip_force_n: 0.0,
            facing: MagnetFacing::Ignore,
            from: None,
            why: None,
        }
    }
}

impl MagnetsSection {
    /// Whether the section is left out.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

/// The force between the two magnets of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MagnetFacing {
    /// Unlike poles face: the pair pulls together.
    Attract,
    /// Like poles face: the pair pushes apart.
    Repel,
    /// Their force on each other is left out of the model.
    Ignore,
}

/// Weight of what the springs carry; leave the section out to leave weight out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GravitySection {
    /// Acceleration in the rest frame, m/s^2.
    pub acceleration_mps2: [f64; 3],
    /// Mass of upper platform, sheet, dome and LEDs, g.
    #[schemars(range(min = 0.0, max = 1.0e6))]
    pub moving_mass_g: f64,
    /// Centre of that mass in the sensor frame, mm.
    pub center_of_mass_mm: [f64; 3],
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}
