//! The check of design texts, in memory; what a person sees is in `tests/cli_bad_input.rs`.

use super::*;

const THUMB24: &str = include_str!("../../designs/thumb24.json");

#[test]
fn thumb24_resolves() {
    let design = from_text(THUMB24).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(design.name(), "thumb24");
    let [low, high] = design.bounds_mm();
    assert!(((high - low) - glam::DVec3::new(24.0, 24.0, 26.0)).length() < 1e-9);
    assert_eq!(design.springs_at_mm().len(), 6);
    assert!((design.lower_top_z_mm() + 10.0).abs() < 1e-12);
    assert_eq!(design.warnings().len(), 1, "the field of view that the lens model cannot reach");
    assert!(design.warnings()[0].message.contains("folds at 61.0"));
}
