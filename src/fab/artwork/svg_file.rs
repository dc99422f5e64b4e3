//! Drawings as SVG: true millimetres, one Inkscape layer for each layer.
//!
//! One user unit is one millimetre. SVG's y runs down, the drawing's up: a point (x, y) of the drawing is
//! written as (x, -y), and nothing else is changed, so that a reader gets the drawing's coordinates back by
//! turning one sign.
//!
//! Notes are drawn in strokes, so that they look alike without any font; each line carries its words as a title,
//! which readers show and programs can search.

use std::fmt::Write;

use svg::Document;
use svg::node::element::{Description, Group, Path as SvgPath, Title};
use svg::node::{Node, Value};

use super::drawing::{Drawing, InkedPath, Item, Layer, Path, PathInk, Segment, Text};
use super::strokes;
use domecast_mesh::number::rounded;

/// The drawing as an SVG file.
pub fn to_svg(drawing: &Drawing) -> Vec<u8> {
    let (low, _) = drawing.page_mm;
    let size = drawing.size_mm();
    let mut document = Document::new()
        .set("xmlns:inkscape", "http://www.inkscape.org/namespaces/inkscape")
        .set("width", format!("{}mm", number(size.x)))
        .set("height", format!("{}mm", number(size.y)))
        .set(
            "viewBox",
            format!(
                "{} {} {} {}",
                number(low.x),
                number(-drawing.page_mm.1.y),
                number(size.x),
                number(size.y)
            ),
        );
    for (name, value) in &drawing.facts {
        document.assign(format!("data-{name}"), value.as_str());
    }
    document.append(Title::new(drawing.title.as_str()));
    document.append(Description::new().add(svg::node::Text::new(drawing.description.as_str())));
    for layer in &drawing.layers {
        document.append(group(layer));
    }
    let mut bytes = b"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".to_vec();
    bytes.extend_from_slice(document.to_string().as_bytes());
    bytes.push(b'\n');
    bytes
}

fn group(layer: &Layer) -> Group {
    let mut group = Group::new()
        .set("id", layer.name.as_str())
        .set("inkscape:groupmode", "layer")
        .set("inkscape:label", layer.name.as_str());
    for item in &layer.items {
        match item {
            Item::Path(shape) => group.append(path(shape)),
            Item::Text(line) => group.append(text(line)),
        }
    }
    group
}

fn path(shape: &InkedPath) -> SvgPath {
    let mut path = SvgPath::new().set("d", path_data(&shape.path));
    if !shape.id.is_empty() {
        path.assign("id", shape.id.as_str());
    }
    for (name, value) in &shape.facts {
        path.assign(format!("data-{name}"), value.as_str());
    }
    match shape.ink {
        PathInk::Fill => path.assign("fill", "#000000"),
        PathInk::Line(width_mm) => {
            path.assign("fill", "none");
            path.assign("stroke", "#000000");
            path.assign("stroke-width", number(width_mm));
        }
    }
    path
}

/// A line of text: one path of strokes.
fn text(line: &Text) -> SvgPath {
    let mut data = String::new();
    for stroke in strokes::of_text(line) {
        let mut command = 'M';
        for point in stroke {
            let _ = write!(data, "{command}{},{}", number(point.x), number(-point.y));
            command = 'L';
        }
    }
    SvgPath::new()
        .set("class", "note")
        .set("d", data)
        .set("fill", "none")
        .set("stroke", "#000000")
        .set("stroke-width", number(strokes::pen_mm(line.height_mm)))
        .add(Title::new(line.words.as_str()))
}

fn path_data(path: &Path) -> Value {
    let mut data = String::new();
    let mut put = |command: char, points: &[glam::DVec2]| {
        let _ = write!(data, "{command}");
        for (i, point) in points.iter().enumerate() {
            let _ = write!(data, "{}{},{}", if i == 0 { "" } else { " " }, number(point.x), number(-point.y));
        }
    };
    put('M', &[path.start()]);
    for segment in path.segments() {
        match segment {
            Segment::Line(to) => put('L', &[*to]),
            Segment::Cubic(a, b, to) => put('C', &[*a, *b, *to]),
        }
    }
    if path.is_closed() {
        put('Z', &[]);
    }
    Value::from(data)
}

/// A number with as many digits as a nanometre needs, and no more.
fn number(x: f64) -> String {
    rounded(x, 6)
}
