//! Parts, the assembly and the fits on the page.

use super::subject::ReportSubject;
use crate::html::{Html, figure, html, table};
use crate::numbers::dimension;

/// The assembly to turn, a picture and a line for each part.
pub(super) fn parts(subject: &ReportSubject<'_>) -> Html {
    let mut pictures = Html::default();
    let mut rows = Vec::new();
    for part in subject.parts {
        let name = part.name.replace('_', " ");
        pictures += figure(&subject.drawn(&format!("report/{}.png", part.name), &name), &name);
        let size = part.bounds.max_mm - part.bounds.min_mm;
        let links = ["stl", "3mf", "step", "dxf", "svg"]
            .iter()
            .map(|kind| (kind, format!("parts/{}.{kind}", part.name)))
            .filter(|(_, path)| subject.file(path).is_some())
            .map(|(kind, path)| html!("<a href=\"../{}\">{}</a> ", path, kind));
        rows.push(vec![
            name.into(),
            size.to_array().map(dimension).join(" × ").into(),
            dimension(part.volume_mm3).into(),
            dimension(part.area_mm2).into(),
            html!("{}", part.genus),
            html!("{}", part.mesh.triangles.len()),
            links.collect(),
        ]);
    }
    html!(
        "<div class=\"viewer\" id=\"viewer\"><canvas tabindex=\"0\" role=\"img\" aria-label=\"The assembly; arrow keys \
         turn it, plus and minus zoom\"></canvas><div data-still>{}{}</div><label>closed <input type=\"range\" \
         min=\"0\" max=\"100\" value=\"60\" aria-label=\"How far the assembly is exploded\"> exploded</label><fieldset>\
         <legend class=\"soft\">Shown</legend></fieldset></div>\n<div class=\"row\">\n{}</div>\n{}",
        subject.drawn("report/assembly-closed.png", "The assembly, closed"),
        subject.drawn("report/assembly-exploded.png", "The assembly, exploded"),
        pictures,
        table(
            "Parts",
            &["part", "size, mm", "volume, mm³", "surface, mm²", "holes through it", "triangles", "files"],
            &rows,
        ),
    )
}

/// Play of every fit, and the limits of the process.
pub(super) fn fits(subject: &ReportSubject<'_>) -> Html {
    let s = subject.design.sections();
    let n = dimension;
    let pocket = s.magnets.diameter_mm + s.magnet_pockets.diameter_clearance_mm;
    let fits = [
        ("magnet in its pocket", s.magnets.diameter_mm, pocket, "magnet_pockets.diameter_clearance_mm"),
        (
            if s.camera_body.board.is_some() { "lens barrel in its bore" } else { "camera in its bore" },
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
    ];
    let there = fits.into_iter().filter(|fit| fit.1 > 0.0);
    let row = |(fit, inner, outer, field): (&str, f64, f64, &str)| {
        vec![
            fit.into(),
            n(inner).into(),
            n(outer).into(),
            format!("{} ± {}", n(0.5 * (outer - inner)), n(s.process.tolerance_mm)).into(),
            html!("<code>{}</code>", field),
        ]
    };
    let rows: Vec<Vec<Html>> = there.map(row).collect();
    let limits = [
        ("thinnest wall", s.process.min_wall_mm),
        ("smallest hole", s.process.min_hole_diameter_mm),
        ("smallest pin", s.process.min_pin_diameter_mm),
        ("smallest gap", s.process.min_gap_mm),
    ]
    .map(|(what, limit)| vec![what.into(), format!("{} mm", n(limit)).into()]);
    html!(
        "<p>No two bodies of the assembly touch at any of {} positions of the platform, and no LED shines straight into the \
         lens.</p>\n<details><summary>The positions</summary><p>{}</p></details>\n{}{}{}",
        subject.poses.len(),
        subject.poses.join("; "),
        sight(subject),
        table("Fits", &["fit", "inner, mm", "outer, mm", "play on each side, mm", "field"], &rows),
        table(&format!("Limits of {}, kept by every part", s.process.name), &["", "limit"], &limits),
    )
}

/// The traced rays, by position and by what they show.
fn sight(subject: &ReportSubject<'_>) -> Html {
    let kinds: Vec<&str> =
        subject.sight.first().map_or_else(Vec::new, |s| s.counts.iter().map(|c| c.kind.as_str()).collect());
    let heads: Vec<&str> = std::iter::once("position").chain(kinds).collect();
    let cell = |count: &domecast_design::parts::RayCount| match count.traced {
        0 => "no ray".into(),
        traced => html!("{} of {}", traced - count.blocked, traced),
    };
    let row = |pose: &domecast_design::parts::PoseSight| {
        std::iter::once(pose.pose.as_str().into()).chain(pose.counts.iter().map(cell)).collect()
    };
    let rows: Vec<Vec<Html>> = subject.sight.iter().map(row).collect();
    table(
        "Rays of the image that reach the sheet, traced from the pupil against every part's mesh",
        &heads,
        &rows,
    )
}
