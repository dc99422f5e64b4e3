//! What the numbers of the lit frame mean: errors where `track` would be blind, warnings where it would be worse than need
//! be.

use serde_json::json;

use super::levels::LightReport;
use crate::numbers::{percent, typeset};
use domecast_design::{Design, DesignError};
use domecast_runtime::track::MIN_MARKER_RISE_LEVELS;

/// A dot's ink gives back a twentieth of the membrane's light at most: what is left of the level is the dot's contrast,
/// and it must be as clear as a marker's.
const MIN_DOME_LEVEL: f64 = MIN_MARKER_RISE_LEVELS / 0.95;
/// A marker below this contrast, in units of what `track` needs, is worth a word.
const CLEAR_MARKER: f64 = 3.0;
/// The median that the paper's runtime and photometric stereo want at least: a tenth of full scale.
const MIN_MEDIAN_LEVEL: f64 = 25.0;
/// More shadowed or saturated places than this share are worth a word.
const MAX_SHARE: f64 = 0.005;

/// Refuses a sensor that its own camera could not read.
pub(super) fn require(design: &Design, report: &LightReport) -> Result<(), DesignError> {
    let (dome, leds) = (&report.dome, &design.sections().leds);
    if dome.median_level < MIN_DOME_LEVEL {
        // Light from outside does not grow with the lights.
        let stray = 255.0 * design.sections().exposure.stray_level;
        let factor = (MIN_DOME_LEVEL - stray) / (dome.median_level - stray).max(f64::MIN_POSITIVE);
        let [r, g, b] = leds.radiant_flux_mw.to_array().map(|mw| round_up(1.1 * factor.max(1.0) * mw));
        return Err(DesignError::at(
            "leds.radiant_flux_mw",
            json!(leds.radiant_flux_mw),
            format!(
                "the dome is dark: its median is {} of 255 with the camera's exposure, and dots on it cannot be told from it",
                typeset(dome.median_level)
            ),
            format!("a median of at least {}", typeset(MIN_DOME_LEVEL)),
        )
        .with_help(format!(
            "leds.radiant_flux_mw = {} would do, or a larger exposure.max_level_per_mw_mm2 where the camera has it",
            json!({ "r": r, "g": g, "b": b })
        )));
    }
    let dimmest = report.markers.iter().min_by(|a, b| a.contrast_levels.total_cmp(&b.contrast_levels));
    let Some(marker) = dimmest.filter(|marker| marker.contrast_levels < MIN_MARKER_RISE_LEVELS) else {
        return Ok(());
    };
    Err(DesignError::at(
        format!("white_markers.positions_mm[{}]", marker.id),
        json!(design.sections().white_markers.positions_mm.get(marker.id)),
        format!(
            "`track` cannot see the marker: under the design's lights it is {} of 255, {} above what is around it",
            typeset(marker.level),
            typeset(marker.contrast_levels)
        ),
        format!("at least {} above it", typeset(MIN_MARKER_RISE_LEVELS)),
    )
    .with_help(
        "place the markers where more light reaches them, nearer to the dome's rim, or darken what is around them \
         (`exposure.surround_level`)",
    ))
}

/// What its maker should know.
pub(super) fn warnings(design: &Design, report: &LightReport) -> Vec<(String, String)> {
    let dome = &report.dome;
    let mut found = Vec::new();
    let mut warn = |field: &str, message: String| found.push((field.to_owned(), message));
    if dome.median_level < MIN_MEDIAN_LEVEL {
        warn(
            "leds.radiant_flux_mw",
            format!(
                "the lit dome has a median of {} of 255 only{}",
                typeset(dome.median_level),
                if report.is_exposure_at_limit { ", with the camera's largest exposure" } else { "" }
            ),
        );
    }
    if dome.percentile_5_level < MIN_DOME_LEVEL {
        warn(
            "leds",
            format!(
                "one place in twenty of the dome in view is darker than {} of 255: dots there cannot be told from it",
                typeset(dome.percentile_5_level)
            ),
        );
    }
    if dome.shadow_share > MAX_SHARE {
        warn(
            "leds.lip_top_z_mm",
            format!(
                "{} of the dome in view lies in the platform's shadow: less than a fifth of its light comes from the lights \
                 directly, see report/light-frame.png",
                percent(dome.shadow_share)
            ),
        );
    }
    if dome.saturated_share > MAX_SHARE {
        warn(
            "exposure.level_per_mw_mm2",
            format!(
                "a colour is cut off at full scale over {} of the dome in view",
                percent(dome.saturated_share)
            ),
        );
    }
    let contrast = |pick: fn(f64, f64) -> f64, start: f64| {
        report.markers.iter().map(|marker| marker.contrast_levels).fold(start, pick)
    };
    let (dimmest, brightest) = (contrast(f64::min, f64::INFINITY), contrast(f64::max, 0.0));
    let level = report.markers.iter().map(|marker| marker.level).fold(f64::INFINITY, f64::min);
    if dimmest < CLEAR_MARKER * MIN_MARKER_RISE_LEVELS {
        warn(
            "white_markers.positions_mm",
            format!(
                "the white markers stand out by {} to {} of 255; `track` needs {}, and noise of {} leaves little",
                typeset(dimmest),
                typeset(brightest),
                typeset(MIN_MARKER_RISE_LEVELS),
                typeset(design.sections().exposure.pixel_noise_levels)
            ),
        );
    }
    if level < dome.percentile_95_level {
        warn(
            "white_markers.reflectance",
            format!(
                "the white markers are at {} of 255 under the design's lights and the dome at {}: a runtime that finds them \
                 by one high threshold, as the paper's, does not see them; `track` does",
                typeset(level),
                typeset(dome.percentile_95_level)
            ),
        );
    }
    found
}

/// Two digits, upwards.
fn round_up(value: f64) -> f64 {
    let unit = 10_f64.powf(value.abs().max(f64::MIN_POSITIVE).log10().floor() - 1.0);
    (value / unit).ceil() * unit
}
