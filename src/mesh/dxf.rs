//! Drawings as DXF: lines, circles, polylines and text on layers, in millimetres.
//!
//! Release 2000 (`AC1015`) is the oldest that states its unit; cutters, engravers and every CAD program read it. A
//! file holds the tables and blocks that the release asks for, with handles counted from one, no time stamp and
//! nothing by chance: the same drawing gives the same bytes.
//!
//! ```
//! use domecast_mesh::{DxfFile, DxfText};
//! use glam::DVec2;
//! let mut file = DxfFile::new(&[("CUT", 1), ("NOTES", 8)]);
//! file.circle("CUT", DVec2::ZERO, 5.0);
//! file.line("NOTES", DVec2::new(-5.0, -7.0), DVec2::new(5.0, -7.0));
//! file.text("NOTES", &DxfText { at_mm: DVec2::new(0.0, -9.0), height_mm: 1.5, is_centered: true, words: "10 mm" });
//! assert!(file.finish().contains("AC1015"));
//! ```

use std::fmt::{Display, Write as _};

use glam::DVec2;

use crate::number::rounded_real;

/// Digits after the point, mm: a picometre is below every rounding of the drawing.
const PLACES: i32 = 12;

/// A DXF file under construction; coordinates in mm, y up, finite.
#[derive(Debug, Clone)]
pub struct DxfFile {
    layers: Vec<(String, u8)>,
    entities: Groups,
    bounds_mm: Option<(DVec2, DVec2)>,
}

/// A corner of a polyline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DxfVertex {
    /// Where it is, mm.
    pub at_mm: DVec2,
    /// How the piece to the next corner bends: the tangent of a quarter of the arc's angle, counter-clockwise
    /// positive; 0 for a straight piece.
    pub bulge: f64,
}

/// A line of text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DxfText<'a> {
    /// On the base line, mm: the left end, or the middle.
    pub at_mm: DVec2,
    /// Height of the capitals, mm.
    pub height_mm: f64,
    /// Whether `at_mm` is the middle of the line.
    pub is_centered: bool,
    /// The words.
    pub words: &'a str,
}

impl DxfFile {
    /// An empty drawing with these layers: name and AutoCAD's colour index (7 is black on white).
    pub fn new(layers: &[(&str, u8)]) -> Self {
        Self {
            layers: layers.iter().map(|(name, color)| ((*name).to_owned(), *color)).collect(),
            entities: Groups { text: String::new(), next_handle: FIRST_ENTITY },
            bounds_mm: None,
        }
    }

    /// A polyline; `width_mm` is the width that it is drawn with, 0 for the thinnest.
    pub fn polyline(&mut self, layer: &str, vertices: &[DxfVertex], is_closed: bool, width_mm: f64) {
        let e = self.entity("LWPOLYLINE", "AcDbPolyline", layer);
        e.put(90, vertices.len()).put(70, u8::from(is_closed)).real(43, width_mm);
        for vertex in vertices {
            e.real(10, vertex.at_mm.x).real(20, vertex.at_mm.y);
            if vertex.bulge != 0.0 {
                e.real(42, vertex.bulge);
            }
        }
        vertices.iter().for_each(|vertex| self.cover(vertex.at_mm));
    }

    /// A straight line between two points.
    pub fn line(&mut self, layer: &str, from_mm: DVec2, to_mm: DVec2) {
        self.entity("LINE", "AcDbLine", layer).point(10, from_mm).point(11, to_mm);
        self.cover(from_mm);
        self.cover(to_mm);
    }

    /// A circle.
    pub fn circle(&mut self, layer: &str, center_mm: DVec2, radius_mm: f64) {
        self.entity("CIRCLE", "AcDbCircle", layer).point(10, center_mm).real(40, radius_mm);
        self.cover(center_mm - radius_mm);
        self.cover(center_mm + radius_mm);
    }

    /// A line of text.
    pub fn text(&mut self, layer: &str, text: &DxfText<'_>) {
        let e = self.entity("TEXT", "AcDbText", layer);
        e.point(10, text.at_mm).real(40, text.height_mm).put(1, escaped(text.words));
        if text.is_centered {
            e.put(72, 1).point(11, text.at_mm);
        }
        // The second mark is part of the format.
        e.put(100, "AcDbText");
        self.cover(text.at_mm);
    }

    /// The file's text.
    pub fn finish(&self) -> String {
        let mut out = Groups { text: String::new(), next_handle: 0 };
        let (low, high) = self.bounds_mm.unwrap_or_default();
        out.section("HEADER");
        out.put(9, "$ACADVER").put(1, "AC1015").put(9, "$DWGCODEPAGE").put(3, "ANSI_1252");
        out.put(9, "$HANDSEED").put(5, format_args!("{:X}", self.entities.next_handle));
        out.put(9, "$INSUNITS").put(70, 4).put(9, "$MEASUREMENT").put(70, 1);
        out.put(9, "$EXTMIN").point(10, low).put(9, "$EXTMAX").point(10, high).put(0, "ENDSEC");
        out.section("CLASSES").put(0, "ENDSEC");
        self.tables(&mut out);
        out.section("BLOCKS");
        for (name, record, begin, end) in
            [("*Model_Space", MODEL_SPACE, "20", "21"), ("*Paper_Space", PAPER_SPACE, "22", "23")]
        {
            out.put(0, "BLOCK").put(5, begin).put(330, record).put(100, "AcDbEntity").put(8, 0);
            out.put(100, "AcDbBlockBegin").put(2, name).put(70, 0).point(10, DVec2::ZERO).put(3, name);
            out.put(1, "").put(0, "ENDBLK").put(5, end).put(330, record);
            out.put(100, "AcDbEntity").put(8, 0).put(100, "AcDbBlockEnd");
        }
        out.put(0, "ENDSEC").section("ENTITIES");
        out.text.push_str(&self.entities.text);
        out.put(0, "ENDSEC").section("OBJECTS");
        out.put(0, "DICTIONARY").put(5, "C").put(330, 0).put(100, "AcDbDictionary").put(281, 1);
        out.put(3, "ACAD_GROUP").put(350, "D");
        out.put(0, "DICTIONARY").put(5, "D").put(330, "C").put(100, "AcDbDictionary").put(281, 1);
        out.put(0, "ENDSEC").put(0, "EOF");
        out.text
    }

    /// The nine tables, in the order of the reference.
    fn tables(&self, out: &mut Groups) {
        out.section("TABLES");
        out.table("VPORT", "8", 0).put(0, "ENDTAB");
        out.table("LTYPE", "5", 3);
        for (handle, name) in [("14", "ByBlock"), ("15", "ByLayer"), ("16", "Continuous")] {
            out.record("LTYPE", handle, "5", "AcDbLinetypeTableRecord", name);
            out.put(3, "").put(72, 65).put(73, 0).real(40, 0.0);
        }
        out.put(0, "ENDTAB").table("LAYER", "2", self.layers.len() + 1);
        for (i, (name, color)) in std::iter::once(&("0".to_owned(), 7)).chain(&self.layers).enumerate() {
            let handle = format!("{:X}", FIRST_LAYER + i);
            out.record("LAYER", &handle, "2", "AcDbLayerTableRecord", name);
            out.put(62, color).put(6, "Continuous");
        }
        out.put(0, "ENDTAB").table("STYLE", "3", 1);
        out.record("STYLE", "11", "3", "AcDbTextStyleTableRecord", "Standard");
        out.real(40, 0.0).real(41, 1.0).real(50, 0.0).put(71, 0).real(42, 1.0).put(3, "txt").put(4, "");
        out.put(0, "ENDTAB").table("VIEW", "6", 0).put(0, "ENDTAB");
        out.table("UCS", "7", 0).put(0, "ENDTAB").table("APPID", "9", 1);
        out.record("APPID", "12", "9", "AcDbRegAppTableRecord", "ACAD");
        out.put(0, "ENDTAB").table("DIMSTYLE", "A", 1).put(100, "AcDbDimStyleTable").put(71, 0);
        out.put(0, "DIMSTYLE").put(105, "13").put(330, "A").put(100, "AcDbSymbolTableRecord");
        out.put(100, "AcDbDimStyleTableRecord").put(2, "Standard").put(70, 0);
        out.put(0, "ENDTAB").table("BLOCK_RECORD", "1", 2);
        for (handle, name) in [(MODEL_SPACE, "*Model_Space"), (PAPER_SPACE, "*Paper_Space")] {
            out.put(0, "BLOCK_RECORD").put(5, handle).put(330, "1").put(100, "AcDbSymbolTableRecord");
            out.put(100, "AcDbBlockTableRecord").put(2, name);
        }
        out.put(0, "ENDTAB").put(0, "ENDSEC");
    }

    fn entity(&mut self, kind: &str, class: &str, layer: &str) -> &mut Groups {
        let e = &mut self.entities;
        let handle = e.next_handle;
        e.next_handle += 1;
        e.put(0, kind).put(5, format_args!("{handle:X}")).put(330, MODEL_SPACE);
        e.put(100, "AcDbEntity").put(8, layer).put(100, class)
    }

    fn cover(&mut self, at_mm: DVec2) {
        let (low, high) = self.bounds_mm.unwrap_or((at_mm, at_mm));
        self.bounds_mm = Some((low.min(at_mm), high.max(at_mm)));
    }
}

/// Handles of the two block records, of the first layer and of the first entity. Those of the tables are theirs by
/// custom.
const MODEL_SPACE: &str = "17";
const PAPER_SPACE: &str = "1B";
const FIRST_LAYER: usize = 0x30;
const FIRST_ENTITY: usize = 0x100;

/// Pairs of a group code and a value, a line each.
#[derive(Debug, Clone)]
struct Groups {
    text: String,
    next_handle: usize,
}

impl Groups {
    fn put(&mut self, code: u16, value: impl Display) -> &mut Self {
        // Writing to a String does not fail.
        let _ = writeln!(self.text, "{code:3}\n{value}");
        self
    }

    fn real(&mut self, code: u16, value: f64) -> &mut Self {
        self.put(code, rounded_real(value, PLACES))
    }

    fn point(&mut self, code: u16, at_mm: DVec2) -> &mut Self {
        self.real(code, at_mm.x).real(code + 10, at_mm.y).real(code + 20, 0.0)
    }

    fn section(&mut self, name: &str) -> &mut Self {
        self.put(0, "SECTION").put(2, name)
    }

    fn table(&mut self, name: &str, handle: &str, records: usize) -> &mut Self {
        self.put(0, "TABLE")
            .put(2, name)
            .put(5, handle)
            .put(330, 0)
            .put(100, "AcDbSymbolTable")
            .put(70, records)
    }

    fn record(&mut self, kind: &str, handle: &str, table: &str, class: &str, name: &str) -> &mut Self {
        self.put(0, kind).put(5, handle).put(330, table).put(100, "AcDbSymbolTableRecord");
        self.put(100, class).put(2, name).put(70, 0)
    }
}

/// Text as release 2000 holds it: one line; what is not ASCII by its number; a caret would start a control character.
fn escaped(words: &str) -> String {
    let mut out = String::with_capacity(words.len());
    for unit in words.encode_utf16() {
        match u8::try_from(unit) {
            Ok(b'^') => out.push_str("^ "),
            Ok(byte @ b' '..=b'~') => out.push(char::from(byte)),
            Ok(0..=31 | 127) => out.push(' '),
            _ => {
                let _ = write!(out, "\\U+{unit:04X}");
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_stays_on_its_line() {
        assert_eq!(escaped("a\nb\r^µ"), "a b ^ \\U+00B5");
        let mut file = DxfFile::new(&[("NOTES", 8)]);
        let text = DxfText { at_mm: DVec2::ZERO, height_mm: 1.0, is_centered: false, words: "0\nEOF" };
        file.text("NOTES", &text);
        let written = file.finish();
        assert_eq!(written.lines().count() % 2, 0);
        assert_eq!(written.lines().filter(|line| *line == "EOF").count(), 1);
    }

    #[test]
    fn handles_are_unique() {
        let mut file = DxfFile::new(&[("a", 1), ("b", 2)]);
        for i in 0..40 {
            file.circle("a", DVec2::splat(f64::from(i)), 1.0);
        }
        let written = file.finish();
        let lines: Vec<&str> = written.lines().map(str::trim).collect();
        // Only the header's seed is no handle of its own.
        let mut handles: Vec<&str> = lines
            .chunks(2)
            .zip(lines.chunks(2).skip(1))
            .filter(|(before, pair)| ["5", "105"].contains(&pair[0]) && before[1] != "$HANDSEED")
            .map(|(_, pair)| pair[1])
            .collect();
        let count = handles.len();
        handles.sort_unstable();
        handles.dedup();
        assert_eq!(handles.len(), count);
    }
}
