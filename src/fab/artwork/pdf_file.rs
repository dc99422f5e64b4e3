//! Drawings as PDF: one page at 1:1, vector, each layer an optional-content group that a viewer can hide.
//!
//! Notes are drawn in strokes, so that no reader can put another font in place of theirs; the words lie over them
//! as invisible text, to be searched and copied.

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use glam::DVec2;
use pdf_writer::types::TextRenderingMode;
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, Str, TextStr};

use super::drawing::{Drawing, Item, Path, PathInk, Segment, Text};
use super::error::RenderError;
use super::strokes;

/// PDF's unit is a point, 1/72 inch.
const POINTS_PER_MM: f64 = 72.0 / 25.4;
/// Height of the capitals of Helvetica over its size (Adobe's metrics).
const CAPITALS: f64 = 0.718;

/// The drawing as a PDF file. Coordinates are written in mm; the page's transform turns them into points.
///
/// # Errors
/// The page's content could not be compressed.
pub fn to_pdf(drawing: &Drawing) -> Result<Vec<u8>, RenderError> {
    let [catalog, pages, page, contents, font, info] = [1, 2, 3, 4, 5, 6].map(Ref::new);
    let groups: Vec<Ref> = (0..drawing.layers.len()).map(|i| Ref::new(7 + i as i32)).collect();
    let size = drawing.size_mm() * POINTS_PER_MM;

    let mut pdf = Pdf::new();
    let mut root = pdf.catalog(catalog);
    root.pages(pages);
    {
        let mut properties = root.insert(Name(b"OCProperties")).dict();
        properties.insert(Name(b"OCGs")).array().items(groups.iter().copied());
        properties.insert(Name(b"D")).dict().insert(Name(b"Order")).array().items(groups.iter().copied());
    }
    root.finish();
    pdf.pages(pages).kids([page]).count(1);
    let mut sheet = pdf.page(page);
    sheet.parent(pages).media_box(Rect::new(0.0, 0.0, size.x as f32, size.y as f32)).contents(contents);
    {
        let mut resources = sheet.resources();
        resources.fonts().pair(Name(b"F1"), font);
        let mut properties = resources.insert(Name(b"Properties")).dict();
        for (i, group) in groups.iter().enumerate() {
            properties.pair(Name(&layer_name(i)), *group);
        }
    }
    sheet.finish();
    pdf.type1_font(font).base_font(Name(b"Helvetica")).encoding_predefined(Name(b"WinAnsiEncoding"));
    pdf.document_info(info)
        .title(TextStr(&drawing.title))
        .subject(TextStr(&drawing.description))
        .creator(TextStr("domecast"));
    for (layer, group) in drawing.layers.iter().zip(&groups) {
        let mut entry = pdf.indirect(*group).dict();
        entry.pair(Name(b"Type"), Name(b"OCG"));
        entry.pair(Name(b"Name"), TextStr(&layer.name));
    }

    let plain = content(drawing).finish();
    let mut packer = ZlibEncoder::new(Vec::new(), Compression::new(6));
    let packed = packer
        .write_all(plain.as_slice())
        .and_then(|()| packer.finish())
        .map_err(|error| RenderError::Encode(error.to_string()))?;
    pdf.stream(contents, &packed).filter(Filter::FlateDecode);
    Ok(pdf.finish())
}

fn layer_name(index: usize) -> Vec<u8> {
    format!("L{index}").into_bytes()
}

fn content(drawing: &Drawing) -> Content {
    let mut content = Content::new();
    let scale = POINTS_PER_MM as f32;
    let shift = drawing.page_mm.0 * -POINTS_PER_MM;
    content.save_state().transform([scale, 0.0, 0.0, scale, shift.x as f32, shift.y as f32]);
    for (i, layer) in drawing.layers.iter().enumerate() {
        content.begin_marked_content_with_properties(Name(b"OC")).properties_named(Name(&layer_name(i)));
        for item in &layer.items {
            match item {
                Item::Path(shape) => {
                    trace(&mut content, &shape.path);
                    match shape.ink {
                        PathInk::Fill => content.fill_nonzero(),
                        PathInk::Line(width_mm) => content.set_line_width(width_mm as f32).stroke(),
                    };
                }
                Item::Text(text) => write(&mut content, text),
            }
        }
        content.end_marked_content();
    }
    content.restore_state();
    content
}

fn xy(p: DVec2) -> (f32, f32) {
    (p.x as f32, p.y as f32)
}

fn trace(content: &mut Content, path: &Path) {
    let (x, y) = xy(path.start());
    content.move_to(x, y);
    for segment in path.segments() {
        match segment {
            Segment::Line(to) => {
                let (x, y) = xy(*to);
                content.line_to(x, y);
            }
            Segment::Cubic(a, b, to) => {
                let ((ax, ay), (bx, by), (x, y)) = (xy(*a), xy(*b), xy(*to));
                content.cubic_to(ax, ay, bx, by, x, y);
            }
        }
    }
    if path.is_closed() {
        content.close_path();
    }
}

fn write(content: &mut Content, text: &Text) {
    content.set_line_width(strokes::pen_mm(text.height_mm) as f32);
    let strokes = strokes::of_text(text);
    for stroke in &strokes {
        for (i, point) in stroke.iter().enumerate() {
            let (x, y) = xy(*point);
            if i == 0 {
                content.move_to(x, y)
            } else {
                content.line_to(x, y)
            };
        }
    }
    content.stroke();
    let Some(first) = strokes.first().and_then(|stroke| stroke.first()) else { return };
    // WinAnsi agrees with ASCII; what lies beyond it has no place in a film's notes.
    let bytes: Vec<u8> = text.words.chars().map(|c| if c.is_ascii() { c as u8 } else { b'?' }).collect();
    let (x, y) = xy(DVec2::new(first.x, text.at.y));
    content
        .begin_text()
        .set_text_rendering_mode(TextRenderingMode::Invisible)
        .set_font(Name(b"F1"), (text.height_mm / CAPITALS) as f32)
        .next_line(x, y)
        .show(Str(&bytes))
        .end_text();
}
