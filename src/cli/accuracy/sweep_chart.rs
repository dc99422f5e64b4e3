//! The picture of a sweep: error over time on logarithmic axes.

use glam::DVec2;

use super::sweep::{Sweep, SweepSample};
use domecast_fab::chart::{Axis, Chart, ChartColor, INK, TextAlign};
use domecast_fab::numbers::significant;

const SIZE: DVec2 = DVec2::new(640.0, 430.0);
/// Corners of the plot: left, top, right, bottom.
const PLOT: [f64; 4] = [86.0, 62.0, 610.0, 366.0];
const FAINT: ChartColor = ChartColor { rgb: [222, 222, 222], class: "grid" };
const DOMINATED: ChartColor = ChartColor::new([150, 150, 150]);
const FRONT: ChartColor = ChartColor::new([0, 114, 178]);
const IN_USE: ChartColor = ChartColor::new([213, 94, 0]);
const MEETS: ChartColor = ChartColor::new([0, 158, 115]);
// Sizes of the font, px.
const TITLE: f64 = 17.6;
const NAME: f64 = 11.2;
const LABEL: f64 = 9.6;
const LEGEND: f64 = 8.8;

/// The sweep's samples by time and error, the Pareto front, what is in use and what meets the design's accuracy. `None`
/// where no sample has an error and a time that a logarithm takes.
pub fn sweep_chart(sweep: &Sweep) -> Option<Chart> {
    let floor = sweep.noise_floor();
    let error = |sample: &SweepSample| sample.max_error.max(floor).max(f64::MIN_POSITIVE);
    let usable = |sample: &&SweepSample| {
        sample.max_error.is_finite() && sample.time.median_s > 0.0 && error(sample) > 1e-300
    };
    let samples: Vec<&SweepSample> = sweep.samples.iter().filter(usable).collect();
    let mut errors: Vec<f64> = samples.iter().map(|sample| error(sample)).collect();
    errors.extend(sweep.asked.filter(|asked| *asked > 0.0));
    let per_item = |sample: &SweepSample, s: f64| s * sample.per_item_s / sample.time.median_s;
    // the axis holds the spread as well
    let spread = |sample: &&SweepSample| {
        let time = sample.time;
        [time.lower_quartile_s, time.median_s, time.upper_quartile_s].map(|s| per_item(sample, s))
    };
    let times: Vec<f64> = samples.iter().flat_map(spread).collect();
    let [left, top, right, bottom] = PLOT;
    let (across, up) = (Axis::decades(&times, [left, right])?, Axis::decades(&errors, [bottom, top])?);
    let place = |time: f64, error: f64| DVec2::new(across.px(time), up.px(error));

    let mut chart = Chart::new(&sweep.title, SIZE);
    frame(&mut chart, sweep, &across, &up);
    if let Some(asked) = sweep.asked {
        let y = up.px(asked);
        chart.line(&[DVec2::new(left, y), DVec2::new(right, y)], MEETS, 1.5);
        let text = format!("asked: {} {}", significant(asked), sweep.unit);
        chart.text(DVec2::new(right, y - 5.0), TextAlign::End, LABEL, MEETS, text);
    }
    let mut front: Vec<&SweepSample> = samples.iter().copied().filter(|sample| !sample.dominated).collect();
    front.sort_by(|a, b| a.time.median_s.total_cmp(&b.time.median_s));
    let line: Vec<DVec2> = front.iter().map(|sample| place(sample.per_item_s, error(sample))).collect();
    chart.line(&line, FRONT, 2.0);
    for sample in &samples {
        let color = if sample.dominated { DOMINATED } else { FRONT };
        let quartiles = [sample.time.lower_quartile_s, sample.time.upper_quartile_s];
        chart.line(&quartiles.map(|s| place(per_item(sample, s), error(sample))), color, 1.0);
        chart.disc(place(sample.per_item_s, error(sample)), 4.0, color, !sample.dominated);
    }
    for (index, color, radius) in [(sweep.in_use, IN_USE, 8.0), (sweep.meets, MEETS, 11.0)] {
        if let Some(sample) = index.and_then(|index| sweep.samples.get(index)).filter(|s| usable(s)) {
            chart.disc(place(sample.per_item_s, error(sample)), radius, color, false);
        }
    }
    legend(&mut chart, sweep);
    Some(chart)
}

/// Title, grid and axes.
fn frame(chart: &mut Chart, sweep: &Sweep, across: &Axis, up: &Axis) {
    let [left, top, right, bottom] = PLOT;
    chart.text(DVec2::new(16.0, 24.0), TextAlign::Start, TITLE, INK, sweep.title.as_str());
    chart.text(DVec2::new(16.0, 42.0), TextAlign::Start, NAME, INK, format!("error, {}", sweep.unit));
    let name = format!("time for one {}, s", sweep.item);
    chart.text(DVec2::new(right, bottom + 32.0), TextAlign::End, NAME, INK, name);
    for tick in across.ticks() {
        chart.line(&[DVec2::new(tick.px, top), DVec2::new(tick.px, bottom)], FAINT, 1.0);
        chart.text(DVec2::new(tick.px, bottom + 15.0), TextAlign::Middle, LABEL, INK, tick.label);
    }
    for tick in up.ticks().into_iter().filter(|tick| !tick.label.is_empty()) {
        chart.line(&[DVec2::new(left, tick.px), DVec2::new(right, tick.px)], FAINT, 1.0);
        chart.text(DVec2::new(left - 8.0, tick.px + 3.0), TextAlign::End, LABEL, INK, tick.label);
    }
    chart.line(&[DVec2::new(left, top), DVec2::new(left, bottom), DVec2::new(right, bottom)], INK, 1.5);
}

fn legend(chart: &mut Chart, sweep: &Sweep) {
    let y = SIZE.y - 14.0;
    let named = |index: Option<usize>| index.and_then(|index| sweep.samples.get(index)).map(|s| &s.label);
    let mut entries = vec![(FRONT, "Pareto front".to_owned()), (DOMINATED, "dominated".to_owned())];
    entries.extend(named(sweep.in_use).map(|label| (IN_USE, format!("in use: {label}"))));
    entries.extend(named(sweep.meets).map(|label| (MEETS, format!("enough: {label}"))));
    let mut x = 16.0;
    for (color, text) in entries {
        chart.disc(DVec2::new(x + 4.0, y - 3.0), 4.0, color, color == FRONT);
        let width = text.chars().count() as f64 * 5.1;
        chart.text(DVec2::new(x + 13.0, y), TextAlign::Start, LEGEND, INK, text);
        x += 13.0 + width + 12.0;
    }
}
