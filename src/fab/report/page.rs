//! The page: what is to be seen first, then a chapter for each subject.

use super::subject::ReportSubject;
use super::{
    constants, electrical, forces, light, making, measured, overlay, parts, pattern, section, verdict,
};
use crate::html::{Html, ORBIT, document, figure, html, packed, table};
use crate::numbers::{dimension, typeset};
use domecast_optics::DomeShape;

/// A chapter of the page.
struct Chapter {
    anchor: &'static str,
    heading: &'static str,
    content: Html,
}

fn chapters(subject: &ReportSubject<'_>) -> Vec<Chapter> {
    let chapter = |anchor, heading, content| Chapter { anchor, heading, content };
    let mut all = vec![
        chapter("sensor", "The sensor in section", sensor(subject)),
        chapter("dots", "Dots", pattern::dots(subject)),
        chapter("coverage", "What the camera covers", pattern::coverage(subject)),
        chapter("light", "The lit sensor", light::chapter(subject)),
        chapter("electrical", "Currents and wires of the lights", electrical::chapter(subject)),
        chapter("parts", "Parts and assembly", parts::parts(subject)),
        chapter("fits", "Fits and interference", parts::fits(subject)),
        chapter("loads", "Springs and load envelope", forces::loads(subject)),
        chapter("resolution", "What the sensor can resolve", forces::resolution(subject)),
        chapter("constants", "Constants at a glance", constants::chapter(subject)),
    ];
    let measured = measured::chapter(subject);
    all.extend(measured.map(|content| chapter("accuracy", "What accuracy costs in time", content)));
    all.push(chapter("making", "Making it", making::chapter(subject)));
    all.push(chapter("files", "All files", files(subject)));
    all
}

/// The page of a build.
pub fn page(subject: &ReportSubject<'_>) -> Html {
    let chapters = chapters(subject);
    let description = subject.design.sections().description.as_ref();
    let links = chapters.iter().map(|c| html!("<li><a href=\"#{}\">{}</a></li>\n", c.anchor, c.heading));
    let sections = chapters
        .iter()
        .map(|c| html!("<section id=\"{}\">\n<h2>{}</h2>\n{}</section>\n", c.anchor, c.heading, c.content));
    let body = html!(
        "<a class=\"skip\" href=\"#verdict\">To the \
         content</a>\n<header>\n<h1>{0}</h1>\n{1}<p class=\"soft\">Design <a href=\"../design.json\"><code>{2}</code></a>, \
         domecast {3}</p>\n<nav aria-label=\"Chapters\"><ul>\n{4}</ul></nav>\n</header>\n<main>\n{5}{6}{7}</main>\n\
         <footer><p>Lengths mm, angles degrees, forces N, pixels px. Made by domecast from the design (and the \
         measurement, where one is shown) alone: the same design gives the same page.</p></footer>\n{8}",
        subject.design.name(),
        description.map_or_else(Html::default, |text| html!("<p>{}</p>\n", text)),
        subject.hash.chars().take(12).collect::<String>(),
        env!("CARGO_PKG_VERSION"),
        links.collect::<Html>(),
        verdict::verdict(subject),
        key_figures(subject),
        sections.collect::<Html>(),
        viewer(subject),
    );
    document(&format!("{} – domecast", subject.design.name()), "", &body)
}

/// The assembly and the script that shows it.
fn viewer(subject: &ReportSubject<'_>) -> Html {
    subject.file("parts/assembly.glb").map_or_else(Html::default, |bytes| {
        html!(
            "{}<script type=\"application/json\" id=\"overlay\">{}</script>\n<script>\n{}{}</script>\n",
            packed("assembly", bytes),
            // numbers and fixed names only: nothing that could end the element
            Html::trusted(overlay::overlay(subject).to_string()),
            Html::trusted(ORBIT),
            Html::trusted(include_str!("viewer.js")),
        )
    })
}

/// The dome's size in words.
fn dome_size(dome: &DomeShape) -> String {
    let n = dimension;
    let round = |mm: f64| n((1e3 * mm).round() / 1e3);
    let (wide, radius) = (round(2.0 * dome.rim_radius_mm()), n(dome.radius_mm()));
    match dome.center_z_mm() {
        z if z < 0.0 => format!(
            "⌀ {wide} mm, a cap {} mm high of a sphere of radius {radius} mm",
            round(dome.height_mm())
        ),
        z if z > 0.0 => format!("⌀ {wide} mm, on a cylinder {} mm high", n(z)),
        _ => format!("⌀ {} mm", n(2.0 * dome.radius_mm())),
    }
}

fn key_figures(subject: &ReportSubject<'_>) -> Html {
    let s = subject.design.sections();
    let n = dimension;
    let mut entries = vec![
        ("Dots", subject.layout.dots.len().to_string()),
        ("Dome", dome_size(&s.dome.shape())),
        ("Envelope", s.envelope.size_mm.map(n).join(" × ") + " mm"),
        ("Air gap at rest", format!("{} mm", n(subject.design.optics().air_gap_mm()))),
        (
            "Largest field angle",
            format!("{}°", typeset(subject.constants.camera.max_field_angle_rad.to_degrees())),
        ),
    ];
    if let Some(springs) = &subject.constants.springs {
        entries.push(("Stiffness Fz", format!("{} N/mm", typeset(springs.stiffness[2][2]))));
    }
    if let Some(press) = subject.forces.lines.iter().find(|line| line.load == "press") {
        entries.push(("Straight press", format!("{} N", typeset(press.size))));
    }
    let entry = |(name, value): &(&str, String)| html!("<div><dt>{}</dt><dd>{}</dd></div>\n", name, value);
    html!("<dl class=\"glance\">\n{}</dl>\n", entries.iter().map(entry).collect::<Html>())
}

fn sensor(subject: &ReportSubject<'_>) -> Html {
    let row = |layer: &domecast_runtime::constants::LayerConstants| {
        let index =
            layer.index_rgb.map_or_else(|| dimension(layer.index), |rgb| rgb.map(dimension).join(" / "));
        let thickness =
            layer.thickness_mm.map_or_else(|| "fills the dome".into(), |t| format!("{} mm", dimension(t)));
        vec![layer.name.as_str().into(), thickness.into(), index.into()]
    };
    let rows: Vec<Vec<Html>> = subject.constants.optics.layers.iter().map(row).collect();
    figure(
        &section::drawing(subject.design, subject.assembly),
        "Cut along x through the pupil, true to scale, from the meshes of the parts; dashed grey outlines stand behind the \
         cut. Red are rays of the image's middle row, bent at the sheet and in the silicone; dashed red ones end on a part \
         beyond the dome.",
    ) + table("Layers from the camera outwards", &["layer", "thickness", "index (red / green / blue)"], &rows)
}

fn files(subject: &ReportSubject<'_>) -> Html {
    let line = |(path, bytes): &(&str, &[u8])| {
        let kb = dimension((bytes.len() as f64 / 100.0).round() / 10.0);
        html!(
            "<li><a href=\"../{0}\"><code>{0}</code></a> <span class=\"soft\">{1} kB</span></li>\n",
            path,
            kb
        )
    };
    let left_out = subject.formats_left_out.iter().map(|text| html!("<p>Not written: {}.</p>\n", text));
    html!(
        "{}<details><summary>{} files</summary><ul>\n{}<li><a href=\"../manifest.json\"><code>manifest.json</code></a></li>\n\
         </ul></details>\n",
        left_out.collect::<Html>(),
        subject.files.len() + 1,
        subject.files.iter().map(line).collect::<Html>(),
    )
}
