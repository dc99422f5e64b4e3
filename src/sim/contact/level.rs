//! The level of contact that a scene asks for, and how fine its displacements are kept.

use crate::scene::Scene;
use crate::scene::file::LevelName;
use domecast_contact::Level;

/// A level with the scene's element length.
pub fn level_named(scene: &Scene, name: LevelName) -> Level {
    let element_mm = scene.file().contact.element_mm;
    match name {
        LevelName::Geometric => Level::Geometric,
        LevelName::ClosedForm => Level::ClosedForm,
        LevelName::Linear => Level::Linear { element_mm },
    }
}

/// The level that the scene takes for exact.
pub fn level_of(scene: &Scene) -> Level {
    level_named(scene, scene.file().contact.level)
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
