//! The page of `illuminate`: one file that opens from a disk.

use super::crescents::{COLORS, Crescent};
use super::maps::Map;
use super::numbers::{IlluminationReport, LightEvenness, Percentiles, Within};
use super::optimize::Optimization;
use super::search_page;
use super::tilt::TiltStudy;
use crate::html::{Html, color_bar, document, figure, html, picture, table};
use crate::numbers::{percent, typeset};
use crate::report::markers;
use domecast_runtime::overlay::VIRIDIS;

/// Crescents that the page lists; the JSON has all.
const MAX_CRESCENTS: usize = 12;

/// The numbers in short, the maps, then the tables.
pub(super) fn page(
    report: &IlluminationReport,
    maps: &[Map],
    study: &TiltStudy,
    searched: Option<&Optimization>,
) -> Html {
    let figures = |kind: &str| -> Html {
        let of_kind = maps.iter().filter(|map| map.name.starts_with(kind));
        of_kind
            .map(|map| {
                let caption = format!("{}; {}.", map.title, map.scale);
                figure(&picture("image/png", &map.png, &map.title, ""), &caption)
            })
            .collect()
    };
    let body = html!(
        "<header>\n<h1>Light on the dome: {0}</h1>\n<p \
         class=\"soft\">domecast {1}. At rest, exposure and gain: level {2} for each mW/mm² on a white \
         surface{3}.</p>\n<nav aria-label=\"Chapters\"><ul>\n<li><a href=\"#numbers\">Numbers</a></li>\n<li><a \
         href=\"#dome\">On the dome</a></li>\n<li><a href=\"#image\">In the image</a></li>\n<li><a \
         href=\"#seen\">Markers, dots, reflections</a></li>\n<li><a href=\"#tilt\">Tilt and \
         diffuser</a></li>\n{9}</ul></nav>\n</header>\n<main>\n<section id=\"numbers\">\n\
         <h2>Numbers</h2>\n{4}</section>\n<section id=\"dome\">\n<h2>On the dome</h2>\n<p>Seen from outside: the pole in the \
         middle, x to the right, y up; circles at polar angles of 45°, 60° and 75°.</p>\n{5}<div \
         class=\"row\">\n{6}</div>\n</section>\n<section id=\"image\">\n<h2>In the image</h2>\n<div \
         class=\"row\">\n{7}</div>\n</section>\n<section id=\"seen\">\n<h2>Markers, dots, \
         reflections</h2>\n{8}</section>\n{10}{11}</main>\n",
        report.design,
        report.domecast,
        typeset(report.level_per_mw_mm2),
        if report.is_exposure_at_limit { ", the camera's largest" } else { "" },
        numbers(report),
        color_bar(&VIRIDIS, "low", "high"),
        figures("dome"),
        figures("image"),
        seen(report),
        Html::trusted(if searched.is_some() {
            "<li><a href=\"#search\">Search for lights</a></li>\n"
        } else {
            ""
        }),
        search_page::tilt(study),
        searched.map(search_page::search).unwrap_or_default(),
    );
    document(&format!("Light on the dome: {}", report.design), "", &body)
}

fn or_dash(value: Option<f64>, unit: &str) -> String {
    value.map_or("–".into(), |value| format!("{}{unit}", typeset(value)))
}

fn three(of: Percentiles, unit: &str) -> Html {
    [of.p5, of.p50, of.p95].map(|value| or_dash(value, unit)).join(" / ").into()
}

fn numbers(report: &IlluminationReport) -> Html {
    let heads: Vec<String> =
        report.within.iter().map(|one| format!("to {}°", typeset(one.polar_angle_deg))).collect();
    let mut columns = vec![""];
    columns.extend(heads.iter().map(String::as_str));
    let row = |name: &str, cell: &dyn Fn(&Within) -> Html| -> Vec<Html> {
        std::iter::once(Html::from(name)).chain(report.within.iter().map(cell)).collect()
    };
    let channel = |c: usize, of: &dyn Fn(&Within) -> &LightEvenness, name: &str| {
        row(&format!("{name}, {}: 95th over 5th percentile (factor)", COLORS[c]), &|one| {
            or_dash(of(one).p95_over_p5[c], "").into()
        })
    };
    let direct = |one: &Within| one.direct.clone();
    let mut rows = vec![
        row("error of the normal for one grey level, 5th / 50th / 95th percentile", &|one| {
            three(one.normal_error_deg_per_level, "°")
        }),
        row("condition number, 5th / 50th / 95th percentile", &|one| three(one.condition_number, "")),
        row("crescents, of the area", &|one| percent(one.crescent_share).into()),
        row("cut off at full scale, of the places seen", &|one| percent(one.saturated_share).into()),
        row("sum of the direct light: standard deviation over mean", &|one| {
            direct(one).sum_coefficient_of_variation.map_or("–".into(), percent).into()
        }),
    ];
    rows.extend((0..3).map(|c| channel(c, &|one| &one.direct, "direct light")));
    rows.extend((0..3).map(|c| channel(c, &|one| &one.total, "with the dome lighting itself")));
    let crescent = |one: &Crescent| {
        vec![
            one.color.into(),
            percent(one.share_of_dome).into(),
            format!("{}°", typeset(one.azimuth_deg.round() % 360.0)).into(),
            format!("{}° to {}°", typeset(one.min_polar_deg), typeset(one.max_polar_deg)).into(),
        ]
    };
    let crescents: Vec<Vec<Html>> = report.crescents.iter().take(MAX_CRESCENTS).map(crescent).collect();
    let listed = if crescents.is_empty() {
        html!("<p>No crescents: within 75° no colour is below a twentieth of its median.</p>\n")
    } else {
        table(
            "Crescents: connected places within 75° where a colour is below a twentieth of its median",
            &["colour", "of the dome", "mean azimuth", "polar angles"],
            &crescents,
        )
    };
    html!("{}{}", table("Light from the pole to a polar angle, by area", &columns, &rows), listed)
}

fn seen(report: &IlluminationReport) -> Html {
    let dots = &report.dots;
    let seen = &report.lights_seen;
    let markers = if report.markers.is_empty() {
        html!("<p>No white markers.</p>\n")
    } else {
        markers(&report.markers)
    };
    let at = seen.brightest_mirrored_px.map_or(String::new(), |[x, y]| {
        format!(
            " The brightest adds {} levels at ({}, {}) px.",
            or_dash(seen.brightest_mirrored_level, ""),
            typeset(x),
            typeset(y)
        )
    });
    html!(
        "{}<p>Dots are darker than the dome around them by {} / {} / {} levels at the 5th / 50th / 95th percentile of the \
         dome's grey level.</p>\n<p>Pieces of the lights mirrored in the faces of sheet and silicone, in the image: {}.{} \
         Lights that shine straight into the lens are refused by <code>domecast build</code>.</p>\n",
        markers,
        typeset(dots.p5_levels),
        typeset(dots.p50_levels),
        typeset(dots.p95_levels),
        seen.mirrored_pieces,
        at,
    )
}
