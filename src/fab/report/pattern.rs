//! Dots and coverage on the page.

use super::subject::ReportSubject;
use crate::chart::histogram;
use crate::html::{Html, bar, bars, figure, html, table};
use crate::numbers::{percent, typeset};
use domecast_design::layout::evenness::Evenness;

/// Larger drawings of dots stand beside the page, not in it: they would make it heavy.
const MAX_INLINE_BYTES: usize = 300_000;
/// Dots left out that are listed one by one.
const MAX_LISTED: usize = 200;

/// Pictures, histograms, evenness, placement without refraction, tolerances, lost dots.
pub(super) fn dots(subject: &ReportSubject<'_>) -> Html {
    let judged = subject.judged;
    let film = if subject.file("artwork/dots.svg").is_some_and(|bytes| bytes.len() <= MAX_INLINE_BYTES) {
        subject.drawn("artwork/dots.svg", "The film for the pad printer")
    } else {
        html!("<p>The film is large: <a href=\"../artwork/dots.svg\">artwork/dots.svg</a>.</p>")
    };
    let charts = [
        histogram(&nearest(subject, Place::Image), "nearest dot in the image", "px"),
        histogram(&nearest(subject, Place::Dome), "nearest dot on the dome", "mm"),
        histogram(&nearest(subject, Place::Plate), "nearest dot on the film", "mm"),
    ];
    html!(
        "<div class=\"row\">\n{}{}{}</div>\n<p>{} dots, {} px apart, {} to {} mm across on the dome, from {} film{}.</p>\n\
         {}<div class=\"row\">\n{}</div>\n{}{}{}",
        figure(
            &subject.shown("artwork/camera-view.png", "The dots and white markers in the camera's view"),
            "In the camera's view (raw image).",
        ),
        figure(
            &subject.drawn("artwork/outside-view.png", "The dots on the dome from outside"),
            "On the dome, from outside.",
        ),
        figure(&film, "On the film, as the pad takes it."),
        judged.dots,
        typeset(judged.pitch_px),
        typeset(judged.dot_diameter_mm[0]),
        typeset(judged.dot_diameter_mm[1]),
        judged.passes.len(),
        if judged.passes.len() == 1 { "" } else { "s" },
        spacing(subject),
        charts.iter().flatten().map(crate::chart::Chart::to_html).collect::<Html>(),
        evenness(subject),
        tolerances(subject),
        key(subject) + lost(subject),
    )
}

/// The dot that is left out on purpose.
fn key(subject: &ReportSubject<'_>) -> Html {
    let Some(key) = &subject.judged.key else { return Html::default() };
    html!(
        "<p>One dot is left out at ({}, {}) px, ringed in the camera's view: {}.</p>\n",
        typeset(key.image_px[0]),
        typeset(key.image_px[1]),
        key.because.as_str(),
    )
}

fn lost(subject: &ReportSubject<'_>) -> Html {
    let lost = &subject.judged.lost;
    if lost.is_empty() {
        return Html::default();
    }
    let rows: Vec<Vec<Html>> = lost
        .iter()
        .take(MAX_LISTED)
        .map(|dot| vec![html!("{}", dot.id), dot.reason.into(), dot.because.as_str().into()])
        .collect();
    table(
        &format!("{} dots left out (the first {})", lost.len(), rows.len()),
        &["id", "reason", "because"],
        &rows,
    )
}

#[derive(Clone, Copy)]
enum Place {
    Image,
    Dome,
    Plate,
}

/// Distance of each dot to the nearest of its neighbours; on the film only within one print pass.
fn nearest(subject: &ReportSubject<'_>, place: Place) -> Vec<f64> {
    let dots = &subject.layout.dots;
    dots.iter()
        .filter_map(|dot| {
            dot.neighbors
                .iter()
                .filter_map(|id| dots.get(*id as usize))
                .filter(|other| !matches!(place, Place::Plate) || other.pass == dot.pass)
                .map(|other| match place {
                    Place::Image => dot.image_px.distance(other.image_px),
                    Place::Dome => dot.surface_mm.distance(other.surface_mm),
                    Place::Plate => dot.plate_mm.distance(other.plate_mm),
                })
                .min_by(f64::total_cmp)
        })
        .collect()
}

/// What the histograms below it show.
fn spacing(subject: &ReportSubject<'_>) -> Html {
    let Some(report) = &subject.judged.evenness else { return Html::default() };
    let on_film = report.plate_mm.as_ref().map_or_else(String::new, |plate| {
        format!(" and by {} on the film", percent(plate.nearest.variation))
    });
    html!(
        "<p>Each dot's distance to its nearest neighbour varies by {} in the image, and therefore by {} on the dome{}:</p>\n",
        percent(report.image_px.nearest.variation),
        percent(report.dome_mm.nearest.variation),
        on_film,
    )
}

fn evenness(subject: &ReportSubject<'_>) -> Html {
    let Some(report) = &subject.judged.evenness else { return Html::default() };
    let row = |name: &str, unit: &str, e: &Evenness| {
        vec![
            format!("{name}, {unit}").into(),
            typeset(e.nearest.min).into(),
            typeset(e.nearest.mean).into(),
            typeset(e.nearest.max).into(),
            percent(e.nearest.variation).into(),
            percent(e.edges.variation).into(),
        ]
    };
    let mut rows = vec![
        row("where the pattern is even", "px", &report.even_frame_px),
        row("raw image", "px", &report.image_px),
        row("dome", "mm", &report.dome_mm),
    ];
    rows.extend(report.plate_mm.as_ref().map(|plate| row("film", "mm", plate)));
    let pinhole = subject.judged.pinhole_alone.as_ref();
    rows.extend(pinhole.map(|pinhole| row("image, dots placed without refraction", "px", &pinhole.image_px)));
    table(
        "Distance to the nearest neighbour, and its variation (standard deviation over mean)",
        &["", "smallest", "mean", "largest", "variation", "variation of all edges"],
        &rows,
    ) + pinhole.map_or_else(Html::default, |pinhole| {
        html!(
            "<p>Without refraction in the model, the same pattern would lie {} mm off on the dome ({} mm at most), {} px \
             in the image.</p>\n",
            typeset(pinhole.mean_shift_mm),
            typeset(pinhole.max_shift_mm),
            typeset(pinhole.mean_shift_px),
        )
    })
}

fn tolerances(subject: &ReportSubject<'_>) -> Html {
    let Some(report) = &subject.judged.tolerances else { return Html::default() };
    let rows: Vec<(String, f64, String)> = report
        .ranking
        .iter()
        .map(|share| {
            let label =
                format!("{}, shifts {} px", percent(share.added_variation), typeset(share.mean_shift_px));
            (share.tolerance.to_owned(), share.added_variation, label)
        })
        .collect();
    html!(
        "<h3>What tolerances do to it</h3><p>Over {} sensors drawn from <code>tolerances</code>, the variation in the image \
         is at most {} for half of them and at most {} for 19 of 20. Each tolerance alone adds:</p>\n{}",
        report.samples,
        percent(report.nearest_variation_median),
        percent(report.nearest_variation_p95),
        bars(&rows),
    )
}

/// Coverage at rest and under each claimed load.
pub(super) fn coverage(subject: &ReportSubject<'_>) -> Html {
    const HEADS: [&str; 8] = [
        "load",
        "by the lens",
        "in the image",
        "in the mask",
        "visible",
        "nearest to the window",
        "fully visible up to",
        "partly visible dots",
    ];
    let rows: Vec<Vec<Html>> = subject
        .judged
        .coverage
        .iter()
        .map(|record| {
            let mut row = vec![record.load.as_str().into()];
            match &record.coverage {
                Some(found) => row.extend([
                    bar(found.seen_by_lens, &percent(found.seen_by_lens)),
                    bar(found.on_raster, &percent(found.on_raster)),
                    bar(found.in_mask, &percent(found.in_mask)),
                    bar(found.in_sight, &percent(found.in_sight)),
                    found
                        .window_gap_mm
                        .map_or_else(|| "–".into(), |gap| format!("{} mm", typeset(gap)))
                        .into(),
                    format!("{}°", typeset(found.whole_to_deg)).into(),
                    html!("{}", found.unseen_dots.len()),
                ]),
                None => {
                    row.push("no equilibrium".into());
                    row.resize(HEADS.len(), "–".into());
                }
            }
            row
        })
        .collect();
    let notes = subject.design.notes().iter().map(|note| html!("<p>{}.</p>\n", note));
    notes.collect::<Html>() + table("Share of the dome's area that is seen through the layers", &HEADS, &rows)
}
