use serde_json::{Value, json};

use super::*;
use crate::Design;

const THUMB24: &str = include_str!("../../../../designs/thumb24.json");

fn minimal(radius_mm: f64) -> Value {
    let thumb24: Value = serde_json::from_str(THUMB24).unwrap();
    let camera = &thumb24["camera"];
    json!({
        "version": 1,
        "name": "least",
        "camera": {
            "model": camera["model"], "matrix": camera["matrix"], "distortion": camera["distortion"]
        },
        "dome": { "radius_mm": radius_mm }
    })
}

#[test]
fn a_whole_file_is_left_as_it_is() {
    let mut design: Value = serde_json::from_str(THUMB24).unwrap();
    let before = design.clone();
    assert_eq!(derive(&mut design).unwrap(), []);
    assert_eq!(design, before);
}

#[test]
fn radius_and_lens_make_a_design() {
    for radius_mm in [4.0, 5.0, 7.9, 10.0, 12.6, 20.0, 25.0] {
        let text = minimal(radius_mm).to_string();
        let design: Design = text.parse().unwrap_or_else(|error| panic!("R = {radius_mm}: {error}"));
        assert!(design.derived().len() > 120, "{}", design.derived().len());
        assert_eq!(design.text(), text, "the text stays as it was written");
        let layout = design.layout().unwrap_or_else(|error| panic!("R = {radius_mm}: {error}"));
        assert!(layout.dots.len() > 20, "R = {radius_mm}: {} dots", layout.dots.len());
        assert!(layout.lost.is_empty());
    }
}

#[test]
fn every_rule_reads_only_what_stands_before_it() {
    // from the minimal design every rule is applied; one that read a later field would find no number
    let mut design = minimal(10.0);
    let mut given = derive(&mut design).unwrap();
    // posts are a rigid mount's
    let mut rigid = minimal(10.0);
    rigid["mount"] = json!({ "kind": "rigid" });
    given.extend(derive(&mut rigid).unwrap().into_iter().filter(|field| field.field.starts_with("mount.")));
    for rule in rules() {
        let is_other = ["camera.field_of_view_deg", "camera.distortion"].contains(&rule.field);
        let found = given.iter().any(|field| field.field == rule.field);
        assert!(found || is_other || rule.field.starts_with("accuracy"), "{}", rule.field);
        assert!(rule_of(rule.field).is_some_and(|says| says.len() > 2), "{}", rule.field);
    }
    let mut fields: Vec<&str> = rules().map(|rule| rule.field).collect();
    fields.sort_unstable();
    assert!(fields.windows(2).all(|two| two[0] != two[1]), "a field has one rule");
}

#[test]
fn a_given_field_wins_and_the_others_follow_it() {
    let mut design = minimal(10.0);
    design["springs"] = json!({ "free_length_mm": 8.0 });
    design["process"] = json!({ "min_wall_mm": 1.0 });
    derive(&mut design).unwrap();
    assert_eq!(design["springs"]["free_length_mm"], json!(8.0));
    let mut plain = minimal(10.0);
    derive(&mut plain).unwrap();
    let depth = |design: &Value| -design["camera"]["position_mm"][2].as_f64().unwrap();
    assert!(depth(&design) > depth(&plain), "longer springs need a deeper camera");
    let outer = |design: &Value| design["platforms"]["outer_mm"][0].as_f64().unwrap();
    assert!(outer(&design) > outer(&plain), "thicker walls need more room");
}

#[test]
fn cameras_on_boards_and_rigid_mounts_follow_from_a_radius() {
    for camera in crate::catalogue::entries(crate::catalogue::CatalogueKind::Cameras) {
        for mount in ["springs", "rigid"] {
            for radius_mm in [4.0, 10.0, 25.0] {
                let text = json!({
                    "version": 1, "name": "least", "camera": { "from": camera.key },
                    "camera_body": { "from": camera.key }, "dome": { "radius_mm": radius_mm },
                    "mount": { "kind": mount },
                });
                let name = format!("{} {mount} R = {radius_mm}", camera.key);
                let design: Design =
                    text.to_string().parse().unwrap_or_else(|error| panic!("{name}: {error}"));
                assert_eq!(design.is_rigid(), mount == "rigid", "{name}");
                let sections = design.sections();
                let holes = &sections.platforms.lower.mounting.at_mm;
                assert!(holes.len() >= 2, "{name}: {holes:?}");
                if design.is_rigid() {
                    assert_eq!(sections.mount.at_mm.len(), 4, "{name}");
                    for hole in holes {
                        let apart = |post: &[f64; 2]| (post[0] - hole[0]).hypot(post[1] - hole[1]);
                        let nearest = sections.mount.at_mm.iter().map(apart).fold(f64::INFINITY, f64::min);
                        assert!(nearest > 0.5 * sections.mount.post_diameter_mm + 1.1, "{name}: {nearest}");
                    }
                }
                if let Some(board) = &sections.camera_body.board {
                    let needed = board.size_mm[0].max(board.size_mm[1]) + 2.0 * board.clearance_mm;
                    let outer = sections.platforms.outer_mm;
                    assert!(outer[0].min(outer[1]) > needed, "{name}: {outer:?}");
                    assert!(sections.platforms.lower.clamp.azimuth_deg.is_empty(), "{name}");
                }
            }
        }
    }
}

#[test]
fn any_one_field_may_be_left_out_of_a_whole_file() {
    for field in fields() {
        let mut design: Value = serde_json::from_str(THUMB24).unwrap();
        let (above, last) = field.rsplit_once('.').unwrap();
        let place = design.pointer_mut(&format!("/{}", above.replace('.', "/")));
        let Some(Value::Object(section)) = place else { continue };
        section.remove(last);
        if let Err(error) = design.to_string().parse::<Design>() {
            // a rule's value may not suit the other numbers of a tight design; that must be said by name
            assert!(!error.field.is_empty() && error.problem != "the field is missing", "{field}: {error}");
        }
    }
}

#[test]
fn springs_of_any_common_size_stand_clear_of_a_boards_pocket() {
    let mut unclear = Vec::new();
    for camera in ["picam2", "picam3", "uvc32", "uvc38"] {
        for radius_mm in (4..=25).map(f64::from) {
            for outer_mm in [3.0, 3.5, 4.0] {
                for wall_mm in [0.6, 0.8] {
                    let mut design = json!({
                        "version": 1, "name": "least", "camera": { "from": camera },
                        "camera_body": { "from": camera }, "dome": { "radius_mm": radius_mm },
                        "springs": { "outer_diameter_mm": outer_mm }, "process": { "min_wall_mm": wall_mm },
                    });
                    crate::spec::fill::fill(&mut design, None).unwrap();
                    derive(&mut design).unwrap_or_else(|error| panic!("{camera} {radius_mm}: {error}"));
                    let known = Known::new(&design);
                    let ring = &design["springs"]["places"]["ring"];
                    let of = |key: &str| ring[key].as_f64().unwrap();
                    let hole_mm = 0.5 * known.n("magnet_pockets.push_out_diameter_mm");
                    let is_clear = (0..ring["count"].as_u64().unwrap()).all(|i| {
                        let azimuth_deg = of("first_azimuth_deg") + 360.0 * i as f64 / of("count");
                        let at = of("radius_mm") * glam::DVec2::from_angle(azimuth_deg.to_radians());
                        board::Pocket::of(&known).is_clear(at, hole_mm)
                    });
                    if !is_clear {
                        unclear.push(format!("{camera} {radius_mm} {outer_mm} {wall_mm}"));
                    }
                }
            }
        }
    }
    assert!(unclear.is_empty(), "{}: {unclear:#?}", unclear.len());
}
