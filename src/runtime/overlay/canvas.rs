//! A frame at twice its size, to draw on in the frame's own pixels.

use glam::DVec2;
use tiny_skia::{Color, FillRule, Paint, PathBuilder, Pixmap, PremultipliedColorU8, Rect, Stroke, Transform};

use crate::track::CameraFrame;

/// Picture pixels for each of the frame's: arrows of a pixel are seen then.
const ZOOM: u32 = 2;
/// No line is longer, and nothing lies farther from the corner, in the frame's pixels: what is drawn has no room for more than 32767.
const MAX_PX: f64 = 8000.0;

/// The picture.
pub(super) struct Canvas {
    pixmap: Pixmap,
    /// Picture pixels across.
    across: usize,
}

impl Canvas {
    /// The frame; `None` where it is too large.
    pub fn new(frame: &CameraFrame<'_>) -> Option<Self> {
        let (width, height) = (frame.width() as u32, frame.height() as u32);
        let pixmap = Pixmap::new(width.checked_mul(ZOOM)?, height.checked_mul(ZOOM)?)?;
        let mut canvas = Self { pixmap, across: (width * ZOOM) as usize };
        let channels = frame.channels();
        canvas.recolor(|x, y, _| {
            let at = (y * width as usize + x) * channels;
            [0, 1, 2].map(|c: usize| frame.bytes().get(at + c % channels).copied().unwrap_or(0))
        });
        Some(canvas)
    }

    /// Gives each pixel of the frame, by column and row, a new colour for the one that it has.
    pub fn recolor(&mut self, color: impl Fn(usize, usize, [u8; 3]) -> [u8; 3]) {
        for (index, to) in self.pixmap.pixels_mut().iter_mut().enumerate() {
            let (x, y) = (index % self.across / ZOOM as usize, index / self.across / ZOOM as usize);
            let [red, green, blue] = color(x, y, [to.red(), to.green(), to.blue()]);
            if let Some(color) = PremultipliedColorU8::from_rgba(red, green, blue, 255) {
                *to = color;
            }
        }
    }

    /// Columns and rows of the frame.
    pub fn size(&self) -> DVec2 {
        DVec2::new(f64::from(self.pixmap.width()), f64::from(self.pixmap.height())) / f64::from(ZOOM)
    }

    fn place(at: DVec2) -> (f32, f32) {
        let zoom = f64::from(ZOOM);
        let at = at.clamp(DVec2::splat(-MAX_PX), DVec2::splat(MAX_PX));
        ((zoom * (at.x + 0.5)) as f32, (zoom * (at.y + 0.5)) as f32)
    }

    fn stroke(&mut self, build: impl FnOnce(&mut PathBuilder), color: [u8; 3], width: f32) {
        let mut builder = PathBuilder::new();
        build(&mut builder);
        // An empty path, or one that is not finite, is nothing to draw.
        let Some(path) = builder.finish() else { return };
        let stroke = Stroke { width, ..Stroke::default() };
        self.pixmap.stroke_path(&path, &paint(color, 255), &stroke, Transform::identity(), None);
    }

    /// A line through points, and back to the first if it is closed; `width` in pixels of the picture.
    pub fn line(&mut self, points: &[DVec2], is_closed: bool, color: [u8; 3], width: f32) {
        self.stroke(
            |path| {
                for (index, (x, y)) in points.iter().map(|at| Self::place(*at)).enumerate() {
                    if index == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
                }
                if is_closed && points.len() > 2 {
                    path.close();
                }
            },
            color,
            width,
        );
    }

    /// An arrow; its head takes at most half of the way.
    pub fn arrow(&mut self, from: DVec2, to: DVec2, color: [u8; 3], width: f32) {
        let along = to - from;
        let length = along.length();
        if !(along.is_finite() && length > 1e-3) {
            return;
        }
        let head = (0.5 * length).min(2.5 + 0.8 * f64::from(width));
        let (unit, side) = (along / length, along.perp() / length);
        let to = from + unit * length.min(MAX_PX);
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

    /// A circle.
    pub fn circle(&mut self, at: DVec2, radius: f64, color: [u8; 3], width: f32) {
        let ((x, y), r) = (Self::place(at), (f64::from(ZOOM) * radius.min(MAX_PX)) as f32);
        self.stroke(|path| path.push_circle(x, y, r), color, width);
    }

    /// A filled box between two corners, its upper left one first.
    pub fn fill(&mut self, low: DVec2, high: DVec2, color: [u8; 3], alpha: u8) {
        let ((left, top), (right, bottom)) = (Self::place(low), Self::place(high));
        if let Some(rect) = Rect::from_ltrb(left, top, right, bottom) {
            let path = PathBuilder::from_rect(rect);
            self.pixmap.fill_path(
                &path,
                &paint(color, alpha),
                FillRule::Winding,
                Transform::identity(),
                None,
            );
        }
    }

    /// The picture as a file.
    pub fn to_png(&self) -> Result<Vec<u8>, String> {
        self.pixmap.encode_png().map_err(|error| error.to_string())
    }
}

fn paint([red, green, blue]: [u8; 3], alpha: u8) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(Color::from_rgba8(red, green, blue, alpha));
    paint.anti_alias = true;
    paint
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_is_drawn_anywhere_is_drawn_or_left_out() {
        let bytes = vec![0; 64 * 48];
        let frame = CameraFrame::new(64, 48, 1, &bytes).expect("a frame");
        let mut canvas = Canvas::new(&frame).expect("a picture");
        let middle = DVec2::new(30.0, 20.0);
        for size in [0.0, 1.0, 1e3, 3e4, 1e5, 1e7, 1e9, 1e12, 1e300, f64::INFINITY, f64::NAN] {
            for k in 0..24 {
                let away = DVec2::from_angle(f64::from(k) * 0.26) * size;
                for width in [1.0, 1.5, 5.0] {
                    canvas.arrow(middle, middle + away, [255, 0, 0], width);
                    canvas.arrow(middle - away, middle, [255, 0, 0], width);
                    canvas.arrow(middle + away, middle + 2.0 * away.perp(), [255, 0, 0], width);
                    canvas.line(&[middle, away, away.perp()], true, [0, 255, 0], width);
                    canvas.circle(middle + away, size, [0, 255, 0], width);
                    canvas.circle(middle, size, [0, 255, 0], width);
                }
                canvas.fill(middle - away.abs(), middle + away.abs(), [0, 0, 255], 9);
            }
        }
        assert!(canvas.to_png().is_ok());
    }
}
