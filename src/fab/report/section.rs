//! The sensor cut along its x axis, with the rays that its camera sees by.
//!
//! ```
//! use domecast_fab::report::section;
//! use glam::DVec2;
//! use std::str::FromStr;
//!
//! let design = domecast_design::Design::from_str(include_str!("../../../designs/thumb24.json"))?;
//! let ray = section::ray_points(design.optics(), DVec2::new(400.0, 240.0)).expect("inside the image");
//! // from the pupil through both faces of the sheet to the dome
//! assert_eq!(ray.len(), 4);
//! assert!((ray[3].length() - 10.0).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::fmt::Write as _;

use glam::{DVec2, DVec3};

use crate::html::{AsHtml, Html};
use crate::numbers::typeset;
use domecast_design::Design;
use domecast_optics::camera::Lens;
use domecast_optics::{ColorChannel, SensorOptics};

/// Rays on either side of the axis.
const RAYS_A_SIDE: u32 = 8;

/// The points of a pixel's ray from the pupil to the dome, sensor frame, mm; `None` where it does not arrive.
pub fn ray_points(optics: &SensorOptics, pixel: DVec2) -> Option<Vec<DVec3>> {
    let end = optics.trace(pixel).ok()?.surface_mm;
    let ray = optics.lens().unproject(pixel).ok()?;
    let shift = optics.lens().pupil_shift_mm(Lens::field_angle_rad(ray)).0;
    let pose = optics.sensor_from_camera();
    let (mut at, mut along) = (pose.point(DVec3::Z * shift), pose.vector(ray).normalize());
    let mut points = vec![at];
    let flat: Vec<_> = optics.layers().iter().filter(|layer| layer.thickness_mm.is_some()).collect();
    // from the sheet's top face downwards the thicknesses say where each face lies; the air reaches the pupil
    let mut faces_mm = vec![0.0];
    for layer in flat.iter().skip(1).rev() {
        let below = faces_mm.last().copied().unwrap_or(0.0) - layer.thickness_mm.unwrap_or(0.0);
        faces_mm.push(below);
    }
    faces_mm.reverse();
    let indices: Vec<f64> =
        optics.layers().iter().map(|layer| layer.index_for(ColorChannel::Green)).collect();
    for (face_mm, pair) in faces_mm.iter().zip(indices.windows(2)) {
        if along.z <= 0.0 {
            return None;
        }
        at += along * ((face_mm - at.z) / along.z);
        points.push(at);
        // Snell: what lies along the face scales with the ratio of the indices
        let flat = along.truncate() * (pair[0] / pair[1]);
        let up = 1.0 - flat.length_squared();
        along = flat.extend((up > 0.0).then(|| up.sqrt())?);
    }
    points.push(end);
    Some(points)
}

/// The picture: dome, sheet, platforms, springs, camera, white markers, and rays through the image's middle row.
pub fn drawing(design: &Design) -> Html {
    let s = design.sections();
    let optics = design.optics();
    let radius = s.dome.radius_mm;
    let sheet_bottom = design.sheet_underside_z_mm();
    let half = 0.5 * s.envelope.size_mm[0];
    let underside = s.platforms.upper.underside_z_mm;
    let lower_top = design.lower_top_z_mm();
    let [low, high] = design.bounds_mm();
    let (top, bottom) = (high.z, low.z);
    let margin = 0.06 * (top - bottom);
    let sheet_half = 0.5 * s.sheet.size_mm[0];
    let mut art = String::new();
    let rect = |x: f64, z_top: f64, width: f64, height: f64, class: &str, name: &str| {
        format!(
            "<rect class=\"{class}\" x=\"{x:.3}\" y=\"{:.3}\" width=\"{width:.3}\" height=\"{height:.3}\">\
             <title>{}</title></rect>",
            -z_top,
            AsHtml(name)
        )
    };
    // the platforms as blocks on either side of what they leave open
    let pupil = optics.sensor_from_camera().translation_mm;
    let bore = 0.5 * s.camera_body.diameter_mm;
    for side in [-1.0, 1.0] {
        let from = |inner: f64| if side < 0.0 { -half } else { inner };
        let open = sheet_half.min(0.55 * radius + 0.5);
        art +=
            &rect(from(open), sheet_bottom, half - open, sheet_bottom - underside, "solid", "upper platform");
        art += &rect(from(bore), lower_top, half - bore, lower_top - bottom, "solid", "lower platform");
    }
    art += &rect(
        pupil.x - bore,
        pupil.z + s.camera_body.front_from_pupil_mm,
        2.0 * bore,
        s.camera_body.length_mm,
        "camera",
        "camera",
    );
    art += &springs(design);
    art += &rect(-sheet_half, 0.0, 2.0 * sheet_half, -sheet_bottom, "sheet", "acrylic sheet");
    let _ = write!(
        art,
        "<path class=\"dome\" d=\"M{:.3} 0A{radius:.3} {radius:.3} 0 0 1 {radius:.3} 0Z\"><title>silicone dome, \
         radius {} mm</title></path>",
        -radius,
        typeset(radius)
    );
    for marker in design.white_markers_mm() {
        let width = s.white_markers.diameter_mm;
        art += &rect(marker.x - 0.5 * width, 0.15, width, 0.15, "marker", "white marker");
    }
    art += &rays(optics);
    let (width, height) = (2.0 * (half + margin), top - bottom + 2.0 * margin);
    let label = |x: f64, z: f64, text: &str| {
        format!(
            "<text x=\"{x:.2}\" y=\"{:.2}\" font-size=\"{:.2}\">{}</text>",
            -z,
            0.035 * height,
            AsHtml(text)
        )
    };
    art += &label(-half, top - 0.03 * height, &format!("{} mm", typeset(top - bottom)));
    art += &label(-half, 0.45 * lower_top + 0.55 * underside, "air");
    Html::trusted(format!(
        "<svg class=\"section\" viewBox=\"{:.3} {:.3} {width:.3} {height:.3}\" role=\"img\" aria-label=\"The \
         sensor cut along its x axis, with rays from the camera through the sheet to the dome\">{art}</svg>",
        -half - margin,
        -top - margin,
    ))
}

/// The springs beside the cut; the others would stand before camera and window.
fn springs(design: &Design) -> String {
    let s = design.sections();
    let (underside, lower_top) = (s.platforms.upper.underside_z_mm, design.lower_top_z_mm());
    let mut art = String::new();
    let (outer, coils) = (s.springs.outer_diameter_mm, s.springs.active_coils + 2.0);
    for place in design.springs_at_mm().into_iter().filter(|place| place.x.abs() >= place.y.abs()) {
        let turns = (2.0 * coils).round().max(2.0) as u32;
        let mut path = format!("M{:.3} {:.3}", place.x - 0.5 * outer, -lower_top);
        for turn in 1..=turns {
            let side = if turn % 2 == 1 { 0.5 } else { -0.5 };
            let z = lower_top + (underside - lower_top) * f64::from(turn) / f64::from(turns);
            let _ = write!(path, "L{:.3} {:.3}", place.x + side * outer, -z);
        }
        let _ = write!(art, "<path class=\"spring\" d=\"{path}\"><title>spring</title></path>");
    }
    art
}

/// Rays of the row through the principal point, evenly spread over what arrives at the dome.
fn rays(optics: &SensorOptics) -> String {
    let spec = optics.lens().spec();
    let (center, row) = (spec.matrix[0][2], spec.matrix[1][2]);
    let mut art = String::new();
    for side in [-1.0, 1.0] {
        let reach = if side < 0.0 { center } else { f64::from(spec.width) - 1.0 - center };
        let pixel = |share: f64| DVec2::new(center + side * reach * share, row);
        // the furthest pixel of the row that arrives
        let steps = 400u32;
        let last = (1..=steps)
            .rev()
            .map(|k| f64::from(k) / f64::from(steps))
            .find(|share| optics.trace(pixel(*share)).is_ok());
        let Some(last) = last else { continue };
        for k in (if side < 0.0 { 1 } else { 0 })..=RAYS_A_SIDE {
            let Some(points) = ray_points(optics, pixel(last * f64::from(k) / f64::from(RAYS_A_SIDE))) else {
                continue;
            };
            let mut path = String::new();
            for (index, p) in points.iter().enumerate() {
                let _ = write!(path, "{}{:.3} {:.3}", if index == 0 { 'M' } else { 'L' }, p.x, -p.z);
            }
            let _ = write!(art, "<path class=\"ray\" d=\"{path}\"/>");
        }
    }
    art
}
