//! Random designs: parts that pass, or a refusal that names a field.

use serde_json::{Value, json};
use std::str::FromStr;

use super::random_designs::{random_designs, scale_grip, scale_lengths};
use super::*;

fn sweep(count: usize) -> (usize, Vec<String>) {
    let (mut sound, mut refused) = (0, Vec::new());
    for (index, design) in random_designs(count).enumerate() {
        let text = design.to_string();
        let design = match crate::Design::from_str(&text) {
            Ok(design) => design,
            Err(error) => {
                assert!(!error.field.is_empty(), "{error}");
                refused.push(format!("design: {}", error.field));
                continue;
            }
        };
        let made = Measures::of(&design).and_then(|m| {
            let passes = [PrintPass::new(0.0, 0.0), PrintPass::new(0.02 * (index % 40) as f64, index as f64)];
            let parts = build_seated(&design, &m, &passes)?;
            let assembly = Assembly::of(&m, &parts)?;
            let checked = check_sensor(&design, &m, &parts, &assembly, &[])?;
            assert!(checked.sight.iter().flat_map(|pose| &pose.counts).all(|count| count.blocked == 0));
            Ok(parts)
        });
        match made {
            Ok(parts) => {
                sound += 1;
                for part in parts {
                    let found = part.inspect();
                    assert!(
                        found.is_one_solid() && found.genus() == Some(part.genus),
                        "{index}: {}",
                        part.name
                    );
                    assert!((found.volume_mm3 / part.volume_mm3 - 1.0).abs() < 1e-5);
                }
            }
            Err(error) => {
                for fault in error.faults() {
                    let field = match fault {
                        PartError::Infeasible { field, .. } | PartError::View { field, .. } => field,
                        PartError::Unheld { cure, .. }
                        | PartError::Blocked { cure, .. }
                        | PartError::Cured { cure, .. } => &cure.field,
                        _ => panic!("design {index} is neither made nor refused by field: {fault}\n{text}"),
                    };
                    assert!(!field.is_empty());
                    refused.push(format!("{field}: {fault}"));
                }
            }
        }
    }
    (sound, refused)
}

#[test]
fn random_designs_pass_or_are_refused_by_field() {
    let (sound, refused) = sweep(10);
    assert!(sound >= 2, "only {sound} designs were made; refused: {refused:#?}");
}

#[test]
fn long_many_random_designs() {
    let (sound, refused) = sweep(100);
    println!("{sound} made, {} refused", refused.len());
    for reason in &refused {
        println!("  {reason}");
    }
    assert!(sound >= 16, "only {sound} designs were made; refused: {refused:#?}");
}

/// Shapes that kernels stumble over: pockets that touch the window, flush
/// faces, a pocket almost through, tiny and huge parts.
#[test]
fn awkward_parts_are_sound_or_refused() {
    let base = Measures::of(&thumb24()).unwrap();
    let outcomes: Vec<(&str, Measures)> = vec![
        ("pocket tangent to the bore", {
            let mut m = base.clone();
            let touch = m.bore_radius_mm() + m.pocket_mm().0;
            m.spring_axes_mm[0] = glam::DVec2::new(0.0, touch);
            m
        }),
        ("pocket as deep as the plate less a micrometre", {
            let mut m = base.clone();
            m.magnets.thickness_mm = m.lower_top_z_mm - m.platforms.lower.underside_z_mm - 0.001;
            m.pockets.depth_clearance_mm = 0.0;
            m.pockets.push_out_diameter_mm = 0.0;
            m
        }),
        ("cable exit flush with the top", {
            let mut m = base.clone();
            m.platforms.lower.cable_exit.width_mm = 3.2;
            m.platforms.lower.cable_exit.height_mm = m.lower_top_z_mm - m.platforms.lower.underside_z_mm;
            m
        }),
        ("rim flush with the seat", {
            let mut m = base.clone();
            m.platforms.upper.rim_height_mm = 0.0;
            m
        }),
        ("lip flush with the seat", {
            let mut m = base.clone();
            m.leds.lip_top_z_mm = m.seat_z_mm();
            m
        }),
    ];
    for limit in [0.6, 0.0] {
        for (name, m) in &outcomes {
            let mut m = m.clone();
            m.process.min_wall_mm = limit;
            match build(&m, &passes()) {
                Ok(parts) => parts.iter().for_each(|part| part.check().unwrap()),
                Err(error) => error.faults().iter().for_each(|fault| match fault {
                    PartError::Infeasible { field, .. } => assert!(!field.is_empty(), "{name}"),
                    // Without a limit for walls, touching features are let
                    // through to the mesh, which must then be refused as such.
                    PartError::Broken { .. } if limit == 0.0 => {}
                    other => panic!("{name}: {other}"),
                }),
            }
        }
    }
}

#[test]
fn parts_of_a_millimetre_and_of_two_hundred_are_sound() {
    for size_mm in [1.0, 200.0] {
        let text =
            std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json"))
                .unwrap();
        let mut d: Value = serde_json::from_str(&text).unwrap();
        let scale = size_mm / 24.0;
        scale_lengths(&mut d, scale, false);
        d["loads"]["claims"] = json!([]);
        scale_grip(&mut d, scale);
        d["sheet"]["kerf_mm"] = json!(0.1);
        // The same number of triangles at every size.
        d["mesh"]["chord_tolerance_mm"] = json!((0.03 * scale).max(1e-3));
        d["mesh"]["optical_chord_tolerance_mm"] = json!((0.03 * scale).max(1e-3));
        let design = crate::Design::from_str(&d.to_string()).unwrap();
        let m = Measures::of(&design).unwrap();
        for part in build(&m, &passes()).unwrap() {
            part.check().unwrap();
        }
    }
}
