//! The black dots, as they should appear in the image.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Why;

/// How the dots lie in the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PatternKind {
    /// Square lattice.
    Square,
    /// Hexagonal (triangular) lattice.
    Hexagonal,
    /// Concentric rings, each with as many dots as fit at the pitch.
    Rings,
    /// Even spacing that follows the boundary: rows along the edge, relaxed inwards.
    Fill,
}

/// In which frame the pattern is even (and dots of equal apparent size are circles).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EvenIn {
    /// The image as the camera gives it.
    #[default]
    Raw,
    /// The undistorted frame of the runtime (its own camera matrix).
    Undistorted,
}

/// What lies at the pattern's centre.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CentredOn {
    /// A dot at the centre.
    Dot,
    /// A gap at the centre: a pad must not touch first on a dot.
    #[default]
    Gap,
}

/// Where in the image the pattern's centre lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PatternCentre {
    /// The image of the dome's pole.
    #[default]
    Pole,
    /// The camera matrix's principal point.
    PrincipalPoint,
}

/// What to do with a dot of the pattern that cannot be seen or printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OnLost {
    /// The design is at fault: every dot of the pattern is required.
    #[default]
    Refuse,
    /// Leave the dot out and list it with its reason.
    Drop,
}

/// What lets a runtime see that the picture is turned or mirrored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum KeyKind {
    /// One dot of a symmetric pattern is left out, at half of its polar angle and off all its mirror lines.
    #[default]
    LeftOutDot,
    /// Every dot is laid out: a turned or mirrored picture of a symmetric pattern passes for a good one.
    None,
}

/// The black dots, defined in the image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PatternSection {
    /// Kind of pattern.
    pub kind: PatternKind,
    /// Distance of neighbours in px of the frame `even_in`. Either this or `count`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 20000.0))]
    pub pitch_px: Option<f64>,
    /// Wanted number of dots; the pitch is solved so that the number laid out comes as close as it can. The dot that
    /// `key` leaves out is one of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 1000000))]
    pub count: Option<u32>,
    /// Diameter of each dot in px of the frame `even_in` (equal apparent size, each dot has its own size on
    /// the dome). Either this or `dot_diameter_mm`. Must be smaller than the pitch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 20000.0))]
    pub dot_diameter_px: Option<f64>,
    /// Diameter of each dot on the dome, mm (chord across the cap; equal size on the dome).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 10000.0))]
    pub dot_diameter_mm: Option<f64>,
    /// Frame in which the pattern is even.
    #[serde(default)]
    pub even_in: EvenIn,
    /// A dot or a gap at the centre.
    #[serde(default)]
    pub centred_on: CentredOn,
    /// Where the centre lies.
    #[serde(default)]
    pub centre: PatternCentre,
    /// Turns the pattern about its centre, degrees, from image x towards image y.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub rotation_deg: f64,
    /// The pattern reaches to this polar angle on the dome (0 at the pole, 90 at the rim), degrees. This or
    /// `image_radius_px` or both (then the smaller region).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 90.0))]
    pub polar_angle_deg: Option<f64>,
    /// The pattern reaches to this distance from its centre in px of the frame `even_in`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 20000.0))]
    pub image_radius_px: Option<f64>,
    /// What lets a runtime see that the picture is turned or mirrored.
    #[serde(default)]
    pub key: KeyKind,
    /// A dot that the lens cannot see, or that a white marker hides.
    #[serde(default)]
    pub unseen: OnLost,
    /// A dot that the pad cannot print (too small, too close, beyond the wrap limit).
    #[serde(default)]
    pub unprintable: OnLost,
    /// Zones without dots.
    #[serde(default)]
    pub keep_out: KeepOutSection,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// Zones of the pattern that stay free of dots; a dot whose outline would reach into one is left out and listed.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeepOutSection {
    /// No dot within this polar angle of the pole, degrees; 0: no such zone.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 90.0))]
    pub pole_deg: f64,
    /// No dot within this angle of the rim, degrees; 0: no such zone.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 90.0))]
    pub rim_deg: f64,
    /// Free margin around each white marker's image, px; left out: markers make no zone (a dot that a marker
    /// hides still falls under `unseen`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub white_marker_margin_px: Option<f64>,
    /// Further discs in the raw image.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 1000))]
    pub image_discs: Vec<ImageDiscSection>,
}

/// A disc in the raw image.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImageDiscSection {
    /// Centre, px.
    pub center_px: [f64; 2],
    /// Radius, px.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 20000.0))]
    pub radius_px: f64,
}
