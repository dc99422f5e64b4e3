//! The laser cutter's drawings of the clear sheet: DXF and SVG, millimetres.
//!
//! Three layers. `CUT`: the path of the beam's middle, half a kerf outside the
//! sheet's outline. `MARK`: the dome's base and the white markers, for
//! engraving lightly or for looking at; do not cut. `NOTES`: a scale bar of 10
//! mm and a word on the kerf, outside the sheet.

use std::fmt::Write as _;

use glam::DVec2;

use super::measures::Measures;
use domecast_mesh::{DxfFile, DxfText, DxfVertex};

struct Drawing {
    half_mm: DVec2,
    corner_mm: f64,
    circles: Vec<(DVec2, f64)>,
    bar_from_mm: DVec2,
    note: String,
}

const BAR_MM: f64 = 10.0;

fn drawing(m: &Measures) -> Drawing {
    let half_kerf = 0.5 * m.sheet.kerf_mm;
    let half_mm = 0.5 * m.sheet_size_mm + DVec2::splat(half_kerf);
    let mut circles = vec![(DVec2::ZERO, m.dome.rim_radius_mm())];
    circles.extend(m.markers_mm.iter().map(|&at| (at, m.marker_radius_mm)));
    Drawing {
        half_mm,
        // An offset rounds a sharp corner as well.
        corner_mm: m.sheet.corner_radius_mm + half_kerf,
        circles,
        bar_from_mm: DVec2::new(-half_mm.x, -half_mm.y - 4.0),
        note: format!(
            "sheet {} x {} mm, {} mm thick; kerf {} mm compensated; bar {BAR_MM} mm",
            m.sheet_size_mm.x, m.sheet_size_mm.y, m.sheet_thickness_mm, m.sheet.kerf_mm
        ),
    }
}

/// The cutter's drawing as DXF; polylines with bulges for the arcs.
pub(super) fn dxf(m: &Measures) -> String {
    let d = drawing(m);
    let mut file = DxfFile::new(&[("CUT", 1), ("MARK", 5), ("NOTES", 8)]);
    let (h, r) = (d.half_mm, d.corner_mm);
    // Counter-clockwise; the bulge of a quarter circle is tan(90/4 degrees).
    let arc = if r > 0.0 { (std::f64::consts::PI / 8.0).tan() } else { 0.0 };
    let path = [
        (DVec2::new(-h.x + r, -h.y), 0.0),
        (DVec2::new(h.x - r, -h.y), arc),
        (DVec2::new(h.x, -h.y + r), 0.0),
        (DVec2::new(h.x, h.y - r), arc),
        (DVec2::new(h.x - r, h.y), 0.0),
        (DVec2::new(-h.x + r, h.y), arc),
        (DVec2::new(-h.x, h.y - r), 0.0),
        (DVec2::new(-h.x, -h.y + r), arc),
    ];
    file.polyline("CUT", &path.map(|(at_mm, bulge)| DxfVertex { at_mm, bulge }), true, 0.0);
    for (at, radius) in &d.circles {
        file.circle("MARK", *at, *radius);
    }
    let b = d.bar_from_mm;
    file.line("NOTES", b, b + DVec2::X * BAR_MM);
    let at_mm = b - DVec2::Y * 3.0;
    file.text("NOTES", &DxfText { at_mm, height_mm: 1.5, is_centered: false, words: &d.note });
    file.finish()
}

/// The same as SVG, true to scale, with Inkscape layers.
pub(super) fn svg(m: &Measures) -> String {
    let d = drawing(m);
    let (h, r) = (d.half_mm, d.corner_mm);
    let margin = 8.0;
    let (width, height) = (2.0 * (h.x + margin), 2.0 * (h.y + margin));
    let mut out = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" \
         xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" width=\"{width:.4}mm\" height=\"{height:.4}mm\" \
         viewBox=\"{:.4} {:.4} {width:.4} {height:.4}\">\n",
        -0.5 * width,
        -0.5 * height
    );
    let layer = |out: &mut String, name: &str, color: &str| {
        let _ = writeln!(
            out,
            "<g id=\"{name}\" inkscape:groupmode=\"layer\" inkscape:label=\"{name}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"0.05\">"
        );
    };
    layer(&mut out, "cut", "#ff0000");
    let _ = writeln!(
        out,
        "<rect x=\"{:.6}\" y=\"{:.6}\" width=\"{:.6}\" height=\"{:.6}\" rx=\"{r:.6}\"/>\n</g>",
        -h.x,
        -h.y,
        2.0 * h.x,
        2.0 * h.y
    );
    layer(&mut out, "mark", "#0000ff");
    for (at, radius) in &d.circles {
        // SVG's y runs down; the sheet is drawn as seen from above.
        let _ = writeln!(out, "<circle cx=\"{:.6}\" cy=\"{:.6}\" r=\"{radius:.6}\"/>", at.x, -at.y);
    }
    out.push_str("</g>\n");
    layer(&mut out, "notes", "#808080");
    let b = d.bar_from_mm;
    let _ = writeln!(out, "<path d=\"M {:.6} {:.6} h {BAR_MM}\"/>", b.x, -b.y);
    let _ = writeln!(
        out,
        "<text x=\"{:.6}\" y=\"{:.6}\" font-size=\"1\" font-family=\"sans-serif\" fill=\"#808080\" stroke=\"none\">{}</text>",
        b.x,
        -b.y + 2.0,
        d.note
    );
    out.push_str("</g>\n</svg>\n");
    out
}
