//! Dark blobs of a dot's size that are no dot of the constants.

use glam::DVec2;

use super::dot_track::DotTrack;
use crate::track::marks::DarkBlob;
use crate::track::model::DotModel;

/// False dots that a result holds.
pub const MAX_FALSE_DOTS: usize = 64;
/// A blob nearer to a found dot than this part of its spacing is that dot.
const OWN_REACH: f64 = 0.4;
/// A blob farther from every expected dot than this many spacings is not on the pattern.
const PATTERN_REACH: f64 = 2.5;
/// A false dot's area over that of the nearest dot.
const AREA_RATIO: std::ops::Range<f64> = 0.3..4.0;

/// Appends the blobs of a dot's size on which no dot stands, up to [`MAX_FALSE_DOTS`].
pub(super) fn find_false_dots(
    blobs: &[DarkBlob],
    models: &[DotModel],
    tracks: &[DotTrack],
    out: &mut Vec<DVec2>,
) {
    for blob in blobs {
        let mut own = false;
        let mut nearest = (f64::INFINITY, 0);
        for (index, (track, model)) in tracks.iter().zip(models).enumerate() {
            let square_px2 = |at: DVec2| at.distance_squared(blob.at_px);
            let own_px = OWN_REACH * model.spacing_px;
            own |= track.now_px().is_some_and(|at| square_px2(at) < own_px * own_px);
            let from = track.expected_px.map_or(f64::INFINITY, square_px2);
            if from < nearest.0 {
                nearest = (from, index);
            }
        }
        let Some(model) = models.get(nearest.1).filter(|_| nearest.0.is_finite()) else { continue };
        let ratio = blob.area_px / model.outline.area_px;
        let near = nearest.0.sqrt() < PATTERN_REACH * model.spacing_px;
        if !own && near && AREA_RATIO.contains(&ratio) && out.len() < MAX_FALSE_DOTS {
            out.push(blob.at_px);
        }
    }
}
