//! The film of one print pass: dots, registration and notes on a sheet at 1:1.
//!
//! Two transfers (plate to pad, pad to part) cancel: the plate seen from above reads like the part seen from
//! outside, and nothing is mirrored. The camera, inside, sees the mirror image of both.

use glam::DVec2;

use super::drawing::{Anchor, Drawing, InkedPath, Item, Layer, NotFinite, Path, PathInk};
use super::dxf_file::to_dxf;
use super::error::RenderError;
use super::pdf_file::to_pdf;
use super::svg_file::to_svg;
use super::tiff_file::to_tiff;
use crate::hash::sha256_hex;
use domecast_design::layout::Layout;
use domecast_design::layout::outline::Outline;
use domecast_design::layout::target::{TargetMark, print_target};

/// Half the length of a registration cross, mm.
const CROSS_ARM_MM: f64 = 1.5;
/// Width of the lines of crosses and scale bar, mm: what films and plates hold surely.
const LINE_MM: f64 = 0.1;
/// Free space between the pad's footprint and anything else, and around the sheet, mm.
const MARGIN_MM: f64 = 1.0;
/// Length of the scale bar, mm.
const SCALE_BAR_MM: f64 = 10.0;
/// Height of the chiral mark, mm.
const CHIRAL_MM: f64 = 3.0;
/// Height of the capitals of notes, mm, and the distance of their lines.
const TEXT_MM: f64 = 1.0;
const TEXT_LINE_MM: f64 = 1.9;
/// Width of the notes, mm, and the characters that surely fit: the lettering takes 0.92 mm each.
const NOTES_WIDTH_MM: f64 = 40.0;
const NOTES_CHARACTERS: usize = 40;

/// The films of a layout; for [`Layout`] only, whose scale, sheet and notes they take.
pub trait Films {
    /// The film of one print pass, counted from 0.
    fn film(&self, pass: usize) -> Film<'_>;

    /// The film of the test target by which the pad's map is measured.
    fn target_film(&self) -> Film<'_>;
}

impl Films for Layout {
    fn film(&self, pass: usize) -> Film<'_> {
        Film { layout: self, picture: Picture::Pass(pass) }
    }

    fn target_film(&self) -> Film<'_> {
        Film { layout: self, picture: Picture::Target }
    }
}

/// A film for the pad printer, 1:1 in mm: dots, registration, notes. Its size follows from the layout alone.
#[derive(Debug, Clone, Copy)]
pub struct Film<'a> {
    layout: &'a Layout,
    picture: Picture,
}

/// What a film prints.
#[derive(Debug, Clone, Copy)]
enum Picture {
    Pass(usize),
    Target,
}

impl Film<'_> {
    /// The film as a drawing, before any format.
    ///
    /// # Errors
    /// [`RenderError::NoSuchPass`]; a coordinate is not finite.
    pub fn drawing(&self) -> Result<Drawing, RenderError> {
        let layout = self.layout;
        let label = FilmLabel {
            design: layout.origin().name.clone(),
            hash: sha256_hex(layout.origin().text.as_bytes()),
        };
        match self.picture {
            Picture::Pass(pass) => pass_drawing(layout, pass, &label),
            Picture::Target => {
                let marks = print_target(&layout.transfer, layout.print());
                Ok(target_drawing(layout, &marks, &label)?)
            }
        }
    }

    /// The film as SVG.
    ///
    /// # Errors
    /// As [`Self::drawing`].
    pub fn to_svg(&self) -> Result<Vec<u8>, RenderError> {
        Ok(to_svg(&self.drawing()?))
    }

    /// The film as PDF.
    ///
    /// # Errors
    /// As [`Self::drawing`].
    pub fn to_pdf(&self) -> Result<Vec<u8>, RenderError> {
        to_pdf(&self.drawing()?)
    }

    /// The film as DXF, its outlines divided to the design's tolerance.
    ///
    /// # Errors
    /// As [`Self::drawing`].
    pub fn to_dxf(&self) -> Result<Vec<u8>, RenderError> {
        Ok(to_dxf(&self.drawing()?, self.layout.print().outline_mm()))
    }

    /// The film as TIFF, in the design's resolution.
    ///
    /// # Errors
    /// As [`Self::drawing`], or a picture that is too large.
    pub fn to_tiff(&self) -> Result<Vec<u8>, RenderError> {
        to_tiff(&self.drawing()?, self.layout.print().dpi)
    }
}

/// What the notes of a film say beside what the layout knows.
struct FilmLabel {
    design: String,
    /// In hexadecimal digits.
    hash: String,
}

impl FilmLabel {
    /// As much of the hash as a person compares.
    fn short_hash(&self) -> &str {
        self.hash.get(..12).unwrap_or(&self.hash)
    }
}

fn pass_drawing(layout: &Layout, pass: usize, label: &FilmLabel) -> Result<Drawing, RenderError> {
    let films = layout.passes.len();
    let Some(print_pass) = layout.passes.get(pass) else {
        return Err(RenderError::NoSuchPass { pass, passes: films });
    };
    let dots = layout.dots.iter().filter(|dot| dot.pass == pass);
    let marks: Vec<Mark<'_>> =
        dots.map(|dot| Mark { id: dot.id, plate_mm: dot.plate_mm, outline: &dot.plate_outline }).collect();
    let (tilt_deg, azimuth_deg) = (print_pass.tilt_rad.to_degrees(), print_pass.azimuth_rad.to_degrees());
    let jig = if tilt_deg == 0.0 {
        "pole upright".to_owned()
    } else {
        format!("jig {tilt_deg:.2} deg: the dome's azimuth {azimuth_deg:.2} deg is tilted up to the pad")
    };
    let content = FilmContent {
        name: format!("film {} of {films}", pass + 1),
        shape: "dot",
        first_note: format!("film {} of {films}: {} dots, {jig}", pass + 1, marks.len()),
        marks,
        facts: vec![
            ("film".into(), format!("{} of {films}", pass + 1)),
            ("tilt-deg".into(), tilt_deg.to_string()),
            ("azimuth-deg".into(), azimuth_deg.to_string()),
        ],
        further_notes: Vec::new(),
    };
    Ok(content.drawing(layout, label)?)
}

fn target_drawing(layout: &Layout, target: &[TargetMark], label: &FilmLabel) -> Result<Drawing, NotFinite> {
    let marks = target
        .iter()
        .map(|mark| Mark { id: mark.id, plate_mm: mark.plate_mm, outline: &mark.outline })
        .collect();
    FilmContent {
        name: "print target".to_owned(),
        shape: "mark",
        marks,
        first_note: format!("test target: {} marks, pole upright", target.len()),
        facts: vec![("film".into(), "print target".into())],
        further_notes: vec![
            "Mark 0 is the pole; rings of 6, 12, 18 .. marks follow, numbered counter-clockwise from the large \
             marks along +x. Print it, measure each mark from outside (id,x_mm,y_mm, pole at the origin), and run \
             domecast calibrate-print."
                .to_owned(),
        ],
    }
    .drawing(layout, label)
}

/// A mark of a film.
struct Mark<'a> {
    id: u32,
    plate_mm: DVec2,
    outline: &'a Outline,
}

/// What differs from film to film.
struct FilmContent<'a> {
    name: String,
    shape: &'static str,
    marks: Vec<Mark<'a>>,
    first_note: String,
    facts: Vec<(String, String)>,
    further_notes: Vec<String>,
}

impl FilmContent<'_> {
    fn drawing(self, layout: &Layout, label: &FilmLabel) -> Result<Drawing, NotFinite> {
        let transfer = &layout.transfer;
        let mut layer = Layer::new("dots");
        for mark in &self.marks {
            layer.items.push(Item::Path(InkedPath {
                id: format!("{}-{}", self.shape, mark.id),
                facts: vec![
                    ("id".into(), mark.id.to_string()),
                    ("x-mm".into(), mark.plate_mm.x.to_string()),
                    ("y-mm".into(), mark.plate_mm.y.to_string()),
                ],
                path: Path::of_outline(mark.outline)?,
                ink: PathInk::Fill,
            }));
        }
        let footprint_mm =
            layout.print().pad_over_image * picture_radius_mm(self.marks.iter().map(|mark| mark.outline));
        let map = match transfer.correction() {
            None => transfer.nominal().as_str().to_owned(),
            Some(_) => format!("{}, corrected by measurement", transfer.nominal().as_str()),
        };
        let mut notes = vec![
            format!("{}  sha256 {}", label.design, label.short_hash()),
            self.first_note,
            format!("1:1 in mm, positive: black is ink; map {map}"),
            "Seen from above the plate, with the F upright and unmirrored: reads like the part seen from outside, \
             x to the right, y up. The camera inside sees the mirror image. Do not mirror."
                .to_owned(),
        ];
        notes.extend(self.further_notes);
        let notes = wrapped(&notes);
        let sheet = Sheet::new(footprint_mm, notes.len());
        let mut facts = vec![
            ("design".into(), label.design.clone()),
            ("design-sha256".into(), label.hash.clone()),
            ("frame".into(), "plate: origin under the pole, seen from above, y up, mm".into()),
            ("map".into(), map),
            ("pad-footprint-radius-mm".into(), footprint_mm.to_string()),
        ];
        facts.extend(self.facts);
        Ok(Drawing {
            title: format!("{} {}", label.design, self.name),
            description: format!(
                "Pad-print film of {} ({}), 1:1 in mm, seen from above the plate, y up. One user unit is 1 mm; a \
                 plate point (x, y) is drawn at (x, -y). Reads like the part seen from outside; do not mirror.",
                label.design, label.hash
            ),
            page_mm: sheet.page_mm(),
            facts,
            layers: vec![layer, sheet.registration()?, sheet.notes(&notes)?],
        })
    }
}

/// Breaks lines between words where they would not fit.
fn wrapped(paragraphs: &[String]) -> Vec<String> {
    let mut lines = Vec::new();
    for paragraph in paragraphs {
        let mut line = String::new();
        for word in paragraph.split(' ') {
            if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > NOTES_CHARACTERS {
                lines.push(std::mem::take(&mut line));
            }
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
        lines.push(line);
    }
    lines
}

/// Radius of the circle around the stroke's axis that holds all outlines, mm.
pub fn picture_radius_mm<'a>(outlines: impl Iterator<Item = &'a Outline>) -> f64 {
    outlines.flat_map(|outline| outline.polygon(4)).map(|p| p.length()).fold(0.0, f64::max)
}

/// What surrounds the picture: crosses, scale bar, chiral mark, notes.
pub(super) struct Sheet {
    footprint_mm: f64,
    /// Crosses stand at (+-cross, +-cross).
    cross_mm: f64,
    half_width_mm: f64,
    top_mm: f64,
    lines: usize,
}

impl Sheet {
    pub(super) fn new(footprint_mm: f64, lines: usize) -> Self {
        // The arm's end nearest to the centre, (c - arm, c), lies one margin outside the footprint.
        let clear = footprint_mm + MARGIN_MM;
        let cross_mm =
            0.5 * (CROSS_ARM_MM + (2.0 * clear * clear - CROSS_ARM_MM * CROSS_ARM_MM).max(0.0).sqrt());
        let top_mm = clear.max(cross_mm + CROSS_ARM_MM + MARGIN_MM);
        Self { footprint_mm, cross_mm, half_width_mm: top_mm.max(0.5 * NOTES_WIDTH_MM), top_mm, lines }
    }

    /// Top of the notes.
    fn notes_top_mm(&self) -> f64 {
        -self.top_mm - MARGIN_MM
    }

    pub(super) fn page_mm(&self) -> (DVec2, DVec2) {
        let notes_mm = CHIRAL_MM + 2.0 * MARGIN_MM + TEXT_LINE_MM * self.lines as f64;
        let low = DVec2::new(-self.half_width_mm, self.notes_top_mm() - notes_mm);
        (low, DVec2::new(self.half_width_mm, self.top_mm))
    }

    pub(super) fn registration(&self) -> Result<Layer, NotFinite> {
        let mut layer = Layer::new("registration");
        for (x, y) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
            let at = DVec2::new(x, y) * self.cross_mm;
            for arm in [DVec2::X, DVec2::Y] {
                let line = [at - arm * CROSS_ARM_MM, at + arm * CROSS_ARM_MM];
                layer.draw(Path::polyline(&line, false)?, PathInk::Line(LINE_MM));
            }
        }
        let base = DVec2::new(-0.5 * NOTES_WIDTH_MM + MARGIN_MM, self.notes_top_mm() - CHIRAL_MM);
        for (from, to) in [
            (DVec2::ZERO, DVec2::new(SCALE_BAR_MM, 0.0)),
            (DVec2::new(0.0, -0.75), DVec2::new(0.0, 0.75)),
            (DVec2::new(SCALE_BAR_MM, -0.75), DVec2::new(SCALE_BAR_MM, 0.75)),
        ] {
            layer.draw(Path::polyline(&[base + from, base + to], false)?, PathInk::Line(LINE_MM));
        }
        let mark = DVec2::new(0.5 * NOTES_WIDTH_MM - MARGIN_MM - 0.6 * CHIRAL_MM, base.y);
        // The letter F, in units of its height: no turn or mirror image of it looks the same.
        let letter = [
            (0.0, 0.0),
            (0.2, 0.0),
            (0.2, 0.4),
            (0.5, 0.4),
            (0.5, 0.6),
            (0.2, 0.6),
            (0.2, 0.8),
            (0.6, 0.8),
            (0.6, 1.0),
            (0.0, 1.0),
        ]
        .map(|(x, y)| mark + DVec2::new(x, y) * CHIRAL_MM);
        layer.draw(Path::polyline(&letter, true)?, PathInk::Fill);
        debug_assert!(self.cross_mm.hypot(self.cross_mm - CROSS_ARM_MM) >= self.footprint_mm);
        Ok(layer)
    }

    pub(super) fn notes(&self, lines: &[String]) -> Result<Layer, NotFinite> {
        let mut layer = Layer::new("notes");
        let left = -0.5 * NOTES_WIDTH_MM + MARGIN_MM;
        let base = self.notes_top_mm() - CHIRAL_MM;
        let bar_end = DVec2::new(left + SCALE_BAR_MM + MARGIN_MM, base - 0.5 * TEXT_MM);
        layer.write(bar_end, TEXT_MM, Anchor::Start, format!("{SCALE_BAR_MM} mm"));
        for (i, words) in lines.iter().enumerate() {
            let at = DVec2::new(left, base - MARGIN_MM - TEXT_LINE_MM * (i as f64 + 0.5) - TEXT_MM);
            layer.write(at, TEXT_MM, Anchor::Start, words.clone());
        }
        Ok(layer)
    }
}
