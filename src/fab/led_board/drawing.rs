//! The board of one light as a drawing at 1:1: outline, copper, mask, silkscreen, the light's package, and notes.

use glam::DVec2;

use crate::artwork::drawing::{Anchor, Drawing, Layer, NotFinite, Path, PathInk};
use domecast_design::electrical::{BoardRect, LedBoard};
use domecast_mesh::number::rounded;

/// Width of the lines, mm: thin, because the board is small.
const LINE_MM: f64 = 0.03;
/// Height of the notes' capitals, mm, and the distance of their lines.
const TEXT_MM: f64 = 1.0;
const TEXT_LINE_MM: f64 = 1.9;
/// Width of the notes and free space round everything, mm.
const NOTES_MM: f64 = 44.0;
const MARGIN_MM: f64 = 2.0;
/// Length of the scale bar, mm.
const SCALE_BAR_MM: f64 = 10.0;

/// The drawing; y up, the board's centre at the origin, seen from the light's face.
pub(super) fn drawing(name: &str, board: &LedBoard) -> Result<Drawing, NotFinite> {
    let half = 0.5 * board.size_mm;
    let mut outline = Layer::new("outline");
    outline.draw(rectangle([-half, half])?, PathInk::Line(LINE_MM));
    let mut copper = Layer::new("copper");
    for pad in &board.pads {
        copper.draw(rectangle(pad.rect_mm)?, PathInk::Line(LINE_MM));
    }
    for corners in &board.tracks_mm {
        copper.draw(Path::polyline(corners, false)?, PathInk::Line(board.track_mm));
    }
    let mut mask = Layer::new("mask");
    for opening in board.mask_openings_mm() {
        mask.draw(rectangle(opening)?, PathInk::Line(LINE_MM));
    }
    let mut silk = Layer::new("silkscreen");
    for line in &board.silk_mm {
        silk.draw(Path::polyline(line, false)?, PathInk::Line(board.silk_line_mm));
    }
    let mut package = Layer::new("package");
    package.draw(rectangle(board.package_mm)?, PathInk::Line(LINE_MM));
    let mut notes = Layer::new("notes");
    let left = -half.x.max(0.5 * NOTES_MM);
    let mut y = -half.y - MARGIN_MM;
    notes.draw(
        Path::polyline(&[DVec2::new(left, y), DVec2::new(left + SCALE_BAR_MM, y)], false)?,
        PathInk::Line(LINE_MM),
    );
    let n = |value: f64| rounded(value, 3);
    let lines = [
        "bar 10 mm; seen from the light's face".to_owned(),
        format!(
            "{} x {} x {} mm, one copper layer",
            n(board.size_mm.x),
            n(board.size_mm.y),
            n(board.thickness_mm)
        ),
        format!("lands {}, wire pads {} mm", sides(board.pads[0].rect_mm), sides(board.pads[2].rect_mm)),
        "left: cathode (-), right: anode (+)".to_owned(),
    ];
    for words in &lines {
        y -= TEXT_LINE_MM;
        notes.write(DVec2::new(left, y), TEXT_MM, Anchor::Start, words.as_str());
    }
    let low = DVec2::new(left - MARGIN_MM, y - MARGIN_MM);
    Ok(Drawing {
        title: format!("LED board of {name}"),
        description:
            "The board of one light at 1:1: outline, copper, mask openings, silkscreen, the light's package. \
                      Gerbers and a KiCad file stand beside it."
                .into(),
        page_mm: (low, DVec2::new(-low.x, half.y + MARGIN_MM)),
        facts: vec![("width-mm".into(), n(board.size_mm.x)), ("height-mm".into(), n(board.size_mm.y))],
        layers: vec![outline, copper, mask, silk, package, notes],
    })
}

fn rectangle([low, high]: BoardRect) -> Result<Path, NotFinite> {
    Path::polyline(&[low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)], true)
}

fn sides([low, high]: BoardRect) -> String {
    let size = high - low;
    format!("{} x {}", rounded(size.x, 3), rounded(size.y, 3))
}
