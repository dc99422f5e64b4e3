//! The paper's picture: the frame, a yellow arrow for each dot, the platform's axes, a red arrow for the force.

use glam::{DVec2, DVec3};
use tiny_skia::{Color, Paint, PathBuilder, Pixmap, PremultipliedColorU8, Stroke, Transform};

use super::result::Tracked;
use crate::track::frame::CameraFrame;
use domecast_optics::SensorOptics;
use domecast_springs::Wrench;

/// Picture pixels for each of the frame's: arrows of a pixel are seen then.
const ZOOM: u32 = 2;
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

struct Canvas {
    pixmap: Pixmap,
}

impl Canvas {
    fn place(at: DVec2) -> (f32, f32) {
        let zoom = f64::from(ZOOM);
        ((zoom * (at.x + 0.5)) as f32, (zoom * (at.y + 0.5)) as f32)
    }

    fn stroke(&mut self, build: impl FnOnce(&mut PathBuilder), color: [u8; 3], width: f32) {
        let mut builder = PathBuilder::new();
        build(&mut builder);
        // An empty path, or one that is not finite, is nothing to draw.
        let Some(path) = builder.finish() else { return };
        let mut paint = Paint::default();
        paint.set_color(Color::from_rgba8(color[0], color[1], color[2], 255));
        paint.anti_alias = true;
        let stroke = Stroke { width, ..Stroke::default() };
        self.pixmap.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
    }

    fn arrow(&mut self, from: DVec2, to: DVec2, color: [u8; 3], width: f32) {
        let along = to - from;
        let length = along.length();
        if !(along.is_finite() && length > 1e-3) {
            return;
        }
        // The head takes at most half of the way.
        let head = (0.5 * length).min(2.5 + 0.8 * f64::from(width));
        let (unit, side) = (along / length, along.perp() / length);
        let wing = |sign: f64| to - unit * head + side * (sign * 0.5 * head);
        self.stroke(
            |path| {
                for (a, b) in [(from, to), (wing(1.0), to), (wing(-1.0), to)] {
                    let ((ax, ay), (bx, by)) = (Self::place(a), Self::place(b));
                    path.move_to(ax, ay);
                    path.line_to(bx, by);
                }
            },
            color,
            width,
        );
    }

    fn circle(&mut self, at: DVec2, radius: f64, color: [u8; 3], width: f32) {
        let ((x, y), r) = (Self::place(at), (f64::from(ZOOM) * radius) as f32);
        self.stroke(|path| path.push_circle(x, y, r), color, width);
    }
}

/// A PNG of the frame, at twice its size. Yellow arrows: dots from where the undeformed dome would show them to where
/// they are, `magnify` times as long; small red circles: where lost dots should be; green circles: white markers; red,
/// green and blue lines: the platform's axes; a thick red arrow: the force across the image, 25 px a newton; a red
/// ring around its start: the force along the axis, to the same scale; magenta arrows: `tractions`, places of the deformed skin (sensor frame, mm)
/// with the force on it over its area (N/mm2), 15 mm a N/mm2 into the scene.
///
/// # Errors
/// [`OverlayError`].
pub fn overlay_png(
    frame: &CameraFrame<'_>,
    tracked: &Tracked,
    rest: &SensorOptics,
    magnify: f64,
    tractions: &[(DVec3, DVec3)],
) -> Result<Vec<u8>, OverlayError> {
    let (width, height) = (frame.width() as u32, frame.height() as u32);
    let size = width.checked_mul(ZOOM).zip(height.checked_mul(ZOOM));
    let pixmap = size.and_then(|(w, h)| Pixmap::new(w, h)).ok_or(OverlayError::Size)?;
    let mut canvas = Canvas { pixmap };
    let channels = frame.channels();
    let across = (width * ZOOM) as usize;
    for (index, to) in canvas.pixmap.pixels_mut().iter_mut().enumerate() {
        let (x, y) = (index % across / ZOOM as usize, index / across / ZOOM as usize);
        let at = (y * width as usize + x) * channels;
        let value = |c: usize| frame.bytes().get(at + c % channels).copied().unwrap_or(0);
        if let Some(color) = PremultipliedColorU8::from_rgba(value(0), value(1), value(2), 255) {
            *to = color;
        }
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
            let end_mm = *at_mm + *traction_n_mm2 * MM_PER_N_MM2;
            if let (Ok(from), Ok(to)) = (optics.project_deformed(*at_mm), optics.project_deformed(end_mm)) {
                canvas.arrow(from, to, [255, 60, 255], 2.0);
            }
        }
        if let Some(Wrench { force_n, .. }) = tracked.wrench {
            let camera = rest.rest_from_camera().inverse().vector(force_n);
            canvas.arrow(origin, origin + DVec2::new(camera.x, camera.y) * PX_PER_N, [255, 0, 0], 5.0);
            canvas.circle(origin, (force_n.z.abs() * PX_PER_N).min(2000.0), [255, 0, 0], 2.0);
        }
    }
    canvas.pixmap.encode_png().map_err(|error| OverlayError::Png(error.to_string()))
}
