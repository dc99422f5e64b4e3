//! Where the pose puts each dot on the undeformed dome.

use glam::DVec2;

use super::dot_track::DotTrack;
use crate::track::frame::Mask;
use crate::track::marks::MarkState;
use crate::track::model::DotModel;
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;

/// Offsets of centroids from centres change with the pose, by a few hundredths of a pixel a millimetre. After a move of
/// the first length (mm; a turn counts at ten millimetres) each frame computes some of them anew, the oldest first;
/// after one of the second, all at once.
const RENEW_SOME_MM: f64 = 0.02;
const RENEW_ALL_MM: f64 = 0.6;
/// A frame computes offsets anew for one dot in so many.
const RENEWED_PART: usize = 8;

/// The poses that the dots' offsets are for.
#[derive(Debug, Clone, Default)]
pub(super) struct DotPrediction {
    /// The oldest pose that an offset may be for, and the one that the newest are for.
    oldest: Option<Rigid>,
    newest: Option<Rigid>,
    /// The dot whose turn is next.
    next: usize,
}

impl DotPrediction {
    /// Fills what the pose says of each dot: where it is expected, its outline, whether it should be seen. The optics
    /// stand at the pose.
    pub fn predict(
        &mut self,
        pose: &Rigid,
        optics: &SensorOptics,
        mask: &Mask,
        models: &[DotModel],
        tracks: &mut [DotTrack],
    ) {
        let farther =
            |from: &Option<Rigid>, mm: f64| from.as_ref().is_none_or(|from| distance_mm(from, pose) > mm);
        let is_all_old = farther(&self.oldest, RENEW_ALL_MM);
        let is_some_old = farther(&self.newest, RENEW_SOME_MM);
        let count = tracks.len();
        // A round over all dots that began after the last move ends it.
        let renewed = if is_all_old {
            0..count
        } else if is_some_old || self.next > 0 {
            self.next..(self.next + count.div_ceil(RENEWED_PART)).min(count)
        } else {
            0..0
        };
        for (index, (track, model)) in tracks.iter_mut().zip(models).enumerate() {
            track.expected_px = None;
            track.state = MarkState::Hidden;
            let Ok(center) = optics.project(model.surface_mm) else { continue };
            // A dot that could not be seen whole when its turn was has no outline yet.
            if renewed.contains(&index) || track.outline.area_px == 0.0 {
                let Some((offset, outline)) = model.image_at(optics, center) else { continue };
                (track.offset_px, track.outline) = (offset, outline);
            }
            let at = center + track.offset_px;
            track.expected_px = Some(at);
            if mask.holds(at + track.displaced_px.unwrap_or(DVec2::ZERO)) {
                track.state = MarkState::Missing;
            }
        }
        if is_all_old {
            (self.oldest, self.newest, self.next) = (Some(*pose), Some(*pose), 0);
        } else if !renewed.is_empty() {
            if renewed.start == 0 {
                // What the last round left is as old as its beginning.
                self.oldest = self.newest.replace(*pose);
            }
            self.next = if renewed.end == count { 0 } else { renewed.end };
        }
    }
}

/// How far a pose is from another, mm; a turn counts at ten millimetres.
fn distance_mm(from: &Rigid, to: &Rigid) -> f64 {
    let between = from.inverse().compose(to);
    let turn = between.rotation - glam::DMat3::IDENTITY;
    let turned = turn.to_cols_array().iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    between.translation_mm.length().max(10.0 * turned)
}
