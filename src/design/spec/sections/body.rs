//! The camera's housing: a cylinder, or a board with a lens on it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Why;

/// A cable is bent to no less than this many of its diameters where the design gives no radius: the usual limit of
/// thin flexible cables.
pub const MIN_BEND_DIAMETERS: f64 = 2.0;

/// What a camera's housing is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CameraBodyKind {
    /// A cylinder around the optical axis, held in a bore by set screws.
    #[default]
    Cylinder,
    /// A board with a lens barrel on it, screwed against posts from below.
    Board,
}

impl CameraBodyKind {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// The camera's housing: a cylinder around the optical axis, or a board that carries a lens barrel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraBodySection {
    /// Cylinder (where it is left out) or board.
    #[serde(default, skip_serializing_if = "CameraBodyKind::is_default")]
    pub kind: CameraBodyKind,
    /// The board, for the kind `board`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub board: Option<CameraBoardSection>,
    /// Outer diameter, mm; of a board its lens barrel's.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 200.0))]
    pub diameter_mm: f64,
    /// Length from the front glass to the back, mm; of a board from the front glass to the board's upper face.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 500.0))]
    pub length_mm: f64,
    /// How far the front glass stands ahead of the entrance pupil, towards the dome, mm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub front_from_pupil_mm: f64,
    /// Diameter of the front glass that light can enter, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 200.0))]
    pub lens_diameter_mm: f64,
    /// Radial clearance of the bore that holds the body, or that a board's lens barrel stands in, mm.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub bore_clearance_mm: f64,
    /// Smallest gap allowed between the front glass and the sheet under the claimed loads, mm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub min_sheet_gap_mm: f64,
    /// Diameter of the cable that leaves at the back, mm; the thickness of a flat one.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub cable_diameter_mm: f64,
    /// Width of a flat cable, mm; left out: the cable is round.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 200.0))]
    pub cable_width_mm: Option<f64>,
    /// Smallest radius that the cable may be bent to, mm; left out: twice its diameter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1000.0))]
    pub cable_bend_radius_mm: Option<f64>,
    /// Key of a part whose numbers stand for the fields that are left out here: `domecast list cameras`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// A camera's board: a rectangle across the optical axis, with holes for its screws. Places are x, y from the board's
/// middle, along the camera's axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraBoardSection {
    /// Side lengths along the camera's x and y, mm.
    pub size_mm: [f64; 2],
    /// Thickness, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 20.0))]
    pub thickness_mm: f64,
    /// x, y of the lens's axis, mm.
    #[serde(default)]
    pub lens_offset_mm: [f64; 2],
    /// x, y of each screw hole, mm.
    #[schemars(length(min = 2, max = 16))]
    pub holes_mm: Vec<[f64; 2]>,
    /// Diameter of those holes, mm; the screws are the largest that pass them.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 20.0))]
    pub hole_diameter_mm: f64,
    /// Height of what stands on the back, mm: connectors and parts.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub components_height_mm: f64,
    /// Height of what stands on the front beside the lens barrel, mm: the lens's holder, small parts.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub front_components_height_mm: f64,
    /// Gap between the board's edge and its pocket, and above what stands on its front, mm.
    #[serde(default = "board_clearance")]
    #[schemars(range(min = 0.0, max = 10.0))]
    pub clearance_mm: f64,
    /// Where the cable leaves the board, from the camera's +x towards +y, degrees; left out: anywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub cable_azimuth_deg: Option<f64>,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// Boards are routed or broken out to two tenths of a millimetre.
fn board_clearance() -> f64 {
    0.3
}
