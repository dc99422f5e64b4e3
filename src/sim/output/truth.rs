//! What is true of a frame.

use glam::DVec2;
use serde::Serialize;

use crate::contact::record::ContactTruth;
use crate::effect_name::EffectName;
use crate::output::depth::DepthTruth;
use crate::plan::Plan;
use crate::raster::spots::{Spot, Spots};
use crate::scene::Scene;

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

/// The gains of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ExposureTruth {
    /// What the converter's full scale is below that of the scene's levels: levels are multiplied by it.
    pub gain: f64,
    /// What red, green and blue are multiplied by after it.
    pub white_balance: [f64; 3],
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
    /// How the contact was solved; null where none takes part in the frames (no object, or left out by the plan).
    pub contact: Option<ContactTruth>,
    /// The dots.
    pub black_dots: Vec<DotTruth>,
    /// The white markers.
    pub white_markers: Vec<MarkerTruth>,
    /// The gains that the camera has set; only where it sets them by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure: Option<ExposureTruth>,
    /// How the maps of what each pixel sees are to be read; only where they are written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth: Option<DepthTruth>,
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
    let means = |entry: &crate::plan::Entry| EffectTruth {
        id: entry.effect,
        used: entry.used,
        why: entry.why.clone(),
    };
    plan.entries.iter().map(means).collect()
}

/// What was seen for a frame.
pub(crate) struct Seen<'a> {
    /// At the frame's time.
    pub now: &'a Spots,
    /// In each part of the exposure; empty where all light is gathered at the frame's time.
    pub parts: &'a [Spots],
    /// The reference channel.
    pub reference: usize,
}

/// Mean centre, mean centroid and area of an item over the parts of the exposure.
struct Mean {
    center_px: DVec2,
    centroid_px: DVec2,
    area_px2: f64,
}

impl Seen<'_> {
    fn mean<'s>(
        &'s self,
        channel: usize,
        see: &dyn Fn(&'s Spots, usize) -> Option<&'s Spot>,
    ) -> Option<Mean> {
        let parts = if self.parts.is_empty() { std::slice::from_ref(self.now) } else { self.parts };
        let spots: Vec<&Spot> = parts.iter().filter_map(|spots| see(spots, channel)).collect();
        let first = spots.first()?;
        let count = spots.len() as f64;
        let area: f64 = spots.iter().map(|spot| spot.area_px2).sum();
        let weighted = spots.iter().map(|spot| spot.centroid_px * spot.area_px2).sum::<DVec2>();
        Some(Mean {
            center_px: spots.iter().map(|spot| spot.center_px).sum::<DVec2>() / count,
            centroid_px: if area > 0.0 { weighted / area } else { first.centroid_px },
            area_px2: area / count,
        })
    }
}

/// Centre, centroid, centroids by colour and whether it is seen.
type Means = (Option<[f64; 2]>, Option<[f64; 2]>, Option<[Option<[f64; 2]>; 3]>, bool);

fn means<'s>(seen: &'s Seen<'_>, see: &dyn Fn(&'s Spots, usize) -> Option<&'s Spot>) -> Means {
    let mean = seen.mean(seen.reference, see);
    let visible = mean.as_ref().is_some_and(|mean| mean.area_px2 > 0.0);
    let colours = (seen.now.channels() == 3).then(|| {
        std::array::from_fn(|channel| {
            seen.mean(channel, see).filter(|mean| mean.area_px2 > 0.0).map(|mean| mean.centroid_px.to_array())
        })
    });
    let centroid = mean.as_ref().filter(|_| visible).map(|mean| mean.centroid_px.to_array());
    (mean.map(|mean| mean.center_px.to_array()), centroid, colours, visible)
}

/// What is true of a dot.
pub(crate) fn dot_truth(scene: &Scene, index: usize, seen: &Seen<'_>) -> DotTruth {
    let (image_px, centroid_px, centroid_rgb_px, visible) =
        means(seen, &|spots, channel| spots.dot(index, channel));
    DotTruth {
        id: scene.dots().get(index).map_or(0, |dot| dot.id),
        image_px,
        centroid_px,
        centroid_rgb_px,
        surface_mm: seen.now.surface_mm.get(index).copied().unwrap_or_default().to_array(),
        visible,
    }
}

/// What is true of a white marker.
pub(crate) fn marker_truth(scene: &Scene, index: usize, seen: &Seen<'_>) -> MarkerTruth {
    let (image_px, centroid_px, centroid_rgb_px, visible) =
        means(seen, &|spots, channel| spots.marker(index, channel));
    let id = scene.markers().get(index).map_or(0, |marker| marker.id);
    MarkerTruth { id, image_px, centroid_px, centroid_rgb_px, visible }
}
