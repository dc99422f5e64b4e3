//! What the numbers of the lit frame mean: errors where `track` would be blind, warnings where it would be worse than need
//! be.

use serde_json::json;

use super::edges::ShadowEdges;
use super::levels::{FULL, LightReport, MarkerLevels};
use super::separation::Separation;
use crate::numbers::{percent, typeset};
use domecast_design::{Cure, Design, DesignError};
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

/// A paint whiter than this is none.
const MAX_REFLECTANCE: f64 = 0.9;
/// A dome whose median is brighter than this is cut off at full scale over too much of it.
const MAX_MEDIAN_LEVEL: f64 = 200.0;
/// Lights this many times brighter are other lights.
const MAX_BRIGHTER: f64 = 1e3;

/// Refuses a sensor that its own camera could not read.
pub(super) fn require(design: &Design, report: &LightReport) -> Result<(), DesignError> {
    let (dome, leds) = (&report.dome, &design.sections().leds);
    if dome.median_level < MIN_DOME_LEVEL {
        // Light from outside does not grow with the lights.
        let stray = FULL * design.sections().exposure.stray_level;
        let factor = (MIN_DOME_LEVEL - stray) / (dome.median_level - stray).max(f64::MIN_POSITIVE);
        // An exposure that follows the brightest place takes back what brighter lights give.
        let follows = design.sections().exposure.level_per_mw_mm2.is_none() && !report.is_exposure_at_limit;
        let field =
            if follows { "leds.center_z_mm or leds.center_radius_mm" } else { "leds.radiant_flux_mw" };
        let fault = DesignError::at(
            field,
            if follows { json!(leds.center_z_mm) } else { json!(leds.radiant_flux_mw) },
            format!(
                "the dome is dark: its median is {} of 255 with the camera's exposure, and dots on it cannot be distinguished from it",
                typeset(dome.median_level)
            ),
            format!("a median of at least {}", typeset(MIN_DOME_LEVEL)),
        );
        if follows {
            return Err(fault.with_help(
                "the camera exposes for the brightest place: let the lights reach more of the dome \
                 (leds.center_z_mm, leds.center_radius_mm, leds.tilt_deg, leds.lip_top_z_mm)",
            ));
        }
        let cure = brighter(design, 1.1 * factor.max(1.0));
        let text = format!("{cure}, or a larger exposure.max_level_per_mw_mm2 where the camera has it");
        return Err(fault.with_cure(cure).with_help(text));
    }
    let dimmest = report.markers.iter().min_by(|a, b| a.contrast_levels.total_cmp(&b.contrast_levels));
    let Some(marker) = dimmest.filter(|marker| marker.contrast_levels < MIN_MARKER_RISE_LEVELS) else {
        return Ok(());
    };
    let fault = DesignError::at(
        format!("white_markers.positions_mm[{}]", marker.id),
        json!(design.sections().white_markers.positions_mm.get(marker.id)),
        format!(
            "`track` cannot see the marker: under the design's lights it is {} of 255, {} above what is around it",
            typeset(marker.level),
            typeset(marker.contrast_levels)
        ),
        format!("at least {} above it", typeset(MIN_MARKER_RISE_LEVELS)),
    );
    const ELSE: &str = "place the markers where more light reaches them, nearer to the dome's rim, or darken what is \
                        around them (`exposure.surround_level`)";
    Err(match seen_by(design, report, marker) {
        Some(cure) => {
            let text = format!("{cure}; or {ELSE}");
            fault.with_cure(cure).with_help(text)
        }
        None => fault.with_help(ELSE),
    })
}

/// Refuses a pattern whose key lies on the edge of a shadow: `track` would state nothing of any frame.
pub(super) fn require_key(design: &Design, report: &LightReport) -> Result<(), DesignError> {
    let Some(edges) = report.edges.filter(|edges| edges.is_key_hidden) else {
        return Ok(());
    };
    let fault = DesignError::at(
        "pattern.polar_angle_deg",
        json!(design.sections().pattern.polar_angle_deg),
        "the dot left out as the pattern's key lies on the edge of a light's shadow: `track` does not see the gap and states nothing",
        "a pattern whose key keeps off the edges of shadows",
    );
    const ELSE: &str = "let the lights reach more of the dome (leds.center_z_mm, leds.lip_top_z_mm)";
    let within_deg = edges.from_polar_deg.map_or(0.0, f64::floor);
    if within_deg <= 0.0 {
        return Err(fault.with_help(ELSE));
    }
    let cure = Cure { field: "pattern.polar_angle_deg".into(), value: json!(within_deg) };
    let text = format!("{cure}; or {ELSE}");
    Err(fault.with_cure(cure).with_help(text))
}

/// Lights so many times brighter.
fn brighter(design: &Design, factor: f64) -> Cure {
    let [r, g, b] = design.sections().leds.radiant_flux_mw.to_array().map(|mw| round_up(factor * mw));
    Cure { field: "leds.radiant_flux_mw".into(), value: json!({ "r": r, "g": g, "b": b }) }
}

/// What makes a marker stand out by what `track` needs and half of that again: surroundings as dark as that asks for;
/// where none are dark enough, more light if the camera cannot expose longer, and else a whiter paint, or an exposure that
/// cuts off the brightest places of the dome.
fn seen_by(design: &Design, report: &LightReport, marker: &MarkerLevels) -> Option<Cure> {
    let wanted = 1.5 * MIN_MARKER_RISE_LEVELS;
    let sections = design.sections();
    if marker.level >= wanted {
        let level = (1e4 * (marker.level - wanted) / FULL).floor() / 1e4;
        return Some(Cure { field: "exposure.surround_level".into(), value: json!(level) });
    }
    let factor = (wanted + FULL * sections.exposure.surround_level) / marker.level.max(f64::MIN_POSITIVE);
    if report.is_exposure_at_limit && factor < MAX_BRIGHTER {
        return Some(brighter(design, factor));
    }
    let reflectance = factor * sections.white_markers.reflectance;
    if reflectance <= MAX_REFLECTANCE {
        return Some(Cure { field: "white_markers.reflectance".into(), value: json!(round_up(reflectance)) });
    }
    // The exposure leaves headroom at the dome's brightest place, which dots do not need: a longer one.
    let stray = FULL * sections.exposure.stray_level;
    let longer = (wanted + FULL * sections.exposure.surround_level - stray)
        / (marker.level - stray).max(f64::MIN_POSITIVE);
    let level = round_up(longer * report.level_per_mw_mm2);
    let is_possible = level <= sections.exposure.max_level_per_mw_mm2
        && longer * report.dome.median_level <= MAX_MEDIAN_LEVEL;
    is_possible.then(|| Cure { field: "exposure.level_per_mw_mm2".into(), value: json!(level) })
}

/// What dots on edges of shadows mean; `None` where there are none.
fn on_edges(edges: ShadowEdges) -> Option<String> {
    let polar_deg = edges.from_polar_deg.filter(|_| edges.dots > 0)?;
    let dots = if edges.dots == 1 { "1 dot lies".to_owned() } else { format!("{} dots lie", edges.dots) };
    Some(format!(
        "{dots} on the edge of a light's shadow, where `track` may withhold them or put them some tenths of a pixel off: the pattern keeps off \
         it within {} degrees",
        typeset(polar_deg.floor())
    ))
}

/// What lights mean whose colors hardly change with the skin's slope, as where two of a color stand opposite each other.
fn hides_slopes(separation: Separation) -> Option<String> {
    let share = separation.blind_share_to_45_deg;
    (share > MAX_SHARE).then(|| {
        format!(
            "{} of the dome within 45 degrees of the pole hardly changes its color with slope (a normal is off by more than 5 degrees for one \
             level): `track --shape` fills in from around there, and deep touches may be far off, as `height_sd` says; let each color reach it from one \
             side, its lights side by side and not opposite each other",
            percent(share)
        )
    })
}

/// What platforms that let light through mean: neither the lit platform nor what the lens sees of the lights is simulated.
fn shows_lights(design: &Design) -> Option<String> {
    let leds = &design.sections().leds;
    (leds.through_platform > 0.0 && !leds.list.is_empty()).then(|| {
        format!(
            "the platforms let {} of the light through: the lens sees the lights through them, as spots that are not in \
             report/light-frame.png; paint them black, or judge a frame of the real sensor",
            percent(leds.through_platform)
        )
    })
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
    if let Some(message) = shows_lights(design) {
        warn("leds.through_platform", message);
    }
    if dome.percentile_5_level < MIN_DOME_LEVEL {
        warn(
            "leds",
            format!(
                "one place in twenty of the dome in view is darker than {} of 255: dots there cannot be distinguished from it",
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
    if let Some(message) = report.separation.and_then(hides_slopes) {
        warn("leds.list", message);
    }
    if let Some(message) = report.edges.and_then(on_edges) {
        warn("pattern.polar_angle_deg", message);
    }
    found.extend(dim_markers(design, report));
    found
}

/// White markers that hardly stand out, or less than the dome does.
fn dim_markers(design: &Design, report: &LightReport) -> Vec<(String, String)> {
    let (dome, mut found) = (&report.dome, Vec::new());
    let mut warn = |field: &str, message: String| found.push((field.to_owned(), message));
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
