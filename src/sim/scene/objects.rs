//! What touches the dome, as it is written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use domecast_design::sections::Why;

/// A body and its way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObjectSection {
    /// A word for it.
    pub name: String,
    /// Its shape, in its own frame.
    pub shape: ShapeSection,
    /// Young's modulus, MPa; left out: rigid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e7))]
    pub young_mpa: Option<f64>,
    /// Poisson's ratio; counts only with `young_mpa`.
    #[serde(default = "poisson")]
    #[schemars(range(min = 0.0, max = 0.499))]
    pub poisson: f64,
    /// Its poses over time, in the rest frame.
    #[schemars(length(min = 1, max = 100000))]
    pub path: Vec<ObjectKey>,
    /// Forces over time with which it is pressed on, along a way from its pose; left out: its pose is held.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub press: Option<PressSection>,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

fn poisson() -> f64 {
    0.3
}

/// A pose of an object in the rest frame; linear in between, constant before and after.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObjectKey {
    /// When, s.
    pub time_s: f64,
    /// Its frame's origin, mm.
    pub position_mm: [f64; 3],
    /// Rotation vector from its frame to the rest frame, degrees.
    #[serde(default)]
    pub rotation_deg: [f64; 3],
}

/// An object that moves along a way until the dome bears a force.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PressSection {
    /// The way, rest frame; any length.
    pub direction: [f64; 3],
    /// The force along it over time, N: linear in between, constant before and after; at 0 the object does not
    /// touch.
    #[schemars(length(min = 1, max = 100000))]
    pub force: Vec<ForceKey>,
}

/// A force at a time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ForceKey {
    /// When, s.
    pub time_s: f64,
    /// How strong, N.
    #[schemars(range(min = 0.0, max = 1e4))]
    pub force_n: f64,
}

/// A shape around the origin of its own frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum ShapeSection {
    /// A ball.
    Sphere {
        /// Radius, mm.
        #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e4))]
        radius_mm: f64,
    },
    /// A round bar along z, centred.
    Cylinder {
        /// Radius, mm.
        #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e4))]
        radius_mm: f64,
        /// Length, mm.
        #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e4))]
        length_mm: f64,
    },
    /// A block along the axes, centred.
    Box {
        /// Its sides, mm.
        size_mm: [f64; 3],
    },
    /// A cone whose tip is at the origin and points to -z.
    Cone {
        /// Radius of its base, mm.
        #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e4))]
        radius_mm: f64,
        /// Height from tip to base, mm.
        #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e4))]
        height_mm: f64,
    },
    /// A closed mesh.
    Mesh {
        /// An STL file, relative to the scene file.
        file: String,
        /// mm per unit of the file.
        #[serde(default = "one")]
        #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e6))]
        scale: f64,
    },
}

fn one() -> f64 {
    1.0
}
