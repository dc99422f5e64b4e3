//! What the camera will see, as a picture of the raw image's size.

use std::f64::consts::TAU;

use glam::DVec2;
use tiny_skia::Pixmap;

use super::canvas::{color, fill, fill_outline, stroke};
use super::error::RenderError;
use domecast_design::layout::frame::EvenFrame;
use domecast_design::layout::{Layout, LayoutSpec, region};
use domecast_design::sections::EvenIn;

const AROUND: [u8; 3] = [58, 58, 62];
const MEMBRANE: [u8; 3] = [205, 205, 200];
const DOT: [u8; 3] = [10, 10, 10];
const MARKER: [u8; 3] = [255, 255, 255];
const MASK: [u8; 3] = [230, 110, 20];

/// Corners of curves that are carried into the image.
const CORNERS: u32 = 360;

/// The dots as the camera will see them at rest: the membrane light, the dots and the white markers where the
/// raw image shows them, the runtime's mask and the outline of the dot that is left out as coloured lines. A PNG of the raw image's size; the centre of
/// the top-left pixel is (0, 0).
///
/// # Errors
/// The image has no size that can be drawn, or the PNG could not be written.
pub fn camera_view(spec: &LayoutSpec, layout: &Layout) -> Result<Vec<u8>, RenderError> {
    let optics = &spec.optics;
    let lens = optics.lens().spec();
    let mut picture = Pixmap::new(lens.width, lens.height).ok_or(RenderError::Size)?;
    picture.fill(color(AROUND));

    let raw = EvenFrame::new(optics.lens(), EvenIn::Raw, spec.undistorted);
    let pole = optics.project(optics.dome().pole_mm());
    if let Ok(center) = pole
        && let Ok(rim) = region::parallel(optics, &raw, center, optics.dome().meridian_end_rad())
    {
        let corners: Vec<DVec2> = rim.boundary.polygon().into_iter().map(|p| center + p).collect();
        fill(&mut picture, &corners, MEMBRANE);
    }
    for dot in &layout.dots {
        fill_outline(&mut picture, &dot.image_outline, DOT);
    }
    if let Some(key) = &layout.key {
        stroke(&mut picture, &key.dot.image_outline.polygon(8), true, 1.0, MASK);
    }
    for marker in &spec.white_markers {
        let rim = around().map(|out| {
            optics.project(marker.position_mm + (out * (0.5 * marker.diameter_mm)).extend(0.0)).ok()
        });
        // A marker that is seen in part only is left out: the design's own checks speak of it.
        if let Some(corners) = rim.collect::<Option<Vec<_>>>() {
            fill(&mut picture, &corners, MARKER);
        }
    }
    if let Some(mask) = &spec.mask {
        let undistorted = EvenFrame::new(optics.lens(), EvenIn::Undistorted, spec.undistorted);
        let corners: Vec<DVec2> = around()
            .filter_map(|out| undistorted.raw_from_even(mask.center_px + out * mask.radius_px).ok())
            .collect();
        stroke(&mut picture, &corners, true, 1.0, MASK);
    }
    picture.encode_png().map_err(|error| RenderError::Encode(error.to_string()))
}

fn around() -> impl Iterator<Item = DVec2> {
    (0..CORNERS).map(|k| DVec2::from_angle(TAU * f64::from(k) / f64::from(CORNERS)))
}
