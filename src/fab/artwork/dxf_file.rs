//! Drawings as DXF: polylines in millimetres, y up, one layer for each layer.
//!
//! Release 2000, the oldest that states its unit, is what cutters and engravers read. Curves become polygons
//! within the drawing's tolerance, grown so that they enclose the outline's own area: an inscribed polygon
//! would print a smaller dot.

use dxf::entities::{Entity, EntityType, LwPolyline, Text as DxfText};
use dxf::enums::{AcadVersion, DrawingUnits, HorizontalTextJustification, Units};
use dxf::tables::Layer as DxfLayer;
use dxf::{LwPolylineVertex, Point};
use glam::DVec2;

use super::RenderError;
use super::drawing::{Anchor, Drawing, Ink, Item, Path, Text};

/// The drawing as a DXF file, its curves within `tolerance_mm`.
///
/// # Errors
/// The library could not write the file.
pub fn to_dxf(drawing: &Drawing, tolerance_mm: f64) -> Result<Vec<u8>, RenderError> {
    let mut file = dxf::Drawing::new();
    file.header.version = AcadVersion::R2000;
    file.header.drawing_units = DrawingUnits::Metric;
    file.header.default_drawing_units = Units::Millimeters;
    for layer in &drawing.layers {
        file.add_layer(DxfLayer { name: layer.name.clone(), ..DxfLayer::default() });
        for item in &layer.items {
            let kind = match item {
                Item::Shape(shape) => {
                    let width_mm = match shape.ink {
                        Ink::Fill => 0.0,
                        Ink::Line(width_mm) => width_mm,
                    };
                    polyline(&shape.path, width_mm, tolerance_mm)
                }
                Item::Text(text) => words(text),
            };
            let mut entity = Entity::new(kind);
            entity.common.layer.clone_from(&layer.name);
            file.add_entity(entity);
        }
    }
    let mut bytes = Vec::new();
    file.save(&mut bytes).map_err(|error| RenderError::Encode(error.to_string()))?;
    Ok(without_chance(&bytes))
}

fn polyline(path: &Path, width_mm: f64, tolerance_mm: f64) -> EntityType {
    let vertex = |p: DVec2| LwPolylineVertex { x: p.x, y: p.y, ..LwPolylineVertex::default() };
    EntityType::LwPolyline(LwPolyline {
        flags: i32::from(path.is_closed()),
        constant_width: width_mm,
        vertices: path.polygon(tolerance_mm).into_iter().map(vertex).collect(),
        ..LwPolyline::default()
    })
}

fn words(text: &Text) -> EntityType {
    let at = Point::new(text.at.x, text.at.y, 0.0);
    EntityType::Text(DxfText {
        location: at.clone(),
        second_alignment_point: at,
        text_height: text.height_mm,
        value: text.words.clone(),
        horizontal_text_justification: match text.anchor {
            Anchor::Start => HorizontalTextJustification::Left,
            Anchor::Middle => HorizontalTextJustification::Center,
        },
        ..DxfText::default()
    })
}

/// Header variables that the library sets from the clock and from chance.
const BY_CHANCE: [&[u8]; 6] =
    [b"$TDCREATE", b"$TDUPDATE", b"$TDUCREATE", b"$TDUUPDATE", b"$FINGERPRINTGUID", b"$VERSIONGUID"];

/// Leaves out what is not the design's: the same design gives the same bytes. A header variable is four lines:
/// 9, its name, a code, a value.
fn without_chance(bytes: &[u8]) -> Vec<u8> {
    let mut kept = Vec::with_capacity(bytes.len());
    let mut lines = bytes.split_inclusive(|byte| *byte == b'\n').peekable();
    while let Some(line) = lines.next() {
        let by_chance = line.trim_ascii() == b"9"
            && lines.peek().is_some_and(|name| BY_CHANCE.contains(&name.trim_ascii()));
        if by_chance {
            for _ in 0..3 {
                lines.next();
            }
        } else {
            kept.extend_from_slice(line);
        }
    }
    kept
}
