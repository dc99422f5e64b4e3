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

mod edges;
mod frame;
mod judge;
mod levels;
mod rest;
mod separation;

use serde_json::json;

use domecast_design::{Cure, Design, DesignError};
use domecast_sim::light::RestLight;

pub use edges::ShadowEdges;
pub use levels::{DomeLevels, LightReport, MarkerLevels};
use levels::{dome_levels, marker_levels};
use rest::pixels;
pub(crate) use rest::{fault, scene};
pub use separation::Separation;
pub(crate) use separation::{lacking, normal_error_deg, percentile_of};

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

/// The light at rest, and what it is in the frame.
///
/// # Errors
/// As [`LightCheck::of`].
fn measure(design: &Design) -> Result<(RestLight, LightReport), DesignError> {
    let exposure = &design.sections().exposure;
    let unit = scene(design, 1.0, 0.0)?;
    let light = RestLight::of(&unit, pixels(design)).map_err(fault)?;
    let light = light.filter(|light| light.dome.iter().any(|place| place.level.iter().any(|v| *v > 0.0)));
    let Some(light) = light else {
        let fault = DesignError::at(
            "leds.list",
            json!(design.sections().leds.list),
            "no light reaches the part of the dome that the camera sees",
            "at least one light, with a radiant flux above 0, whose way to the dome is open",
        );
        // Left out, a rule gives lights.
        let is_empty = design.sections().leds.list.is_empty();
        let ruled = Cure { field: "leds.list".into(), value: serde_json::Value::Null };
        return Err(if is_empty { fault.with_cure(ruled) } else { fault });
    };
    let brightest = light.dome.iter().flat_map(|place| place.level).fold(0.0, f64::max);
    let wanted = exposure.brightest_level / brightest;
    let level_per_mw_mm2 = exposure.level_per_mw_mm2.unwrap_or(wanted).min(exposure.max_level_per_mw_mm2);
    let report = LightReport {
        level_per_mw_mm2,
        is_exposure_at_limit: exposure.level_per_mw_mm2.is_none() && wanted > exposure.max_level_per_mw_mm2,
        dome: dome_levels(&light, level_per_mw_mm2, exposure),
        markers: marker_levels(design, &light, level_per_mw_mm2),
        edges: None,
        separation: None,
    };
    judge::require(design, &report)?;
    Ok((light, report))
}

impl LightCheck {
    /// Looks at a design under its own lights.
    ///
    /// # Errors
    /// No light, lights that do not fit the design, a dome too dark for `track`, a key on the edge of a shadow, or a white
    /// marker that `track` cannot tell from what is around it.
    pub fn of(design: &Design) -> Result<Self, DesignError> {
        let (light, mut report) = measure(design)?;
        report.edges = ShadowEdges::of(design, &light);
        judge::require_key(design, &report)?;
        let map_png = frame::map(design, &light, &report)?;
        let lit = scene(design, report.level_per_mw_mm2, design.sections().exposure.stray_level)?;
        report.separation = Separation::of(&lit, report.level_per_mw_mm2)?;
        let warnings = judge::warnings(design, &report);
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

impl LightReport {
    /// The numbers without the pictures.
    ///
    /// # Errors
    /// As [`LightCheck::of`].
    pub fn of(design: &Design) -> Result<Self, DesignError> {
        measure(design).map(|(_, report)| report)
    }
}

/// Where the design's own lights leave edges of shadows; `None` where its dots cannot be laid out.
///
/// # Errors
/// As [`LightCheck::of`].
pub fn shadow_edges(design: &Design) -> Result<Option<ShadowEdges>, DesignError> {
    let (light, _) = measure(design)?;
    Ok(ShadowEdges::of(design, &light))
}

/// Standard deviation of each white marker's centroid in an image axis, px, from its contrast in the lit frame.
///
/// # Errors
/// As [`LightCheck::of`].
pub fn marker_noise_px(design: &Design) -> Result<Vec<f64>, DesignError> {
    Ok(LightReport::of(design)?.markers.iter().map(|marker| marker.centroid_sd_px).collect())
}
