//! The lit sensor at rest, as the camera will see it: is the dome bright enough, even enough, and do the white markers
//! stand out?
//!
//! ```
//! use domecast_fab::light::LightCheck;
//! use std::str::FromStr;
//!
//! let design = domecast_design::Design::from_str(include_str!("../../../designs/thumb24.json"))?;
//! let check = LightCheck::of(&design)?;
//! assert_eq!(check.report.markers.len(), 4);
//! assert!(check.report.dome.median_level > 20.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod frame;
mod judge;
mod levels;

use std::path::Path;

use glam::DVec2;
use serde::Serialize;
use serde_json::json;

use domecast_design::layout::frame::UndistortedFrame;
use domecast_design::parts::markers_of;
use domecast_design::{Design, DesignError};
use domecast_sim::light::RestLight;
use domecast_sim::scene::SceneFile;
use domecast_sim::{Scene, SimError};

pub use levels::{DomeLevels, MarkerLevels};
use levels::{dome_levels, marker_levels};

/// Places of the image at which the dome's light is looked at are this far apart, px.
const STEP_PX: u32 = 4;

/// What the frame of the lit sensor at rest shows; levels are grey values of 0 to 255 before clipping.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LightReport {
    /// Exposure and gain that the frame is taken with: level (of full scale) of a white surface for each mW/mm^2 on it.
    pub level_per_mw_mm2: f64,
    /// Whether that is the camera's largest, and the frame darker than wanted.
    pub is_exposure_at_limit: bool,
    /// The dome between the dots.
    pub dome: DomeLevels,
    /// Each white marker.
    pub markers: Vec<MarkerLevels>,
}

/// The report with the frame, a map, and what its maker should know.
#[derive(Debug, Clone)]
pub struct LightCheck {
    /// The numbers.
    pub report: LightReport,
    /// The frame at rest, without dots' noise: a PNG of the raw image's size.
    pub frame_png: Vec<u8>,
    /// The dome's grey level over its median, as a map in the raw image: a PNG.
    pub map_png: Vec<u8>,
    /// Field and message of each warning.
    pub warnings: Vec<(String, String)>,
}

impl LightCheck {
    /// Looks at a design under its own lights.
    ///
    /// # Errors
    /// No light, lights that do not fit the design, a dome too dark for `track`, or a white marker that `track` cannot
    /// tell from what is around it.
    pub fn of(design: &Design) -> Result<Self, DesignError> {
        let exposure = &design.sections().exposure;
        let unit = scene(design, 1.0, 0.0)?;
        let light = RestLight::of(&unit, pixels(design)).map_err(fault)?;
        let light = light.filter(|light| light.dome.iter().any(|place| place.level.iter().any(|v| *v > 0.0)));
        let Some(light) = light else {
            return Err(DesignError::at(
                "leds.list",
                json!(design.sections().leds.list),
                "no light reaches the part of the dome that the camera sees",
                "at least one light, with a radiant flux above 0, whose way to the dome is open",
            ));
        };
        let brightest = light.dome.iter().flat_map(|place| place.level).fold(0.0, f64::max);
        let wanted = exposure.brightest_level / brightest;
        let level_per_mw_mm2 = exposure.level_per_mw_mm2.unwrap_or(wanted).min(exposure.max_level_per_mw_mm2);
        let report = LightReport {
            level_per_mw_mm2,
            is_exposure_at_limit: exposure.level_per_mw_mm2.is_none()
                && wanted > exposure.max_level_per_mw_mm2,
            dome: dome_levels(&light, level_per_mw_mm2, exposure),
            markers: marker_levels(design, &light, level_per_mw_mm2),
        };
        judge::require(design, &report)?;
        let warnings = judge::warnings(design, &report);
        let map_png = frame::map(design, &light, &report)?;
        let lit = scene(design, level_per_mw_mm2, exposure.stray_level)?;
        Ok(Self { frame_png: frame::frame(&lit)?, map_png, report, warnings })
    }

    /// Files of the build: path and content.
    pub fn files(&self) -> Vec<(String, Vec<u8>)> {
        // numbers and lists only: nothing here can fail to be written
        let numbers = serde_json::to_string_pretty(&self.report).unwrap_or_default() + "\n";
        vec![
            ("report/light.json".into(), numbers.into_bytes()),
            ("report/light-frame.png".into(), self.frame_png.clone()),
            ("report/light-map.png".into(), self.map_png.clone()),
        ]
    }
}

/// Standard deviation of each white marker's centroid in an image axis, px, from its contrast in the lit frame.
///
/// # Errors
/// As [`LightCheck::of`].
pub fn marker_noise_px(design: &Design) -> Result<Vec<f64>, DesignError> {
    Ok(LightCheck::of(design)?.report.markers.iter().map(|marker| marker.centroid_sd_px).collect())
}

/// The sensor at rest under its lights with an exposure.
fn scene(design: &Design, level_per_mw_mm2: f64, stray_level: f64) -> Result<Scene, DesignError> {
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
fn pixels(design: &Design) -> impl Iterator<Item = DVec2> {
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
fn fault(error: SimError) -> DesignError {
    match error {
        SimError::Input(error) => *error,
        other => DesignError::at("leds", "", other.to_string(), "lights that can be computed"),
    }
}

/// Outlines of the design's white markers in the raw image, px; empty where the lens does not see one whole.
fn marker_outlines(design: &Design) -> Vec<Vec<DVec2>> {
    let outline = |marker: &domecast_optics::pose::Marker| marker.outline_px(design.optics());
    markers_of(design).iter().map(|marker| outline(marker).map(Vec::from).unwrap_or_default()).collect()
}
