//! The marks of a chart, as SVG and as PNG.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use glam::DVec2;
use tiny_skia::Pixmap;

use crate::artwork::canvas;
use crate::artwork::strokes::{pen_mm, strokes};
use crate::html::{AsHtml, Html};

/// A colour; in a page, the style sheet's rule for its class stands above it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChartColor {
    /// Red, green, blue.
    pub rgb: [u8; 3],
    /// Class of the mark; empty for none.
    pub class: &'static str,
}

impl ChartColor {
    /// A colour of no class.
    pub const fn new(rgb: [u8; 3]) -> Self {
        Self { rgb, class: "" }
    }
}

/// Text and axes.
pub const INK: ChartColor = ChartColor { rgb: [40, 40, 40], class: "axis" };

/// Where a text's place lies on its line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TextAlign {
    /// At its first letter.
    Start,
    /// In its middle.
    Middle,
    /// At its last letter.
    End,
}

/// Px, y down.
#[derive(Debug, Clone)]
enum Mark {
    Line { points: Vec<DVec2>, width: f64 },
    Area { corners: Vec<DVec2> },
    Disc { at: DVec2, radius: f64, filled: bool },
    Bar { low: DVec2, high: DVec2, title: String },
    Text { at: DVec2, align: TextAlign, size: f64, text: String },
}

/// A picture of lines, discs, bars and text; px, y down.
#[derive(Debug, Clone)]
pub struct Chart {
    title: String,
    size_px: DVec2,
    marks: Vec<(Mark, ChartColor)>,
}

impl Chart {
    /// An empty chart; the title is for those who do not see it.
    pub fn new(title: &str, size_px: DVec2) -> Self {
        Self { title: title.to_owned(), size_px, marks: Vec::new() }
    }

    /// Draws a line through points; one point is nothing.
    pub fn line(&mut self, points: &[DVec2], color: ChartColor, width: f64) {
        if points.len() > 1 {
            self.marks.push((Mark::Line { points: points.to_vec(), width }, color));
        }
    }

    /// Fills a polygon.
    pub fn area(&mut self, corners: &[DVec2], color: ChartColor) {
        self.marks.push((Mark::Area { corners: corners.to_vec() }, color));
    }

    /// Draws a disc, or its rim.
    pub fn disc(&mut self, at: DVec2, radius: f64, color: ChartColor, filled: bool) {
        self.marks.push((Mark::Disc { at, radius, filled }, color));
    }

    /// Fills a box between two corners; its title shows under the pointer.
    pub fn bar(&mut self, [low, high]: [DVec2; 2], color: ChartColor, title: String) {
        self.marks.push((Mark::Bar { low, high, title }, color));
    }

    /// Writes a line of text; `size` is the font's.
    pub fn text(
        &mut self,
        at: DVec2,
        align: TextAlign,
        size: f64,
        color: ChartColor,
        text: impl Into<String>,
    ) {
        self.marks.push((Mark::Text { at, align, size, text: text.into() }, color));
    }

    /// As an SVG file, on white.
    pub fn to_svg(&self) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" \
             font-family=\"sans-serif\" role=\"img\"><title>{2}</title>\n<rect width=\"100%\" height=\"100%\" \
             fill=\"white\"/>\n{3}</svg>\n",
            self.size_px.x,
            self.size_px.y,
            AsHtml(&self.title),
            self.svg_marks()
        )
    }

    /// As a drawing in a page, in the colours of the page's style sheet.
    pub fn to_html(&self) -> Html {
        Html::trusted(format!(
            "<svg class=\"chart\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">\n{}</svg>",
            self.size_px.x,
            self.size_px.y,
            AsHtml(&self.title),
            self.svg_marks()
        ))
    }

    fn svg_marks(&self) -> String {
        let mut svg = String::new();
        for (mark, ChartColor { rgb: [r, g, b], class }) in &self.marks {
            let color = format!("#{r:02x}{g:02x}{b:02x}");
            let class = if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") };
            // writing to a String cannot fail
            let _ = match mark {
                Mark::Line { points, width } => writeln!(
                    svg,
                    "<path{class} d=\"M{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\"/>",
                    path(points)
                ),
                Mark::Area { corners } => {
                    writeln!(svg, "<path{class} d=\"M{}Z\" fill=\"{color}\"/>", path(corners))
                }
                Mark::Disc { at, radius, filled } => writeln!(
                    svg,
                    "<circle{class} cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\" stroke-width=\"1.5\" \
                     stroke=\"{color}\" fill=\"{}\"/>",
                    at.x,
                    at.y,
                    if *filled { &color } else { "none" }
                ),
                Mark::Bar { low, high, title } => writeln!(
                    svg,
                    "<rect{class} x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" \
                     fill=\"{color}\"><title>{}</title></rect>",
                    low.x,
                    low.y,
                    high.x - low.x,
                    high.y - low.y,
                    AsHtml(title)
                ),
                Mark::Text { at, align, size, text } => writeln!(
                    svg,
                    "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{}\" font-size=\"{size:.1}\" \
                     fill=\"{color}\">{}</text>",
                    at.x,
                    at.y,
                    match align {
                        TextAlign::Start => "start",
                        TextAlign::Middle => "middle",
                        TextAlign::End => "end",
                    },
                    AsHtml(text)
                ),
            };
        }
        svg
    }

    /// As PNG, twice as many pixels each way, in a lettering that needs no font; `None` if it could not be packed.
    pub fn to_png(&self) -> Option<Vec<u8>> {
        const SCALE: f64 = 2.0;
        /// Height of a capital in parts of the font's size, and width of a letter in parts of that height.
        const CAPITAL: f64 = 1.0 / 1.6;
        const LETTER: f64 = 5.5 / 6.0;
        let mut picture = Pixmap::new((self.size_px.x * SCALE) as u32, (self.size_px.y * SCALE) as u32)?;
        picture.fill(canvas::color([255; 3]));
        for (mark, ChartColor { rgb, .. }) in &self.marks {
            match mark {
                Mark::Line { points, width } => {
                    let points: Vec<DVec2> = points.iter().map(|p| *p * SCALE).collect();
                    canvas::stroke(&mut picture, &points, false, (width * SCALE) as f32, *rgb);
                }
                Mark::Area { corners } => {
                    let corners: Vec<DVec2> = corners.iter().map(|p| *p * SCALE).collect();
                    canvas::fill(&mut picture, &corners, *rgb);
                }
                Mark::Disc { at, radius, filled } => {
                    let rim: Vec<DVec2> = (0..32)
                        .map(|k| DVec2::from_angle(TAU * f64::from(k) / 32.0))
                        .map(|direction| (*at + direction * *radius) * SCALE)
                        .collect();
                    if *filled {
                        canvas::fill(&mut picture, &rim, *rgb);
                    } else {
                        canvas::stroke(&mut picture, &rim, true, (1.5 * SCALE) as f32, *rgb);
                    }
                }
                Mark::Bar { low, high, .. } => {
                    let corners = [*low, DVec2::new(high.x, low.y), *high, DVec2::new(low.x, high.y)];
                    canvas::fill(&mut picture, &corners.map(|corner| corner * SCALE), *rgb);
                }
                Mark::Text { at, align, size, text } => {
                    let height = CAPITAL * size * SCALE;
                    let width = text.chars().count() as f64 * LETTER * height;
                    let before = match align {
                        TextAlign::Start => 0.0,
                        TextAlign::Middle => 0.5,
                        TextAlign::End => 1.0,
                    };
                    let start = *at * SCALE - DVec2::new(before * width, 0.0);
                    for stroke in strokes(text, DVec2::ZERO, height) {
                        let points: Vec<DVec2> =
                            stroke.iter().map(|p| start + DVec2::new(p.x, -p.y)).collect();
                        canvas::stroke(&mut picture, &points, false, pen_mm(height) as f32, *rgb);
                    }
                }
            }
        }
        picture.encode_png().ok()
    }
}

/// Points of an SVG path.
fn path(points: &[DVec2]) -> String {
    points.iter().map(|p| format!("{:.1} {:.1}", p.x, p.y)).collect::<Vec<_>>().join("L")
}
