//! The page that people look at before they send a film to a print shop: `report/index.html`.
//!
//! One self-contained file: pictures, style, script and the assembly stand in it, so that it opens from a disk
//! without a network. It sees only what the build has made; it computes nothing that goes into another file.

mod chart;
mod forces;
mod html;
mod making;
mod measured;
mod numbers;
mod pattern;
pub mod section;

use std::fmt::Write as _;

use crate::constants::ForceReport;
use domecast_design::Design;
use domecast_design::layout::Layout;
use domecast_design::layout::report::LayoutReport;
use domecast_design::parts::Part;
use domecast_runtime::constants::Constants;
use html::{escape, figure, number, percent, picture, table};
pub use making::{Step, steps};
pub use measured::MEASURED;
pub use numbers::{duration, sparse};

/// What the page is made from.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// The design.
    pub design: &'a Design,
    /// Its dots.
    pub layout: &'a Layout,
    /// What the layout came to.
    pub judged: &'a LayoutReport,
    /// The constants.
    pub constants: &'a Constants,
    /// Loads and resolution.
    pub forces: &'a ForceReport,
    /// The parts.
    pub parts: &'a [Part],
    /// Positions of the platform at which the assembly was checked, by name.
    pub poses: &'a [String],
    /// Field and message of each warning.
    pub warnings: &'a [(String, String)],
    /// SHA-256 of the design file.
    pub hash: &'a str,
    /// The files of the build so far, by path.
    pub files: &'a [(&'a str, &'a [u8])],
}

impl Subject<'_> {
    /// A file of the build.
    fn file(&self, path: &str) -> Option<&[u8]> {
        self.files.iter().find(|(name, _)| *name == path).map(|(_, bytes)| *bytes)
    }

    /// A picture of the build, in the page.
    fn shown(&self, path: &str, alt: &str) -> String {
        let mime = if path.ends_with(".svg") { "image/svg+xml" } else { "image/png" };
        self.file(path).map_or_else(String::new, |bytes| picture(mime, bytes, alt))
    }
}

/// Sections of the page: anchor, heading, content.
fn chapters(subject: &Subject<'_>) -> Vec<(&'static str, &'static str, String)> {
    let mut all = vec![
        ("sensor", "The sensor in section", sensor(subject)),
        ("dots", "Dots", pattern::dots(subject)),
        ("coverage", "What the camera covers", pattern::coverage(subject)),
        ("parts", "Parts and assembly", parts(subject)),
        ("fits", "Fits and interference", fits(subject)),
        ("loads", "Springs and load envelope", forces::loads(subject)),
        ("resolution", "What the sensor can resolve", forces::resolution(subject)),
        ("constants", "Constants at a glance", constants(subject)),
    ];
    let measured = measured::chapter(subject);
    all.extend(measured.map(|content| ("accuracy", "What accuracy costs in time", content)));
    all.extend([("making", "Making it", making_list(subject)), ("files", "All files", files(subject))]);
    all
}

/// The page.
pub fn page(subject: &Subject<'_>) -> String {
    let name = escape(subject.design.name());
    let chapters = chapters(subject);
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<title>{name} – domecast</title>\n<link rel=\"icon\" \
         href=\"data:,\">\n<style>\n{}</style>\n</head>\n<body>\n<a class=\"skip\" href=\"#warnings\">To the \
         content</a>\n<header>\n<h1>{name}</h1>\n",
        include_str!("style.css")
    );
    if let Some(description) = &subject.design.sections().description {
        let _ = writeln!(text, "<p>{}</p>", escape(description));
    }
    let _ = writeln!(
        text,
        "<p class=\"soft\">Design <a href=\"../design.json\"><code>{}</code></a>, domecast {}</p>\n<nav \
         aria-label=\"Chapters\"><ul>",
        escape(&subject.hash.chars().take(12).collect::<String>()),
        env!("CARGO_PKG_VERSION")
    );
    for (anchor, heading, _) in &chapters {
        let _ = writeln!(text, "<li><a href=\"#{anchor}\">{heading}</a></li>");
    }
    text += "</ul></nav>\n</header>\n<main>\n";
    text += &warnings(subject);
    text += &glance(subject);
    for (anchor, heading, content) in &chapters {
        let _ = write!(text, "<section id=\"{anchor}\">\n<h2>{heading}</h2>\n{content}</section>\n");
    }
    text += "</main>\n<footer><p>Lengths mm, angles degrees, forces N, pixels px. Made by domecast from the design \
             (and the measurement, where one is shown) alone: the same design gives the same page.</p></footer>\n";
    if let Some(bytes) = subject.file("parts/assembly.glb") {
        let _ = writeln!(
            text,
            "<script type=\"application/octet-stream\" id=\"assembly\">{}</script>",
            html::base64(bytes)
        );
        let _ = writeln!(text, "<script>\n{}</script>", include_str!("viewer.js"));
    }
    text + "</body>\n</html>\n"
}

fn warnings(subject: &Subject<'_>) -> String {
    if subject.warnings.is_empty() {
        return "<section id=\"warnings\"><p class=\"fine\">No warnings.</p></section>\n".into();
    }
    let mut text = format!(
        "<section id=\"warnings\"><h2>{} warning{}</h2><ul class=\"warnings\">\n",
        subject.warnings.len(),
        if subject.warnings.len() == 1 { "" } else { "s" }
    );
    for (field, message) in subject.warnings {
        let _ = writeln!(text, "<li><code>{}</code> {}</li>", escape(field), escape(message));
    }
    text + "</ul></section>\n"
}

fn glance(subject: &Subject<'_>) -> String {
    let s = subject.design.sections();
    let n = number;
    let mut entries = vec![
        ("Dots", subject.layout.dots.len().to_string()),
        ("Dome", format!("⌀ {} mm", n(2.0 * s.dome.radius_mm))),
        ("Room", s.envelope.size_mm.map(n).join(" × ") + " mm"),
        ("Air gap at rest", format!("{} mm", n(subject.design.optics().air_gap_mm()))),
        ("Lens reaches", format!("{}°", n(subject.constants.camera.max_field_angle_rad.to_degrees()))),
    ];
    if let Some(coverage) = subject.judged.coverage.first().and_then(|record| record.coverage.as_ref()) {
        entries.push(("Dome seen at rest", percent(coverage.in_mask)));
    }
    if let Some(springs) = &subject.constants.springs {
        entries.push(("Stiffness Fz", format!("{} N/mm", n(springs.stiffness[2][2]))));
    }
    if let Some(press) = subject.forces.lines.iter().find(|line| line.load == "press") {
        entries.push(("Straight press", format!("{} N", n(press.size))));
    }
    let mut text = String::from("<dl class=\"glance\">\n");
    for (name, value) in entries {
        let _ = writeln!(text, "<div><dt>{name}</dt><dd>{value}</dd></div>");
    }
    text + "</dl>\n"
}

fn sensor(subject: &Subject<'_>) -> String {
    let mut rows = Vec::new();
    for layer in &subject.constants.optics.layers {
        let index = layer.index_rgb.map_or_else(|| number(layer.index), |rgb| rgb.map(number).join(" / "));
        let thickness =
            layer.thickness_mm.map_or_else(|| "fills the dome".into(), |t| format!("{} mm", number(t)));
        rows.push(vec![escape(&layer.name), thickness, index]);
    }
    figure(
        &section::drawing(subject.design),
        "Cut along x, true to scale: red are the rays of the image's middle row, bent at the sheet and in the silicone. \
         Platforms are drawn as blocks; their true shape is below.",
    ) + &table(
        "Layers from the camera outwards",
        &["layer", "thickness", "index (red / green / blue)"],
        &rows,
    )
}

fn parts(subject: &Subject<'_>) -> String {
    let mut text = String::from(
        "<div class=\"viewer\" id=\"viewer\"><canvas tabindex=\"0\" role=\"img\" aria-label=\"The assembly; arrow keys \
         turn it, plus and minus zoom\"></canvas><div data-still>",
    );
    text += &subject.shown("report/assembly-closed.png", "The assembly, closed");
    text += &subject.shown("report/assembly-exploded.png", "The assembly, exploded");
    text += "</div><label>closed <input type=\"range\" min=\"0\" max=\"100\" value=\"60\" aria-label=\"How far the \
             assembly is pulled apart\"> exploded</label><fieldset><legend class=\"soft\">Shown</legend></fieldset></div>\n\
             <div class=\"row\">\n";
    let mut rows = Vec::new();
    for part in subject.parts {
        let name = part.name.replace('_', " ");
        text += &figure(&subject.shown(&format!("report/{}.png", part.name), &name), &name);
        let size = part.bounds.max_mm - part.bounds.min_mm;
        let links: Vec<String> = ["stl", "3mf", "step", "dxf", "svg"]
            .iter()
            .map(|kind| (kind, format!("parts/{}.{kind}", part.name)))
            .filter(|(_, path)| subject.file(path).is_some())
            .map(|(kind, path)| format!("<a href=\"../{path}\">{kind}</a>"))
            .collect();
        rows.push(vec![
            escape(&name),
            size.to_array().map(number).join(" × "),
            number(part.volume_mm3),
            number(part.area_mm2),
            part.genus.to_string(),
            part.mesh.triangles.len().to_string(),
            links.join(" "),
        ]);
    }
    text += "</div>\n";
    text + &table(
        "Parts",
        &["part", "size, mm", "volume, mm³", "surface, mm²", "handles", "triangles", "files"],
        &rows,
    )
}

fn fits(subject: &Subject<'_>) -> String {
    let s = subject.design.sections();
    let n = number;
    let pocket = s.magnets.diameter_mm + s.magnet_pockets.diameter_clearance_mm;
    let rows = [
        ("magnet in its pocket", s.magnets.diameter_mm, pocket, "magnet_pockets.diameter_clearance_mm"),
        (
            "camera in its bore",
            s.camera_body.diameter_mm,
            s.camera_body.diameter_mm + 2.0 * s.camera_body.bore_clearance_mm,
            "camera_body.bore_clearance_mm",
        ),
        (
            "mould pin in its hole",
            s.mould.pins.diameter_mm,
            s.mould.pins.diameter_mm + 2.0 * s.mould.pins.clearance_mm,
            "mould.pins.clearance_mm",
        ),
        (
            "LED in its pit, along the board",
            s.leds.package_mm[0],
            s.leds.package_mm[0] + 2.0 * s.leds.clearance_mm,
            "leds.clearance_mm",
        ),
    ]
    .map(|(fit, inner, outer, field)| {
        vec![
            fit.to_owned(),
            n(inner),
            n(outer),
            format!("{} ± {}", n(0.5 * (outer - inner)), n(s.process.tolerance_mm)),
            format!("<code>{field}</code>"),
        ]
    });
    let mut text = format!(
        "<p>No two bodies of the assembly touch at any of {} positions of the platform, the view is free, and no LED \
         shines straight into the lens.</p>\n<details><summary>The positions</summary><p>{}</p></details>\n",
        subject.poses.len(),
        escape(&subject.poses.join("; "))
    );
    text += &table("Fits", &["fit", "inner, mm", "outer, mm", "play on each side, mm", "field"], &rows);
    let limits = [
        ("thinnest wall", s.process.min_wall_mm),
        ("smallest hole", s.process.min_hole_diameter_mm),
        ("smallest pin", s.process.min_pin_diameter_mm),
        ("smallest gap", s.process.min_gap_mm),
    ]
    .map(|(what, limit)| vec![what.to_owned(), format!("{} mm", n(limit))]);
    text + &table(&format!("Limits of {}, kept by every part", s.process.name), &["", "limit"], &limits)
}

fn constants(subject: &Subject<'_>) -> String {
    let c = subject.constants;
    let n = number;
    let list = |values: &[f64]| values.iter().map(|v| n(*v)).collect::<Vec<_>>().join(", ");
    let matrix = |m: &[[f64; 3]; 3]| {
        format!("fx {}, fy {}, cx {}, cy {}", n(m[0][0]), n(m[1][1]), n(m[0][2]), n(m[1][2]))
    };
    let rows = vec![
        vec![
            "camera".into(),
            format!("{}, {} × {} px", escape(&c.camera.model), c.camera.width, c.camera.height),
        ],
        vec!["matrix, px".into(), matrix(&c.camera.matrix)],
        vec!["distortion".into(), list(&c.camera.distortion)],
        vec!["undistorted matrix, px".into(), matrix(&c.camera.undistorted_matrix)],
        vec![
            "mask, undistorted px".into(),
            format!("centre {}, radius {}", list(&c.mask.center_px), n(c.mask.radius_px)),
        ],
    ];
    let mut text = table("Camera", &["", "value"], &rows);
    let markers: Vec<Vec<String>> = c
        .white_markers
        .iter()
        .map(|marker| {
            vec![
                marker.id.to_string(),
                list(&marker.position_mm),
                marker.apparent_position_mm.map_or_else(|| "–".into(), |p| list(&p)),
                list(&marker.image_px),
            ]
        })
        .collect();
    text += &table(
        "White markers",
        &["id", "painted at, mm", "appears at (plain solvePnP), mm", "in the raw image, px"],
        &markers,
    );
    if let Some(springs) = &c.springs {
        let axes = ["Fx", "Fy", "Fz", "Mx", "My", "Mz"];
        let rows: Vec<Vec<String>> = axes
            .iter()
            .zip(&springs.stiffness)
            .map(|(axis, row)| {
                // what rounding leaves beside the diagonal is nothing
                let floor = 1e-12 * row.iter().fold(0.0f64, |a, b| a.max(b.abs()));
                std::iter::once((*axis).to_owned())
                    .chain(row.iter().map(|v| if v.abs() <= floor { "0".into() } else { n(*v) }))
                    .collect()
            })
            .collect();
        text += &table(
            &format!(
                "Stiffness at rest ({}), N, N·mm against mm, rad, about {} mm",
                springs.source,
                list(&springs.at_mm)
            ),
            &["", "tx", "ty", "tz", "rx", "ry", "rz"],
            &rows,
        );
    }
    text + "<p>The whole: <a href=\"../constants/constants.json\"><code>constants/constants.json</code></a>.</p>\n"
}

fn making_list(subject: &Subject<'_>) -> String {
    let mut text = String::from("<ol class=\"making\">\n");
    for step in steps(subject) {
        let _ = writeln!(text, "<li><strong>{}.</strong> {}</li>", step.title, step.text);
    }
    text + "</ol>\n<p>What to buy and print: <a href=\"../parts/bom.csv\"><code>parts/bom.csv</code></a>.</p>\n"
}

fn files(subject: &Subject<'_>) -> String {
    let mut text = String::from("<ul>\n");
    for (path, bytes) in subject.files {
        let path = escape(path);
        let _ = writeln!(
            text,
            "<li><a href=\"../{path}\"><code>{path}</code></a> <span class=\"soft\">{} kB</span></li>",
            number((bytes.len() as f64 / 100.0).round() / 10.0)
        );
    }
    text + "<li><a href=\"../manifest.json\"><code>manifest.json</code></a></li>\n</ul>\n"
}

/// A page that reloads itself when the folder holds a newer build.
pub fn watched(page: &str) -> String {
    page.replacen("</body>", &format!("<script>\n{}</script>\n</body>", include_str!("fresh.js")), 1)
}

/// What a watched page asks for: the stamp of the newest build.
pub fn stamp(design_sha256: &str) -> String {
    format!("window.domecastBuild({design_sha256:?});\n")
}
