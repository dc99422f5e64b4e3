//! The seam between geometry and light: the brightness of points of the membrane.

use glam::DVec3;

use super::scene::Scene;
use super::work::Work;

/// A point of the membrane that the camera sees. Sensor frame, mm: the lights ride with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceSample {
    /// Where the point is on the undeformed dome.
    pub rest_mm: DVec3,
    /// Where it is now.
    pub point_mm: DVec3,
    /// Unit normal out of the elastomer there, of the deformed surface.
    pub normal: DVec3,
    /// Unit direction inside the elastomer from the point towards the camera.
    pub to_camera: DVec3,
    /// Whether an object has moved it: where not, `point_mm` is `rest_mm` and a table may answer.
    pub deformed: bool,
}

/// Brightness of the membrane without ink, as linear values of the picture (1 is full scale), red, green, blue.
pub trait Shading: Send + Sync {
    /// The brightness of each sample, written to the place of the same number; the slices have one length.
    fn levels(&self, samples: &[SurfaceSample], levels: &mut [[f32; 3]], work: &mut Work);

    /// Brightness of a white marker at a place of the sheet's top.
    fn marker_level(&self, scene: &Scene, _position_mm: DVec3) -> [f32; 3] {
        [scene.file().light.marker_level as f32; 3]
    }

    /// Largest rise of brightness along the undeformed membrane, full scales per mm: what a shift of the picture
    /// can do to a pixel. May be too large.
    fn steepest_per_mm(&self) -> f64;
}
