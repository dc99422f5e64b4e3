//! The page's numbers for its scripts and for programs.

use serde_json::{Value, json};

use super::curves::{PLOT, ends};
use super::quantities::QUANTITIES;
use super::record::TrackReport;
use super::skin::{AROUND, HEIGHT_UNIT_MM, RINGS, UNSEEN};
use super::still::{FADE, REST_COLOR};
use domecast_runtime::overlay::VIRIDIS;

/// To the places of the JSON lines.
fn rounded(value: f64) -> f64 {
    let rounded = (value * 1e6).round() / 1e6;
    // no minus before a zero
    if rounded == 0.0 { 0.0 } else { rounded }
}

/// Frames, statuses and readings that the curves are drawn from; the skin's grid. Numbers and fixed names only.
pub(super) fn data(report: &TrackReport) -> Value {
    let kept = report.frames.kept();
    let mut data = json!({
        "version": 1,
        "frames_in_all": report.frames.seen(),
        "every": report.frames.stride(),
        "frames": kept.iter().map(|f| f.frame).collect::<Vec<_>>(),
        "status": kept.iter().map(|f| f.status).collect::<Vec<_>>(),
    });
    if kept.iter().any(|f| f.time_s.is_some()) {
        data["time_s"] = kept.iter().map(|f| f.time_s.map(rounded)).collect();
    }
    for (index, quantity) in QUANTITIES.iter().enumerate() {
        let numbers = |of: glam::DVec3| match quantity.components.len() {
            1 => json!(rounded(of.x)),
            _ => json!(of.to_array().map(rounded)),
        };
        let reading = || kept.iter().map(|f| f.readings[index]);
        data[quantity.key] = reading().map(|reading| reading.map(|r| numbers(r.value))).collect();
        if let Some(key) = quantity.sd_key {
            data[key] = reading().map(|reading| reading.and_then(|r| r.sd).map(numbers)).collect();
        }
    }
    let [low, high] = ends(report);
    data["plot"] = json!({ "corners_px": PLOT, "first": low, "last": high });
    let skins = report.skins.frames.kept();
    if !skins.is_empty() {
        let places = &report.skins.places;
        // Each ring's first place is in the plane y = 0.
        let ring = |ring: usize| {
            let (at, normal) = places[if ring == 0 { 0 } else { 1 + (ring - 1) * AROUND }];
            [at.x, at.z, normal.x, normal.z].map(rounded)
        };
        data["skin"] = json!({
            "frames_in_all": report.skins.frames.seen(),
            "every": report.skins.frames.stride(),
            "frames": skins.iter().map(|f| f.frame).collect::<Vec<_>>(),
            "depth_mm": skins.iter().map(|f| rounded(f.depth_mm)).collect::<Vec<_>>(),
            "around": AROUND,
            "rings": (0..=RINGS).map(ring).collect::<Vec<_>>(),
            "unit_mm": HEIGHT_UNIT_MM,
            "unseen": UNSEEN,
            "range_mm": report.skins.range_mm(),
            "colors": VIRIDIS,
            "rest_color": REST_COLOR,
            "fade": FADE,
        });
    }
    data
}

/// The skins for the page's script: each frame's heights (16-bit, the low byte first), then each frame's touched places (a byte each).
pub(super) fn skin_bytes(report: &TrackReport) -> Vec<u8> {
    let skins = report.skins.frames.kept();
    let heights = skins.iter().flat_map(|skin| skin.heights.iter().flat_map(|height| height.to_le_bytes()));
    let touched = skins.iter().flat_map(|skin| skin.is_touched.iter().map(|is| u8::from(*is)));
    heights.chain(touched).collect()
}
