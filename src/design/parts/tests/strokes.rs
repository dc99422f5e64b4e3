//! Tilted print passes: the pad must meet the dome before sheet and jig.

use super::*;
use crate::layout::PrintPass;

#[test]
fn a_stroke_that_meets_sheet_or_jig_first_is_said_with_the_tilt_that_does_not() {
    let design = thumb24();
    let m = Measures::of(&design).unwrap();
    assert!(stroke_notes(&m, &design.layout().unwrap().passes).is_empty(), "one pass from above");
    let note = |tilt_deg: f64, azimuth_deg: f64| {
        let pass = PrintPass::new(tilt_deg.to_radians(), azimuth_deg.to_radians());
        stroke_notes(&m, &[pass]).pop()
    };
    for azimuth_deg in [0.0, 30.0, 45.0, 120.0, 270.0] {
        let said = note(70.0, azimuth_deg).unwrap();
        assert_eq!(said.field, "print.max_tilt_deg");
        let (_, rest) = said.message.split_once("up to ").unwrap();
        let cure: f64 = rest.split_once(" degrees").unwrap().0.parse().unwrap();
        assert!(note(cure, azimuth_deg).is_none(), "{azimuth_deg}: {}", said.message);
        assert!(note(cure + 0.6, azimuth_deg).is_some(), "{azimuth_deg}: {}", said.message);
        // The sheet's corner towards the stroke is R high where its distance times the sine of the tilt is R.
        let azimuth = azimuth_deg.to_radians();
        let corner_mm = 10.8 * (azimuth.cos().abs() + azimuth.sin().abs());
        let sheet_deg = (10.0 / corner_mm).min(1.0).asin().to_degrees();
        assert!(cure < sheet_deg + 0.1 && cure > sheet_deg - 17.0, "{azimuth_deg}: {cure} {sheet_deg}");
    }
}

#[test]
fn thumb24_wide_is_printed_past_sheet_and_jig() {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24-wide.json"));
    let design = Design::load(path).unwrap();
    let layout = design.layout().unwrap();
    let polar = |dot: &crate::layout::Dot| dot.normal.z.acos().to_degrees();
    let furthest = layout.dots.iter().map(polar).fold(0.0, f64::max);
    assert!(furthest >= 80.0 && layout.passes.len() == 5 && layout.lost.is_empty(), "{furthest}");
    assert!(stroke_notes(&Measures::of(&design).unwrap(), &layout.passes).is_empty());
}
