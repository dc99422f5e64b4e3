//! What the cells of a frame show, beside the light that the constants expect there: what the light is calibrated with.

use glam::DVec3;

use super::estimator::ShapeFromColor;

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
    /// Share of the irradiance that goes the camera's way, and the cosine of the field angle.
    pub passed: DVec3,
    pub cosine: f64,
    /// Irradiance of the undeformed dome by the constants' light.
    pub still: DVec3,
    /// The level without stray light that the same place of the untouched dome had in the frame at rest; 0 before a frame was
    /// measured.
    pub at_rest: DVec3,
}

impl ShapeFromColor {
    /// The cells of the frame that was taken in last.
    pub(crate) fn seen_cells(&self) -> Vec<SeenCell> {
        let view = &self.view;
        let is_bare = |cell: &usize| view.is_dome[*cell] && !self.covered[*cell];
        let bare = (0..self.cells.count().min(view.is_dome.len())).filter(is_bare);
        bare.map(|cell| {
            let passed = self.light.passed(view.ray[cell].z).as_dvec3();
            let still = self.light.still(view.place[cell]).as_dvec3();
            let gain = self.gain.get(cell).map_or(DVec3::ZERO, |gain| gain.as_dvec3());
            let level = &self.levels[cell];
            SeenCell {
                column: cell % self.cells.width,
                row: cell / self.cells.width,
                point_mm: view.surface_mm[cell].as_dvec3(),
                normal: view.normal[cell].as_dvec3(),
                ray: view.ray[cell].as_dvec3(),
                level: level.light.as_dvec3(),
                is_known: level.is_known.min_element() > 0.0,
                passed,
                cosine: f64::from(self.cells.cosine(cell)),
                still,
                at_rest: gain * passed * still,
            }
        })
        .collect()
    }
}
