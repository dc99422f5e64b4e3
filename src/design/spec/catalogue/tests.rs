//! The data: complete, sourced, in a design's own words; every key in a design.
use serde_json::json;

use super::*;
use crate::Design;
use std::str::FromStr;

fn thumb24() -> Value {
    serde_json::from_str(include_str!("../../../../designs/thumb24.json")).unwrap()
}

#[test]
fn every_entry_is_complete_and_has_sources() {
    for kind in CatalogueKind::ALL {
        assert_eq!(CatalogueKind::parse(kind.as_str()), Some(kind));
        let read: Result<Vec<CatalogueEntry>, _> = serde_json::from_str(kind.data());
        assert!(read.is_ok_and(|read| read.len() >= 4), "{kind:?}");
        for (i, entry) in entries(kind).iter().enumerate() {
            assert_eq!(entry.kind, kind);
            assert!(entries(kind)[..i].iter().all(|other| other.key != entry.key), "{} twice", entry.key);
            assert!(!entry.name.is_empty() && !entry.fields.is_empty(), "{}", entry.key);
            for (name, fact) in &entry.fields {
                assert!(fact.source.len() > 8, "{} {name}: a source is missing", entry.key);
                assert!(!fact.value.is_null() && name.contains('.'), "{} {name}", entry.key);
                let explained = match name.split_once('.') {
                    Some(("sensor", _)) => continue,
                    Some(("layer", field)) => format!("optics.layers.{field}"),
                    _ => name.clone(),
                };
                assert!(crate::explain(&explained, &json!({})).is_ok(), "{name} is no field of a design");
            }
        }
    }
    assert_eq!(entries(CatalogueKind::Cameras).len(), 6);
}

#[test]
fn an_unknown_key_names_the_nearest() {
    let fault = find(&[CatalogueKind::Leds], "luxeon_cz").unwrap_err().to_string();
    assert!(fault.contains("\"luxeon-cz\"") && fault.contains("domecast list leds"), "{fault}");
    assert!(find(&[CatalogueKind::Cameras], "").is_err());
}

/// thumb24 with one section that names a part, without the fields that the part gives.
fn with_part(kind: CatalogueKind, entry: &CatalogueEntry) -> Value {
    let mut design = thumb24();
    let name = |section: &mut Value, target: &str| {
        let Value::Object(section) = section else { return };
        for (field, _) in entry.section(target) {
            section.shift_remove(field);
        }
        section.insert("from".into(), json!(entry.key));
    };
    match kind {
        CatalogueKind::Cameras => {
            name(&mut design["camera"], "camera");
            name(&mut design["camera_body"], "camera_body");
        }
        CatalogueKind::Leds => name(&mut design["leds"], "leds"),
        CatalogueKind::Silicones => {
            name(&mut design["elastomer"], "elastomer");
            name(&mut design["optics"]["layers"][1], "layer");
        }
        CatalogueKind::Sheets => name(&mut design["optics"]["layers"][0], "layer"),
        CatalogueKind::Springs => name(&mut design["springs"], "springs"),
        CatalogueKind::Magnets => name(&mut design["magnets"], "magnets"),
    }
    design
}

#[test]
fn every_key_resolves_or_is_refused_for_a_physical_reason() {
    let mut resolved = Vec::new();
    for kind in CatalogueKind::ALL {
        for entry in entries(kind) {
            match Design::from_str(&with_part(kind, entry).to_string()) {
                Ok(_) => resolved.push(entry.key.as_str()),
                Err(fault) => {
                    // never the form of the entry: a rule between sections, or a part that cannot be built in yet
                    let text = fault.to_string();
                    let of_form = ["is missing", "unknown", "no such field", "not a number", "the type"];
                    assert!(of_form.iter().all(|word| !text.contains(word)), "{}: {text}", entry.key);
                    assert!(!fault.field.is_empty() && !fault.allowed.is_empty(), "{}: {text}", entry.key);
                }
            }
        }
    }
    for key in
        ["misumi75", "luxeon-cz", "0603", "solaris", "sylgard-184", "pmma-1", "music-0.3x3x5", "disc-3x1"]
    {
        assert!(resolved.contains(&key), "{key} does not fit thumb24; resolved: {resolved:?}");
    }
}

#[test]
fn what_a_design_gives_wins_and_sources_are_kept() {
    let mut design = with_part(CatalogueKind::Magnets, find(&[CatalogueKind::Magnets], "disc-3x1").unwrap());
    design["magnets"]["grip_force_n"] = json!(0.9);
    design["magnets"]["why"] = json!("choice: what the drawer had");
    let read = Design::from_str(&design.to_string()).unwrap();
    assert_eq!(read.sections().magnets.grip_force_n, 0.9);
    assert_eq!(read.sections().magnets.thickness_mm, 1.0);
    // the text is complete in itself
    let text: Value = serde_json::from_str(read.text()).unwrap();
    assert!(text["magnets"]["why"]["thickness_mm"].as_str().unwrap().starts_with("catalogue disc-3x1: "));
    assert_eq!(text["magnets"]["why"]["grip_force_n"], "choice: what the drawer had");
    assert!(text["magnets"].get("from").is_none());
    assert_eq!(Design::from_str(read.text()).unwrap().sections(), read.sections());
    // a design that names nothing keeps its own bytes
    let own = include_str!("../../../../designs/thumb24.json");
    assert_eq!(Design::from_str(own).unwrap().text(), own);
}

#[test]
fn boards_are_bodies() {
    for key in ["picam2", "picam3", "uvc32", "uvc38"] {
        let mut design = thumb24();
        design["camera_body"] = json!({ "from": key, "bore_clearance_mm": 0.3, "min_sheet_gap_mm": 0.5 });
        // A cylinder's set screws do not press on a board.
        let fault = Design::from_str(&design.to_string()).unwrap_err();
        assert_eq!(fault.field, "platforms.lower.clamp.azimuth_deg", "{key}: {fault}");
        design["platforms"]["lower"]["clamp"]["azimuth_deg"] = json!([]);
        design["envelope"]["size_mm"] = json!([100, 100, 100]);
        let read = Design::from_str(&design.to_string()).unwrap_or_else(|fault| panic!("{key}: {fault}"));
        let board = read.sections().camera_body.board.clone().unwrap();
        assert_eq!(board.holes_mm.len(), 4, "{key}");
    }
}
