//! The camera: lens, layers before it, body, place.

use serde_json::{Value, json};

use super::board::{above_mm, has_board};
use super::geometry::{
    depth_for_mm, depth_mm, lens, lower_top_mm, marks_angle_rad, press_mm, rim_mm, sheet_mm, travel_mm,
    usable_angle_rad,
};
use super::known::{Known, up};
use super::rule::{Rule, fixed, follows};
use domecast_optics::camera::Lens;
use glam::DVec2;

pub(super) const LENS: &[Rule] = &[
    follows("camera.width", "twice the principal point's column and one, 2 cx + 1", |k| size(k, 0)),
    follows("camera.height", "twice the principal point's row and one, 2 cy + 1", |k| size(k, 1)),
    fixed("camera.distortion", "[]", "none, as for a pinhole"),
    follows(
        "camera.field_of_view_deg",
        "what the lens model shows in the image's farthest corner, twice its field angle",
        field_of_view,
    ),
];

pub(super) const LAYERS: &[Rule] = &[
    follows(
        "optics.layers",
        "an acrylic sheet of one millimetre for each 12.5 mm of the dome's radius begun, and clear silicone; indices at \
         633, 532 and 440 nm",
        layers,
    ),
    fixed("elastomer.material", "\"clear platinum silicone\"", "clear, and soft enough to feel"),
    fixed("elastomer.membrane_thickness_mm", "0.1", "one brushed or sprayed coat of pigmented silicone"),
    fixed(
        "elastomer.membrane_reflectance",
        "{\"r\": 0.55, \"g\": 0.55, \"b\": 0.55}",
        "a neutral grey; a whiter one mixes the lights",
    ),
    fixed("elastomer.shrinkage_percent", "0.1", "usual for platinum silicone cured at room temperature"),
    fixed(
        "elastomer.young_modulus_mpa",
        "0.56",
        "a clear platinum silicone of Shore A 15, by Gent's formula",
    ),
    fixed("elastomer.poisson_ratio", "0.49", "nearly incompressible, as silicones are"),
    fixed("elastomer.friction", "0.6", "a dry coated membrane on smooth plastic or metal"),
];

pub(super) const BODY: &[Rule] = &[
    fixed("camera_body.diameter_mm", "7.5", "a mini UVC camera of 7.5 mm; measure yours"),
    fixed("camera_body.length_mm", "6.5", "a mini UVC camera; measure yours"),
    fixed(
        "camera_body.front_from_pupil_mm",
        "0.8",
        "small lenses have their pupil just behind the front glass",
    ),
    follows("camera_body.lens_diameter_mm", "about half of the body, 8/15 of its diameter", |k| {
        k.number(k.n("camera_body.diameter_mm") * 8.0 / 15.0)
    }),
    follows("camera_body.bore_clearance_mm", "the process's smallest gap, a sliding fit", |k| {
        k.number(k.n("process.min_gap_mm").max(0.05))
    }),
    follows("camera_body.min_sheet_gap_mm", "four times the printing accuracy, at least 0.5 mm", |k| {
        k.number(up(4.0 * k.n("process.tolerance_mm"), 0.1).clamp(0.5, 100.0))
    }),
    follows("camera_body.cable_diameter_mm", "a third of the body, at most 2.5 mm", |k| {
        k.number((k.n("camera_body.diameter_mm") / 3.0).min(2.5))
    }),
    follows(
        "white_markers.diameter_mm",
        "8 % of the rim's radius, at least 0.8 mm and the smallest hole",
        |k| k.number((0.08 * rim_mm(k)).max(0.8).max(k.n("process.min_hole_diameter_mm"))),
    ),
    follows(
        "white_markers.positions_mm",
        "four on the diagonals, 0.2 mm outside the dome's rim: (r + 0.2 + d/2) / sqrt 2",
        markers,
    ),
    fixed("white_markers.reflectance", "0.9", "usual for white paint"),
];

pub(super) const PLACE: &[Rule] = &[
    follows(
        "camera.position_mm",
        "on the axis, as near as it can be: the markers inside image, lens model and 62 degrees under the claimed \
         loads, the body below the upper platform at full travel and in its bore for 2.4 mm, or the block high enough for a \
         board's screws",
        position,
    ),
    follows("runtime.mask_radius_px", "half of the image's smaller side", |k| {
        k.number(0.5 * k.n("camera.width").min(k.n("camera.height")))
    }),
    follows(
        "runtime.mask_field_angle_deg",
        "the field angle of the markers' outer edges under the claimed loads, and 3 % more",
        mask_angle,
    ),
];

fn size(k: &Known<'_>, axis: usize) -> Option<Value> {
    let center = k.value("camera.matrix").and_then(|m| m.get(axis)?.get(2)?.as_f64()).unwrap_or_else(|| {
        k.wrong("camera.matrix has no principal point");
        0.0
    });
    Some(json!((2.0 * center + 1.0).round().clamp(16.0, 20_000.0) as u64))
}

fn field_of_view(k: &Known<'_>) -> Option<Value> {
    let lens = lens(k)?;
    let (width, height) = (k.n("camera.width"), k.n("camera.height"));
    let corners = [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)];
    let reach = lens.max_field_angle_rad();
    let angle = |(x, y): (f64, f64)| {
        lens.unproject(DVec2::new(x - 0.5, y - 0.5)).map_or(reach, Lens::field_angle_rad)
    };
    let farthest = corners.into_iter().map(angle).fold(0.0, f64::max).min(reach);
    k.number(((2.0 * farthest).to_degrees() * 100.0).floor() / 100.0)
}

fn layers(k: &Known<'_>) -> Option<Value> {
    let thickness_mm = up(rim_mm(k) / 12.5, 1.0).max(1.0);
    Some(json!([
        { "name": "acrylic", "index": { "r": 1.489, "g": 1.494, "b": 1.5015 }, "thickness_mm": thickness_mm },
        { "name": "silicone", "index": { "r": 1.409, "g": 1.412, "b": 1.417 } }
    ]))
}

fn markers(k: &Known<'_>) -> Option<Value> {
    let off_axis = rim_mm(k) + 0.2 + 0.5 * k.n("white_markers.diameter_mm");
    let side = up(off_axis / 2f64.sqrt(), 0.01);
    k.places(&[[side, side], [-side, side], [-side, -side], [side, -side]])
}

fn position(k: &Known<'_>) -> Option<Value> {
    let angle_rad = usable_angle_rad(k)?;
    if angle_rad <= 1e-3 {
        k.wrong("the lens shows nothing about its axis");
    }
    let (front, length) = (k.n("camera_body.front_from_pupil_mm"), k.n("camera_body.length_mm"));
    let under = -k.n("platforms.upper.underside_z_mm");
    let clear = under + front + travel_mm(k) + 0.5;
    let holds = if has_board(k) { above_mm(k) } else { 2.4 };
    let held = -lower_top_mm(k) + holds + front - length;
    let gap = sheet_mm(k) + front + k.n("camera_body.min_sheet_gap_mm") + press_mm(k);
    let depth = depth_for_mm(k, angle_rad).max(clear).max(held).max(gap);
    k.numbers(&[0.0, 0.0, -up(depth, 0.1)])
}

fn mask_angle(k: &Known<'_>) -> Option<Value> {
    let lens = lens(k)?;
    let wanted = 1.03 * marks_angle_rad(k, depth_mm(k));
    let reach = lens.max_field_angle_rad().min(75f64.to_radians());
    k.number(up(wanted.min(0.995 * reach).to_degrees(), 0.1).min(reach.to_degrees()))
}
