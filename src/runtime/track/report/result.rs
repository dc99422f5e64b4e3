//! The result of one frame.

use glam::{DVec2, DVec3};

use super::problem::Problems;
use crate::track::identities::CameraTurn;
use crate::track::marks::MarkState;
use domecast_optics::numeric::Rigid;
use domecast_springs::{Displacement, Wrench};

/// A black dot in a frame. Numbers are there only where it is seen.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DotResult {
    /// Its number in the constants.
    pub id: u32,
    /// What is known of it.
    pub state: MarkState,
    /// Image of its centre, raw px: the centroid less what a disc on the dome, seen through lens and layers, has its
    /// centroid off.
    pub image_px: Option<DVec2>,
    /// Centroid of what is seen, raw px.
    pub centroid_px: Option<DVec2>,
    /// Standard deviation of the centroid on each axis that the frame's noise means, px.
    pub sd_px: Option<f64>,
    /// Where the undeformed dome would show its centre at this pose, raw px; there for every dot that can be seen.
    pub undeformed_px: Option<DVec2>,
    /// Motion of the centroid since the last frame, px.
    pub motion_px: Option<DVec2>,
    /// Its ray met with the undeformed dome, the platform's motion removed, less its rest position; mm.
    pub displacement_mm: Option<DVec3>,
}

/// A white marker in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MarkerResult {
    /// Its number in the constants.
    pub id: u32,
    /// What is known of it.
    pub state: MarkState,
    /// Image of its centre, raw px, as [`DotResult::image_px`].
    pub image_px: Option<DVec2>,
    /// Centroid of what is seen, raw px.
    pub centroid_px: Option<DVec2>,
    /// Standard deviation of the centroid on each axis that the frame's noise means, px.
    pub sd_px: Option<f64>,
    /// Centroid less where the pose puts it, px.
    pub residual_px: Option<DVec2>,
}

/// The result of one frame; the lists keep the order of the constants.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tracked {
    /// Number of the frame.
    pub frame: u64,
    /// What is wrong with it.
    pub problems: Problems,
    /// How the picture lies against the constants' camera, where it is turned or mirrored: all numbers are withheld then.
    pub camera_turn: Option<CameraTurn>,
    /// `rest_from_platform`; nothing is measured of it on a rigid mount, and then there is none, nor a wrench.
    pub pose: Option<Rigid>,
    /// Standard deviations of the displacement (mm, rad) about the springs' reference point, or the origin.
    pub pose_sd: Option<Displacement>,
    /// Root mean square of the white markers' residuals, px.
    pub pose_rms_px: Option<f64>,
    /// What the world puts on dome and platform, rest frame, about the springs' reference point.
    pub wrench: Option<Wrench>,
    /// Its standard deviations.
    pub wrench_sd: Option<Wrench>,
    /// The dots.
    pub black_dots: Vec<DotResult>,
    /// The white markers.
    pub white_markers: Vec<MarkerResult>,
    /// Whether the whole frame was searched.
    pub searched: bool,
    /// Dark blobs of a dot's size inside of the mask that are no dot of the constants; known where the whole frame was
    /// searched. At most [`MAX_FALSE_DOTS`](crate::track::MAX_FALSE_DOTS) are kept.
    pub false_dots: Vec<DVec2>,
}

impl Tracked {
    /// `ok`, or the name of the gravest problem.
    pub fn status(&self) -> &'static str {
        self.problems.status()
    }

    /// How many dots are in a state.
    pub fn count(&self, state: MarkState) -> usize {
        self.black_dots.iter().filter(|dot| dot.state == state).count()
    }
}
