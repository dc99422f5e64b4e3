//! The sensor at rest under its own lights, as a scene.

use std::path::Path;

use glam::DVec2;
use serde_json::json;

use domecast_design::layout::frame::UndistortedFrame;
use domecast_design::parts::markers_of;
use domecast_design::{Design, DesignError};
use domecast_sim::scene::SceneFile;
use domecast_sim::{Scene, SimError};

/// Places of the image at which the dome's light is looked at are this far apart, px.
pub(super) const STEP_PX: u32 = 4;

/// Weights of red, green and blue in luma (ITU-R BT.601), the grey that `track` reads.
const LUMA: [f64; 3] = [0.299, 0.587, 0.114];

/// Grey of a colour.
pub(super) fn luma(level: [f64; 3]) -> f64 {
    level.iter().zip(LUMA).map(|(level, weight)| level * weight).sum()
}

/// The sensor at rest under its lights with an exposure.
pub(crate) fn scene(design: &Design, level_per_mw_mm2: f64, stray_level: f64) -> Result<Scene, DesignError> {
    let exposure = &design.sections().exposure;
    let file: SceneFile = serde_json::from_value(json!({
        "version": 1,
        "name": "rest",
        "design": "",
        "frames": { "count": 1, "rate_hz": 30 },
        "tolerance": { "px": 0.1, "grey": 1 },
        "light": {
            "surround_level": exposure.surround_level,
            "leds": {
                "level_per_mw_mm2": level_per_mw_mm2,
                "stray_level": stray_level,
                "crosstalk": exposure.crosstalk,
            },
        },
    }))
    .map_err(|error| {
        DesignError::at("exposure", "", error.to_string(), "an exposure as the schema has it")
    })?;
    Scene::new(file, Path::new(""), design.clone()).map_err(fault)
}

/// Places inside of the runtime's mask.
pub(super) fn pixels(design: &Design) -> impl Iterator<Item = DVec2> {
    let lens = design.optics().lens();
    let (width, height) = (lens.spec().width, lens.spec().height);
    let matrix = design.undistorted_matrix();
    let [[_, _, cx], [_, _, cy], _] = matrix;
    let undistorted = UndistortedFrame::new(&matrix);
    let radius_px = design.sections().runtime.mask_radius_px;
    let columns = move |y: u32| {
        (0..width).step_by(STEP_PX as usize).map(move |x| DVec2::new(f64::from(x), f64::from(y)))
    };
    (0..height).step_by(STEP_PX as usize).flat_map(columns).filter(move |pixel| {
        let place = undistorted.as_ref().and_then(|frame| frame.from_raw(lens, *pixel).ok());
        place.is_some_and(|place| place.distance(DVec2::new(cx, cy)) <= radius_px)
    })
}

/// What the simulator refuses is a fault of the design: of its lights, as a rule.
pub(crate) fn fault(error: SimError) -> DesignError {
    match error {
        SimError::Input(error) => *error,
        other => DesignError::at("leds", "", other.to_string(), "lights that can be computed"),
    }
}

/// Outlines of the design's white markers in the raw image, px; empty where the lens does not see one whole.
pub(super) fn marker_outlines(design: &Design) -> Vec<Vec<DVec2>> {
    let outline = |marker: &domecast_optics::pose::Marker| marker.outline_px(design.optics());
    markers_of(design).iter().map(|marker| outline(marker).map(Vec::from).unwrap_or_default()).collect()
}
