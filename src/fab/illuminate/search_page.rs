//! The chapters of the page that are about other lights: tilt and diffuser, and what a search found.

use glam::DVec2;

use super::numbers::Percentiles;
use super::optimize::{FrontPoint, LightsSummary, Optimization};
use super::tilt::{COLORS, TiltStudy};
use crate::chart::{Axis, Chart, INK, TextAlign};
use crate::html::{Html, figure, html, table};
use crate::numbers::{dimension, percent, typeset};

/// Both charts of the study.
pub(super) fn tilt(study: &TiltStudy) -> Html {
    let charts = [
        (
            study.error_chart(),
            "Error of the normals to 60° for one grey level, over the lights' tilt; median and 95th percentile.",
        ),
        (
            study.evenness_chart(),
            "Standard deviation over mean of the colours' sum to 60°, over the lights' tilt.",
        ),
    ];
    let shown: Html = charts.iter().map(|(chart, caption)| figure(&chart.to_html(), caption)).collect();
    html!(
        "<section id=\"tilt\">\n<h2>Tilt and diffuser</h2>\n<p>The lights where they stand, leaning from 0° (facing up) to 90° \
         (facing the axis), bare and behind diffusers. The platform's shadow is left out: other tilts have no pits in it. Numbers \
         in <code>tilt.json</code>.</p>\n<div class=\"row\">\n{}</div>\n</section>\n",
        shown
    )
}

/// What a search found.
pub(super) fn search(searched: &Optimization) -> Html {
    let report = &searched.report;
    let intro = match (&report.best, searched.proposal_name()) {
        (Some(_), Some(name)) => html!(
            "<p>{} lights looked at, {} of them through the build's checks; the search {}. The design with the lights found is <a \
             href=\"{3}\">{3}</a>, which builds as it is.</p>\n",
            report.evaluations,
            report.verified,
            status(searched),
            name
        ),
        _ => html!(
            "<p>{} lights looked at; the search {}. None that can be made is better than the given ones.</p>\n",
            report.evaluations,
            status(searched)
        ),
    };
    let mut columns = vec!["", "given"];
    let mut ends = vec![&report.start];
    if let Some(best) = &report.best {
        columns.push("found");
        ends.push(best);
    }
    let row = |name: &str, cell: &dyn Fn(&LightsSummary) -> String| -> Vec<Html> {
        std::iter::once(Html::from(name)).chain(ends.iter().map(|lights| Html::from(cell(lights)))).collect()
    };
    let rows = vec![
        row("error of the normal, 95th percentile, as above", &|lights| {
            number(lights.illuminate_normal_error_p95_deg_per_level, "°")
        }),
        row("by direct light at the search's places, 5th / 50th / 95th percentile", &|lights| {
            three(lights.score.normal_error_deg_per_level, "°")
        }),
        row("condition number, 5th / 50th / 95th percentile", &|lights| {
            three(lights.score.condition_number, "")
        }),
        row("sum of the colours: standard deviation over mean", &|lights| {
            lights.score.sum_coefficient_of_variation.map_or("–".into(), percent)
        }),
        row("crescents within 75°, of the area", &|lights| percent(lights.score.crescent_share_to_75_deg)),
        row("lights", &|lights| lights.list.len().to_string()),
        row("distance from the axis, mm", &|lights| dimension(lights.place.center_radius_mm)),
        row("height, mm", &|lights| dimension(lights.place.center_z_mm)),
        row("tilt", &|lights| format!("{}°", dimension(lights.place.tilt_deg))),
        row("top of the lip, mm", &|lights| dimension(lights.lip_top_z_mm)),
        row("underside of the upper platform, mm", &|lights| dimension(lights.underside_z_mm)),
        row("height of the sensor, mm", &|lights| dimension(lights.height_mm)),
    ];
    let off: Vec<Vec<Html>> = report
        .sensitivities
        .iter()
        .map(|one| {
            vec![
                Html::from(one.change.as_str()),
                number(one.normal_error_p95_deg_per_level, "°").into(),
                number(one.ratio, "").into(),
            ]
        })
        .collect();
    let caption = format!("Lights from the pole to {}°", typeset(report.polar_angle_deg));
    let mut found = html!(
        "<section id=\"search\">\n<h2>Search for lights</h2>\n{}{}",
        intro,
        table(&caption, &columns, &rows)
    );
    if !report.front.is_empty() {
        let caption = "Lights that no others found are better than in error, evenness, count and height together; a disc for each \
                       number of lights, the found one filled.";
        found += figure(&front(&report.front).to_html(), caption);
    }
    if !off.is_empty() {
        let heads = ["change by itself", "error of the normal, 95th percentile", "over the unchanged"];
        found += table("What being off by a little does to what was found", &heads, &off);
    }
    found + Html::trusted("</section>\n")
}

fn status(searched: &Optimization) -> &'static str {
    use super::optimize::SearchStatus;
    match searched.report.status {
        SearchStatus::Converged => "converged",
        SearchStatus::EvaluationsUsedUp => "used up what it was allowed",
        SearchStatus::Interrupted => "was interrupted",
    }
}

fn number(value: Option<f64>, unit: &str) -> String {
    value.map_or("–".into(), |value| format!("{}{unit}", typeset(value)))
}

fn three(of: Percentiles, unit: &str) -> String {
    [of.p5, of.p50, of.p95].map(|value| number(value, unit)).join(" / ")
}

/// Unevenness over the error of normals.
fn front(points: &[FrontPoint]) -> Chart {
    let mut chart = Chart::new("Evenness against the error of normals", DVec2::new(560.0, 320.0));
    let range = |value: &dyn Fn(&FrontPoint) -> f64| {
        let all = || points.iter().map(value);
        let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max));
        let margin = (0.15 * (high - low)).max(0.05 * high).max(1e-9);
        (low - margin, high + margin)
    };
    let (low, high) = range(&|point| point.normal_error_p95_deg_per_level);
    let across = Axis::linear(low, high, [60.0, 430.0]);
    let (low, high) = range(&|point| point.sum_coefficient_of_variation);
    let up = Axis::linear(low, high, [270.0, 20.0]);
    let corner = [DVec2::new(60.0, 20.0), DVec2::new(60.0, 270.0), DVec2::new(430.0, 270.0)];
    chart.line(&corner, INK, 1.0);
    for tick in across.ticks() {
        chart.text(DVec2::new(tick.px, 286.0), TextAlign::Middle, 11.0, INK, tick.label);
    }
    for tick in up.ticks() {
        chart.text(DVec2::new(55.0, tick.px + 4.0), TextAlign::End, 11.0, INK, tick.label);
    }
    let below = "error of normals, 95th percentile, degrees a grey level";
    chart.text(DVec2::new(245.0, 308.0), TextAlign::Middle, 12.0, INK, below);
    let mut counts: Vec<usize> = points.iter().map(|point| point.lights).collect();
    counts.sort_unstable();
    counts.dedup();
    for (index, (count, color)) in counts.iter().zip(COLORS).enumerate() {
        for (rank, point) in points.iter().enumerate().filter(|(_, point)| point.lights == *count) {
            let at = DVec2::new(
                across.px(point.normal_error_p95_deg_per_level),
                up.px(point.sum_coefficient_of_variation),
            );
            chart.disc(at, 5.0, color, rank == 0);
        }
        let at = 40.0 + 18.0 * index as f64;
        chart.disc(DVec2::new(452.0, at - 4.0), 5.0, color, false);
        chart.text(DVec2::new(464.0, at), TextAlign::Start, 12.0, INK, format!("{count} lights"));
    }
    chart
}
