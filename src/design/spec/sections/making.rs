//! How the parts are made: mould, jig, stencil, coupon, and the processes' limits.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Why;

/// The mould: a cavity, and a base plate that carries pins, fill and vents.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MouldSection {
    /// Thickness of the sealer on every face that touches silicone, mm.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub sealer_thickness_mm: f64,
    /// Wall beside the cavity, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1000.0))]
    pub wall_mm: f64,
    /// Wall below the cavity, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1000.0))]
    pub floor_mm: f64,
    /// Thickness of the base plate, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1000.0))]
    pub base_thickness_mm: f64,
    /// Pins that register the two parts.
    pub pins: PinsSection,
    /// The fill hole, from the flat side.
    pub fill: FillSection,
    /// The vents, at the highest points of the rim.
    pub vents: VentsSection,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// Registration pins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PinsSection {
    /// Diameter, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub diameter_mm: f64,
    /// Height, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub height_mm: f64,
    /// Radial clearance of the holes, mm.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub clearance_mm: f64,
    /// Extra depth of the holes, mm.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub depth_clearance_mm: f64,
    /// Chamfer at the pin's tip, mm.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub chamfer_mm: f64,
    /// x, y of each pin, mm; an arrangement without symmetry closes one way only.
    #[schemars(length(min = 2, max = 16))]
    pub at_mm: Vec<[f64; 2]>,
}

/// The fill hole with its funnel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FillSection {
    /// Diameter, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub diameter_mm: f64,
    /// Distance from the axis, mm.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub radius_mm: f64,
    /// Direction from +x towards +y, degrees.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub azimuth_deg: f64,
    /// Diameter of the funnel at the top, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub funnel_diameter_mm: f64,
    /// Depth of the funnel, mm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub funnel_depth_mm: f64,
}

/// Vents at the rim.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VentsSection {
    /// How many.
    #[schemars(range(min = 0, max = 24))]
    pub count: u32,
    /// Diameter, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub diameter_mm: f64,
    /// Distance of a vent's edge inside the rim, mm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub inset_mm: f64,
    /// Direction of the first from +x towards +y, degrees.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub first_azimuth_deg: f64,
}

/// The pad-print jig: a rigid mandrel for the soft dome.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JigSection {
    /// Gap between mandrel and part, mm.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub clearance_mm: f64,
    /// Side lengths of the base, mm.
    pub base_mm: [f64; 2],
    /// Thickness of the base, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1000.0))]
    pub base_thickness_mm: f64,
    /// Diameter of the holes for the press's pins, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub pin_diameter_mm: f64,
    /// Distance of the two pins, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 10000.0))]
    pub pin_distance_mm: f64,
    /// Height of the sheet's underside above the base, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1000.0))]
    pub seat_height_mm: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// The stencil for the white markers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StencilSection {
    /// Thickness, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub thickness_mm: f64,
    /// Width of the frame around the sheet, mm.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub border_mm: f64,
    /// Depth of the skirt that grips the sheet, mm.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub skirt_depth_mm: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// The fit coupon: pockets and bores in steps around the nominal size.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CouponSection {
    /// Steps on either side of nominal.
    #[schemars(range(min = 1, max = 10))]
    pub steps: u32,
    /// Step of the diameter, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 10.0))]
    pub step_mm: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// What the printing process can make.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProcessSection {
    /// Which process and material.
    pub name: String,
    /// Thinnest wall, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub min_wall_mm: f64,
    /// Smallest hole, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub min_hole_diameter_mm: f64,
    /// Smallest pin, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub min_pin_diameter_mm: f64,
    /// Smallest gap between faces that must stay apart, mm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub min_gap_mm: f64,
    /// Accuracy of a printed dimension, plus or minus, mm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub tolerance_mm: f64,
    /// The printer's build volume, mm.
    pub build_volume_mm: [f64; 3],
    /// Density of the printed material, g/cm^3.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 30.0))]
    pub density_g_per_cm3: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// How exact the meshes are.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshSection {
    /// Largest distance of a mesh from the exact surface, mm; chosen from `accuracy` where it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0001, max = 10.0))]
    pub chord_tolerance_mm: Option<f64>,
    /// The same for the mould's cavity, which shapes the dome, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0001, max = 10.0))]
    pub optical_chord_tolerance_mm: Option<f64>,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}
