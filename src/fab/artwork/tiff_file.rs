//! Drawings as 1-bit TIFF at a chosen resolution.
//!
//! A pixel is black where at least half of it lies in the ink. Rows are packed one by one with PackBits, which every
//! reader of baseline TIFF knows. Only a band of rows is held as a picture at a time.

use std::io::Cursor;

use glam::DVec2;
use tiff::encoder::compression::{CompressionAlgorithm, Packbits};
use tiff::encoder::{Rational, TiffEncoder};
use tiff::tags::{CompressionMethod, PhotometricInterpretation, ResolutionUnit, Tag};
use tiny_skia::{FillRule, Mask, PathBuilder, Stroke, Transform};

use super::drawing::{Drawing, InkedPath, Item, Path, PathInk, Segment};
use super::error::RenderError;
use super::strokes;

/// Rows of a band: also the rows of a strip.
const BAND_ROWS: u32 = 256;

/// Widest picture, px; far above any plate, far below what would exhaust memory.
const WIDEST_PX: f64 = 60_000.0;

/// A shape that is to be filled, with the rows that it touches.
struct Inked {
    path: tiny_skia::Path,
    first_row: u32,
    last_row: u32,
}

/// The drawing as a 1-bit TIFF, black ink on white.
///
/// # Errors
/// The picture would be empty or far too large, or the library could not write it.
pub fn to_tiff(drawing: &Drawing, dpi: u32) -> Result<Vec<u8>, RenderError> {
    let per_mm = f64::from(dpi) / 25.4;
    let size = (drawing.size_mm() * per_mm).ceil();
    if !(size.min_element() >= 1.0 && size.max_element() <= WIDEST_PX) {
        return Err(RenderError::Size);
    }
    let (width, height) = (size.x as u32, size.y as u32);
    let corner = DVec2::new(drawing.page_mm.0.x, drawing.page_mm.1.y);
    let to_px = |p: DVec2| {
        let px = (p - corner) * per_mm;
        DVec2::new(px.x, -px.y)
    };
    let inked = ink(drawing, per_mm, &to_px);

    let fault = |error: tiff::TiffError| RenderError::Encode(error.to_string());
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).map_err(fault)?;
    let mut directory = encoder.image_directory().map_err(fault)?;
    let (mut offsets, mut counts) = (Vec::new(), Vec::new());
    // Shapes in the order of their first rows, so that each band looks only at what can touch it.
    let mut order: Vec<usize> = (0..inked.len()).collect();
    order.sort_by_key(|i| (inked[*i].first_row, *i));
    let mut waiting = order.into_iter().peekable();
    let mut active: Vec<usize> = Vec::new();
    for top in (0..height).step_by(BAND_ROWS as usize) {
        let rows = BAND_ROWS.min(height - top);
        while let Some(i) = waiting.next_if(|i| inked[*i].first_row < top + rows) {
            active.push(i);
        }
        active.retain(|i| inked[*i].last_row >= top);
        let mut mask = Mask::new(width, rows).ok_or(RenderError::Size)?;
        for i in &active {
            let shift = Transform::from_translate(0.0, -(top as f32));
            mask.fill_path(&inked[*i].path, FillRule::Winding, true, shift);
        }
        let packed = pack(mask.data(), width as usize)?;
        counts.push(u32::try_from(packed.len()).map_err(|_| RenderError::Size)?);
        let offset = directory.write_data(packed.as_slice()).map_err(fault)?;
        offsets.push(u32::try_from(offset).map_err(|_| RenderError::Size)?);
    }
    directory.write_tag(Tag::ImageWidth, width).map_err(fault)?;
    directory.write_tag(Tag::ImageLength, height).map_err(fault)?;
    directory.write_tag(Tag::BitsPerSample, 1u16).map_err(fault)?;
    directory.write_tag(Tag::SamplesPerPixel, 1u16).map_err(fault)?;
    directory.write_tag(Tag::Compression, CompressionMethod::PackBits.to_u16()).map_err(fault)?;
    directory
        .write_tag(Tag::PhotometricInterpretation, PhotometricInterpretation::WhiteIsZero.to_u16())
        .map_err(fault)?;
    directory.write_tag(Tag::RowsPerStrip, BAND_ROWS).map_err(fault)?;
    directory.write_tag(Tag::StripOffsets, offsets.as_slice()).map_err(fault)?;
    directory.write_tag(Tag::StripByteCounts, counts.as_slice()).map_err(fault)?;
    directory.write_tag(Tag::XResolution, Rational { n: dpi, d: 1 }).map_err(fault)?;
    directory.write_tag(Tag::YResolution, Rational { n: dpi, d: 1 }).map_err(fault)?;
    directory.write_tag(Tag::ResolutionUnit, ResolutionUnit::Inch.to_u16()).map_err(fault)?;
    let description: String = drawing.description.chars().filter(char::is_ascii).collect();
    directory.write_tag(Tag::ImageDescription, description.as_str()).map_err(fault)?;
    directory.finish().map_err(fault)?;
    Ok(bytes.into_inner())
}

/// One bit a pixel, each row packed by itself.
fn pack(coverage: &[u8], width: usize) -> Result<Vec<u8>, RenderError> {
    let mut packed = Vec::new();
    let mut row_bytes = vec![0u8; width.div_ceil(8)];
    for row in coverage.chunks_exact(width) {
        for (byte, pixels) in row_bytes.iter_mut().zip(row.chunks(8)) {
            // Nearly all of a film is white.
            *byte = match <[u8; 8]>::try_from(pixels).map(u64::from_le_bytes) {
                Ok(0) => 0,
                Ok(u64::MAX) => 0xff,
                _ => {
                    pixels.iter().enumerate().fold(0, |bits, (i, c)| bits | (u8::from(*c >= 128) << (7 - i)))
                }
            };
        }
        Packbits.write_to(&mut packed, &row_bytes).map_err(|error| RenderError::Encode(error.to_string()))?;
    }
    Ok(packed)
}

fn ink(drawing: &Drawing, per_mm: f64, to_px: &impl Fn(DVec2) -> DVec2) -> Vec<Inked> {
    let mut inked = Vec::new();
    let mut add = |path: Option<tiny_skia::Path>| {
        if let Some(path) = path {
            let bounds = path.bounds();
            let row = |y: f32| y.clamp(0.0, 1e9) as u32;
            let (first_row, last_row) = (row(bounds.top() - 1.0), row(bounds.bottom() + 1.0));
            inked.push(Inked { path, first_row, last_row });
        }
    };
    for item in drawing.layers.iter().flat_map(|layer| &layer.items) {
        match item {
            Item::Path(InkedPath { path, ink: PathInk::Fill, .. }) => add(pixels(path, to_px)),
            Item::Path(InkedPath { path, ink: PathInk::Line(width_mm), .. }) => {
                add(pixels(path, to_px).and_then(|path| stroked(&path, width_mm * per_mm)));
            }
            Item::Text(text) => {
                for line in strokes::of_text(text) {
                    let pen = strokes::pen_mm(text.height_mm) * per_mm;
                    add(Path::polyline(&line, false)
                        .ok()
                        .and_then(|path| pixels(&path, to_px))
                        .and_then(|path| stroked(&path, pen)));
                }
            }
        }
    }
    inked
}

fn stroked(path: &tiny_skia::Path, width_px: f64) -> Option<tiny_skia::Path> {
    let stroke = Stroke { width: width_px as f32, ..Stroke::default() };
    path.stroke(&stroke, 1.0)
}

fn pixels(path: &Path, to_px: &impl Fn(DVec2) -> DVec2) -> Option<tiny_skia::Path> {
    let xy = |p: DVec2| {
        let px = to_px(p);
        (px.x as f32, px.y as f32)
    };
    let mut builder = PathBuilder::new();
    let (x, y) = xy(path.start());
    builder.move_to(x, y);
    for segment in path.segments() {
        match segment {
            Segment::Line(to) => {
                let (x, y) = xy(*to);
                builder.line_to(x, y);
            }
            Segment::Cubic(a, b, to) => {
                let ((ax, ay), (bx, by), (x, y)) = (xy(*a), xy(*b), xy(*to));
                builder.cubic_to(ax, ay, bx, by, x, y);
            }
        }
    }
    if path.is_closed() {
        builder.close();
    }
    builder.finish()
}
