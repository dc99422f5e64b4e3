//! A smooth random field in space: what is uneven over a surface.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3A};

use domecast_optics::numeric::SeededRandom;

/// Waves that a field is the sum of.
const WAVES: usize = 48;

/// No place is farther from the mean, standard deviations.
pub const MAX_DEVIATIONS: f64 = 3.0;

/// Counted work of one place.
pub(crate) const PLACE_UNITS: u64 = 6 * WAVES as u64;

/// A Gaussian random field of mean 0 and standard deviation 1 whose correlation falls with the distance `d` as
/// `exp(-d^2 / (2 l^2))`: a sum of plane waves with random phases, whose wave vectors are normal with the
/// standard deviation `1 / l` along each axis (M. Shinozuka, C.-M. Jan, J. Sound Vib. 25, 1972). It ends at
/// [`MAX_DEVIATIONS`].
///
/// ```
/// use domecast_sim::light::random_field::RandomField;
/// use glam::DVec3;
///
/// let field = RandomField::new(7, 0, 2.0);
/// let (here, near) = (field.at(DVec3::ZERO), field.at(DVec3::X * 0.02));
/// assert!((here - near).abs() < 0.1 && here.abs() <= 3.0);
/// ```
#[derive(Debug, Clone)]
pub struct RandomField {
    /// Wave vector, 1/mm, and phase, rad.
    waves: Vec<(Vec3A, f32)>,
}

impl RandomField {
    /// The field of a seed and a stream of it, alike over `correlation_mm`.
    pub fn new(seed: u64, stream: u64, correlation_mm: f64) -> Self {
        let mut random = SeededRandom::stream(seed, stream);
        let wave = |_| {
            let (xy, z) = (random.normal_pair(), random.normal());
            (((xy.extend(z)) / correlation_mm).as_vec3a(), (TAU * random.uniform()) as f32)
        };
        Self { waves: (0..WAVES).map(wave).collect() }
    }

    /// The field at a place, mm; -3 to 3.
    pub fn at(&self, place_mm: DVec3) -> f64 {
        f64::from(self.at_single(place_mm.as_vec3a()))
    }

    /// The same in single precision.
    pub fn at_single(&self, place_mm: Vec3A) -> f32 {
        let sum: f32 = self.waves.iter().map(|(wave, phase)| (wave.dot(place_mm) + phase).cos()).sum();
        let value = sum * (2.0 / WAVES as f32).sqrt();
        value.clamp(-MAX_DEVIATIONS as f32, MAX_DEVIATIONS as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_deviation_and_correlation_are_those_that_are_stated() {
        let correlation_mm = 1.5;
        let (mut mean, mut square) = (0.0, 0.0);
        let mut products = [0.0; 3];
        let shifts = [0.5, 1.5, 3.0];
        let (fields, places) = (400, 10);
        for seed in 0..fields {
            let field = RandomField::new(seed, 3, correlation_mm);
            for k in 0..places {
                let place = DVec3::new(4.0 * f64::from(k), 9.0, -3.0);
                let value = field.at(place);
                mean += value;
                square += value * value;
                for (product, shift) in products.iter_mut().zip(shifts) {
                    // Along a direction of no axis.
                    *product += value * field.at(place + DVec3::new(0.6, 0.0, 0.8) * shift);
                }
            }
        }
        let count = fields as f64 * f64::from(places);
        assert!((mean / count).abs() < 0.06 && (square / count - 1.0).abs() < 0.06, "{mean} {square}");
        for (product, shift) in products.iter().zip(shifts) {
            let stated = (-0.5 * (shift / correlation_mm).powi(2)).exp();
            assert!((product / count - stated).abs() < 0.06, "{shift}: {} {stated}", product / count);
        }
    }
}
