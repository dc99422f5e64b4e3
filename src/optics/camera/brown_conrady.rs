//! Brown-Conrady with tangential terms and an optional rational denominator.
//!
//! On the plane `z = 1`, with `u = |x|^2`, `L = N(u) / D(u)`,
//! `N = 1 + k1 u + k2 u^2 + k3 u^3`, `D = 1 + k4 u + k5 u^2 + k6 u^3` and
//! `q = (p2, p1)`,
//!
//! `f(x) = L x + q u + 2 (q . x) x`,
//!
//! which is OpenCV's formula with the tangential part written as a vector.
//!
//! # Domain
//! `f` is the gradient of a potential, so its Jacobian is symmetric. In polar
//! coordinates about the centre, with `rho(r) = r L`, its entries are
//! `rho' + 6 q_r r` and `L + 2 q_r r` on the diagonal and `2 q_t r` beside it.
//! The domain is the largest disc in which it is positive definite at every
//! azimuth. A disc is convex, and a map with a positive definite Jacobian on a
//! convex set is one-to-one there: inside the domain no two rays share a pixel.
//! Without tangential terms the disc ends where `rho' = 0`, the fold. The
//! disc also ends before a pole of the rational form (`D = 0`).

use glam::{DMat2, DVec2, DVec3};
use nalgebra::{Matrix2x3, Matrix3x2};

use super::LensLimit;
use super::brown_formula::{factor_of, first_fold, image_of, image_with_slope, radius};
use super::inverse::{NEWTON_TOLERANCE, RadialInverse};
use super::lanes::Lanes;
use super::limit::Domain;
use super::perspective::{
    NEAR_RIGHT_ANGLE_RAD, half_view_rad, plane_by_ray, plane_point, ray_by_image, ray_of,
};
use crate::numeric::{MAX_ITERATIONS, bracketed_newton};

/// Most first Newton steps in two dimensions; a lens has as many as it needs.
const MAX_FIRST_STEPS: u32 = 5;

/// No inverse takes more evaluations of the formula than this.
pub(super) const MAX_STEPS: u32 = MAX_FIRST_STEPS + 2 + 1 + MAX_ITERATIONS;

/// The lens of `plumb_bob` and `rational_polynomial` calibrations.
#[derive(Debug, Clone)]
pub(super) struct BrownConrady {
    numerator: [f64; 3],
    denominator: [f64; 3],
    /// `(p2, p1)`, see the module's formula.
    q: DVec2,
    domain: Domain,
    /// Radius of the domain on the plane `z = 1`.
    end: f64,
    /// Bound on the second derivative of the tangential terms.
    tangential_curvature: f64,
    max_radius: f64,
    inverse: RadialInverse,
    /// Newton steps that the tangential terms need before the last ones.
    first_steps: u32,
}

impl BrownConrady {
    /// `distortion` has 5 or 8 entries. `None` when there is no domain.
    pub fn new(distortion: &[f64], field_of_view_rad: f64) -> Option<Self> {
        let at = |i: usize| distortion.get(i).copied().unwrap_or(0.0);
        let numerator = [at(0), at(1), at(4)];
        let denominator = [at(5), at(6), at(7)];
        let q = DVec2::new(at(3), at(2));
        let last = (std::f64::consts::FRAC_PI_2 - NEAR_RIGHT_ANGLE_RAD).tan();
        let fold = first_fold(&numerator, &denominator, q.length(), last)?;
        let domain = Domain::new(half_view_rad(field_of_view_rad), fold.map(f64::atan));
        let end = match (fold, domain.limit) {
            (Some(fold), LensLimit::BeyondFold) => fold,
            _ => domain.end_rad.tan(),
        };
        let inverse = RadialInverse::new(|r| radius(&numerator, &denominator, r), end)?;
        let tangential_curvature = 6.0 * q.length();
        let max_radius = inverse.end_image() + 3.0 * q.length() * end * end;
        let mut lens = Self {
            numerator,
            denominator,
            q,
            domain,
            end,
            tangential_curvature,
            max_radius,
            inverse,
            first_steps: 0,
        };
        if q != DVec2::ZERO {
            lens.first_steps = lens.clone().needed_first_steps();
        }
        Some(lens)
    }

    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// Largest image radius: `|f|^2` on a circle is convex in the cosine of
    /// the azimuth from `q`, and largest along `q`.
    pub fn max_radius(&self) -> f64 {
        self.max_radius
    }

    fn image(&self, x: DVec2) -> DVec2 {
        let (n, d) = (&self.numerator, &self.denominator);
        if *d == [0.0; 3] { image_of::<false>(n, d, self.q, x) } else { image_of::<true>(n, d, self.q, x) }
    }

    #[inline]
    pub fn image_with_slope(&self, x: DVec2) -> (DVec2, DMat2) {
        let (n, d) = (&self.numerator, &self.denominator);
        let (image, slope) = if *d == [0.0; 3] {
            image_with_slope::<false>(n, d, self.q, x)
        } else {
            image_with_slope::<true>(n, d, self.q, x)
        };
        let matrix = DMat2::from_cols(DVec2::new(slope.xx, slope.xy), DVec2::new(slope.xy, slope.yy));
        (image, matrix)
    }

    pub fn project(&self, ray: DVec3) -> Result<DVec2, LensLimit> {
        Ok(self.image(plane_point(ray, self.end, &self.domain)?))
    }

    pub fn project_with_jacobian(&self, ray: DVec3) -> Result<(DVec2, Matrix2x3<f64>), LensLimit> {
        let point = plane_point(ray, self.end, &self.domain)?;
        let (image, slope) = self.image_with_slope(point);
        Ok((image, plane_by_ray(ray, point, slope)))
    }

    /// The unit ray of an image point; `slack` is how far rounding may have
    /// moved the point.
    #[inline]
    pub fn unproject(&self, image: DVec2, slack: f64) -> Result<DVec3, LensLimit> {
        Ok(ray_of(self.plane_of(image, slack)?.0))
    }

    /// [`Self::unproject`] for many at a time, and the same bits. What is not
    /// `converged` is left to it.
    #[inline]
    pub fn unproject_lanes<const N: usize>(&self, images: &Lanes<N>) -> ([DVec3; N], [bool; N]) {
        let (points, converged) = self.quick_planes(images);
        (std::array::from_fn(|l| ray_of(points.at(l))), converged)
    }

    pub fn unproject_with_jacobian(
        &self,
        image: DVec2,
        slack: f64,
    ) -> Result<(DVec3, Matrix3x2<f64>), LensLimit> {
        let (point, _) = self.plane_of(image, slack)?;
        let (_, slope) = self.image_with_slope(point);
        Ok((ray_of(point), ray_by_image(ray_of(point), slope)))
    }

    /// The point of the domain that `f` sends to `image`, and the evaluations of
    /// `f` that it took.
    #[inline]
    pub fn plane_of(&self, image: DVec2, slack: f64) -> Result<(DVec2, u32), LensLimit> {
        let (point, [converged]) = self.quick_planes(&Lanes { x: [image.x], y: [image.y] });
        let quick = if self.q == DVec2::ZERO { 1 } else { self.first_steps + 2 };
        if converged {
            return Ok((point.at(0), quick));
        }
        let (point, steps) = self.slow_plane_of(image, slack)?;
        Ok((point, quick + steps))
    }

    /// With `u = r^2`, `f(x) = y` says `y - u q = (L + 2 q . x) x`: the point lies
    /// along `w = y - u q`, and its radius is the root of one function,
    ///
    /// `R(r) = rho(r) + 2 u (q . w) / |w| - |w|`.
    ///
    /// `f` is the gradient of a convex potential on the domain, so `R` is
    /// negative below the root and positive above it: a bracket finds it, and
    /// its sign at the rim tells whether there is one.
    #[cold]
    fn slow_plane_of(&self, image: DVec2, slack: f64) -> Result<(DVec2, u32), LensLimit> {
        let square = self.q.length_squared();
        let mismatch = |r: f64| {
            let (value, slope) = radius(&self.numerator, &self.denominator, r);
            let w = image - self.q * (r * r);
            let size = w.length();
            if size == 0.0 {
                return (value, slope);
            }
            let along = self.q.dot(w) / size;
            let across = (square - along * along).max(0.0);
            (value + 2.0 * r * r * along - size, slope + 6.0 * r * along - 4.0 * r * r * r * across / size)
        };
        let past_rim = -mismatch(self.end).0;
        // Also refuses a distance that overflowed.
        if past_rim.is_nan() || past_rim > self.rounding_at_rim() + slack {
            return Err(self.domain.limit);
        }
        let (r, steps) = if past_rim >= 0.0 {
            (self.end, 1)
        } else {
            let ([stretch], _) = self.inverse.starts(&[image.length_squared()]);
            bracketed_newton(mismatch, 0.0, self.end, stretch * image.length())
                .map(|root| (root.value, root.iterations + 1))
                .map_err(|_| LensLimit::NotConverged)?
        };
        let w = image - self.q * (r * r);
        let size = w.length();
        Ok((if size > 0.0 { w * (r / size) } else { w }, steps))
    }

    /// Rounding error of the formula at the domain's end: a few ulp of the sum
    /// of the sizes of all terms.
    pub fn rounding_at_rim(&self) -> f64 {
        let (r, u) = (self.end, self.end * self.end);
        let sum = |k: &[f64; 3]| 1.0 + u * (k[0].abs() + u * (k[1].abs() + u * k[2].abs()));
        let d = &self.denominator;
        let bottom = (1.0 + u * (d[0] + u * (d[1] + u * d[2]))).abs();
        let terms = r * (sum(&self.numerator) / bottom) * (sum(d) / bottom);
        8.0 * f64::EPSILON * (terms + 3.0 * self.q.length() * u)
    }

    /// The fast way: the table's stretch, then Newton's method with a fixed
    /// number of steps and without damping.
    #[inline(always)]
    fn quick_planes<const N: usize>(&self, images: &Lanes<N>) -> (Lanes<N>, [bool; N]) {
        match (self.q == DVec2::ZERO, self.denominator == [0.0; 3]) {
            (true, true) => self.radial_planes::<N, false>(images),
            (true, false) => self.radial_planes::<N, true>(images),
            (false, true) => self.tangential_planes::<N, false>(images),
            (false, false) => self.tangential_planes::<N, true>(images),
        }
    }

    #[inline(always)]
    fn radial_planes<const N: usize, const RATIONAL: bool>(
        &self,
        images: &Lanes<N>,
    ) -> (Lanes<N>, [bool; N]) {
        let (n, d) = (self.numerator, self.denominator);
        let (stretches, converged) = self.inverse.stretches(&images.squares(), |u| {
            let (level, slope) = factor_of::<RATIONAL>(&n, &d, u);
            (level, level + 2.0 * u * slope)
        });
        (images.times(&stretches), converged)
    }

    /// From the radial inverse, which is off by the tangential terms: as many
    /// Newton steps as this lens needs, one more, and one with the same slope.
    #[inline(always)]
    fn tangential_planes<const N: usize, const RATIONAL: bool>(
        &self,
        images: &Lanes<N>,
    ) -> (Lanes<N>, [bool; N]) {
        let (n, d, q) = (self.numerator, self.denominator, self.q);
        let (rim, sides) = (self.end * self.end, self.tangential_curvature);
        let (stretches, curvatures) = self.inverse.starts(&images.squares());
        let mut points = images.times(&stretches);
        for _ in 0..self.first_steps {
            for l in 0..N {
                let (image, x) = (images.at(l), points.at(l));
                let (value, slope) = image_with_slope::<RATIONAL>(&n, &d, q, x);
                points.set(l, x - slope.inverse().times(value - image));
            }
        }
        let mut converged = [false; N];
        for l in 0..N {
            let (image, mut x) = (images.at(l), points.at(l));
            let (value, slope) = image_with_slope::<RATIONAL>(&n, &d, q, x);
            let inverse = slope.inverse();
            let step = inverse.times(value - image);
            x -= step;
            let last = inverse.times(image_of::<RATIONAL>(&n, &d, q, x) - image);
            x -= last;
            points.set(l, x);
            // The last step's error is at most |f''| |step| |last| / s with the
            // smaller eigenvalue s > determinant / trace. |f''| is rho'' along
            // the radius, 2 r L' across, both within 3 times the curvature, and
            // 6 |q| from the tangential terms.
            let curvature = (3.0 * curvatures[l] + sides) * slope.trace();
            let (left, size) = (step.length_squared() * last.length_squared(), x.length_squared());
            let room = NEWTON_TOLERANCE * slope.determinant();
            converged[l] = (curvature * curvature * left <= room * room * size)
                & (size <= rim)
                & (slope.determinant() > 0.0)
                & (slope.trace() > 0.0);
        }
        (points, converged)
    }

    /// The smallest number of first steps with which nearly all of the domain is
    /// found the fast way: a ring of rays in each of many field angles is asked.
    fn needed_first_steps(mut self) -> u32 {
        const RINGS: u32 = 32;
        const AROUND: u32 = 8;
        for steps in 0..MAX_FIRST_STEPS {
            self.first_steps = steps;
            let mut missed = 0;
            for i in 0..RINGS * AROUND {
                let r = self.end * (f64::from(i / AROUND) + 0.5) / f64::from(RINGS);
                let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / f64::from(AROUND)).sin_cos();
                let image = self.image(DVec2::new(r * cos, r * sin));
                let (_, [converged]) = self.quick_planes(&Lanes { x: [image.x], y: [image.y] });
                missed += u32::from(!converged);
            }
            if missed <= RINGS * AROUND / 64 {
                return steps;
            }
        }
        MAX_FIRST_STEPS
    }
}
