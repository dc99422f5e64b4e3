//! A touch for any design: a ball pressed onto the pole and rolled aside, under the design's own lights.

use std::path::Path;

use serde_json::{Value, json};

use domecast_design::{Design, DesignError};
use domecast_fab::light::LightReport;
use domecast_sim::{Scene, SimError};

/// The scene as a file; `design_path` is what it names as its design. The ball is half as large as the dome, as the shipped
/// scene `ball` is to its own, and rolls without slipping: it turns by its way over its radius.
///
/// # Errors
/// A design whose lights leave its dome dark.
pub fn file(name: &str, design: &Design, design_path: &str) -> Result<Value, DesignError> {
    let sections = design.sections();
    let dome = sections.dome.shape();
    let (wide_mm, pole_mm) = (dome.rim_radius_mm(), dome.height_mm());
    let ball_mm = 0.5 * wide_mm;
    let aside_mm = 0.24 * wide_mm;
    let at = |time_s: f64, x_mm: f64, gap: f64| {
        json!({
            "time_s": time_s,
            "position_mm": [rounded(x_mm), 0, rounded(pole_mm + ball_mm + gap * wide_mm)],
            "rotation_deg": [0, rounded((x_mm / ball_mm).to_degrees()), 0],
        })
    };
    let exposure = &sections.exposure;
    Ok(json!({
        "version": 1,
        "name": name,
        "description": "A ball is pressed on the pole and rolled to the side.",
        "design": design_path,
        "frames": { "count": 31, "rate_hz": 15 },
        "tolerance": { "px": 0.05, "grey": 16 },
        // a few pixels of the contact's edge are not what this scene is for
        "contact": { "level": "linear", "element_mm": rounded(wide_mm / 10.0) },
        "objects": [{
            "name": "ball",
            "shape": { "kind": "sphere", "radius_mm": rounded(ball_mm) },
            "path": [at(0.0, 0.0, 0.02), at(0.8, 0.0, -0.14), at(2.0, aside_mm, -0.16)],
        }],
        "light": {
            "surround_level": exposure.surround_level,
            "leds": {
                "level_per_mw_mm2": rounded(LightReport::of(design)?.level_per_mw_mm2),
                "stray_level": exposure.stray_level,
                "crosstalk": exposure.crosstalk,
                "why": "as the design's exposure is set in its own report",
            },
        },
    }))
}

/// That scene, resolved.
///
/// # Errors
/// What the scene meets in this design: a load beyond its springs, say.
pub fn scene(design: &Design) -> Result<Scene, SimError> {
    let value = file("ball", design, "")?;
    Scene::new(domecast_design::from_value(&value)?, Path::new("."), design.clone())
}

/// A number that people may read.
fn rounded(value: f64) -> f64 {
    (1e3 * value).round() / 1e3
}
