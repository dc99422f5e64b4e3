//! A normal from three colours: two slopes, and what is left as brightness.

use glam::{Vec2, Vec3A};

use super::fill::Weighted;
use super::light::PointLight;
use domecast_light::separation;

const BRIGHTNESS_SD: f32 = separation::BRIGHTNESS_SD as f32;

/// Tilt of a normal that was filled in from around, rad.
pub(super) const FILLED_SD_RAD: f32 = 0.09;

/// What a cell's light says.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reading {
    /// Outward normal, of unit length along the guess.
    pub normal: Vec3A,
    /// Covariance of the normal's tilt along the two tangents, rad^2: `xx, xy, yy`.
    pub covariance: [f32; 3],
    /// The same by noise alone.
    pub noise: [f32; 3],
    /// Sum of squares of what is left over, in standard deviations: one degree of freedom.
    pub misfit: f32,
}

/// What the colours of a cell say.
#[derive(Debug, Clone, Copy)]
pub(super) struct CellReading {
    /// Tilt of the normal away from the undeformed dome's, and its weight.
    pub tilt: Weighted,
    /// Variance of the tilt across and down, rad^2, as the cells around say it too.
    pub spread: [f32; 2],
    /// The same by noise alone and of the reading alone, as it counts over many cells.
    pub noise: [f32; 2],
    /// Whether the colours say a normal.
    pub is_read: bool,
}

impl Default for CellReading {
    fn default() -> Self {
        let filled = [FILLED_SD_RAD * FILLED_SD_RAD; 2];
        Self { tilt: Weighted::default(), spread: filled, noise: filled, is_read: false }
    }
}

impl CellReading {
    /// Whether the cell is filled in from around.
    #[inline]
    pub fn is_hole(&self) -> bool {
        !self.is_read && self.tilt.weight() < 1.0
    }
}

/// Two unit tangents at a normal; the first as near to `along` as may be.
#[inline]
pub(super) fn tangents(normal: Vec3A, along: Vec3A) -> [Vec3A; 2] {
    let first = (along - normal * along.dot(normal)).normalize_or(normal.any_orthonormal_vector());
    [first, normal.cross(first)]
}

/// The normal that explains the irradiance of three channels, one step from a guess: linear in the levels, so that noise has no
/// mean, and therefore not of unit length. `precision` is one over the variance of each channel's irradiance, 0 where the
/// channel says nothing; `noise` the variance that noise alone has; `along` the direction of the first tangent.
#[inline]
pub(super) fn read(
    light: &PointLight,
    irradiance: Vec3A,
    precision: Vec3A,
    noise: Vec3A,
    guess: Vec3A,
    along: Vec3A,
) -> Option<Reading> {
    let [t1, t2] = tangents(guess, along);
    let [j1, j2, whole] = [light.along(t1), light.along(t2), light.along(guess)];
    let left = irradiance - light.base - whole;
    let weigh = |a: Vec3A, b: Vec3A| (a * b).dot(precision);
    let (a11, a12, a22) = (weigh(j1, j1), weigh(j1, j2), weigh(j2, j2));
    // The brightness, with what is known of it, put into the slopes' equations (Schur's complement).
    let (k1, k2, kk) = (weigh(j1, whole), weigh(j2, whole), weigh(whole, whole));
    let bright = 1.0 / (kk + 1.0 / (BRIGHTNESS_SD * BRIGHTNESS_SD));
    let (b1, b2, bk) = (weigh(j1, left), weigh(j2, left), weigh(whole, left));
    let (m11, m12, m22) = (a11 - k1 * k1 * bright, a12 - k1 * k2 * bright, a22 - k2 * k2 * bright);
    let (r1, r2) = (b1 - k1 * bk * bright, b2 - k2 * bk * bright);
    let determinant = m11 * m22 - m12 * m12;
    let is_regular = determinant > 1e-12 * (m11 + m22) * (m11 + m22);
    if !is_regular {
        return None;
    }
    let inverse = 1.0 / determinant;
    let step = Vec2::new(m22 * r1 - m12 * r2, m11 * r2 - m12 * r1) * inverse;
    let brightness = (bk - k1 * step.x - k2 * step.y) * bright;
    let rest = left - j1 * step.x - j2 * step.y - whole * brightness;
    let misfit = weigh(rest, rest) + (brightness / BRIGHTNESS_SD).powi(2);
    let normal = guess + t1 * step.x + t2 * step.y;
    // What each channel moves the slopes by.
    let by = |k: f32, j: Vec3A| (j - whole * (k * bright)) * precision;
    let (g1, g2) = (by(k1, j1), by(k2, j2));
    let (s1, s2) = ((g1 * m22 - g2 * m12) * inverse, (g2 * m11 - g1 * m12) * inverse);
    let is_finite = normal.is_finite() && misfit.is_finite();
    is_finite.then_some(Reading {
        normal,
        covariance: [m22 * inverse, -m12 * inverse, m11 * inverse],
        noise: [(s1 * s1).dot(noise), (s1 * s2).dot(noise), (s2 * s2).dot(noise)],
        misfit,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_steps_find_the_normal_whatever_the_brightness() {
        let light = PointLight {
            base: Vec3A::new(0.3, 0.2, 0.25),
            vectors: [Vec3A::new(0.5, -0.3, -0.2), Vec3A::new(0.0, 0.4, -0.45), Vec3A::new(0.8, 0.9, 0.7)],
            direct: Vec3A::ONE,
        };
        let normal = Vec3A::new(0.25, -0.1, 1.0).normalize();
        let precision = Vec3A::splat(1e4);
        for brightness in [1.0, 1.01] {
            let irradiance = light.base + light.along(normal) * brightness;
            let mut guess = Vec3A::Z;
            let mut misfit = 0.0;
            for _ in 0..3 {
                let reading = read(&light, irradiance, precision, 1.0 / precision, guess, Vec3A::X)
                    .expect("three colours");
                (guess, misfit) = (reading.normal.normalize(), reading.misfit);
            }
            let off = guess.cross(normal).length();
            assert!(off < 3e-3 && misfit < 1.0, "{brightness}: {off} {misfit}");
        }
        // A channel without a say leaves two; no channel leaves nothing.
        let irradiance = light.base + light.along(normal);
        let two =
            read(&light, irradiance, precision * Vec3A::new(1.0, 1.0, 0.0), Vec3A::ONE, normal, Vec3A::X);
        assert!(two.is_some_and(|two| two.normal.distance(normal) < 1e-3));
        assert!(read(&light, irradiance, Vec3A::ZERO, Vec3A::ONE, normal, Vec3A::X).is_none());
    }
}
