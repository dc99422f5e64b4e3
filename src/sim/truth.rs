//! What is true of a frame.

use serde::Serialize;

use super::effect::EffectName;
use super::plan::Plan;

/// A dot in a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DotTruth {
    /// Its number.
    pub id: u32,
    /// Image of its centre in the reference channel (green), px; null where it is not seen.
    pub image_px: Option<[f64; 2]>,
    /// Centroid of what is seen of it in the reference channel, px.
    pub centroid_px: Option<[f64; 2]>,
    /// Centroids in red, green and blue, where the colours have rays of their own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centroid_rgb_px: Option<[Option<[f64; 2]>; 3]>,
    /// Its centre on the deformed dome, sensor frame, mm.
    pub surface_mm: [f64; 3],
    /// Whether any of it is in the picture.
    pub visible: bool,
}

/// A white marker in a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MarkerTruth {
    /// Its number.
    pub id: u32,
    /// Image of its centre in the reference channel, px; null where it is not seen.
    pub image_px: Option<[f64; 2]>,
    /// Centroid of what is seen of it in the reference channel, px.
    pub centroid_px: Option<[f64; 2]>,
    /// Centroids in red, green and blue, where the colours have rays of their own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centroid_rgb_px: Option<[Option<[f64; 2]>; 3]>,
    /// Whether any of it is in the picture.
    pub visible: bool,
}

/// What the plan did with an effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectTruth {
    /// Its name.
    pub id: EffectName,
    /// Whether it takes part in the frame.
    pub used: bool,
    /// Why, or why not.
    pub why: String,
}

/// One line of `truth.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameTruth {
    /// Number of the frame, from 0.
    pub frame: u32,
    /// Its time, s.
    pub time_s: f64,
    /// `ok`, or the name of the limit that holds the platform.
    pub status: String,
    /// What the status means, where it is not `ok`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// `rest_from_platform`, row-major.
    pub pose: [[f64; 4]; 4],
    /// Fx, Fy, Fz, Mx, My, Mz that the world puts on dome and platform, rest frame, about the springs' reference
    /// point (fixed at rest), N and N*mm.
    pub wrench: [f64; 6],
    /// The dots.
    pub black_dots: Vec<DotTruth>,
    /// The white markers.
    pub white_markers: Vec<MarkerTruth>,
    /// The effects.
    pub effects: Vec<EffectTruth>,
}

impl FrameTruth {
    /// The line, without its end.
    pub fn to_line(&self) -> String {
        // numbers, strings and lists only: nothing here can fail to be written
        serde_json::to_string(self).unwrap_or_default()
    }
}

/// The effects of a plan, as the truth tells them.
pub fn effects_of(plan: &Plan) -> Vec<EffectTruth> {
    let told = |entry: &super::plan::Entry| EffectTruth {
        id: entry.effect,
        used: entry.used,
        why: entry.why.clone(),
    };
    plan.entries.iter().map(told).collect()
}
