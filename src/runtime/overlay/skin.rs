//! The skin's depth as colours, the outline of what touches, and the scale.

use glam::DVec2;

use super::canvas::Canvas;
use super::color_map::viridis;
use crate::shape::ShapeMap;

/// How much of the colour stands over the picture.
const OPACITY: f64 = 0.65;
/// Below this share of the scale colours fade out, so that the picture of a skin at rest stays as it is.
const FADE: f64 = 0.1;
/// Deviations of the depth from which on there is a colour, and where it is whole.
const SDS: [f64; 2] = [1.0, 3.0];
const WHITE: [u8; 3] = [255; 3];
const BLACK: [u8; 3] = [0; 3];

/// Size of the scale's bar and of its numerals, px of the frame; and its distance from the picture's corner.
const BAR: DVec2 = DVec2::new(8.0, 72.0);
const NUMERAL_PX: f64 = 6.0;
const MARGIN_PX: f64 = 10.0;
/// Room for the numerals beside the bar, px of the frame.
const LABELS_PX: f64 = 26.0;

/// Draws depths from 0 to `range_mm` over the picture, and the outline of the touch.
pub(super) fn draw_skin(canvas: &mut Canvas, map: &ShapeMap, range_mm: f64) {
    if range_mm.is_nan() || range_mm <= 0.0 {
        return;
    }
    canvas.recolor(|x, y, under| {
        let pixel = y * map.width + x;
        let height_mm = map.height_mm.get(pixel).filter(|_| x < map.width);
        let Some(depth_mm) = height_mm.map(|height| -f64::from(*height)).filter(|depth| *depth > 0.0) else {
            return under;
        };
        let share = depth_mm / range_mm;
        let sd_mm = map.height_sd_mm.get(pixel).filter(|sd| sd.is_finite()).map_or(0.0, |sd| f64::from(*sd));
        let sds = depth_mm / sd_mm.max(1e-9);
        let fade = (share / FADE).min(1.0) * ((sds - SDS[0]) / (SDS[1] - SDS[0])).clamp(0.0, 1.0);
        // The lights' own colours would mix with those of the scale: below them the picture is grey.
        let gray = 0.299 * f64::from(under[0]) + 0.587 * f64::from(under[1]) + 0.114 * f64::from(under[2]);
        let color = viridis(share);
        std::array::from_fn(|c| {
            let covered = OPACITY * f64::from(color[c]) + (1.0 - OPACITY) * gray;
            (f64::from(under[c]) + fade * (covered - f64::from(under[c]))).round() as u8
        })
    });
    if let Some(contact) = &map.contact {
        let outline: Vec<DVec2> = contact.outline_px.iter().map(|at| at.as_dvec2()).collect();
        canvas.line(&outline, true, BLACK, 4.0);
        canvas.line(&outline, true, WHITE, 2.0);
    }
}

/// Draws the scale into the lower right corner.
pub(super) fn draw_scale(canvas: &mut Canvas, range_mm: f64) {
    let low = canvas.size() - BAR - DVec2::new(MARGIN_PX + LABELS_PX, MARGIN_PX);
    let title = DVec2::new(low.x, low.y - 2.0 * NUMERAL_PX);
    let edge = DVec2::splat(0.7 * NUMERAL_PX);
    canvas.fill(title - edge, low + BAR + DVec2::new(LABELS_PX, 0.0) + edge, BLACK, 150);
    let steps = BAR.y as usize;
    for step in 0..steps {
        let top = low + DVec2::new(0.0, step as f64);
        let share = 1.0 - (step as f64 + 0.5) / steps as f64;
        canvas.fill(top, top + DVec2::new(BAR.x, 1.0), viridis(share), 255);
    }
    write(canvas, "mm", title + DVec2::new(0.0, NUMERAL_PX));
    for share in [0.0, 0.5, 1.0] {
        let at = low + DVec2::new(BAR.x, (1.0 - share) * BAR.y);
        canvas.line(&[at, at + DVec2::new(3.0, 0.0)], false, WHITE, 1.5);
        let label = format!("{}", (share * range_mm * 1e6).round() / 1e6);
        write(canvas, &label, at + DVec2::new(5.0, 0.5 * NUMERAL_PX));
    }
}

/// Writes numerals, a point and `m`, which are all that a scale needs, from the left end of their base line.
fn write(canvas: &mut Canvas, text: &str, at: DVec2) {
    let unit = NUMERAL_PX / 4.0;
    let mut across = 0.0;
    for letter in text.chars() {
        let (width, strokes) = glyph(letter);
        for stroke in strokes.split(' ') {
            let points: Vec<DVec2> = stroke
                .as_bytes()
                .chunks_exact(2)
                .map(|xy| {
                    let [x, y] = [xy[0], xy[1]].map(|digit| f64::from(digit.saturating_sub(b'0')));
                    at + DVec2::new(across + x, -y) * unit
                })
                .collect();
            canvas.line(&points, false, WHITE, 1.5);
        }
        across += width + 1.2;
    }
}

/// Width and strokes of a letter on a grid 2 wide and 4 high: points `xy`, y up.
fn glyph(letter: char) -> (f64, &'static str) {
    match letter {
        '0' => (2.0, "0004242000"),
        '1' => (1.0, "031410"),
        '2' => (2.0, "042422020020"),
        '3' => (2.0, "04242000 0222"),
        '4' => (2.0, "040222 2420"),
        '5' => (2.0, "240402222000"),
        '6' => (2.0, "240400202202"),
        '7' => (2.0, "042420"),
        '8' => (2.0, "0004242000 0222"),
        '9' => (2.0, "220204242000"),
        '.' => (0.0, "0001"),
        'm' => (2.0, "000323 1310 2320"),
        _ => (2.0, ""),
    }
}
