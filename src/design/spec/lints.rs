//! Lints: the likeliest mistakes of someone who writes a design for the first time.
//!
//! None of them is certain, so none is an error by itself: a design that works keeps its lints as warnings, and a
//! design that fails shows them beside the error, because the error is often not where the mistake is.

use std::f64::consts::PI;

use super::design::{DesignWarning, sensor_from_camera};
use super::sections::{DesignFile, ModelName};
use domecast_optics::SensorOptics;

/// Tangential coefficients of real lenses stay far below this; k3 in their place does not.
const MAX_TANGENTIAL: f64 = 0.005;
/// Share of the stated field of view below which what the frame shows belongs to another lens model.
const MIN_SHARE_OF_VIEW: f64 = 0.8;
/// A part of the sensor this many times smaller or larger than its neighbour is in another unit.
const OTHER_UNIT: f64 = 50.0;

fn lint(field: &str, message: String) -> DesignWarning {
    DesignWarning { field: field.into(), message }
}

/// What looks like a mistake. `optics` is `None` where they could not be made.
pub(super) fn lints(file: &DesignFile, optics: Option<&SensorOptics>) -> Vec<DesignWarning> {
    let mut found = Vec::new();
    found.extend(units(file));
    found.extend(radians(file));
    found.extend(frame(file));
    found.extend(count(file));
    found.extend(tangential(file));
    found.extend(optics.and_then(|optics| other_model(file, optics)));
    found.extend(looks_away(file));
    found
}

/// Metres or micrometres among millimetres: lengths that go together, of sizes that do not.
fn units(file: &DesignFile) -> Vec<DesignWarning> {
    let dome = file.dome.shape().rim_radius_mm();
    let head = 0.5 * file.platforms.outer_mm[0].min(file.platforms.outer_mm[1]);
    let sheet: f64 = file.optics.layers.iter().filter_map(|layer| layer.thickness_mm).sum();
    let depth = file.camera.position_mm[2].abs();
    let pairs = [
        ("dome.radius_mm", dome, "half of platforms.outer_mm", head),
        ("camera.position_mm", depth, "dome.radius_mm", dome),
        ("optics.layers", sheet, "dome.radius_mm", dome),
        (
            "springs.wire_diameter_mm",
            10.0 * file.springs.wire_diameter_mm,
            "ten times less than springs.outer_diameter_mm",
            file.springs.outer_diameter_mm,
        ),
        (
            "springs.free_length_mm",
            file.springs.free_length_mm,
            "springs.outer_diameter_mm",
            file.springs.outer_diameter_mm,
        ),
        (
            "magnets.diameter_mm",
            file.magnets.diameter_mm,
            "springs.outer_diameter_mm",
            file.springs.outer_diameter_mm,
        ),
        ("camera_body.diameter_mm", file.camera_body.diameter_mm, "half of platforms.outer_mm", head),
    ];
    let mut found = Vec::new();
    for (field, value, beside, other) in pairs {
        let ratio = value / other;
        // a camera at the sheet or no sheet at all is a design, not a unit
        if !(ratio.is_finite() && ratio > 0.0) {
            continue;
        }
        let unit = if ratio < 1.0 / OTHER_UNIT {
            "is it in metres or centimetres?"
        } else if ratio > OTHER_UNIT {
            "is it in micrometres?"
        } else {
            continue;
        };
        found.push(lint(
            field,
            format!("a wrong unit? it is {ratio:.2e} times {beside}; all lengths are millimetres: {unit}"),
        ));
    }
    let [[fx, ..], ..] = file.camera.matrix;
    if fx < 0.03 * f64::from(file.camera.width) {
        found.push(lint(
            "camera.matrix",
            format!("a wrong unit? fx is {fx}; focal lengths of the matrix are pixels, not millimetres"),
        ));
    }
    found
}

/// Angles that are small where nobody means a small one.
fn radians(file: &DesignFile) -> Vec<DesignWarning> {
    let mut angles = vec![
        ("camera.field_of_view_deg", file.camera.field_of_view_deg),
        ("runtime.mask_field_angle_deg", file.runtime.mask_field_angle_deg),
        ("print.wrap_limit_deg", file.print.wrap_limit_deg),
        ("print.wrap_warn_deg", file.print.wrap_warn_deg),
        ("leds.tilt_deg", file.leds.tilt_deg),
    ];
    angles.extend(file.pattern.polar_angle_deg.map(|angle| ("pattern.polar_angle_deg", angle)));
    angles
        .into_iter()
        .filter(|(_, angle)| (0.0..=PI).contains(angle) && *angle > 0.0)
        .map(|(field, angle)| {
            lint(
                field,
                format!(
                    "radians for degrees? it is {angle}, and {angle} rad would be {:.1} degrees",
                    angle.to_degrees()
                ),
            )
        })
        .collect()
}

/// Width and height swapped: the principal point fits the frame only when it lies on its side.
fn frame(file: &DesignFile) -> Option<DesignWarning> {
    let [width, height] = [f64::from(file.camera.width), f64::from(file.camera.height)];
    let [[_, _, cx], [_, _, cy], _] = file.camera.matrix;
    let off = |c: f64, size: f64| (c - 0.5 * (size - 1.0)).abs() / size;
    let (stands, lies) = (off(cx, width).max(off(cy, height)), off(cx, height).max(off(cy, width)));
    (stands > 0.12 && lies < 0.5 * stands).then(|| {
        lint(
            "camera.width",
            format!(
                "width and height swapped? the principal point ({cx}, {cy}) lies near the middle of a frame of {height} x \
                 {width} px, not of {width} x {height}"
            ),
        )
    })
}

/// k1, k2, k3 first and the tangential ones behind, as some tools list them.
fn tangential(file: &DesignFile) -> Option<DesignWarning> {
    if file.camera.model != ModelName::BrownConrady {
        return None;
    }
    let [_, _, p1, p2, k3, ..] = *file.camera.distortion.as_slice() else { return None };
    let largest = p1.abs().max(p2.abs());
    (largest > MAX_TANGENTIAL && largest > k3.abs()).then(|| {
        lint(
            "camera.distortion",
            format!(
                "the coefficients in another order? p1 = {p1} and p2 = {p2} are large for a tangential part, beside k3 = \
                 {k3}; the order is k1, k2, p1, p2, k3 (then k4, k5, k6)"
            ),
        )
    })
}

/// A wide lens whose frame ends long before its field of view does: its coefficients are another model's.
fn other_model(file: &DesignFile, optics: &SensorOptics) -> Option<DesignWarning> {
    let half_deg = 0.5 * file.camera.field_of_view_deg;
    if file.camera.model != ModelName::BrownConrady || half_deg < 50.0 {
        return None;
    }
    let lens = optics.lens();
    // a model that folds first has its own warning
    if lens.fold_angle_rad().is_some_and(|fold| fold.to_degrees() < half_deg) {
        return None;
    }
    let [right, bottom] = [f64::from(file.camera.width) - 0.5, f64::from(file.camera.height) - 0.5];
    let seen_deg = [(-0.5, -0.5), (right, -0.5), (-0.5, bottom), (right, bottom)]
        .iter()
        .filter_map(|&(u, v)| lens.unproject(glam::DVec2::new(u, v)).ok())
        .map(|ray| ray.z.clamp(-1.0, 1.0).acos().to_degrees())
        .fold(0.0, f64::max);
    (seen_deg > 0.0 && seen_deg < MIN_SHARE_OF_VIEW * half_deg).then(|| {
        lint(
            "camera.model",
            format!(
                "fisheye coefficients under another model's name? the frame's corners see only {seen_deg:.1} degrees from the \
                 axis, though camera.field_of_view_deg asks for {half_deg:.1}; OpenCV's fisheye calibration is \
                 kannala_brandt"
            ),
        )
    })
}

/// Half a turn too many: the camera's axis must point up, to the dome.
fn looks_away(file: &DesignFile) -> Option<DesignWarning> {
    let axis = sensor_from_camera(&file.camera).vector(glam::DVec3::Z);
    (axis.z <= 0.0).then(|| {
        lint(
            "camera.rotation_deg",
            "the camera looks away from the dome? with zero rotation it looks up, along the sensor's +z"
                .to_owned(),
        )
    })
}

/// As many coefficients as another model has.
fn count(file: &DesignFile) -> Option<DesignWarning> {
    let message = match (file.camera.model, file.camera.distortion.len()) {
        (ModelName::BrownConrady, 4) => {
            "fisheye coefficients under another model's name? four are what OpenCV's fisheye calibration gives \
             (kannala_brandt); if they are k1, k2, p1, p2 of the plain model, append k3 = 0"
        }
        (ModelName::KannalaBrandt, 5 | 8) => {
            "another model's coefficients? kannala_brandt has k1..k4; k1, k2, p1, p2, k3 are brown_conrady"
        }
        (ModelName::Pinhole, 1..) => "a pinhole has no coefficients: brown_conrady or kannala_brandt?",
        _ => return None,
    };
    Some(lint("camera.model", message.to_owned()))
}
