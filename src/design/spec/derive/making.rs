//! The process, the tools of the making, and how exact it all is.

use serde_json::Value;

use super::geometry::rim_mm;
use super::known::Known;
use super::rule::{Rule, fixed, follows};

pub(super) const PROCESS: &[Rule] = &[
    fixed("process.name", "\"material jetting, clear\"", "fine enough for walls of 0.6 mm; name yours"),
    fixed("process.min_wall_mm", "0.6", "a trade limit of material jetting"),
    fixed("process.min_hole_diameter_mm", "0.8", "a trade limit of material jetting"),
    fixed("process.min_pin_diameter_mm", "1.0", "a trade limit of material jetting"),
    fixed("process.min_gap_mm", "0.1", "a trade limit of material jetting"),
    fixed("process.tolerance_mm", "0.13", "the accuracy of material jetting"),
    fixed("process.build_volume_mm", "[294, 192, 148]", "a common printer"),
    fixed("process.density_g_per_cm3", "1.18", "printed acrylic resin"),
];

pub(super) const TOOLS: &[Rule] = &[
    fixed(
        "mould.sealer_thickness_mm",
        "0.02",
        "printed resin inhibits platinum silicone, so the cavity is sealed",
    ),
    fixed("mould.wall_mm", "6.0", "room for the register pins in the corners"),
    fixed("mould.floor_mm", "3.0", "stiff enough to be clamped"),
    fixed("mould.base_thickness_mm", "4.0", "stiff enough to be clamped"),
    follows("mould.pins.diameter_mm", "3 mm, or the thinnest pin", |k| {
        k.number(k.n("process.min_pin_diameter_mm").max(3.0))
    }),
    fixed("mould.pins.height_mm", "3.0", "as high as wide"),
    follows("mould.pins.clearance_mm", "one and a half of the smallest gap", |k| {
        k.number((1.5 * k.n("process.min_gap_mm")).max(0.1))
    }),
    follows("mould.pins.depth_clearance_mm", "0.5 mm, or the smallest gap", |k| {
        k.number(k.n("process.min_gap_mm").max(0.5))
    }),
    fixed("mould.pins.chamfer_mm", "0.4", "so that the pins find their holes"),
    follows(
        "mould.pins.at_mm",
        "three corners of four, the rim's radius + 2.5 mm along x and y: the halves close one way only",
        |k| {
            let side = rim_mm(k) + 2.5;
            k.places(&[[side, side], [-side, side], [-side, -side]])
        },
    ),
    follows(
        "mould.fill.diameter_mm",
        "0.3 of the rim's radius, from the smallest hole (at least 1.2 mm) to 3 mm",
        |k| {
            let narrowest = k.n("process.min_hole_diameter_mm").max(1.2);
            k.number((0.3 * rim_mm(k)).min(3.0).max(narrowest))
        },
    ),
    follows(
        "mould.fill.radius_mm",
        "off the axis by 0.6 of the rim's radius, where the scar is bonded to the sheet",
        |k| k.number(0.6 * rim_mm(k)),
    ),
    fixed("mould.fill.azimuth_deg", "0", "between two vents"),
    follows("mould.fill.funnel_diameter_mm", "twice the fill hole", |k| {
        k.number(2.0 * k.n("mould.fill.diameter_mm"))
    }),
    follows("mould.fill.funnel_depth_mm", "half of the base plate, at most 2 mm", |k| {
        k.number((0.5 * k.n("mould.base_thickness_mm")).min(2.0))
    }),
    fixed("mould.vents.count", "4", "at the rim, the highest line of the cavity when it is filled"),
    follows("mould.vents.diameter_mm", "0.1 of the rim's radius, from the smallest hole to 1 mm", |k| {
        k.number((0.1 * rim_mm(k)).min(1.0).max(k.n("process.min_hole_diameter_mm")))
    }),
    fixed("mould.vents.inset_mm", "0.1", "just inside the rim"),
    fixed("mould.vents.first_azimuth_deg", "45", "clear of the fill hole"),
    follows("jig.clearance_mm", "the process's smallest gap", |k| k.number(k.n("process.min_gap_mm"))),
    fixed("jig.pin_diameter_mm", "4.0", "the pins of the press's table; measure yours"),
    follows("jig.pin_distance_mm", "the sheet's length and 28.4 mm, so that the block stands between", |k| {
        k.number(k.at("sheet.size_mm", 0) + 28.4)
    }),
    follows("jig.base_mm", "the pins' distance and 10 mm; at least the sheet's width and 10 mm", |k| {
        let side = k.n("jig.pin_distance_mm") + 10.0;
        k.numbers(&[side, side.max(k.at("sheet.size_mm", 1) + 10.0)])
    }),
    fixed("jig.base_thickness_mm", "8", "stiff under the pad's stroke"),
    fixed("jig.seat_height_mm", "6", "the pad wraps past the sheet"),
    follows("stencil.thickness_mm", "the thinnest wall, at least 0.6 mm, so that the discs are sharp", |k| {
        k.number(k.n("process.min_wall_mm").max(0.6))
    }),
    fixed("stencil.border_mm", "4", "room for two fingers"),
    follows(
        "stencil.skirt_depth_mm",
        "0.7 of the sheet's thickness, so that the skirt grips its edge",
        |k| k.number(0.7 * super::geometry::sheet_mm(k)),
    ),
    fixed("coupon.steps", "3", "seven sizes span the printing accuracy"),
    fixed("coupon.step_mm", "0.05", "seven sizes span the printing accuracy"),
];

pub(super) const EXACTNESS: &[Rule] = &[
    fixed("noise.white_centroid_px", "0.1", "usual for discs of 7 px and 8 bit"),
    fixed("noise.black_centroid_px", "0.1", "usual for discs of 7 px and 8 bit"),
    fixed("tolerances.pupil_mm", "[0.1, 0.1, 0.1]", "the printing accuracy, as one standard deviation"),
    fixed("tolerances.camera_rotation_deg", "[0.5, 0.5, 0.5]", "a body held in a printed bore"),
    fixed("tolerances.dome_radius_mm", "0.05", "half of the printing accuracy"),
    fixed("tolerances.layer_thickness_mm", "0.05", "trade tolerance of thin acrylic"),
    fixed("tolerances.index", "0.005", "between makers"),
    fixed("tolerances.white_marker_mm", "0.1", "a stencil's play"),
    fixed("tolerances.black_dot_mm", "0.1", "a print's play"),
    fixed("tolerances.print_registration_mm", "0.05", "half of the printing accuracy"),
    fixed("tolerances.print_rotation_deg", "0.5", "a jig's play"),
    fixed("tolerances.print_scatter_mm", "0.02", "from print to print"),
    fixed("tolerances.wire_diameter_mm", "0.005", "trade tolerance"),
    fixed("tolerances.spring_diameter_mm", "0.05", "trade tolerance"),
    fixed("tolerances.active_coils", "0.1", "estimate: a tenth of a coil, where the ends are ground"),
    fixed("tolerances.modulus_percent", "2", "music wire: makers state 79 to 81.5 GPa"),
    fixed(
        "tolerances.camera_drift_mm",
        "0.005",
        "estimate: a body held by screws in a printed bore; measure yours",
    ),
    fixed(
        "tolerances.camera_drift_deg",
        "0.05",
        "estimate: 0.005 mm over the length of a small camera; measure yours",
    ),
    follows("tolerances.samples", "200; none where `accuracy` stands in the file and chooses it", |k| {
        if k.has("accuracy") { None } else { Some(Value::from(200)) }
    }),
    fixed("tolerances.seed", "1", "any"),
    follows("accuracy.dot_placement_mm", "a pixel of the film", |k| exact(k, 0.01)),
    follows("accuracy.image_px", "what a centroid of a dot is known to", |k| exact(k, 0.1)),
    follows("accuracy.mesh_mm", "below the printer's layers", |k| exact(k, 0.02)),
    follows("accuracy.force_n", "a 2 g weight", |k| exact(k, 0.02)),
];

/// An accuracy, unless every setting that it would choose is given.
fn exact(k: &Known<'_>, value: f64) -> Option<Value> {
    let settings = [
        "print.outline_tolerance_mm",
        "mesh.chord_tolerance_mm",
        "mesh.optical_chord_tolerance_mm",
        "tolerances.samples",
    ];
    let given = settings.iter().all(|field| k.has(field)) && !k.has("accuracy");
    if given { None } else { k.number(value) }
}
