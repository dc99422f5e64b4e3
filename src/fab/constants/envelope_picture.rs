//! The picture of the load envelope.

use glam::DVec2;

use crate::chart::{Axis, Chart, ChartColor, INK, TextAlign};
use domecast_springs::Limit;

/// Colours of the limits, which people who see few colours can distinguish (Okabe and Ito's set).
const COLORS: [ChartColor; 6] = [
    ChartColor::new([0, 114, 178]),
    ChartColor::new([213, 94, 0]),
    ChartColor::new([0, 158, 115]),
    ChartColor::new([204, 121, 167]),
    ChartColor::new([230, 159, 0]),
    ChartColor::new([0, 0, 0]),
];
/// What is carried, behind the lines.
const CARRIED: ChartColor = ChartColor { rgb: [221, 236, 247], class: "area" };
/// A claimed load.
const CLAIM: ChartColor = ChartColor { rgb: [40, 40, 40], class: "dot" };
const SIZE: DVec2 = DVec2::new(560.0, 420.0);
/// Corners of the plot: left, top, right, bottom.
const PLOT: [f64; 4] = [70.0, 30.0, 540.0, 360.0];
const FONT: f64 = 12.0;

/// The border of pushes and presses (N) at the pole, each stretch in the colour of what ends it, around what the springs
/// carry; `claimed_n` are the design's claimed pushes and presses at the pole.
pub fn envelope_chart(border: &[([f64; 2], Option<Limit>)], claimed_n: &[[f64; 2]]) -> Chart {
    let [left, top, right, bottom] = PLOT;
    let max = |k: usize, sign: f64| 1.1 * border.iter().map(|(p, _)| sign * p[k]).fold(0.1, f64::max);
    let (push, press, pull) = (max(0, 1.0), max(1, 1.0), max(1, -1.0));
    let (across, up) = (Axis::linear(0.0, push, [left, right]), Axis::linear(-pull, press, [bottom, top]));
    let zero = up.px(0.0);
    let mut chart = Chart::new("Push and press at the pole until the first limit", SIZE);
    chart.text(
        DVec2::new(left, 18.0),
        TextAlign::Start,
        FONT,
        INK,
        "Push and press at the pole until the first limit",
    );
    let place = |p: [f64; 2]| DVec2::new(across.px(p[0]), up.px(p[1]));
    // from no push along the border, and back along the axis
    let carried: Vec<DVec2> = border.iter().map(|(p, _)| place(*p)).collect();
    chart.area(&carried, CARRIED);
    chart.line(&[DVec2::new(left, zero), DVec2::new(right, zero)], INK, 1.0);
    chart.line(&[DVec2::new(left, top), DVec2::new(left, bottom)], INK, 1.0);
    for tick in across.ticks() {
        chart.text(DVec2::new(tick.px, zero + 16.0), TextAlign::Middle, FONT, INK, tick.label);
    }
    for tick in up.ticks() {
        chart.line(&[DVec2::new(left - 5.0, tick.px), DVec2::new(left, tick.px)], INK, 1.0);
        chart.text(DVec2::new(left - 9.0, tick.px + 4.0), TextAlign::End, FONT, INK, tick.label);
    }
    chart.text(DVec2::new(right, zero - 6.0), TextAlign::End, FONT, INK, "push, N");
    chart.text(DVec2::new(8.0, top - 12.0), TextAlign::Start, FONT, INK, "press, N");
    let mut names: Vec<&str> = Vec::new();
    for pair in border.windows(2) {
        let [(a, _), (b, limit)] = pair else { continue };
        let name = limit.map_or("nothing", Limit::as_str);
        if !names.contains(&name) {
            names.push(name);
        }
        let color = COLORS[names.iter().position(|n| *n == name).unwrap_or(0) % COLORS.len()];
        chart.line(&[*a, *b].map(place), color, 3.0);
    }
    for [push_n, press_n] in claimed_n {
        chart.disc(place([*push_n, *press_n]), 4.0, CLAIM, true);
    }
    for (i, name) in names.iter().enumerate() {
        let at = DVec2::new(left + 165.0 * (i % 3) as f64, SIZE.y - 34.0 + 18.0 * (i / 3) as f64);
        let swatch = [0.0, 18.0].map(|x| at + DVec2::new(x, -4.0));
        chart.line(&swatch, COLORS[i % COLORS.len()], 3.0);
        chart.text(at + DVec2::new(24.0, 0.0), TextAlign::Start, FONT, INK, name.replace('_', " "));
    }
    chart
}
