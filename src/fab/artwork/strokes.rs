//! A lettering of straight strokes: a raster has no fonts, and a film must not depend on any. A reader that lacks a
//! font takes another, and its wider letters run off the sheet.
//!
//! Letters stand on a grid 4 wide and 6 high and are drawn in capitals. Each glyph is a list of strokes, each
//! stroke a list of grid points "xy".

use glam::DVec2;

use super::drawing::{Anchor, Text};

/// Height of the capitals, grid units.
const HEIGHT: f64 = 6.0;
/// From one letter to the next, grid units.
const ADVANCE: f64 = 5.5;
/// Width of the pen, grid units.
const PEN: f64 = 0.7;

/// The strokes of a line of text, mm: base line at `at`, capitals `height_mm` high. A character that has no
/// glyph is drawn as an empty box.
pub fn strokes(words: &str, at: DVec2, height_mm: f64) -> Vec<Vec<DVec2>> {
    let scale = height_mm / HEIGHT;
    let mut lines = Vec::new();
    for (i, letter) in words.chars().enumerate() {
        let origin = at + DVec2::new(i as f64 * ADVANCE * scale, 0.0);
        for stroke in glyph(letter.to_ascii_uppercase()).split('|').filter(|stroke| !stroke.is_empty()) {
            let points = stroke.as_bytes().chunks_exact(2).map(|xy| {
                let grid = |digit: u8| f64::from(digit.saturating_sub(b'0'));
                origin + DVec2::new(grid(xy[0]), grid(xy[1])) * scale
            });
            lines.push(points.collect());
        }
    }
    lines
}

/// The strokes of a text where it stands in its drawing, mm.
pub fn of_text(text: &Text) -> Vec<Vec<DVec2>> {
    let back = match text.anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => 0.5 * width_mm(&text.words, text.height_mm),
    };
    strokes(&text.words, text.at - DVec2::new(back, 0.0), text.height_mm)
}

/// Width of the pen that draws letters of this height, mm.
pub fn pen_mm(height_mm: f64) -> f64 {
    PEN * height_mm / HEIGHT
}

/// Length of a line of text, mm.
fn width_mm(words: &str, height_mm: f64) -> f64 {
    words.chars().count() as f64 * ADVANCE * height_mm / HEIGHT
}

fn glyph(letter: char) -> &'static str {
    match letter {
        ' ' => "",
        'A' => "002640|1232",
        'B' => "00063645443303|3342413000",
        'C' => "4536160501103041",
        'D' => "00062644422000",
        'E' => "46060040|0333",
        'F' => "460600|0333",
        'G' => "45361605011030414323",
        'H' => "0006|4046|0343",
        'I' => "1636|2620|1030",
        'J' => "4641301001",
        'K' => "0006|460340",
        'L' => "060040",
        'M' => "0006234640",
        'N' => "00064046",
        'O' => "100105163645413010",
        'P' => "00063645443303",
        'Q' => "100105163645413010|2240",
        'R' => "00063645443303|2340",
        'S' => "453616050413334241301001",
        'T' => "0646|2620",
        'U' => "060110304146",
        'V' => "062046",
        'W' => "0610243046",
        'X' => "0046|0640",
        'Y' => "062346|2320",
        'Z' => "06460040",
        '0' => "100105163645413010|0145",
        '1' => "152620|1030",
        '2' => "05163645440040",
        '3' => "051636454433|1333|334241301001",
        '4' => "30360242",
        '5' => "460603334241301001",
        '6' => "453616050110304142331302",
        '7' => "064610",
        '8' => "1304051636454433130201103041423313",
        '9' => "011030414536160504133344",
        '.' => "2021",
        ',' => "2110",
        ':' => "2122|2425",
        ';' => "2110|2425",
        '-' => "1333",
        '+' => "1333|2224",
        '_' => "0040",
        '/' => "0046",
        '(' => "36241230",
        ')' => "16243210",
        '=' => "0242|0444",
        '*' => "1135|3115|0343",
        '\'' => "2625",
        '"' => "1615|3635",
        _ => "0006464000",
    }
}
