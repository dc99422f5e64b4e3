//! Dots and coverage on the page.

use super::Subject;
use super::chart::{bars, histogram};
use super::html::{bar, escape, figure, number, percent, table};
use domecast_design::layout::evenness::Evenness;

/// Drawings of more dots than this stand beside the page, not in it: they would make it heavy.
const MOST_INLINE_BYTES: usize = 1_500_000;

/// Pictures, histograms, evenness, what a pinhole alone would have done, tolerances, lost dots.
pub fn dots(subject: &Subject<'_>) -> String {
    let judged = subject.judged;
    let mut text = String::from("<div class=\"row\">\n");
    text += &figure(
        &subject.shown("artwork/camera-view.png", "The dots and white markers in the camera's view"),
        "In the camera's view (raw image).",
    );
    text += &figure(
        &subject.shown("artwork/outside-view.png", "The dots on the dome from outside"),
        "On the dome, from outside.",
    );
    let film = if subject.file("artwork/dots.svg").is_some_and(|bytes| bytes.len() <= MOST_INLINE_BYTES) {
        subject.shown("artwork/dots.svg", "The film for the pad printer")
    } else {
        "<p>The film is large: <a href=\"../artwork/dots.svg\">artwork/dots.svg</a>.</p>".to_owned()
    };
    text += &figure(&film, "On the film, as the pad takes it.");
    text += "</div>\n";
    text += &format!(
        "<p>{} dots, {} px apart, {} to {} mm across on the dome, from {} film{}.</p>\n",
        judged.dots,
        number(judged.pitch_px),
        number(judged.dot_diameter_mm[0]),
        number(judged.dot_diameter_mm[1]),
        judged.hits.len(),
        if judged.hits.len() == 1 { "" } else { "s" },
    );
    text += "<div class=\"row\">\n";
    for chart in [
        histogram(&nearest(subject, Place::Image), "nearest dot in the image", "px"),
        histogram(&nearest(subject, Place::Dome), "nearest dot on the dome", "mm"),
        histogram(&nearest(subject, Place::Plate), "nearest dot on the film", "mm"),
    ]
    .into_iter()
    .flatten()
    {
        text += &chart;
    }
    text += "</div>\n";
    text += &evenness(subject);
    text += &tolerances(subject);
    if !judged.lost.is_empty() {
        let rows: Vec<Vec<String>> = judged
            .lost
            .iter()
            .take(200)
            .map(|dot| vec![dot.id.to_string(), escape(dot.reason), escape(&dot.because)])
            .collect();
        text += &table(
            &format!("{} dots left out (the first {})", judged.lost.len(), rows.len()),
            &["id", "reason", "because"],
            &rows,
        );
    }
    text
}

#[derive(Clone, Copy)]
enum Place {
    Image,
    Dome,
    Plate,
}

/// Distance of each dot to the nearest of its neighbours; on the film only within one hit.
fn nearest(subject: &Subject<'_>, place: Place) -> Vec<f64> {
    let dots = &subject.layout.dots;
    dots.iter()
        .filter_map(|dot| {
            dot.neighbors
                .iter()
                .filter_map(|id| dots.get(*id as usize))
                .filter(|other| !matches!(place, Place::Plate) || other.hit == dot.hit)
                .map(|other| match place {
                    Place::Image => dot.image_px.distance(other.image_px),
                    Place::Dome => dot.surface_mm.distance(other.surface_mm),
                    Place::Plate => dot.plate_mm.distance(other.plate_mm),
                })
                .min_by(f64::total_cmp)
        })
        .collect()
}

fn evenness(subject: &Subject<'_>) -> String {
    let Some(report) = &subject.judged.evenness else { return String::new() };
    let row = |name: &str, unit: &str, e: &Evenness| {
        vec![
            format!("{name}, {unit}"),
            number(e.nearest.min),
            number(e.nearest.mean),
            number(e.nearest.max),
            percent(e.nearest.variation),
            percent(e.edges.variation),
        ]
    };
    let mut rows = vec![
        row("where the pattern is even", "px", &report.even_frame_px),
        row("raw image", "px", &report.image_px),
        row("dome", "mm", &report.dome_mm),
    ];
    if let Some(plate) = &report.plate_mm {
        rows.push(row("film", "mm", plate));
    }
    if let Some(pinhole) = &subject.judged.pinhole_alone {
        rows.push(row("image, had a pinhole alone placed the dots", "px", &pinhole.image_px));
    }
    let mut text = table(
        "Distance to the nearest neighbour, and its variation (standard deviation over mean)",
        &["", "smallest", "mean", "largest", "variation", "variation of all edges"],
        &rows,
    );
    if let Some(pinhole) = &subject.judged.pinhole_alone {
        text += &format!(
            "<p>Had nothing refracted in the reckoning, the same pattern would stand {} mm off on the dome \
             ({} mm at worst), {} px in the image.</p>\n",
            number(pinhole.mean_shift_mm),
            number(pinhole.max_shift_mm),
            number(pinhole.mean_shift_px),
        );
    }
    text
}

fn tolerances(subject: &Subject<'_>) -> String {
    let Some(report) = &subject.judged.tolerances else { return String::new() };
    let rows: Vec<(String, f64, String)> = report
        .ranking
        .iter()
        .map(|share| {
            let label =
                format!("{}, shifts {} px", percent(share.added_variation), number(share.mean_shift_px));
            (share.tolerance.to_owned(), share.added_variation, label)
        })
        .collect();
    format!(
        "<h3>What tolerances do to it</h3><p>Over {} sensors drawn from <code>tolerances</code>, half vary by at most {} in the \
         image, 19 of 20 by at most {}. Each tolerance alone adds:</p>\n{}",
        report.samples,
        percent(report.nearest_variation_median),
        percent(report.nearest_variation_p95),
        bars(&rows)
    )
}

/// Coverage at rest and under each claimed load.
pub fn coverage(subject: &Subject<'_>) -> String {
    let rows: Vec<Vec<String>> = subject
        .judged
        .coverage
        .iter()
        .map(|record| {
            let Some(found) = &record.coverage else {
                return vec![
                    escape(&record.load),
                    "no balance".into(),
                    "–".into(),
                    "–".into(),
                    "–".into(),
                    "–".into(),
                    "–".into(),
                    "–".into(),
                ];
            };
            vec![
                escape(&record.load),
                bar(found.seen_by_lens, &percent(found.seen_by_lens)),
                bar(found.on_raster, &percent(found.on_raster)),
                bar(found.in_mask, &percent(found.in_mask)),
                bar(found.in_sight, &percent(found.in_sight)),
                found.window_gap_mm.map_or_else(|| "–".into(), |gap| format!("{} mm", number(gap))),
                format!("{}°", number(found.whole_to_deg)),
                found.unseen_dots.len().to_string(),
            ]
        })
        .collect();
    table(
        "Share of the dome's area that is seen through the layers",
        &[
            "load",
            "by the lens",
            "on the raster",
            "in the mask",
            "in sight",
            "nearest to the window",
            "whole up to",
            "dots not whole",
        ],
        &rows,
    )
}
