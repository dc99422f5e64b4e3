//! The curves over the frames, each with the frames' status below.

use glam::{DVec2, DVec3};

use super::quantities::{QUANTITIES, Quantity};
use super::record::{FrameNumbers, TrackReport};
use domecast_fab::chart::{Axis, Chart, ChartColor, INK, TextAlign};
use domecast_fab::html::{Html, figure, html};

const SIZE: DVec2 = DVec2::new(420.0, 236.0);
/// Corners of the plot: left, top, right, bottom.
pub(super) const PLOT: [f64; 4] = [46.0, 22.0, 414.0, 180.0];
/// Height of the band of statuses, its distance from the plot, and how much of it a good frame fills.
const BAND: f64 = 10.0;
const BAND_GAP: f64 = 4.0;
const OK_PART: f64 = 0.4;
const FONT: f64 = 11.0;
const GRID: ChartColor = ChartColor { rgb: [222, 222, 222], class: "grid" };
/// Lines and their deviations by component: colours that are distinguished by all who see (M. Okabe and K. Ito), dashes in the style.
const LINES: [ChartColor; 4] = [
    ChartColor { rgb: [213, 94, 0], class: "line-x" },
    ChartColor { rgb: [0, 158, 115], class: "line-y" },
    ChartColor { rgb: [0, 114, 178], class: "line-z" },
    INK,
];
const SHADES: [ChartColor; 3] = [
    ChartColor { rgb: [246, 218, 198], class: "shade-x" },
    ChartColor { rgb: [200, 234, 224], class: "shade-y" },
    ChartColor { rgb: [199, 224, 238], class: "shade-z" },
];
const OK: ChartColor = ChartColor { rgb: [76, 143, 199], class: "status-ok" };
const FLAGGED: ChartColor = ChartColor { rgb: [230, 159, 0], class: "status-flagged" };
const NUMBERLESS: ChartColor = ChartColor { rgb: [60, 60, 60], class: "status-none" };

/// The ends of the axis of frames: half of a step beyond the first and the last.
pub(super) fn ends(report: &TrackReport) -> [f64; 2] {
    let half = 0.5 * report.frames.stride() as f64;
    let kept = report.frames.kept();
    let [first, last] = [kept.first(), kept.last()].map(|frame| frame.map_or(0.0, |f| f.frame as f64));
    [first - half, last + half]
}

/// A figure for each quantity that any frame has.
pub(super) fn curves(report: &TrackReport) -> Html {
    let all = QUANTITIES.iter().enumerate();
    let drawn = all.filter(|(index, _)| report.extremes[*index].iter().any(Option::is_some));
    drawn
        .map(|(index, quantity)| {
            let chart = curve(report, index, quantity);
            figure(&chart.to_html(), &format!("{}, {}", quantity.title, quantity.unit))
        })
        .collect()
}

/// What a frame draws: the values and their deviations in the page's unit.
type Shown = (f64, Vec<f64>, Option<DVec3>);

/// Frames with a number, in runs between which there is a gap.
fn runs(report: &TrackReport, index: usize, quantity: &Quantity) -> Vec<Vec<Shown>> {
    let mut runs: Vec<Vec<Shown>> = Vec::new();
    let mut last: Option<u64> = None;
    for frame in report.frames.kept() {
        let Some(reading) = frame.readings[index] else {
            last = None;
            continue;
        };
        let sd = reading.sd.map(|sd| sd * quantity.factor);
        let shown = (frame.frame as f64, quantity.shown(reading.value), sd);
        let is_next = last.is_some_and(|last| frame.frame <= last.saturating_add(report.frames.stride()));
        match runs.last_mut().filter(|_| is_next) {
            Some(run) => run.push(shown),
            None => runs.push(vec![shown]),
        }
        last = Some(frame.frame);
    }
    runs
}

fn curve(report: &TrackReport, index: usize, quantity: &Quantity) -> Chart {
    let runs = runs(report, index, quantity);
    let [left, top, right, bottom] = PLOT;
    let [first, last] = ends(report);
    let across = Axis::linear(first, last, [left, right]);
    let [low, high] = span(&runs, quantity);
    let up = Axis::linear(low, high, [bottom, top]);

    let name = format!("{} in {} over the frames", quantity.title, quantity.unit);
    let mut chart = Chart::new(&name, SIZE);
    axes(&mut chart, &across, &up);
    let count = quantity.components.len();
    for k in 0..count {
        runs.iter().for_each(|run| shade(&mut chart, run, k, &across, &up));
    }
    for k in (0..quantity.names().len()).rev() {
        // a single component is drawn in the colour that shows best
        let color = LINES[if count == 1 { 2 } else { k }];
        for run in &runs {
            let points: Vec<DVec2> = run
                .iter()
                .map(|(frame, values, _)| DVec2::new(across.px(*frame), up.px(values[k])))
                .collect();
            chart.line(&points, color, 1.5);
            if let [point] = points[..] {
                chart.disc(point, 1.5, color, true);
            }
        }
    }
    if count > 1 {
        legend(&mut chart, &quantity.names());
    }
    band(&mut chart, report, &across);
    chart
}

/// The ends of the axis: all values, and of their deviations no more than would double what the values span.
fn span(runs: &[Vec<Shown>], quantity: &Quantity) -> [f64; 2] {
    let values = || runs.iter().flatten().flat_map(|(_, values, _)| values.iter().copied());
    let (min_value, max_value) =
        (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    let reach = (max_value - min_value).max(quantity.min_span);
    let (mut low, mut high) = (min_value, max_value);
    for (_, values, sd) in runs.iter().flatten() {
        let Some(sd) = sd else { continue };
        for (value, sd) in values.iter().zip(sd.to_array()) {
            (low, high) = (low.min(value - sd), high.max(value + sd));
        }
    }
    (low, high) = (low.max(min_value - 0.5 * reach), high.min(max_value + 0.5 * reach));
    let padding = (0.06 * (high - low)).max(0.5 * (quantity.min_span - (high - low)));
    [low - padding, high + padding]
}

/// One deviation to either side of a component, as far as the plot goes.
fn shade(chart: &mut Chart, run: &[Shown], k: usize, across: &Axis, up: &Axis) {
    let color = if run.first().is_some_and(|shown| shown.1.len() == 1) { SHADES[2] } else { SHADES[k] };
    // frames without a deviation part what is shaded
    for part in run.chunk_by(|a, b| a.2.is_some() == b.2.is_some()) {
        let side = |sign: f64| {
            let edge = move |(frame, values, sd): &Shown| {
                let sd = (*sd)?.to_array()[k];
                let y = up.px(values[k] + sign * sd).clamp(PLOT[1], PLOT[3]);
                Some(DVec2::new(across.px(*frame), y))
            };
            part.iter().filter_map(edge)
        };
        let corners: Vec<DVec2> = side(1.0).chain(side(-1.0).collect::<Vec<_>>().into_iter().rev()).collect();
        match corners[..] {
            [] => {}
            [high, low] => chart.line(&[high, low], color, 3.0),
            _ => chart.area(&corners, color),
        }
    }
}

fn axes(chart: &mut Chart, across: &Axis, up: &Axis) {
    let [left, top, right, bottom] = PLOT;
    for tick in up.ticks() {
        chart.line(&[DVec2::new(left, tick.px), DVec2::new(right, tick.px)], GRID, 1.0);
        let label = tick.label.replace('-', "−");
        chart.text(DVec2::new(left - 5.0, tick.px + 4.0), TextAlign::End, FONT, INK, label);
    }
    // There is no half of a frame.
    for tick in across.ticks().into_iter().filter(|tick| tick.value.fract() == 0.0) {
        chart.line(&[DVec2::new(tick.px, top), DVec2::new(tick.px, bottom)], GRID, 1.0);
        let at = DVec2::new(tick.px, bottom + BAND_GAP + BAND + 14.0);
        chart.text(at, TextAlign::Middle, FONT, INK, tick.label);
    }
    chart.line(&[DVec2::new(left, top), DVec2::new(left, bottom), DVec2::new(right, bottom)], INK, 1.0);
    let at = DVec2::new(right, bottom + BAND_GAP + BAND + 28.0);
    chart.text(at, TextAlign::End, FONT, INK, "frame");
    let at = DVec2::new(left - 5.0, bottom + BAND_GAP + BAND - 1.0);
    chart.text(at, TextAlign::End, FONT, INK, "status");
}

fn legend(chart: &mut Chart, names: &[&str]) {
    let mut x = PLOT[0];
    for (name, color) in names.iter().zip(LINES) {
        chart.line(&[DVec2::new(x, 11.0), DVec2::new(x + 20.0, 11.0)], color, 2.0);
        chart.text(DVec2::new(x + 24.0, 15.0), TextAlign::Start, FONT, INK, *name);
        x += 40.0 + 6.0 * name.chars().count() as f64;
    }
}

/// A bar for each run of frames of one status: high where something is wrong.
fn band(chart: &mut Chart, report: &TrackReport, across: &Axis) {
    let stride = report.frames.stride();
    let half = 0.5 * stride as f64;
    let has_number = |frame: &FrameNumbers| frame.readings.iter().any(Option::is_some);
    let is_one = |a: &FrameNumbers, b: &FrameNumbers| {
        a.status == b.status && has_number(a) == has_number(b) && b.frame <= a.frame.saturating_add(stride)
    };
    for run in report.frames.kept().chunk_by(is_one) {
        let [Some(first), Some(last)] = [run.first(), run.last()] else { continue };
        let (color, part) = match (first.status, has_number(first)) {
            ("ok", _) => (OK, OK_PART),
            (_, true) => (FLAGGED, 1.0),
            (_, false) => (NUMBERLESS, 1.0),
        };
        let title = if run.len() == 1 {
            format!("frame {}: {}", first.frame, first.status)
        } else {
            format!("frames {} to {}: {}", first.frame, last.frame, first.status)
        };
        let bottom = PLOT[3] + BAND_GAP + BAND;
        let corners = [
            DVec2::new(across.px(first.frame as f64 - half), bottom - part * BAND),
            DVec2::new(across.px(last.frame as f64 + half), bottom),
        ];
        chart.bar(corners, color, title);
    }
}

/// What the marks of the curves mean.
pub(super) fn explained() -> Html {
    let swatch = |color: ChartColor, part: f64| {
        html!(
            "<svg class=\"chart\" width=\"18\" height=\"12\" viewBox=\"0 0 18 12\" aria-hidden=\"true\"><rect class=\"{}\" \
             x=\"0\" y=\"{}\" width=\"18\" height=\"{}\"/></svg>",
            color.class,
            11.0 - BAND * part,
            BAND * part
        )
    };
    html!(
        "<p>Shaded: one standard deviation to either side, of all causes; where it is much more than the curve, the plot ends within it. A curve has a gap where a frame has no number or is missing. \
         Under each curve the frames' status: {} ok, {} something is wrong but there are numbers, {} no number; nothing where no frame \
         is.</p>\n",
        swatch(OK, OK_PART),
        swatch(FLAGGED, 1.0),
        swatch(NUMBERLESS, 1.0),
    )
}
