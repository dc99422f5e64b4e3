//! The printed dome seen from outside, straight from above: what to compare the part with.

use std::f64::consts::TAU;

use glam::DVec2;
use tiny_skia::Pixmap;

use super::canvas::{color, fill, stroke};
use super::error::RenderError;
use super::strokes;
use domecast_design::layout::Layout;

/// Side of the picture, px.
const SIDE_PX: u32 = 900;
/// Radius of the dome in the picture, px.
const DOME_PX: f64 = 380.0;
const GROUND: [u8; 3] = [245, 245, 243];
const MEMBRANE: [u8; 3] = [205, 205, 200];
const LINE: [u8; 3] = [120, 120, 120];
/// The first pass's dots are black, those of the others coloured, so that the shares can be distinguished.
const PASS_COLORS: [[u8; 3]; 6] =
    [[10, 10, 10], [160, 30, 30], [25, 90, 160], [30, 120, 50], [140, 80, 10], [110, 40, 130]];

/// The dome from above, y up, as a PNG: the dots where the pad lays them by the design's map.
///
/// # Errors
/// The PNG could not be written.
pub fn outside_view(layout: &Layout) -> Result<Vec<u8>, RenderError> {
    let mut picture = Pixmap::new(SIDE_PX, SIDE_PX).ok_or(RenderError::Size)?;
    picture.fill(color(GROUND));
    let middle = DVec2::splat(0.5 * f64::from(SIDE_PX - 1));
    let scale = DOME_PX / layout.dome.rim_radius_mm();
    let px = |p_mm: DVec2| middle + DVec2::new(p_mm.x, -p_mm.y) * scale;
    let circle = |radius_mm: f64| -> Vec<DVec2> {
        (0..360).map(|k| px(DVec2::from_angle(TAU * f64::from(k) / 360.0) * radius_mm)).collect()
    };
    let dome = &layout.dome;
    let radius_mm = dome.radius_mm();
    fill(&mut picture, &circle(dome.rim_radius_mm()), MEMBRANE);
    let end_deg = dome.sphere_end_rad().to_degrees();
    for polar_deg in [30.0, 60.0, 90.0f64].map(|deg| deg.min(end_deg)) {
        stroke(&mut picture, &circle(radius_mm * polar_deg.to_radians().sin()), true, 1.0, LINE);
    }
    for dot in &layout.dots {
        let Some(pass) = layout.passes.get(dot.pass) else { continue };
        let sensor_from_pass = pass.pass_from_sensor.transpose();
        let corners: Option<Vec<DVec2>> = dot
            .plate_outline
            .polygon(6)
            .into_iter()
            .map(|p| layout.transfer.dome_from_plate(p).ok())
            .map(|point| point.map(|point| px((sensor_from_pass * point).truncate())))
            .collect();
        // Every dot of a layout came over the map and goes back.
        if let Some(corners) = corners {
            fill(&mut picture, &corners, PASS_COLORS[dot.pass % PASS_COLORS.len()]);
        }
    }
    let mut words = |text: &str, at: DVec2, height_px: f64| {
        for line in strokes::strokes(text, DVec2::ZERO, height_px) {
            let points: Vec<DVec2> = line.iter().map(|p| at + DVec2::new(p.x, -p.y)).collect();
            stroke(&mut picture, &points, false, 1.5, LINE);
        }
    };
    words("seen from outside", DVec2::new(20.0, 36.0), 16.0);
    let circles = if end_deg < 90.0 {
        "circles: 30, 60 deg from the pole; rim"
    } else {
        "circles: 30, 60, 90 deg from the pole"
    };
    words(circles, DVec2::new(20.0, 884.0), 12.0);
    words("x", DVec2::new(872.0, 456.0), 14.0);
    words("y", DVec2::new(444.0, 40.0), 14.0);
    picture.encode_png().map_err(|error| RenderError::Encode(error.to_string()))
}
