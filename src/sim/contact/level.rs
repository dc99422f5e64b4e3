//! The level of contact that a scene asks for, and how fine its displacements are kept.

use crate::scene::Scene;
use crate::scene::file::LevelName;
use domecast_contact::Level;
use glam::DVec3;

/// A level with the scene's element length.
pub fn level_named(scene: &Scene, name: LevelName) -> Level {
    let section = &scene.file().contact;
    let element_mm = section.element_mm;
    match name {
        LevelName::Geometric => Level::Geometric,
        LevelName::ClosedForm => Level::ClosedForm,
        LevelName::Linear => Level::Linear { element_mm },
        LevelName::FiniteStrain => Level::FiniteStrain { across: section.elements_across as usize },
    }
}

/// The level that the scene takes for exact.
pub fn level_of(scene: &Scene) -> Level {
    level_named(scene, scene.file().contact.level)
}

/// Images of points nearer to the camera than at rest move faster, by less than this.
const NEARER: f64 = 1.6;

/// A bound on how far a dot moves in the image for a millimetre of the dome's surface, px.
pub(crate) fn largest_px_per_mm(scene: &Scene) -> f64 {
    largest_px_per_mm_at(scene, scene.dots().iter().map(|dot| dot.center_mm))
}

/// The same of points that lie at these places at rest, mm.
pub(crate) fn largest_px_per_mm_at(scene: &Scene, at_mm: impl Iterator<Item = DVec3>) -> f64 {
    let seen = at_mm.filter_map(|at| scene.optics().project_with_jacobian(at).ok());
    NEARER * seen.map(|(_, by_point)| by_point.norm()).fold(0.0, f64::max)
}

/// Distance of the displacement map's nodes, mm: about a pixel and a half where edges leave creases. Between the nodes of finite elements the table's cubics
/// are smoother than the elements themselves, whose slopes jump from one to the next.
pub(crate) fn map_step_mm(level: Option<Level>) -> f64 {
    match level {
        Some(Level::Linear { element_mm }) => (0.5 * element_mm).max(0.15),
        Some(Level::ClosedForm) => 0.25,
        _ => 0.15,
    }
}
