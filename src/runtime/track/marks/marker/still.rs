//! A marker in a single frame, for calibrations: the same fit as in a sequence.

use glam::DVec2;

use super::fit::FIT_REACH_PX;
use super::shading::usable_slope;
use super::view::MarkerView;
use crate::track::frame::{CameraFrame, Plane};
use crate::track::options::Channel;
use domecast_optics::SensorOptics;
use domecast_optics::pose::Marker;

/// Fits after the first, each with the fall-off of light that the one before shows.
const ROUNDS: usize = 2;

/// The centroid of the disc near `start` (px) in a grey frame, with optics at the frame's pose; `None` where what is there
/// is no disc.
pub(crate) fn marker_in_still(
    optics: &SensorOptics,
    marker: &Marker,
    frame: &CameraFrame<'_>,
    start: DVec2,
) -> Option<DVec2> {
    let plane = Plane::new(frame, Channel::Green);
    let view = MarkerView::new(optics, marker)?;
    let mut disc = view.fit_closely(&plane, start, FIT_REACH_PX, None, DVec2::ZERO)?;
    let mut shading = DVec2::ZERO;
    for _ in 0..ROUNDS {
        shading = usable_slope(disc.shading).unwrap_or(shading);
        disc = view
            .fit_closely(&plane, disc.centroid_px, FIT_REACH_PX, Some(disc.levels), shading)
            .unwrap_or(disc);
    }
    Some(disc.centroid_px)
}
