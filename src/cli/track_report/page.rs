//! The page: in short, the skin, the curves.

use super::curves::{curves, explained};
use super::data::{data, skin_bytes};
use super::quantities::QUANTITIES;
use super::record::{Extremes, TrackReport};
use super::still::{depth_color, still};
use domecast_fab::html::{Html, ORBIT, color_bar, document, html, packed, picture, table};
use domecast_fab::numbers::{percent, typeset};

/// Colours of the scale's bar.
const COLORS: usize = 50;

/// The page of all frames so far.
pub fn page(report: &TrackReport) -> Html {
    let skin = skin(report);
    let skin_link = if skin.is_empty() { "" } else { "<li><a href=\"#skin\">The skin</a></li>\n" };
    let body = html!(
        "<a class=\"skip\" href=\"#summary\">To the content</a>\n<header>\n<h1>What {0} felt</h1>\n<p class=\"soft\">{1}; domecast \
         {2}.</p>\n<nav aria-label=\"Chapters\"><ul>\n<li><a href=\"#summary\">In short</a></li>\n{3}<li><a \
         href=\"#curves\">Curves</a></li>\n</ul></nav>\n</header>\n<main>\n<section id=\"summary\">\n<h2>In short</h2>\n{4}</section>\n\
         {5}<section id=\"curves\">\n<h2>Curves</h2>\n{6}{7}<div class=\"row wide\">\n{8}</div>\n</section>\n</main>\n<footer><p>Force and \
         torque are what the world puts on dome and platform, in the rest frame, about the springs' reference point: a push on the pole \
         has a negative z. Shift is that point's from rest, turn the platform's rotation vector.</p></footer>\n<script type=\"application/json\" \
         id=\"track\">{9}</script>\n{10}",
        report.design,
        frames_in_words(report.frames.seen()),
        env!("CARGO_PKG_VERSION"),
        Html::trusted(skin_link),
        summary(report),
        skin,
        every(report.frames.stride(), report.frames.kept().len(), "drawn"),
        explained(),
        curves(report),
        // numbers and fixed names only: nothing that could end the element
        Html::trusted(data(report).to_string()),
        viewer(report),
    );
    document(&format!("What {} felt", report.design), include_str!("style.css"), &body)
}

fn frames_in_words(count: u64) -> String {
    format!("{count} frame{}", if count == 1 { "" } else { "s" })
}

/// Says so where not all frames are there.
fn every(stride: u64, kept: usize, verb: &str) -> Html {
    match stride {
        1 => Html::default(),
        _ => html!(
            "<p>Every {}th frame is {} ({} of them), so what is shorter may not show; the tables are of all.</p>\n",
            stride.to_string(),
            verb,
            kept
        ),
    }
}

fn summary(report: &TrackReport) -> Html {
    let all = report.frames.seen().max(1) as f64;
    let row = |(status, count): (&&'static str, &super::record::StatusCount)| {
        vec![
            html!("<code>{}</code>", *status),
            count.frames.to_string().into(),
            percent(count.frames as f64 / all).into(),
            count.with_numbers.to_string().into(),
        ]
    };
    // the most frequent first, and of equals the first by name
    let mut statuses: Vec<_> = report.statuses.iter().collect();
    statuses.sort_by_key(|(_, count)| std::cmp::Reverse(count.frames));
    let rows: Vec<Vec<Html>> = statuses.into_iter().map(row).collect();
    let without = QUANTITIES
        .iter()
        .zip(&report.extremes)
        .filter(|(quantity, extremes)| {
            extremes.iter().all(Option::is_none) && (report.has_shape || !quantity.key.starts_with("contact"))
        })
        .map(|(quantity, _)| quantity.title.to_lowercase())
        .collect::<Vec<_>>();
    let missing = if without.is_empty() {
        Html::default()
    } else {
        html!("<p>No frame has a number for: {}.</p>\n", without.join(", "))
    };
    html!(
        "{}{}{}",
        table("Status of the frames", &["status", "frames", "share", "frames with numbers"], &rows),
        missing,
        ranges(report),
    )
}

fn ranges(report: &TrackReport) -> Html {
    let mut rows = Vec::new();
    for (quantity, extremes) in QUANTITIES.iter().zip(&report.extremes) {
        for (name, all) in quantity.names().into_iter().zip(extremes) {
            let Some(Extremes { count, sum, low, high }) = all else { continue };
            let label = if quantity.components.len() == 1 {
                format!("{}, {}", quantity.title, quantity.unit)
            } else {
                format!("{} {name}, {}", quantity.title, quantity.unit)
            };
            rows.push(vec![
                label.into(),
                typeset(low.0).into(),
                low.1.to_string().into(),
                typeset(sum / *count as f64).into(),
                typeset(high.0).into(),
                high.1.to_string().into(),
                count.to_string().into(),
            ]);
        }
    }
    if rows.is_empty() {
        return Html::default();
    }
    let heads = ["", "smallest", "in frame", "mean", "largest", "in frame", "frames"];
    table("Over all frames", &heads, &rows)
}

/// The skin to turn, and a picture of its deepest frame.
fn skin(report: &TrackReport) -> Html {
    let skins = &report.skins;
    let Some(deepest) = skins.deepest() else {
        let why =
            "<section id=\"skin\">\n<h2>The skin</h2>\n<p>No frame shows the skin's shape.</p>\n</section>\n";
        return if report.has_shape { Html::trusted(why) } else { Html::default() };
    };
    let range_mm = skins.range_mm();
    let alt = format!("The skin in frame {}, coloured by depth", deepest.frame);
    let image = still(skins, deepest, range_mm);
    let image = image.map_or_else(Html::default, |png| picture("image/png", &png, &alt, ""));
    let kept = skins.frames.kept();
    let colors: Vec<[u8; 3]> = (0..COLORS).map(|k| depth_color((k as f64 + 0.5) / COLORS as f64)).collect();
    html!(
        "<section id=\"skin\">\n<h2>The skin</h2>\n<p>The dome (radius {0} mm) with its height map, coloured by depth; a white line is around \
         what touches; grey is not seen. {1} of {2} frames with a shape{3}. Drag or use the arrow keys to turn it, plus and minus to \
         zoom.</p>\n{4}<div class=\"viewer\" id=\"skin-view\"><canvas hidden tabindex=\"0\" role=\"img\" aria-label=\"The skin; arrow keys \
         turn it, plus and minus zoom\"></canvas><div data-still>{5}<p class=\"soft\">Frame {6}, the deepest.</p></div><label \
         hidden>frame <input type=\"range\" min=\"0\" max=\"{7}\" step=\"1\" value=\"{8}\" aria-label=\"Frame\"></label><output hidden \
         aria-live=\"polite\"></output><label class=\"deeper\" hidden><input type=\"checkbox\"> depths drawn five times as \
         deep</label></div>\n</section>\n",
        typeset(skins.dome().radius_mm()),
        kept.len(),
        skins.frames.seen().to_string(),
        match skins.frames.stride() {
            1 => String::new(),
            stride => format!(", every {stride}th"),
        },
        color_bar(&colors, "0 mm", &format!("{} mm deep", typeset(range_mm))),
        image,
        deepest.frame.to_string(),
        kept.len() - 1,
        kept.iter().position(|frame| frame.frame == deepest.frame).unwrap_or(0),
    )
}

fn viewer(report: &TrackReport) -> Html {
    if report.skins.frames.kept().is_empty() {
        return Html::default();
    }
    html!(
        "{}<script>\n{}{}</script>\n",
        packed("skins", &skin_bytes(report)),
        Html::trusted(ORBIT),
        Html::trusted(include_str!("skin.js")),
    )
}
