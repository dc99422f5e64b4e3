//! The laser cutter's drawings of the clear sheet: DXF and SVG, millimetres.
//!
//! Three layers. `CUT`: the path of the beam's middle, half a kerf outside the
//! sheet's outline. `MARK`: the dome's base and the white markers, for
//! engraving lightly or for looking at; do not cut. `NOTES`: a scale bar of 10
//! mm and a word on the kerf, outside the sheet.

use std::fmt::Write as _;

use glam::DVec2;

use super::measures::Measures;

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
    let mut circles = vec![(DVec2::ZERO, m.dome_radius_mm)];
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

/// The cutter's drawing as DXF (R12, which every cutter reads; polylines with
/// bulges for the arcs).
pub(super) fn dxf(m: &Measures) -> String {
    let d = drawing(m);
    let mut out = String::from(
        "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n9\n$INSUNITS\n70\n4\n9\n$MEASUREMENT\n70\n1\n0\nENDSEC\n",
    );
    out.push_str("0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLAYER\n70\n3\n");
    for (layer, color) in [("CUT", 1), ("MARK", 5), ("NOTES", 8)] {
        let _ = write!(out, "0\nLAYER\n2\n{layer}\n70\n0\n62\n{color}\n6\nCONTINUOUS\n");
    }
    out.push_str("0\nENDTAB\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n");
    let (h, r) = (d.half_mm, d.corner_mm);
    // Counter-clockwise; the bulge of a quarter circle is tan(90/4 degrees).
    let bulge = if r > 0.0 { (std::f64::consts::PI / 8.0).tan() } else { 0.0 };
    let path = [
        (DVec2::new(-h.x + r, -h.y), 0.0),
        (DVec2::new(h.x - r, -h.y), bulge),
        (DVec2::new(h.x, -h.y + r), 0.0),
        (DVec2::new(h.x, h.y - r), bulge),
        (DVec2::new(h.x - r, h.y), 0.0),
        (DVec2::new(-h.x + r, h.y), bulge),
        (DVec2::new(-h.x, h.y - r), 0.0),
        (DVec2::new(-h.x, -h.y + r), bulge),
    ];
    out.push_str("0\nPOLYLINE\n8\nCUT\n66\n1\n10\n0.0\n20\n0.0\n30\n0.0\n70\n1\n");
    for (p, bulge) in path {
        let _ = write!(out, "0\nVERTEX\n8\nCUT\n10\n{:.6}\n20\n{:.6}\n30\n0.0\n42\n{bulge:.12}\n", p.x, p.y);
    }
    out.push_str("0\nSEQEND\n8\nCUT\n");
    for (at, radius) in &d.circles {
        let _ =
            write!(out, "0\nCIRCLE\n8\nMARK\n10\n{:.6}\n20\n{:.6}\n30\n0.0\n40\n{radius:.6}\n", at.x, at.y);
    }
    let b = d.bar_from_mm;
    let _ = write!(
        out,
        "0\nLINE\n8\nNOTES\n10\n{:.6}\n20\n{:.6}\n30\n0.0\n11\n{:.6}\n21\n{:.6}\n31\n0.0\n",
        b.x,
        b.y,
        b.x + BAR_MM,
        b.y
    );
    let _ = write!(
        out,
        "0\nTEXT\n8\nNOTES\n10\n{:.6}\n20\n{:.6}\n30\n0.0\n40\n1.5\n1\n{}\n",
        b.x,
        b.y - 3.0,
        d.note
    );
    out.push_str("0\nENDSEC\n0\nEOF\n");
    out
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
