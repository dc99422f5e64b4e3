//! Pictures of the lit sensor: the frame itself, and how even the dome is.

use glam::DVec2;
use tiny_skia::{IntSize, Pixmap};

use super::levels::{FULL, LightReport};
use super::rest::{STEP_PX, fault, luma};
use crate::artwork::canvas::{color, fill};
use domecast_design::{Design, DesignError};
use domecast_sim::light::RestLight;
use domecast_sim::{Plan, Renderer, Scene};

/// Colours of the map from no light over the median to twice that.
const SCALE: [[u8; 3]; 5] = [[20, 20, 60], [60, 90, 190], [235, 235, 230], [240, 160, 60], [200, 40, 30]];
const AROUND: [u8; 3] = [58, 58, 62];

/// Why a picture could not be coded: its size, as a rule.
fn picture_fault(problem: impl ToString) -> DesignError {
    DesignError::at("camera", "", problem.to_string(), "an image size that can be drawn")
}

/// The frame at rest with every effect that the scene calls for, as PNG.
pub(super) fn frame(scene: &Scene) -> Result<Vec<u8>, DesignError> {
    let plan = Plan::everything(scene).map_err(fault)?;
    let drawn = Renderer::new(scene, &plan).and_then(|renderer| renderer.frame(0)).map_err(fault)?;
    let image = drawn.image.ok_or_else(|| picture_fault("the frame is not drawn"))?;
    let opaque = match image.channels {
        3 => image.bytes.chunks_exact(3).flat_map(|c| [c[0], c[1], c[2], 255]).collect(),
        _ => image.bytes.iter().flat_map(|v| [*v, *v, *v, 255]).collect(),
    };
    let size = u32::try_from(image.width).ok().zip(u32::try_from(image.height).ok());
    let size = size.and_then(|(width, height)| IntSize::from_wh(width, height));
    let picture = size.and_then(|size| Pixmap::from_vec(opaque, size));
    picture.ok_or_else(|| picture_fault("the frame has no size"))?.encode_png().map_err(picture_fault)
}

/// Grey level of the dome over its median: dark blue is no light, white the median, red twice the median and more.
pub(super) fn map(design: &Design, light: &RestLight, report: &LightReport) -> Result<Vec<u8>, DesignError> {
    let lens = design.optics().lens().spec();
    let mut picture =
        Pixmap::new(lens.width, lens.height).ok_or_else(|| picture_fault("the map has no size"))?;
    picture.fill(color(AROUND));
    // A little over half: no seams between the squares.
    let half = 0.5 * f64::from(STEP_PX) + 0.3;
    for place in &light.dome {
        let level = FULL * luma(place.level) * report.level_per_mw_mm2;
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let corners = corners.map(|corner| place.image_px + half * DVec2::from(corner));
        fill(&mut picture, &corners, shade(level / report.dome.median_level));
    }
    picture.encode_png().map_err(picture_fault)
}

/// The colour of a level over the median.
fn shade(part: f64) -> [u8; 3] {
    let place = (2.0 * part).clamp(0.0, (SCALE.len() - 1) as f64);
    let low = (place as usize).min(SCALE.len() - 2);
    let share = place - low as f64;
    std::array::from_fn(|c| {
        let [from, to] = [SCALE[low][c], SCALE[low + 1][c]].map(f64::from);
        (from + share * (to - from)).round() as u8
    })
}
