//! The lit sensor on the page.

use super::subject::ReportSubject;
use crate::html::{Html, figure, html, table};
use crate::light::{MarkerLevels, Separation};
use crate::numbers::{percent, typeset};

/// The frame, how even the dome is, and how the markers stand out.
pub(super) fn chapter(subject: &ReportSubject<'_>) -> Html {
    let report = subject.light;
    let dome = &report.dome;
    let [red, green, blue] = dome.median_rgb.map(typeset);
    let rows: Vec<Vec<Html>> = [
        ("median", typeset(dome.median_level)),
        ("one place in twenty is darker than", typeset(dome.percentile_5_level)),
        ("one place in twenty is brighter than", typeset(dome.percentile_95_level)),
        ("median of red / green / blue", format!("{red} / {green} / {blue}")),
        ("in the platform's shadow", percent(dome.shadow_share)),
        ("cut off at full scale", percent(dome.saturated_share)),
    ]
    .map(|(name, value)| vec![name.into(), value.into()])
    .into();
    let separation = report.separation.map(separation_rows).unwrap_or_default();
    html!(
        "<div class=\"row\">\n{}{}</div>\n<p>Exposure and gain: level {} for each mW/mm² on a white surface{}.</p>\n{}{}{}",
        figure(
            &subject.shown("report/light-frame.png", "The sensor at rest under its own lights"),
            "The frame at rest, with every effect of light.",
        ),
        figure(
            &subject.shown("report/light-map.png", "How even the light on the dome is"),
            "Grey level over its median: blue is darker, white the median, red twice as bright.",
        ),
        typeset(report.level_per_mw_mm2),
        if report.is_exposure_at_limit { ", the camera's largest" } else { "" },
        table("Grey level of the dome in view, of 255", &["", "value"], &rows),
        table(
            "What the colours tell of the dome's normals; domecast illuminate has the maps",
            &["", "value"],
            &separation
        ),
        markers(&report.markers),
    )
}

/// How the white markers stand out.
pub(crate) fn markers(markers: &[MarkerLevels]) -> Html {
    let row = |marker: &MarkerLevels| {
        vec![
            html!("{}", marker.id),
            typeset(marker.level).into(),
            typeset(marker.contrast_levels).into(),
            format!("{} px", typeset(marker.centroid_sd_px)).into(),
        ]
    };
    let rows: Vec<Vec<Html>> = markers.iter().map(row).collect();
    table(
        "White markers, levels of 255",
        &["marker", "level", "above what is around", "centroid known to"],
        &rows,
    )
}

/// What the lights' colours tell of normals; a dash where one place in twenty lacks a colour.
fn separation_rows(separation: Separation) -> Vec<Vec<Html>> {
    let or_dash = |value: Option<f64>| value.map_or("–".to_owned(), typeset);
    let error = separation.normal_error_deg_per_level_p95_to_60_deg;
    let degrees = error.map_or("–".to_owned(), |deg| format!("{}°", typeset(deg)));
    let rows = [
        ("error of a normal for one grey level, 95th percentile to 60° from the pole", degrees),
        (
            "condition number of crosstalk and direct light, 95th percentile to 60°",
            or_dash(separation.condition_number_p95_to_60_deg),
        ),
        (
            "hardly any slope in color: area within 45° where that error is above 5°",
            percent(separation.blind_share_to_45_deg),
        ),
        (
            "crescents: area within 75° where a colour is below a twentieth of its median",
            percent(separation.crescent_share_to_75_deg),
        ),
    ];
    rows.map(|(name, value)| vec![name.into(), value.into()]).into()
}
