//! The seam between geometry and light: the brightness of points of the membrane.

use glam::{DVec3, Vec3A, Vec4};

use super::scene::Scene;
use super::work::Work;

/// A point of the membrane that the camera sees. Sensor frame, mm: the lights ride with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceSample {
    /// Where the point is.
    pub point_mm: Vec3A,
    /// Unit normal out of the elastomer there, of the deformed surface.
    pub normal: Vec3A,
    /// Unit direction inside the elastomer from the point towards the camera.
    pub to_camera: Vec3A,
    /// What an object has done to it.
    pub moved: Moved,
}

/// A point of the membrane that an object has moved not at all, or so smoothly that the points about it tell the change of its
/// light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlainSample {
    /// Its unit direction from the dome's centre.
    pub direction: Vec3A,
    /// Along the sensor's axis, how much of the unit direction towards the camera inside the elastomer.
    pub cosine: f32,
    /// The change of its light ([`Shading::change`]).
    pub change: Vec3A,
}

/// What an object has done to a point of the membrane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Moved {
    /// Nothing: it lies on the undeformed dome, and a table may answer.
    Not,
    /// It has moved and turned it.
    Far,
    /// The same, but so smoothly that the points about it tell the change of its light ([`Shading::change`]): its normal
    /// is not used.
    Little(Vec3A),
}

/// Bounds on what an object has done to a part of the membrane.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Turned {
    /// How far its normals may be from the surface of the second order through those at nine nodes, rad.
    pub tilt_rad: f32,
    /// Slope of its displacement.
    pub slope: f32,
    /// Its displacement, mm.
    pub moved_mm: f32,
}

/// How much further the light of a displaced part of the membrane may be from a surface through nodes than that of the
/// undeformed one, full scales.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MovedBend {
    /// For what the tables of its light do.
    pub table: f32,
    /// For its sharp bends.
    pub tilt: f32,
}

impl Turned {
    /// What holds for either.
    pub fn or(self, other: Self) -> Self {
        Self {
            tilt_rad: self.tilt_rad.max(other.tilt_rad),
            slope: self.slope.max(other.slope),
            moved_mm: self.moved_mm.max(other.moved_mm),
        }
    }
}

/// Brightness of the membrane without ink, as linear values of the picture (1 is full scale), red, green, blue.
pub trait Shading: Send + Sync {
    /// The brightness of each sample, put after what is there; the fourth number means nothing.
    fn levels(&self, samples: &[SurfaceSample], levels: &mut Vec<Vec4>, work: &mut Work);

    /// The same where little or nothing has moved.
    fn plain_levels(&self, samples: &[PlainSample], levels: &mut Vec<Vec4>, work: &mut Work);

    /// What is added to the brightness of an undeformed point in the same direction from the dome's centre where the
    /// membrane lies at `point_mm` with this unit normal; before losses on the way to the camera.
    fn change(&self, point_mm: Vec3A, normal: Vec3A) -> Vec3A;

    /// How far the light of the undeformed membrane may be, full scales, from the surface of the second order through
    /// nine nodes in rows of three over a part of the dome that holds these directions from its centre.
    fn bend(&self, directions: &[Vec3A]) -> f32;

    /// How much further that of the displaced membrane may be.
    fn moved_bend(&self, directions: &[Vec3A], turned: Turned) -> MovedBend;

    /// Brightness of a white marker at a place of the sheet's top.
    fn marker_level(&self, scene: &Scene, _position_mm: DVec3) -> [f32; 3] {
        [scene.file().light.marker_level as f32; 3]
    }

    /// Largest rise of brightness along the undeformed membrane, full scales per mm: what a shift of the picture
    /// can do to a pixel. May be too large.
    fn steepest_per_mm(&self) -> f64;
}
