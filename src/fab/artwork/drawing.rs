//! A drawing as a resolved tree: layers of shapes and texts in millimetres, y up, ready to be written.
//!
//! Whoever builds a drawing decides everything; a writer only spells it. Numbers that are not finite cannot
//! get in.

use std::fmt;

use glam::DVec2;

use domecast_design::layout::outline::Outline;

/// A drawing at 1:1.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// Name, for the file's title.
    pub title: String,
    /// What a person should know about the file, one sentence or a few.
    pub description: String,
    /// The sheet: lowest and highest corner, mm.
    pub page_mm: (DVec2, DVec2),
    /// Facts for programs, in this order: (name, value); names in lower case with hyphens.
    pub facts: Vec<(String, String)>,
    /// The layers, the lowest first.
    pub layers: Vec<Layer>,
}

/// A named layer.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Its name.
    pub name: String,
    /// What lies on it.
    pub items: Vec<Item>,
}

/// Something that is drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// A path.
    Path(InkedPath),
    /// A line of text.
    Text(Text),
}

/// A path with its ink.
#[derive(Debug, Clone, PartialEq)]
pub struct InkedPath {
    /// Name of the shape, unique in the drawing; empty for none.
    pub id: String,
    /// Facts for programs: (name, value).
    pub facts: Vec<(String, String)>,
    /// The path, mm.
    pub path: Path,
    /// Filled, or drawn along.
    pub ink: PathInk,
}

/// How a path is inked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PathInk {
    /// The inside.
    Fill,
    /// A line of this width along the path, mm.
    Line(f64),
}

/// A run of lines and cubic curves.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    start: DVec2,
    segments: Vec<Segment>,
    closed: bool,
}

/// One piece of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Segment {
    /// A straight line to the point.
    Line(DVec2),
    /// A cubic Bezier curve: two control points and the end.
    Cubic(DVec2, DVec2, DVec2),
}

/// Where a text's `at` lies along the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// At its left end.
    Start,
    /// In its middle.
    Middle,
}

/// A line of text.
#[derive(Debug, Clone, PartialEq)]
pub struct Text {
    /// On the base line, mm.
    pub at: DVec2,
    /// Height of the capitals, mm.
    pub height_mm: f64,
    /// Which part of the line stands at `at`.
    pub anchor: Anchor,
    /// The words.
    pub words: String,
}

/// A number that is not finite was about to enter a drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotFinite;

impl fmt::Display for NotFinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a coordinate of the drawing is not a finite number")
    }
}

impl std::error::Error for NotFinite {}

impl Path {
    /// A path from its start and its pieces.
    ///
    /// # Errors
    /// A coordinate is not finite.
    pub fn new(start: DVec2, segments: Vec<Segment>, closed: bool) -> Result<Self, NotFinite> {
        let finite = |segment: &Segment| match segment {
            Segment::Line(to) => to.is_finite(),
            Segment::Cubic(a, b, to) => a.is_finite() && b.is_finite() && to.is_finite(),
        };
        if start.is_finite() && segments.iter().all(finite) {
            Ok(Self { start, segments, closed })
        } else {
            Err(NotFinite)
        }
    }

    /// Straight lines through the points; closed or open.
    ///
    /// # Errors
    /// A coordinate is not finite, or there is no point.
    pub fn polyline(points: &[DVec2], closed: bool) -> Result<Self, NotFinite> {
        let (first, rest) = points.split_first().ok_or(NotFinite)?;
        Self::new(*first, rest.iter().map(|p| Segment::Line(*p)).collect(), closed)
    }

    /// The path of a closed outline.
    ///
    /// # Errors
    /// A coordinate is not finite.
    pub fn of_outline(outline: &Outline) -> Result<Self, NotFinite> {
        let segments = outline.pieces().iter().map(|[a, b, to]| Segment::Cubic(*a, *b, *to)).collect();
        Self::new(outline.start(), segments, true)
    }

    /// The path as a polygon within `tolerance_mm`; the start is not repeated. A closed path of curves is grown
    /// about its middle until the polygon encloses the path's own area.
    pub fn polygon(&self, tolerance_mm: f64) -> Vec<DVec2> {
        let mut curves = Vec::new();
        for segment in &self.segments {
            match segment {
                Segment::Cubic(a, b, to) => curves.push([*a, *b, *to]),
                Segment::Line(_) => break,
            }
        }
        if self.closed && curves.len() == self.segments.len() && !curves.is_empty() {
            let outline = Outline::from_pieces(curves);
            let mut points = outline.polygon_within(tolerance_mm);
            let next = points.iter().cycle().skip(1);
            let area: f64 = 0.5 * points.iter().zip(next).map(|(p, q)| p.perp_dot(*q)).sum::<f64>();
            let growth = (outline.signed_area() / area).sqrt();
            if growth.is_finite() {
                let middle = outline.centroid();
                for point in &mut points {
                    *point = middle + (*point - middle) * growth;
                }
            }
            return points;
        }
        let mut points = vec![self.start];
        for segment in &self.segments {
            match segment {
                Segment::Line(to) => points.push(*to),
                Segment::Cubic(a, b, to) => {
                    // A lone curve: its chord's error falls with the square of the number of chords.
                    let from = points.last().copied().unwrap_or(self.start);
                    let bend = (from - 2.0 * *a + *b).length().max((*a - 2.0 * *b + *to).length());
                    let count = (0.75 * bend / tolerance_mm).sqrt().ceil().clamp(1.0, 1e4) as u32;
                    points.extend((1..=count).map(|k| {
                        let t = f64::from(k) / f64::from(count);
                        let u = 1.0 - t;
                        from * (u * u * u)
                            + *a * (3.0 * u * u * t)
                            + *b * (3.0 * u * t * t)
                            + *to * (t * t * t)
                    }));
                }
            }
        }
        points
    }

    /// Where the path starts, mm.
    pub fn start(&self) -> DVec2 {
        self.start
    }

    /// Its pieces.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Whether it leads back to its start.
    pub fn is_closed(&self) -> bool {
        self.closed
    }
}

impl Drawing {
    /// Width and height of the sheet, mm.
    pub fn size_mm(&self) -> DVec2 {
        self.page_mm.1 - self.page_mm.0
    }
}

impl Layer {
    /// An empty layer.
    pub fn new(name: &str) -> Self {
        Self { name: name.to_owned(), items: Vec::new() }
    }

    /// Adds a path without a name.
    pub fn draw(&mut self, path: Path, ink: PathInk) {
        self.items.push(Item::Path(InkedPath { id: String::new(), facts: Vec::new(), path, ink }));
    }

    /// Adds a line of text.
    pub fn write(&mut self, at: DVec2, height_mm: f64, anchor: Anchor, words: impl Into<String>) {
        self.items.push(Item::Text(Text { at, height_mm, anchor, words: words.into() }));
    }
}
