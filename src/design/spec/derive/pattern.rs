//! The dots, and how they are printed.

use serde_json::{Value, json};

use super::super::resolve::optics;
use super::super::sections::{CameraSection, DomeSection, OpticsSection};
use super::geometry::{dome, sphere_place};
use super::known::{Known, down, up};
use super::rule::{Rule, fixed, follows};
use domecast_optics::SensorOptics;
use nalgebra::Matrix3x2;

/// Share of the pitch that a dot takes where nothing asks for more.
const SHARE: f64 = 0.39;
/// The largest share: the gap is then still a little smaller than the dot.
const MAX_SHARE: f64 = 0.55;
/// Dots where neither the file nor the plate says fewer.
const DOTS: f64 = 170.0;
/// Pixels of a dot's diameter that a centroid needs.
const MIN_DOT_PX: f64 = 4.0;

pub(super) const RULES: &[Rule] = &[
    fixed("print.min_dot_mm", "0.3", "safe for pad printing"),
    follows("print.min_gap_mm", "half of the smallest dot", |k| k.number(0.5 * k.n("print.min_dot_mm"))),
    fixed("print.wrap_warn_deg", "50", "a pad wraps safely to 45-50 degrees"),
    follows(
        "print.wrap_limit_deg",
        "65 degrees, beyond which the pad slides, or where the warning begins",
        |k| k.number(k.n("print.wrap_warn_deg").max(65.0)),
    ),
    fixed("print.pad_over_image", "1.3", "pads are taken 20 to 30 percent larger than the image"),
    fixed("print.dpi", "2400", "usual for pad-print films"),
    fixed("pattern.kind", "\"hexagonal\"", "the most dots for a distance"),
    follows("pattern.polar_angle_deg", "60 degrees, or 5 less than the wrap limit, or a cap's rim", |k| {
        let rim_deg = k.value("dome.rim_angle_deg").and_then(Value::as_f64).unwrap_or(90.0);
        let angle = (k.n("print.wrap_limit_deg") - 5.0).clamp(5.0, 60.0).min(rim_deg);
        if k.has("pattern.image_radius_px") { None } else { k.number(angle) }
    }),
    follows(
        "pattern.count",
        "170, or as many as dots that take 39 % of the pitch can be printed and seen; none beside a pitch",
        count,
    ),
    follows(
        "pattern.dot_diameter_px",
        "39 % of the pitch, and up to 55 % where the plate's smallest dot asks for it",
        diameter,
    ),
];

/// What the pattern's region comes to in the image.
struct Region {
    /// Area, px^2.
    area_px2: f64,
    /// The most pixels for a millimetre of the plate.
    px_per_mm: f64,
}

fn sensor(k: &Known<'_>) -> Option<SensorOptics> {
    let camera: CameraSection = k.read("camera")?;
    let layers: OpticsSection = k.read("optics")?;
    let dome: DomeSection = k.read("dome")?;
    optics(&camera, &layers, &dome).map_err(|fault| k.wrong(fault.to_string())).ok()
}

fn region(k: &Known<'_>) -> Option<Region> {
    const AROUND: u32 = 16;
    const RINGS: u32 = 6;
    let optics = sensor(k)?;
    let shape = dome(k);
    let asked = k.value("pattern.polar_angle_deg").and_then(Value::as_f64);
    let polar = asked.unwrap_or(60.0).clamp(1.0, 89.0).to_radians().min(shape.sphere_end_rad());
    let pole = match optics.project(shape.center_mm() + sphere_place(shape.radius_mm(), 0.0, 0.0)) {
        Ok(pole) => pole,
        Err(limit) => {
            k.wrong(format!("the dome's pole is not seen: {limit}"));
            return None;
        }
    };
    let (mut square, mut seen, mut px_per_mm) = (0.0, 0.0, 0.0_f64);
    for ring in 0..=RINGS {
        for turn in 0..AROUND {
            let azimuth = std::f64::consts::TAU * f64::from(turn) / f64::from(AROUND);
            let at = polar * f64::from(ring) / f64::from(RINGS);
            let point = sphere_place(shape.radius_mm(), at, azimuth);
            let place = optics.project_with_jacobian(shape.center_mm() + point);
            let Ok((pixel, slope)) = place else { continue };
            // the plate shows the dome from above: a step on it is a step on the dome with its height
            let fall = -point.truncate() / point.z.max(1e-6);
            let by_plate = slope * Matrix3x2::new(1.0, 0.0, 0.0, 1.0, fall.x, fall.y);
            px_per_mm = px_per_mm.max(by_plate.singular_values().max());
            if ring == RINGS {
                square += pixel.distance_squared(pole);
                seen += 1.0;
            }
        }
    }
    if seen == 0.0 || px_per_mm <= 0.0 {
        k.wrong("the edge of the pattern is not seen");
        return None;
    }
    let mut radius_px2 = square / seen;
    if let Some(radius_px) = k.value("pattern.image_radius_px").and_then(Value::as_f64) {
        radius_px2 =
            if asked.is_some() { radius_px2.min(radius_px * radius_px) } else { radius_px * radius_px };
    }
    Some(Region { area_px2: std::f64::consts::PI * radius_px2, px_per_mm })
}

/// Area of a dot's cell over the pitch's square.
fn cell(k: &Known<'_>) -> f64 {
    let square = k.value("pattern.kind").and_then(Value::as_str) == Some("square");
    if square { 1.0 } else { 0.75_f64.sqrt() }
}

/// The smallest dot that can be printed everywhere and seen, px.
fn smallest_px(k: &Known<'_>, region: &Region) -> f64 {
    (1.08 * k.n("print.min_dot_mm") * region.px_per_mm).max(MIN_DOT_PX)
}

fn count(k: &Known<'_>) -> Option<Value> {
    if k.has("pattern.pitch_px") {
        return None;
    }
    let region = region(k)?;
    let pitch_px = smallest_px(k, &region) / SHARE;
    Some(json!((region.area_px2 / (cell(k) * pitch_px * pitch_px)).floor().clamp(7.0, DOTS) as u64))
}

fn diameter(k: &Known<'_>) -> Option<Value> {
    if k.has("pattern.dot_diameter_mm") {
        return None;
    }
    let region = region(k)?;
    let pitch_px = if k.has("pattern.pitch_px") {
        k.n("pattern.pitch_px")
    } else {
        (region.area_px2 / (cell(k) * k.n("pattern.count").max(1.0))).sqrt()
    };
    let wanted = smallest_px(k, &region).clamp(SHARE * pitch_px, MAX_SHARE * pitch_px);
    let rounded = if wanted > SHARE * pitch_px { up(wanted, 0.05) } else { down(wanted, 0.05) };
    k.number(rounded.max(0.05))
}
