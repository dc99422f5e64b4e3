//! Drawings as DXF: polylines in millimetres, y up, one layer for each layer.
//!
//! Curves become polygons within the drawing's tolerance, grown so that they enclose the outline's own area: an
//! inscribed polygon would print a smaller dot.

use domecast_mesh::{DxfFile, DxfText, DxfVertex};

use super::drawing::{Anchor, Drawing, Item, PathInk};

/// Black on white.
const COLOR: u8 = 7;

/// The drawing as a DXF file, its curves within `tolerance_mm`.
pub fn to_dxf(drawing: &Drawing, tolerance_mm: f64) -> Vec<u8> {
    let layers: Vec<(&str, u8)> = drawing.layers.iter().map(|layer| (layer.name.as_str(), COLOR)).collect();
    let mut file = DxfFile::new(&layers);
    for layer in &drawing.layers {
        for item in &layer.items {
            match item {
                Item::Path(shape) => {
                    let width_mm = match shape.ink {
                        PathInk::Fill => 0.0,
                        PathInk::Line(width_mm) => width_mm,
                    };
                    let corners = shape.path.polygon(tolerance_mm);
                    let vertices: Vec<DxfVertex> =
                        corners.into_iter().map(|at_mm| DxfVertex { at_mm, bulge: 0.0 }).collect();
                    file.polyline(&layer.name, &vertices, shape.path.is_closed(), width_mm);
                }
                Item::Text(text) => file.text(
                    &layer.name,
                    &DxfText {
                        at_mm: text.at,
                        height_mm: text.height_mm,
                        is_centered: text.anchor == Anchor::Middle,
                        words: &text.words,
                    },
                ),
            }
        }
    }
    file.finish().into_bytes()
}
