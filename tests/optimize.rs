//! The search for lights: what it proposes is better and builds, what is off has a name, and it stops when asked to.

use std::cell::Cell;
use std::path::PathBuf;

use domecast::Design;
use domecast::design::Cure;
use domecast::design::parts::{HidingLip, Measures, build_seated, check_assembly};
use domecast_fab::build::verify;
use domecast_fab::illuminate::IlluminationCheck;
use domecast_fab::illuminate::optimize::{Optimization, SearchOptions, SearchStatus, optimize};
use serde_json::{Value, json};

/// thumb24 with three lights just below the sheet behind a lip, as wide apart from good as its parts allow.
fn shallow() -> Design {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("designs/thumb24.json");
    let design = Design::load(&path).expect("the design");
    let list = [("red", 0), ("green", 120), ("blue", 240)]
        .map(|(color, azimuth_deg)| json!({ "color": color, "azimuth_deg": azimuth_deg }));
    let changes: [(&str, Value); 8] = [
        ("leds.list", json!(list)),
        ("leds.center_radius_mm", json!(9.07)),
        ("leds.center_z_mm", json!(-3.3)),
        ("leds.lip_top_z_mm", json!(-3.0)),
        ("leds.well_radius_mm", Value::Null),
        ("platforms.lower.hood", Value::Null),
        ("platforms.upper.underside_z_mm", json!(-5.2)),
        (
            "platforms.lower.clamp",
            json!({ "azimuth_deg": [60, 180, 300], "z_mm": -13.5, "hole_diameter_mm": 1.6 }),
        ),
    ];
    let changes = changes.map(|(field, value)| Cure { field: field.to_owned(), value });
    design.with_changes(&changes).expect("shallow lights")
}

fn searched(design: &Design, options: &SearchOptions, is_stopped: &dyn Fn() -> bool) -> Optimization {
    let light = IlluminationCheck::of(design).expect("its light").report;
    optimize(design, &light, options, &mut |_| {}, is_stopped).expect("a search")
}

#[test]
fn a_short_search_finds_better_lights_that_build() {
    let design = shallow();
    let options = SearchOptions { evaluations: 40, ..SearchOptions::default() };
    let found = searched(&design, &options, &|| false);
    let proposal = found.proposal.as_ref().expect("better lights than shallow ones");
    verify(proposal).expect("a proposal that builds");
    let ratio = found.report.ratio.expect("two errors");
    assert!(ratio < 0.9, "{ratio}");
    assert!(found.report.evaluations <= 40 && !found.report.changes.is_empty());
    // nothing is said of arrangements that so few evaluations never got to: each takes four first tries at least
    assert!(4 * found.report.arrangements.len() <= 40, "{:?}", found.report.arrangements);
    let why = serde_json::to_value(&proposal.sections().leds.why).expect("its reasons");
    assert!(why.to_string().contains("--optimize"), "{why}");
}

#[test]
fn a_search_that_is_asked_to_stop_keeps_what_it_has() {
    let design = shallow();
    let looks = Cell::new(0);
    let is_stopped = || {
        looks.set(looks.get() + 1);
        looks.get() > 1
    };
    let options = SearchOptions { evaluations: 5000, ..SearchOptions::default() };
    let found = searched(&design, &options, &is_stopped);
    assert_eq!(found.report.status, SearchStatus::Interrupted);
    assert!(found.report.evaluations < 200, "{}", found.report.evaluations);
    assert_eq!(found.proposal.is_some(), found.report.best.is_some());
    // what would be found beside it is not waited for
    assert!(found.report.front.is_empty() && found.report.sensitivities.is_empty());
}

#[test]
fn the_hiding_lip_is_as_low_as_the_check_of_the_assembly_allows() {
    let design = shallow();
    let lip = HidingLip::of(&Measures::of(&design).expect("measures")).expect("a lip hides them");
    let with_lip = |top_z_mm: f64| {
        let change = Cure { field: "leds.lip_top_z_mm".into(), value: json!(top_z_mm) };
        let design = design.changed(&change).expect("another lip");
        let measures = Measures::of(&design).expect("measures");
        let parts = build_seated(&design, &measures, &design.layout().expect("dots").passes).expect("parts");
        let assembly = domecast::design::parts::Assembly::of(&measures, &parts).expect("an assembly");
        check_assembly(&measures, &parts, &assembly)
    };
    with_lip(lip.top_z_mm).expect("hidden lights");
    let fault = with_lip(lip.top_z_mm - 0.1).expect_err("a light in the lens").to_string();
    assert!(fault.contains("shines straight into the lens"), "{fault}");
}
