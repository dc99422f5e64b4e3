//! Kannala-Brandt: `radius = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)`.

use glam::{DVec2, DVec3};
use nalgebra::{Matrix2x3, Matrix3x2};

use super::LensLimit;
use super::inverse::RadialInverse;
use super::lanes::Lanes;
use super::limit::{Domain, END_ROUNDING};
use crate::numeric::Polynomial;

/// Nearest approach to 180 degrees, where all azimuths meet in one ray.
const NEAR_STRAIGHT_BACK_RAD: f64 = 1e-6;

/// A lens in the angle itself; it may see past 90 degrees.
#[derive(Debug, Clone)]
pub(super) struct KannalaBrandt {
    k: [f64; 4],
    domain: Domain,
    inverse: RadialInverse,
    sines: SineTable,
}

impl KannalaBrandt {
    /// `None` when the radius does not grow from the centre on.
    pub fn new(k: [f64; 4], field_of_view_rad: f64) -> Option<Self> {
        let last = std::f64::consts::PI - NEAR_STRAIGHT_BACK_RAD;
        // The derivative is a polynomial in theta^2.
        let slope = Polynomial::new(&[1.0, 3.0 * k[0], 5.0 * k[1], 7.0 * k[2], 9.0 * k[3]]);
        let fold_rad = slope.first_root_after(0.0, last * last).map(f64::sqrt);
        let domain = Domain::new((0.5 * field_of_view_rad).min(last), fold_rad);
        let inverse = RadialInverse::new(|theta| radius(&k, theta), domain.end_rad)?;
        Some(Self { k, domain, inverse, sines: SineTable::new(domain.end_rad) })
    }

    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    pub fn max_radius(&self) -> f64 {
        self.inverse.end_image()
    }

    fn polar(&self, ray: DVec3) -> Result<(f64, f64), LensLimit> {
        // The caller keeps the squares within range.
        let across = (ray.x * ray.x + ray.y * ray.y).sqrt();
        let theta = across.atan2(ray.z);
        if theta <= self.domain.end_rad * (1.0 + END_ROUNDING) {
            Ok((across, theta))
        } else if ray.z <= 0.0 {
            Err(LensLimit::BehindCamera)
        } else {
            Err(self.domain.limit)
        }
    }

    pub fn project(&self, ray: DVec3) -> Result<DVec2, LensLimit> {
        let (across, theta) = self.polar(ray)?;
        let flat = DVec2::new(ray.x, ray.y);
        if across == 0.0 {
            // On the axis, where the quotient below is 0/0.
            return Ok(DVec2::ZERO);
        }
        Ok(flat * (radius(&self.k, theta).0 / across))
    }

    pub fn project_with_jacobian(&self, ray: DVec3) -> Result<(DVec2, Matrix2x3<f64>), LensLimit> {
        let (across, theta) = self.polar(ray)?;
        let (value, slope) = radius(&self.k, theta);
        let (e, around) = if across == 0.0 {
            (DVec2::X, 1.0 / ray.z)
        } else {
            (DVec2::new(ray.x, ray.y) / across, value / across)
        };
        let length_squared = across * across + ray.z * ray.z;
        let along = slope * ray.z / length_squared;
        // along e e^T + around (I - e e^T), then the column of z.
        let mix = along - around;
        let z = e * (-slope * across / length_squared);
        let jacobian = Matrix2x3::new(
            around + mix * e.x * e.x,
            mix * e.x * e.y,
            z.x,
            mix * e.x * e.y,
            around + mix * e.y * e.y,
            z.y,
        );
        Ok((DVec2::new(ray.x, ray.y) * around, jacobian))
    }

    /// The field angle of an image point, and the evaluations of the radius
    /// that it took; `slack` is how far rounding may have moved the point.
    #[inline]
    pub fn angle_of(&self, image: DVec2, slack: f64) -> Result<(f64, u32), LensLimit> {
        let square = image.length_squared();
        let ([stretch], [converged]) = self.inverse.stretches(&[square], |u| level(&self.k, u));
        if converged {
            return Ok((square.sqrt() * stretch, 1));
        }
        self.slow_angle_of(image.length(), slack)
    }

    #[cold]
    fn slow_angle_of(&self, image_radius: f64, slack: f64) -> Result<(f64, u32), LensLimit> {
        let found = self.inverse.solve(image_radius, slack, |theta| radius(&self.k, theta));
        found.map(|(theta, steps)| (theta, steps + 1)).ok_or(self.domain.limit)
    }

    /// The unit ray of an image point.
    #[inline]
    pub fn unproject(&self, image: DVec2, slack: f64) -> Result<DVec3, LensLimit> {
        let (theta, _) = self.angle_of(image, slack)?;
        Ok(self.ray(image, image.length_squared().sqrt(), theta))
    }

    /// [`Self::unproject`] for many at a time, and the same bits. What is not
    /// `converged` is left to it.
    #[inline]
    pub fn unproject_lanes<const N: usize>(&self, images: &Lanes<N>) -> ([DVec3; N], [bool; N]) {
        let squares = images.squares();
        let (stretches, converged) = self.inverse.stretches(&squares, |u| level(&self.k, u));
        let ray = |l: usize| {
            let image_radius = squares[l].sqrt();
            let theta = image_radius * stretches[l];
            self.ray(images.at(l), image_radius, theta)
        };
        (std::array::from_fn(ray), converged)
    }

    #[inline(always)]
    fn ray(&self, image: DVec2, image_radius: f64, theta: f64) -> DVec3 {
        let (sin, cos) = self.sines.sin_cos(theta);
        let scale = if image_radius == 0.0 { 1.0 } else { sin / image_radius };
        DVec3::new(image.x * scale, image.y * scale, cos)
    }

    pub fn unproject_with_jacobian(
        &self,
        image: DVec2,
        slack: f64,
    ) -> Result<(DVec3, Matrix3x2<f64>), LensLimit> {
        let image_radius = image.length_squared().sqrt();
        let (theta, _) = self.angle_of(image, slack)?;
        let (sin, cos) = self.sines.sin_cos(theta);
        let (e, around) =
            if image_radius == 0.0 { (DVec2::X, 1.0) } else { (image / image_radius, sin / image_radius) };
        let slope = radius(&self.k, theta).1;
        let mix = cos / slope - around;
        let ray = DVec3::new(image.x * around, image.y * around, cos);
        let jacobian = Matrix3x2::new(
            around + mix * e.x * e.x,
            mix * e.x * e.y,
            mix * e.x * e.y,
            around + mix * e.y * e.y,
            -sin * e.x / slope,
            -sin * e.y / slope,
        );
        Ok((ray, jacobian))
    }
}

/// Image radius over the field angle, and the derivative of the image radius,
/// for the square of the angle.
#[inline(always)]
fn level(k: &[f64; 4], u: f64) -> (f64, f64) {
    let level = 1.0 + u * (k[0] + u * (k[1] + u * (k[2] + u * k[3])));
    let slope = 1.0 + u * (3.0 * k[0] + u * (5.0 * k[1] + u * (7.0 * k[2] + u * (9.0 * k[3]))));
    (level, slope)
}

/// Image radius and its derivative by the field angle.
#[inline]
fn radius(k: &[f64; 4], theta: f64) -> (f64, f64) {
    let (level, slope) = level(k, theta * theta);
    (theta * level, slope)
}

/// Angles in the table of sines.
const SINE_TABLE_STEPS: usize = 512;

/// Sine and cosine of the domain's angles, from a table and a rotation by what
/// is left: as exact as the standard functions and several times as fast.
#[derive(Debug, Clone)]
struct SineTable {
    per_step: f64,
    step: f64,
    table: Vec<[f64; 2]>,
}

impl SineTable {
    fn new(end_rad: f64) -> Self {
        let step = end_rad / SINE_TABLE_STEPS as f64;
        let at = |i: usize| {
            let (sin, cos) = (i as f64 * step).sin_cos();
            [sin, cos]
        };
        Self { per_step: 1.0 / step, step, table: (0..=SINE_TABLE_STEPS).map(at).collect() }
    }

    #[inline]
    fn sin_cos(&self, angle: f64) -> (f64, f64) {
        let i = ((angle * self.per_step + 0.5) as usize).min(SINE_TABLE_STEPS);
        let [sin, cos] = self.table[i];
        // At most half a step, 0.0031: the next terms are below 1e-19.
        let left = angle - i as f64 * self.step;
        let square = left * left;
        let s = left * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0)));
        let one_less_c = square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0)));
        (sin + (cos * s - sin * one_less_c), cos - (sin * s + cos * one_less_c))
    }
}
