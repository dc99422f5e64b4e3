//! Pose and wrench from centroids of the white markers, for who finds those by other means.

use glam::{DVec2, DVec3};

use super::error::TrackError;
use super::pose::{MarkerSighting, PoseEstimate, refine};
use super::wrench::{WrenchErrors, WrenchEstimator};
use crate::constants::Constants;
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;
use domecast_optics::pose::Marker;
use domecast_springs::{Displacement, Wrench};

/// A white marker in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarkerCentroid {
    /// Its number in the constants.
    pub id: u32,
    /// Centroid of what is seen, raw px.
    pub centroid_px: DVec2,
    /// Its standard deviation on each axis, px.
    pub sd_px: f64,
}

/// What the markers of a frame say. The fields mean what those of [`Tracked`](super::Tracked) do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredWrench {
    /// `rest_from_platform`.
    pub pose: Rigid,
    /// Root mean square of the markers' residuals on each axis, px.
    pub pose_rms_px: f64,
    /// Standard deviations of the displacement, mm and rad.
    pub pose_sd: Option<Displacement>,
    /// What the world puts on dome and platform, N and N*mm.
    pub wrench: Option<Wrench>,
    /// Its standard deviations.
    pub wrench_sd: Option<Wrench>,
    /// The share of them that changes from frame to frame.
    pub wrench_sd_random: Option<Wrench>,
    /// Whether the pose is one that the springs cannot have.
    pub is_beyond_springs: bool,
}

/// The stages `pose` and `wrench` of the tracker by themselves: each frame for itself, nothing is remembered.
#[derive(Debug, Clone)]
pub struct WrenchMeter {
    optics: SensorOptics,
    markers: Vec<Marker>,
    seen: Vec<MarkerSighting>,
    wrench: WrenchEstimator,
}

impl WrenchMeter {
    /// For the sensor of the constants.
    ///
    /// # Errors
    /// [`TrackError`] names the first field of the constants that cannot be used.
    pub fn new(constants: &Constants) -> Result<Self, TrackError> {
        let optics = constants.sensor().map_err(|problem| TrackError::at("camera, optics:", problem))?;
        let wrench = WrenchEstimator::new(constants, &optics, None)?;
        Ok(Self { optics, markers: constants.markers(), seen: Vec::new(), wrench })
    }

    /// The point that displacements and moments are stated about, rest frame, mm.
    pub fn at_mm(&self) -> DVec3 {
        self.wrench.springs().map_or(DVec3::ZERO, super::Springs::at_mm)
    }

    /// Pose and wrench of a frame, from a start nearby (the last frame's pose, or rest). Numbers that the constants do not
    /// have are passed over; `None` where fewer than three markers are left, or no pose within reach of the start fits.
    pub fn measure(&mut self, centroids: &[MarkerCentroid], start: &Rigid) -> Option<MeasuredWrench> {
        self.seen.clear();
        for one in centroids.iter().filter(|c| c.centroid_px.is_finite() && c.sd_px.is_finite()) {
            if let Some(marker) = self.markers.iter().find(|marker| marker.id == one.id) {
                self.seen.push(MarkerSighting::new(*marker, one.centroid_px, [one.sd_px; 2]));
            }
        }
        let refined = refine(&mut self.optics, &self.seen, start)?;
        let pose = PoseEstimate::of_markers(&refined, &self.seen);
        let found = self.wrench.at_pose(&pose, &self.optics)?;
        let errors = self.wrench.errors();
        Some(MeasuredWrench {
            pose: refined.pose,
            pose_rms_px: refined.rms_px,
            pose_sd: found.displacement_sd,
            wrench: found.wrench,
            wrench_sd: errors.and_then(WrenchErrors::sd),
            wrench_sd_random: errors.and_then(WrenchErrors::sd_random),
            is_beyond_springs: found.is_beyond_springs,
        })
    }
}
