//! The page of a calibration: before and after, with deviations.

use glam::DVec2;

use super::outcome::{Outcome, TakenLoad};
use super::session::{CalibrationSession, Step};
use super::words::AXES;
use domecast_fab::chart::{Axis, Chart, ChartColor, INK, TextAlign};
use domecast_fab::html::{Html, document, figure, html, table};
use domecast_fab::numbers::{percent, significant};
use domecast_runtime::calibrate::force::SpringKnowledge;
use domecast_runtime::calibrate::light::{LightFit, LightParameter};
use domecast_runtime::calibrate::optics::{OpticsFit, Parameter};
use domecast_runtime::constants::{POSE_AXES, WRENCH_AXES, matrix_of};

const SIZE: DVec2 = DVec2::new(620.0, 300.0);
/// Where the curves begin and end, px.
const ACROSS: [f64; 2] = [52.0, 500.0];
const UP: [f64; 2] = [258.0, 14.0];
/// Least distance of the names at the curves' ends, px.
const NAME_PX: f64 = 14.0;
/// The axis reaches so far beyond the last load: the ends of an axis carry no tick.
const LAST_TICK: f64 = 1e-6;
/// Of the six axes; dark and light pages show all of them.
const COLORS: [[u8; 3]; 6] =
    [[204, 51, 51], [46, 139, 87], [51, 102, 204], [204, 119, 34], [136, 86, 167], [110, 110, 110]];

/// The page.
pub fn page(session: &CalibrationSession, outcome: &Outcome, light: Option<&LightFit>) -> Html {
    let design = &session.nominal.design;
    let title = format!("Calibration of {design}");
    let mut body = html!("<header>\n<h1>{}</h1>\n", title);
    body += html!(
        "<p class=\"soft\">{} steps; deviations are one standard deviation. Before: the design and its tolerances. After: these with \
         what the steps say.</p>\n</header>\n<main>\n",
        session.steps.len()
    );
    if let Some(knowledge) = &outcome.knowledge {
        body += force_chapter(knowledge, outcome);
        body += springs_chapter(session, knowledge);
        body += loads_chapter(session, knowledge, &outcome.loads);
    }
    if let Some(optics) = &outcome.optics {
        body += optics_chapter(optics);
    }
    if let Some(light) = light {
        body += light_chapter(light);
    }
    body += steps_chapter(&session.steps, &outcome.notes);
    body += Html::trusted("</main>\n");
    document(&title, "", &body)
}

/// How well each axis is read.
fn force_chapter(knowledge: &SpringKnowledge, outcome: &Outcome) -> Html {
    let (now, prior, known) = (knowledge.parts(), knowledge.prior_parts(), knowledge.is_known());
    let row = |axis: usize| {
        let what: Html =
            if known[axis] { "known".into() } else { html!("<mark>not known by any load</mark>") };
        vec![AXES[axis].into(), percent(prior[axis]).into(), percent(now[axis]).into(), what]
    };
    let rows: Vec<Vec<Html>> = (0..6).map(row).collect();
    let heads = ["A load along", "Before, sd", "After, sd", ""];
    let chart = history(&outcome.history)
        .map(|chart| figure(&chart.to_html(), "What is open of the reading along each axis after each load."))
        .unwrap_or_default();
    let markers = outcome.centroid_px.filter(|_| !outcome.loads.is_empty()).map(|sd_px| {
        html!(
            "<p class=\"soft\">By these frames a marker's mean place in a step is known to {} px.</p>\n",
            significant(sd_px)
        )
    });
    html!(
        "<h2>How well a force is read</h2>\n<p>Standard deviation of the reading of a load along one axis alone, as far as the springs \
         are open; noise of a frame comes beside it.</p>\n{}{}{}",
        table("", &heads, &rows),
        markers.unwrap_or_default(),
        chart
    )
}

/// Curves of what is open, one for each axis; `None` without a load.
fn history(all: &[[f64; 6]]) -> Option<Chart> {
    if all.len() < 2 {
        return None;
    }
    let max = all.iter().flatten().copied().filter(|v| v.is_finite()).fold(0.01, f64::max);
    let up = Axis::linear(0.0, 105.0 * max, UP);
    let across = Axis::linear(0.0, (all.len() - 1) as f64 + LAST_TICK, ACROSS);
    let mut chart = Chart::new("Open part of the reading along each axis by number of loads", SIZE);
    for tick in up.ticks() {
        let y = up.px(tick.value);
        let ends = ACROSS.map(|x| DVec2::new(x, y));
        chart.line(&ends, ChartColor { class: "grid", ..INK }, 1.0);
        chart.text(
            DVec2::new(ACROSS[0] - 6.0, y + 4.0),
            TextAlign::End,
            11.0,
            INK,
            format!("{} %", tick.label),
        );
    }
    for tick in across.ticks() {
        let x = across.px(tick.value);
        chart.text(DVec2::new(x, UP[0] + 16.0), TextAlign::Middle, 11.0, INK, tick.label);
    }
    let middle = 0.5 * (ACROSS[0] + ACROSS[1]);
    chart.text(DVec2::new(middle, SIZE.y - 6.0), TextAlign::Middle, 11.0, INK, "loads");
    let last = all.last()?;
    let mut ends: Vec<(usize, f64)> = (0..6).map(|axis| (axis, up.px(100.0 * last[axis]))).collect();
    ends.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut above = f64::NEG_INFINITY;
    for (axis, y) in ends {
        let color = ChartColor::new(COLORS[axis]);
        let points: Vec<DVec2> = all
            .iter()
            .enumerate()
            .map(|(k, parts)| DVec2::new(across.px(k as f64), up.px(100.0 * parts[axis])))
            .collect();
        chart.line(&points, color, 2.0);
        // names that would lie on each other stand one below the other
        above = y.max(above + NAME_PX);
        chart.line(&[DVec2::new(ACROSS[1] + 6.0, above), DVec2::new(ACROSS[1] + 20.0, above)], color, 3.0);
        chart.text(DVec2::new(ACROSS[1] + 25.0, above + 4.0), TextAlign::Start, 11.0, INK, AXES[axis]);
    }
    Some(chart)
}

fn springs_chapter(session: &CalibrationSession, knowledge: &SpringKnowledge) -> Html {
    let Some(springs) = &session.nominal.springs else { return Html::default() };
    let (before, after, sd) =
        (matrix_of(&springs.stiffness), knowledge.stiffness(), knowledge.stiffness_sd());
    let prior = knowledge.prior_parts();
    let units = ["N/mm", "N/mm", "N/mm", "N mm/rad", "N mm/rad", "N mm/rad"];
    let row = |i: usize| -> Vec<Html> {
        let value = |v: f64, sd: f64| format!("{} ± {}", significant(v + 0.0), significant(sd));
        vec![
            format!("{} by {}, {}", WRENCH_AXES[i], POSE_AXES[i], units[i]).into(),
            value(before[(i, i)], prior[i] * before[(i, i)]).into(),
            value(after[(i, i)], sd[(i, i)]).into(),
            percent(after[(i, i)] / before[(i, i)] - 1.0).into(),
        ]
    };
    let rows: Vec<Vec<Html>> = (0..6).map(row).collect();
    html!(
        "<h2>Springs</h2>\n{}<p class=\"soft\">The diagonal of the stiffness at rest; the whole 6x6 with its covariance stands in the \
         constants.</p>\n",
        table("", &["Stiffness", "Before", "After", "Change"], &rows)
    )
}

/// What each load was said to be, beside what design and calibration read of it.
fn loads_chapter(session: &CalibrationSession, knowledge: &SpringKnowledge, loads: &[TakenLoad]) -> Html {
    if loads.is_empty() {
        return html!("<h2>Loads</h2>\n<p>None: the springs are those of the design.</p>\n");
    }
    let before = SpringKnowledge::new(&session.nominal).ok();
    let size = |w: Option<[f64; 6]>, said: &[f64; 6]| {
        let off = w.map(|w| [0, 1, 2].map(|i| w[i] - said[i]).iter().map(|v| v * v).sum::<f64>().sqrt());
        off.map_or("–".to_owned(), significant)
    };
    let row = |load: &TakenLoad| -> Vec<Html> {
        let known = &load.known;
        let nominal = before.as_ref().and_then(|springs| springs.wrench(&known.displacement));
        vec![
            load.load.answer().into(),
            size(nominal, &known.wrench).into(),
            size(knowledge.wrench(&known.displacement), &known.wrench).into(),
            significant((load.surprise / 6.0).sqrt()).into(),
        ]
    };
    let rows: Vec<Vec<Html>> = loads.iter().map(row).collect();
    let heads = ["Load", "Force off before, N", "Force off after, N", "Unlike what was known, sd"];
    html!(
        "<h2>Loads</h2>\n{}<p class=\"soft\">The last column compares each load with what was known before it, root mean square over the six \
         axes: about 1 where weights, places and directions hold to what is stated of them.</p>\n",
        table("", &heads, &rows)
    )
}

/// A number before and after.
fn number_row(name: &str, [nominal, value]: [f64; 2], [prior_sd, sd]: [f64; 2], observed: bool) -> Vec<Html> {
    let with_sd = |v: f64, sd: f64| Html::from(format!("{} ± {}", significant(v + 0.0), significant(sd)));
    let what: Html = if observed { "known".into() } else { "the tolerance stands".into() };
    vec![html!("<code>{}</code>", name), with_sd(nominal, prior_sd), with_sd(value, sd), what]
}

fn optics_chapter(optics: &OpticsFit) -> Html {
    let row = |p: &Parameter| number_row(&p.name, [p.nominal, p.value], [p.prior_sd, p.sd], p.observed);
    let rows: Vec<Vec<Html>> = optics.parameters.iter().map(row).collect();
    html!(
        "<h2>Camera, sheet and markers</h2>\n<p>{} frames; residuals of the marks {} px rms before, {} after.</p>\n{}",
        optics.poses.len(),
        significant(optics.rms_px[0]),
        significant(optics.rms_px[1]),
        table("", &["Number (mm, rad, 1)", "Before", "After", ""], &rows)
    )
}

fn light_chapter(light: &LightFit) -> Html {
    let row = |p: &LightParameter| number_row(&p.name, [p.nominal, p.value], [p.prior_sd, p.sd], p.observed);
    let rows: Vec<Vec<Html>> = light.parameters.iter().map(row).collect();
    html!(
        "<h2>Lights</h2>\n<p>{} presses of a ball; residuals of the levels under it {} of 255 rms with the light of the frame at rest, {} \
         after all. The presses themselves say a radius of some {} mm.</p>\n{}",
        light.presses.len(),
        significant(light.rms_levels[0]),
        significant(light.rms_levels[1]),
        significant(light.radius_mm),
        table("", &["Number (mW, mm, rad, 1)", "Before", "After", ""], &rows)
    )
}

fn steps_chapter(steps: &[Step], notes: &[String]) -> Html {
    let row = |step: &Step| html!("<li><code>{}</code>: {}</li>\n", step.name, step.said);
    let note = |note: &String| html!("<p>{}.</p>\n", note);
    html!(
        "<h2>Steps</h2>\n<ul>\n{}</ul>\n{}",
        steps.iter().map(row).collect::<Html>(),
        notes.iter().map(note).collect::<Html>()
    )
}
