//! Drawing into a picture in px, the centre of the top-left pixel at (0, 0).

use glam::DVec2;
use tiny_skia::{Color, FillRule, Paint, PathBuilder, Pixmap, Stroke, Transform};

use domecast_design::layout::outline::Outline;

/// An opaque colour.
pub fn color([r, g, b]: [u8; 3]) -> Color {
    Color::from_rgba8(r, g, b, 255)
}

fn paint(rgb: [u8; 3]) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(color(rgb));
    paint.anti_alias = true;
    paint
}

/// Pixel centres lie half a pixel inside the canvas.
fn canvas(p: DVec2) -> (f32, f32) {
    ((p.x + 0.5) as f32, (p.y + 0.5) as f32)
}

fn run(corners: &[DVec2], close: bool) -> Option<tiny_skia::Path> {
    let mut builder = PathBuilder::new();
    for (i, corner) in corners.iter().enumerate() {
        let (x, y) = canvas(*corner);
        if i == 0 { builder.move_to(x, y) } else { builder.line_to(x, y) }
    }
    if close {
        builder.close();
    }
    builder.finish()
}

/// Fills a polygon; corners in px.
pub fn fill(picture: &mut Pixmap, corners: &[DVec2], rgb: [u8; 3]) {
    if let Some(path) = run(corners, true) {
        picture.fill_path(&path, &paint(rgb), FillRule::Winding, Transform::identity(), None);
    }
}

/// The same with hard edges: neighbours that share an edge leave no seam, and a picture of few colours packs well.
pub fn fill_hard(picture: &mut Pixmap, corners: &[DVec2], rgb: [u8; 3]) {
    if let Some(path) = run(corners, true) {
        let paint = Paint { anti_alias: false, ..paint(rgb) };
        picture.fill_path(&path, &paint, FillRule::Winding, Transform::identity(), None);
    }
}

/// Draws a line through corners in px.
pub fn stroke(picture: &mut Pixmap, corners: &[DVec2], close: bool, width_px: f32, rgb: [u8; 3]) {
    if let Some(path) = run(corners, close) {
        let stroke = Stroke { width: width_px, ..Stroke::default() };
        picture.stroke_path(&path, &paint(rgb), &stroke, Transform::identity(), None);
    }
}

/// Fills a smooth outline, in px.
pub fn fill_outline(picture: &mut Pixmap, outline: &Outline, rgb: [u8; 3]) {
    let mut builder = PathBuilder::new();
    let (x, y) = canvas(outline.start());
    builder.move_to(x, y);
    for piece in outline.pieces() {
        let [(ax, ay), (bx, by), (x, y)] = piece.map(canvas);
        builder.cubic_to(ax, ay, bx, by, x, y);
    }
    builder.close();
    if let Some(path) = builder.finish() {
        picture.fill_path(&path, &paint(rgb), FillRule::Winding, Transform::identity(), None);
    }
}
