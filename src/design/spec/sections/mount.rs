//! How the upper platform stands on the lower one.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Why;

/// What carries the upper platform.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MountKind {
    /// Springs between magnets: the platform moves under a load, and its pose tells the net wrench.
    #[default]
    Springs,
    /// Posts and screws: the platform does not move, and no net wrench is promised.
    Rigid,
}

/// How the upper platform stands on the lower one. The numbers are those of a rigid mount; springs have their own section.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MountSection {
    /// Springs (where it is left out) or rigid.
    pub kind: MountKind,
    /// x, y of each post with its screw, mm; of a rigid mount two or more.
    #[schemars(length(max = 32))]
    pub at_mm: Vec<[f64; 2]>,
    /// Height of the posts: from the lower platform's top to the upper platform's underside, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 500.0))]
    pub height_mm: f64,
    /// Diameter of the posts, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub post_diameter_mm: f64,
    /// Diameter of the screws' holes through the lower platform, mm; they cut their thread into the upper one.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 20.0))]
    pub hole_diameter_mm: f64,
    /// Reasons and sources, by field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

impl Default for MountSection {
    fn default() -> Self {
        Self {
            kind: MountKind::Springs,
            at_mm: Vec::new(),
            height_mm: 3.0,
            post_diameter_mm: 5.0,
            hole_diameter_mm: 2.2,
            why: None,
        }
    }
}

impl MountSection {
    /// Whether the platform stands on posts.
    pub fn is_rigid(&self) -> bool {
        self.kind == MountKind::Rigid
    }

    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }
}
