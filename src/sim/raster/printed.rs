//! The dots as an uneven print leaves them.

use crate::light::random_field::{MAX_DEVIATIONS, RandomField};
use crate::scene::Scene;
use domecast_optics::numeric::SeededRandom;

/// Numbers of the streams of random numbers, beside others of the seed.
const REFLECTANCE_STREAM: u64 = 0x696e_6b01;
const DIAMETER_STREAM: u64 = 0x696e_6b02;

/// What differs from dot to dot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PrintedDot {
    /// Its diameter, of the one that was asked for.
    pub scale: f64,
    /// Reflectance of its ink, of the membrane's light.
    pub reflectance: f64,
}

/// The dots of a scene, each with its own diameter and ink: what the scene's seed makes of its unevenness.
pub(crate) fn printed_dots(scene: &Scene) -> Vec<PrintedDot> {
    let ink = &scene.file().ink;
    let even = PrintedDot { scale: 1.0, reflectance: ink.reflectance };
    let Some(uneven) = &ink.uneven else { return vec![even; scene.dots().len()] };
    let seed = scene.file().seed;
    let field = RandomField::new(seed, REFLECTANCE_STREAM, uneven.correlation_mm);
    let mut random = SeededRandom::stream(seed, DIAMETER_STREAM);
    let dots = scene.dots().iter().map(|dot| PrintedDot {
        scale: 1.0 + uneven.diameter * random.normal().clamp(-MAX_DEVIATIONS, MAX_DEVIATIONS),
        reflectance: (ink.reflectance + uneven.reflectance * field.at(dot.center_mm)).clamp(0.0, 1.0),
    });
    dots.collect()
}
