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
    /// Standard deviation of the centroid on each axis that the frame's noise and the mark's looks mean, px.
    pub sd_px: Option<f64>,
    /// Where the undeformed dome would show its centre at this pose, raw px; there for every dot that can be seen.
    pub undeformed_px: Option<DVec2>,
    /// Where what was taken for it lies, whatever its state: the picture shows ink there, not skin; raw px.
    pub ink_px: Option<DVec2>,
    /// Motion of the centroid since the last frame, px.
    pub motion_px: Option<DVec2>,
    /// Its ray met with the undeformed dome, the platform's motion removed, less its rest position; mm. Where the skin is
    /// pressed in the dot is elsewhere on the same ray.
    pub displacement_mm: Option<DVec3>,
    /// Standard deviation of that across the ray which the frame's noise means, on each of two axes, mm.
    pub displacement_sd_random_mm: Option<f64>,
    /// Unit direction of that ray in the dome, platform's frame, away from the camera: along it nothing is known of the
    /// displacement.
    pub ray: Option<DVec3>,
    /// What the reference frames say of its place, where there are such and show it; `displacement_mm` is less that.
    pub reference: Option<DotReference>,
}

/// Where reference frames show a dot of the untouched skin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DotReference {
    /// Mean of its rays met with the undeformed dome, less its place in the constants, mm: print and camera are off by that.
    pub displacement_mm: DVec3,
    /// The frames that show it.
    pub frames: u32,
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
    /// Standard deviation of the centroid on each axis that the frame's noise and the mark's looks mean, px.
    pub sd_px: Option<f64>,
    /// Centroid less where the pose puts it, px.
    pub residual_px: Option<DVec2>,
}

/// The result of one frame; the lists keep the order of the constants.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tracked {
    /// Number of the frame.
    pub frame: u64,
    /// When it was taken, s, on the camera's clock; where the source of the frames says.
    pub time_s: Option<f64>,
    /// What is wrong with it.
    pub problems: Problems,
    /// How the picture lies against the constants' camera, where it is turned or mirrored: all numbers are withheld then.
    pub camera_turn: Option<CameraTurn>,
    /// `rest_from_platform`; nothing is measured of it on a rigid mount, and then there is none, nor a wrench.
    pub pose: Option<Rigid>,
    /// Standard deviations of the displacement (mm, rad) about the springs' reference point, or the origin: noise, and how
    /// far camera, layers and markers may be off the constants.
    pub pose_sd: Option<Displacement>,
    /// The share of them that changes from frame to frame.
    pub pose_sd_random: Option<Displacement>,
    /// Root mean square of the white markers' residuals, px.
    pub pose_rms_px: Option<f64>,
    /// What the world puts on dome and platform, rest frame, about the springs' reference point.
    pub wrench: Option<Wrench>,
    /// Its standard deviations: noise, and how far camera, layers, markers and springs may be off the constants.
    pub wrench_sd: Option<Wrench>,
    /// The share of them that changes from frame to frame; the rest stays, and no filter takes it out.
    pub wrench_sd_random: Option<Wrench>,
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

    /// Takes back what is said of the platform's motion and its load.
    pub(in crate::track) fn withhold_motion(&mut self) {
        (self.pose, self.pose_sd, self.pose_sd_random, self.pose_rms_px) = (None, None, None, None);
        (self.wrench, self.wrench_sd, self.wrench_sd_random) = (None, None, None);
    }

    /// How many dots are in a state.
    pub fn count(&self, state: MarkState) -> usize {
        self.black_dots.iter().filter(|dot| dot.state == state).count()
    }
}
