//! The printed platforms, the sheet, and the lights.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{DiffuserSection, ElectricalSection, PowerRgb, Why};

/// The two printed platforms.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlatformsSection {
    /// Outer side lengths along x and y of both platforms, mm.
    pub outer_mm: [f64; 2],
    /// Gap kept between the camera's view and any printed part, across the view's edge ray, mm.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub window_margin_mm: f64,
    /// The platform that carries sheet, dome and lights.
    pub upper: UpperPlatform,
    /// The platform that carries the camera.
    pub lower: LowerPlatform,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// The upper platform; heights in the sensor frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UpperPlatform {
    /// Height of the underside, where the springs press, mm; negative.
    #[schemars(extend("exclusiveMaximum" = 0.0), range(min = -1000.0))]
    pub underside_z_mm: f64,
    /// Height of the rim around the sheet above the sheet's seat, mm; the sheet's thickness makes it flush.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub rim_height_mm: f64,
}

/// The lower platform; heights in the sensor frame at rest. Its top is one free spring length below the upper platform's underside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LowerPlatform {
    /// Height of the underside, mm; negative.
    #[schemars(extend("exclusiveMaximum" = 0.0), range(min = -10000.0))]
    pub underside_z_mm: f64,
    /// Set screws that hold the camera in its bore.
    pub clamp: ClampSection,
    /// Screw holes through the platform.
    pub mounting: MountingSection,
    /// The channel that lets the cable out.
    pub cable_exit: CableExitSection,
    /// A tube round the lens that hides the lights from it at any position of the springs; left out: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hood: Option<HoodSection>,
    /// Diameter of the vertical holes for the wires of the lights, one under each, mm; 0 for none.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub wire_hole_diameter_mm: f64,
    /// Distance of those holes from the axis, mm.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub wire_hole_ring_radius_mm: f64,
}

/// Set screws that hold the camera: radial holes from the outside into the bore.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClampSection {
    /// Direction of each screw from +x towards +y, degrees; an empty list where the camera is glued.
    #[schemars(length(max = 16))]
    pub azimuth_deg: Vec<f64>,
    /// Height of the screws' axes, mm.
    pub z_mm: f64,
    /// Diameter of the hole (for tapping), mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub hole_diameter_mm: f64,
}

/// Screw holes through the lower platform, counterbored from above.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MountingSection {
    /// x, y of each hole, mm.
    #[schemars(length(max = 64))]
    pub at_mm: Vec<[f64; 2]>,
    /// Diameter of the holes, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub hole_diameter_mm: f64,
    /// Diameter of the counterbores, mm; 0 for none.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub counterbore_diameter_mm: f64,
    /// Depth of the counterbores, mm.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub counterbore_depth_mm: f64,
}

/// A channel from the bore to the outside, cut from the underside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CableExitSection {
    /// Its direction from +x towards +y, degrees.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub azimuth_deg: f64,
    /// Its width, mm; 0 for none.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub width_mm: f64,
    /// Its height above the underside, mm.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub height_mm: f64,
}

/// The camera's bore, continued as a tube above the block; it goes along the camera's axis and moves with the camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HoodSection {
    /// How far its rim stands above the entrance pupil, along the camera's axis, mm.
    #[schemars(range(min = -1000.0, max = 1000.0))]
    pub rim_from_pupil_mm: f64,
    /// Thickness of its wall, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub wall_mm: f64,
    /// Gap at rest between it and the upper platform, whose window is widened to that where it is too narrow, mm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub gap_mm: f64,
}

/// The sheet's outline; its thickness is that of its optical layer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SheetSection {
    /// Side lengths along x and y, mm.
    pub size_mm: [f64; 2],
    /// Radius of the corners, mm.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub corner_radius_mm: f64,
    /// Gap to the recess on each side, mm.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub clearance_mm: f64,
    /// Width of the laser's cut, mm; the drawing for the cutter grows by half of it.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub kerf_mm: f64,
    /// Density, g/cm^3; that of cast acrylic where it is left out.
    #[serde(default = "acrylic_density")]
    #[schemars(range(min = 0.1, max = 25.0))]
    pub density_g_per_cm3: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

fn acrylic_density() -> f64 {
    1.19
}

/// The pockets for the magnets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MagnetPocketsSection {
    /// Added to the diameter (not the radius), mm.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub diameter_clearance_mm: f64,
    /// Added to the depth, mm.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub depth_clearance_mm: f64,
    /// Diameter of the hole behind each pocket, to push a magnet out, mm; 0 for none.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub push_out_diameter_mm: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// What stands for the section where a rigid mount leaves it out.
impl Default for MagnetPocketsSection {
    fn default() -> Self {
        Self { diameter_clearance_mm: 0.0, depth_clearance_mm: 0.0, push_out_diameter_mm: 0.0, why: None }
    }
}

impl MagnetPocketsSection {
    /// Whether the section is left out.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

/// Colour of a light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LedColor {
    /// Red.
    Red,
    /// Green.
    Green,
    /// Blue.
    Blue,
    /// White.
    White,
}

/// One light.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LedSection {
    /// Its colour.
    pub color: LedColor,
    /// Its direction from the axis, from +x towards +y, degrees.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub azimuth_deg: f64,
}

/// Boards with one light each, standing in pits of the upper platform and facing the axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LedsSection {
    /// The lights.
    #[schemars(length(max = 24))]
    pub list: Vec<LedSection>,
    /// Radiant flux of one light of each colour as it is driven, mW; a white light sends all three.
    pub radiant_flux_mw: PowerRgb,
    /// Exponent m of the bare light's lobe: intensity as cos^m of the angle to its axis; 1 is Lambert's law, with
    /// half of the intensity at 60 degrees.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub lobe_exponent: f64,
    /// What the diffuser tape does to the light; left out: no tape, or a clear one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diffuser: Option<DiffuserSection>,
    /// Share of the light that gets straight through the platform where it stands in the way; 0 for an opaque one.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub through_platform: f64,
    /// Angle between board and base plane, degrees: 90 faces the axis squarely, less looks up towards the dome.
    #[schemars(range(min = 30.0, max = 90.0))]
    pub tilt_deg: f64,
    /// Side lengths of the light's package across and along the board's height, mm.
    pub package_mm: [f64; 2],
    /// Height of the package above the board, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub package_height_mm: f64,
    /// Side of the square that emits, centred on the package, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub emitter_mm: f64,
    /// Width and height of the board, mm.
    pub board_mm: [f64; 2],
    /// Thickness of the board, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub board_thickness_mm: f64,
    /// Thickness of the diffuser tape over the light, mm.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub diffuser_thickness_mm: f64,
    /// Gap around board and light in the pit on each side, mm.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub clearance_mm: f64,
    /// Distance of the emitting face's centre from the axis, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1000.0))]
    pub center_radius_mm: f64,
    /// Height of the emitting face's centre in the sensor frame, mm.
    pub center_z_mm: f64,
    /// How far the board's centre stands above the light's, along the board, mm.
    pub board_offset_mm: f64,
    /// Height of the lip's top edge in the sensor frame, mm: light passes above it, the lens hides below it.
    pub lip_top_z_mm: f64,
    /// Radius of the room that is open to all lights above the lip's height, mm; left out: each light has a channel of
    /// its board's width towards the axis, whose walls take what goes sideways.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1000.0))]
    pub well_radius_mm: Option<f64>,
    /// Diameter of the wire hole through the pit's floor, mm; 0 for none.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub wire_hole_diameter_mm: f64,
    /// What drives the lights, how warm they get, and the board of one light.
    pub electrical: ElectricalSection,
    /// Key of a part whose numbers stand for the fields that are left out here: `domecast list leds`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}
