//! Other scenes of a sensor that is there, and a sensor as it came out.

use glam::DVec3;

use super::file::SceneFile;
use super::model::Scene;
use super::resolve::{Sensor, happening};
use crate::SimError;
use domecast_design::{Design, suspension_of};

impl Scene {
    /// Another scene of the same sensor, with its dots and markers as they are; relative paths start at the same folder.
    ///
    /// # Errors
    /// As [`Scene::new`]; the design that the file names is not read.
    pub fn with_file(&self, file: SceneFile) -> Result<Self, SimError> {
        let mut dots = self.dots.clone();
        dots.iter_mut().for_each(|dot| dot.cut = None);
        let sensor = Sensor {
            design: self.design.clone(),
            layout: self.layout.clone(),
            suspension: self.suspension.clone(),
            dots,
            markers: self.markers.clone(),
        };
        happening(file, &self.folder, sensor)
    }

    /// The same scene of the sensor as it came out: `built` is its design with other numbers, while the dots stay those
    /// that were laid out for the design as it was meant. `printed` says where a point of a dot's outline (by the dot's place
    /// in the layout's order; on the sphere of the dome as meant, mm) came to lie; it is put on the built dome's sphere.
    ///
    /// # Errors
    /// As [`Scene::new`].
    pub fn as_built(&self, built: Design, printed: &dyn Fn(usize, DVec3) -> DVec3) -> Result<Self, SimError> {
        let dome = *built.optics().dome();
        let placed = |index: usize, at_mm: DVec3| {
            let from_center = (printed(index, at_mm) - self.optics().dome().center_mm()).normalize_or_zero();
            dome.center_mm() + from_center * dome.radius_mm()
        };
        let mut dots = self.dots.clone();
        for (index, dot) in dots.iter_mut().enumerate() {
            dot.cut = None;
            dot.center_mm = placed(index, dot.center_mm);
            dot.rim_mm = dot.rim_mm.map(|at_mm| placed(index, at_mm));
        }
        let mut markers = self.markers.clone();
        for (marker, at_mm) in markers.iter_mut().zip(built.white_markers_mm()) {
            marker.position_mm = at_mm;
        }
        let suspension = if built.is_rigid() { None } else { Some(suspension_of(&built)?) };
        let sensor = Sensor { design: built, layout: self.layout.clone(), suspension, dots, markers };
        happening(self.file.clone(), &self.folder, sensor)
    }
}
