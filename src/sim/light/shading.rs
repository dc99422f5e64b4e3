//! The seam between geometry and light: the brightness of points of the membrane.

use glam::{DVec3, Vec3A, Vec4};

use crate::scene::Scene;
use crate::work::Work;

/// A point of the membrane that the camera sees. Sensor frame, mm: the lights ride with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceSample {
    /// Where the point is.
    pub point_mm: Vec3A,
    /// Where the point lies on the undeformed dome.
    pub material_mm: Vec3A,
    /// Unit normal out of the elastomer there, of the deformed surface.
    pub normal: Vec3A,
    /// Unit direction inside the elastomer from the point towards the camera.
    pub to_camera: Vec3A,
    /// Whether an object has moved it; else it lies on the undeformed dome.
    pub is_moved: bool,
}

/// Brightness of the membrane without ink, as linear values of the picture (1 is full scale), red, green, blue.
pub trait Shading: Send + Sync {
    /// The brightness of a point; the fourth number means nothing.
    fn level(&self, sample: &SurfaceSample) -> Vec4;

    /// Counts the work of so many points at rest and moved ones.
    fn count(&self, still: u64, moved: u64, work: &mut Work);

    /// Brightness of a white marker at a place of the sheet's top.
    fn marker_level(&self, scene: &Scene, _position_mm: DVec3) -> [f32; 3] {
        [scene.file().light.marker_level as f32; 3]
    }
}
