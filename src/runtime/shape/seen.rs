//! What the cells of a frame show, beside the light that the constants expect there: what the light is calibrated with.

use glam::{DVec3, Vec3A};

use super::cells::View;
use super::estimator::ShapeFromColor;
use domecast_optics::ColorChannel;
use domecast_optics::numeric::Rigid;

/// A cell that sees the bare membrane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SeenCell {
    /// Its place among the cells.
    pub column: usize,
    pub row: usize,
    /// The undeformed dome there, sensor frame, mm, and its outward normal.
    pub point_mm: DVec3,
    pub normal: DVec3,
    /// Unit direction of its ray in the silicone, away from the camera.
    pub ray: DVec3,
    /// Linear light of the three channels, full scale 1, and whether none of them is cut off.
    pub level: DVec3,
    pub is_known: bool,
    /// What each channel's own ray meets.
    pub channels: [ChannelRay; 3],
    /// Share of the irradiance there that goes the camera's way.
    pub passed: DVec3,
    /// Cosine of the field angle.
    pub cosine: f64,
    /// Irradiance of the undeformed dome by the constants' light.
    pub still: DVec3,
    /// The level without stray light that the same place of the untouched dome had in the frame at rest; 0 before a frame was
    /// measured.
    pub at_rest: DVec3,
}

/// The undeformed dome as one channel of a cell sees it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ChannelRay {
    /// Sensor frame, mm.
    pub point_mm: DVec3,
    /// Unit direction in the silicone, away from the camera.
    pub ray: DVec3,
    /// The point as [`ShapeLight::still`](super::ShapeLight::still) takes it.
    pub place: Vec3A,
}

impl ShapeFromColor {
    /// Deviation of a pixel's light by noise in the frame that was taken in last, full scale 1.
    pub(crate) fn pixel_noise(&self) -> DVec3 {
        self.noise.as_dvec3()
    }

    /// The cells of the frame that was taken in last. With dispersion a cell's channels see places some hundredths of a mm apart, so
    /// each channel's ray is followed.
    pub(crate) fn seen_cells(&self) -> Vec<SeenCell> {
        let view = &self.view;
        let pose = view.pose.unwrap_or_else(Rigid::identity);
        let views: [View; 3] = ColorChannel::ALL.map(|channel| {
            let mut own = View::default();
            self.cells.look(&self.optics.for_channel(channel), &pose, &mut own);
            own
        });
        let of = |channel: usize| &views[channel];
        let is_seen = |cell: usize| (0..3).all(|c| of(c).is_dome.get(cell).copied().unwrap_or(false));
        let is_bare = |cell: &usize| view.is_dome[*cell] && !self.covered[*cell] && is_seen(*cell);
        // The lights count as they were at rest: whether they still are is asked of these cells.
        let mut gain = Vec::new();
        if let Some(rest) = self.rest.as_ref().filter(|_| !self.gain.is_empty()) {
            let shifts = &mut self.shifts.clone();
            rest.at_pose(&self.cells, view, &self.rest_seen, shifts, self.is_rigid, &mut gain);
        }
        let bare = (0..self.cells.count().min(view.is_dome.len())).filter(is_bare);
        bare.map(|cell| {
            let by_own = |f: &dyn Fn(usize) -> f32| DVec3::from_array([0, 1, 2].map(|c| f64::from(f(c))));
            let passed = by_own(&|c| self.light.passed(of(c).ray[cell].z)[c]);
            let still = by_own(&|c| self.light.still(of(c).place[cell])[c]);
            let gain = gain.get(cell).map_or(DVec3::ZERO, |gain| gain.as_dvec3());
            let own = self.light.passed(view.ray[cell].z) * self.light.still(view.place[cell]);
            let level = &self.levels[cell];
            SeenCell {
                column: cell % self.cells.width,
                row: cell / self.cells.width,
                point_mm: view.surface_mm[cell].as_dvec3(),
                normal: view.normal[cell].as_dvec3(),
                ray: view.ray[cell].as_dvec3(),
                level: level.light.as_dvec3(),
                is_known: level.is_known.min_element() > 0.0,
                channels: [0, 1, 2].map(|c| ChannelRay {
                    point_mm: of(c).surface_mm[cell].as_dvec3(),
                    ray: of(c).ray[cell].as_dvec3(),
                    place: of(c).place[cell],
                }),
                passed,
                cosine: f64::from(self.cells.cosine(cell)),
                still,
                at_rest: gain * own.as_dvec3(),
            }
        })
        .collect()
    }
}
