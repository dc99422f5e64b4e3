//! The paper's picture, all three modalities in one: the frame, a yellow arrow for each dot, the platform's axes, a red arrow for the
//! force, and the skin's depth as colours.
//!
//! Of the feature `overlay`: for people who look, not for robots.
//!
//! ```
//! use domecast_runtime::overlay::{VIRIDIS, depth_range_mm, viridis};
//!
//! let range_mm = depth_range_mm(0.43);
//! assert_eq!(range_mm, 0.5);
//! assert_eq!(viridis(0.25 / range_mm), VIRIDIS[2]);
//! ```

mod canvas;
mod color_map;
mod skin;

use glam::{DVec2, DVec3};

use crate::shape::ShapeMap;
use crate::track::{CameraFrame, Tracked};
use canvas::Canvas;
use domecast_optics::SensorOptics;
use domecast_springs::Wrench;
use skin::{draw_scale, draw_skin};

pub use color_map::{VIRIDIS, depth_range_mm, viridis};

/// Length of the drawn axes, mm.
const AXIS_MM: f64 = 4.0;
/// Length of a traction's arrow on the skin for each N/mm2, mm.
const MM_PER_N_MM2: f64 = 15.0;
/// Pixels of the frame for each newton.
const PX_PER_N: f64 = 25.0;

/// Why there is no picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OverlayError {
    /// The frame is too large to draw.
    Size,
    /// The picture could not be coded.
    Png(String),
}

impl std::fmt::Display for OverlayError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Size => write!(f, "the frame is too large to draw"),
            Self::Png(why) => write!(f, "the picture could not be coded ({why})"),
        }
    }
}

impl std::error::Error for OverlayError {}

/// What is drawn beside what the tracker says.
#[derive(Debug, Clone, Copy)]
pub struct OverlayLayers<'a> {
    /// How many times as long as they are the arrows of the dots are drawn.
    pub magnify: f64,
    /// Places of the deformed skin (sensor frame, mm) with the force on it over its area (N/mm2).
    pub tractions: &'a [(DVec3, DVec3)],
    /// The skin of this frame, and the depth at the end of the colours, mm: [`depth_range_mm`] of the deepest place.
    pub skin: Option<(&'a ShapeMap, f64)>,
}

impl Default for OverlayLayers<'_> {
    fn default() -> Self {
        Self { magnify: 1.0, tractions: &[], skin: None }
    }
}

/// The arrow of a force on the skin in the frame, px: 15 mm a N/mm2 into the scene, from a place of the deformed skin (sensor frame,
/// mm). `optics` stand where the platform is. `None` where the camera does not see an end of it.
pub fn traction_arrow_px(optics: &SensorOptics, at_mm: DVec3, traction_n_mm2: DVec3) -> Option<[DVec2; 2]> {
    let end_mm = at_mm + traction_n_mm2 * MM_PER_N_MM2;
    Some([optics.project_deformed(at_mm).ok()?, optics.project_deformed(end_mm).ok()?])
}

/// A PNG of the frame, at twice its size. Yellow arrows: dots from where the undeformed dome would show them to where
/// they are, `magnify` times as long; small red circles: where lost dots should be; green circles: white markers; red,
/// green and blue lines: the platform's axes; a thick red arrow: the force across the image, 25 px a newton; a red
/// ring around its start: the force along the axis, to the same scale; magenta arrows: tractions, 15 mm a N/mm2 into the scene. With
/// a skin: its depth in the colours of [`viridis`], dark where it is hardly pressed in and yellow at the end of the scale in the lower right corner (mm);
/// a white line around what touches.
///
/// # Errors
/// [`OverlayError`].
pub fn overlay_png(
    frame: &CameraFrame<'_>,
    tracked: &Tracked,
    rest: &SensorOptics,
    layers: &OverlayLayers<'_>,
) -> Result<Vec<u8>, OverlayError> {
    let OverlayLayers { magnify, tractions, skin } = *layers;
    let mut canvas = Canvas::new(frame).ok_or(OverlayError::Size)?;
    if let Some((map, range_mm)) = skin {
        draw_skin(&mut canvas, map, range_mm);
    }
    for dot in &tracked.black_dots {
        match (dot.undeformed_px, dot.image_px) {
            (Some(from), Some(now)) => {
                canvas.arrow(from, from + (now - from) * magnify, [255, 220, 0], 1.5);
                canvas.circle(now, 0.6, [255, 220, 0], 1.0);
            }
            (Some(at), None) => canvas.circle(at, 3.0, [230, 30, 30], 1.0),
            _ => {}
        }
    }
    for marker in &tracked.white_markers {
        if let Some(at) = marker.centroid_px {
            canvas.circle(at, 7.0, [40, 200, 80], 1.5);
        }
    }
    if let Some(pose) = tracked.pose
        && let Ok(optics) = rest.at_pose(&pose)
        && let Ok(origin) = optics.project(DVec3::ZERO)
    {
        let axes = [(DVec3::X, [230, 60, 60]), (DVec3::Y, [60, 200, 60]), (DVec3::Z, [80, 120, 255])];
        for (axis, color) in axes {
            if let Ok(end) = optics.project(axis * AXIS_MM) {
                canvas.arrow(origin, end, color, 1.5);
            }
        }
        for (at_mm, traction_n_mm2) in tractions {
            if let Some([from, to]) = traction_arrow_px(&optics, *at_mm, *traction_n_mm2) {
                canvas.arrow(from, to, [255, 60, 255], 2.0);
            }
        }
        if let Some(Wrench { force_n, .. }) = tracked.wrench {
            let camera = rest.rest_from_camera().inverse().vector(force_n);
            canvas.arrow(origin, origin + DVec2::new(camera.x, camera.y) * PX_PER_N, [255, 0, 0], 5.0);
            canvas.circle(origin, (force_n.z.abs() * PX_PER_N).min(2000.0), [255, 0, 0], 2.0);
        }
    }
    if let Some((_, range_mm)) = skin {
        draw_scale(&mut canvas, range_mm);
    }
    canvas.to_png().map_err(OverlayError::Png)
}
