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
use super::inverse::{RadialInverse, Start};
use super::limit::{Domain, END_ROUNDING};
use super::perspective::{
    NEAR_RIGHT_ANGLE_RAD, half_view_rad, plane_by_ray, plane_point, ray_by_image, ray_of,
};
use crate::numeric::Polynomial;

/// Relative distance that the domain keeps from a pole of the rational form.
const POLE_MARGIN: f64 = 1e-9;

/// Undamped Newton steps in two dimensions before the damped solve begins.
const QUICK_PLANE_STEPS: u32 = 5;

/// Newton steps in two dimensions, damped ones included.
const MAX_PLANE_STEPS: u32 = 100;

/// Halvings of one damped step.
const MAX_HALVINGS: u32 = 30;

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
    tangential_bend: f64,
    max_radius: f64,
    inverse: RadialInverse,
}

/// `L`, and its derivative by `u`.
#[inline]
fn factor(n: &[f64; 3], d: &[f64; 3], u: f64) -> (f64, f64) {
    let top = 1.0 + u * (n[0] + u * (n[1] + u * n[2]));
    let top_slope = n[0] + u * (2.0 * n[1] + u * 3.0 * n[2]);
    if *d == [0.0; 3] {
        return (top, top_slope);
    }
    let inverse = 1.0 / (1.0 + u * (d[0] + u * (d[1] + u * d[2])));
    let bottom_slope = d[0] + u * (2.0 * d[1] + u * 3.0 * d[2]);
    let value = top * inverse;
    (value, (top_slope - value * bottom_slope) * inverse)
}

/// `rho = r L` and its derivative by `r`.
#[inline]
fn radius(n: &[f64; 3], d: &[f64; 3], r: f64) -> (f64, f64) {
    let u = r * r;
    let (value, slope) = factor(n, d, u);
    (r * value, value + 2.0 * u * slope)
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
        let tangential_bend = 6.0 * q.length();
        let max_radius = inverse.end_image() + 3.0 * q.length() * end * end;
        Some(Self { numerator, denominator, q, domain, end, tangential_bend, max_radius, inverse })
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
        let u = x.length_squared();
        let (l, _) = factor(&self.numerator, &self.denominator, u);
        x * (l + 2.0 * self.q.dot(x)) + self.q * u
    }

    #[inline]
    fn image_with_slope(&self, x: DVec2) -> (DVec2, DMat2) {
        let u = x.length_squared();
        let (l, slope) = factor(&self.numerator, &self.denominator, u);
        let on_axis = l + 2.0 * self.q.dot(x);
        let (s, q) = (2.0 * slope, self.q);
        let xx = on_axis + s * x.x * x.x + 4.0 * q.x * x.x;
        let xy = s * x.x * x.y + 2.0 * (q.x * x.y + q.y * x.x);
        let yy = on_axis + s * x.y * x.y + 4.0 * q.y * x.y;
        (x * on_axis + q * u, DMat2::from_cols(DVec2::new(xx, xy), DVec2::new(xy, yy)))
    }

    pub fn project(&self, ray: DVec3) -> Result<DVec2, LensLimit> {
        Ok(self.image(plane_point(ray, self.end, &self.domain)?))
    }

    pub fn project_with_jacobian(&self, ray: DVec3) -> Result<(DVec2, Matrix2x3<f64>), LensLimit> {
        let point = plane_point(ray, self.end, &self.domain)?;
        let (image, slope) = self.image_with_slope(point);
        Ok((image, plane_by_ray(ray, point, slope)))
    }

    #[inline]
    pub fn unproject(&self, image: DVec2) -> Result<DVec3, LensLimit> {
        Ok(ray_of(self.plane_of(image)?))
    }

    pub fn unproject_with_jacobian(&self, image: DVec2) -> Result<(DVec3, Matrix3x2<f64>), LensLimit> {
        let point = self.plane_of(image)?;
        let (_, slope) = self.image_with_slope(point);
        Ok((ray_of(point), ray_by_image(ray_of(point), slope)))
    }

    /// The point of the domain that `f` sends to `image`.
    #[inline]
    fn plane_of(&self, image: DVec2) -> Result<DVec2, LensLimit> {
        let limit = self.domain.limit;
        let distance = image.length();
        // Also refuses a length that overflowed.
        if distance.is_nan() || distance > self.max_radius() * (1.0 + END_ROUNDING) {
            return Err(limit);
        }
        if self.q != DVec2::ZERO {
            return self.plane_of_tangential(image, distance);
        }
        let r =
            self.inverse.solve(distance, |r| radius(&self.numerator, &self.denominator, r)).ok_or(limit)?;
        Ok(if distance > 0.0 { image * (r / distance) } else { image })
    }

    /// `f` continued past the domain so that Newton's method may step out and
    /// come back: radially back to the rim, plus the distance to it.
    fn continued(&self, x: DVec2) -> (DVec2, DMat2) {
        let r = x.length();
        if r <= self.end {
            return self.image_with_slope(x);
        }
        let rim = x * (self.end / r);
        let (image, slope) = self.image_with_slope(rim);
        let e = x / r;
        let across = DMat2::from_cols(
            DVec2::new(1.0 - e.x * e.x, -e.x * e.y),
            DVec2::new(-e.x * e.y, 1.0 - e.y * e.y),
        ) * (self.end / r);
        (image + (x - rim), slope * across + (DMat2::IDENTITY - across))
    }

    /// Newton's method without damping, from the radial inverse corrected for
    /// the tangential terms to first order. It gives up (and leaves the work
    /// to the damped solve) unless the steps shrink as they should.
    #[inline]
    fn quick_plane_of(&self, image: DVec2, distance: f64) -> Option<DVec2> {
        let Start { x: r, slope, bend_value, bend } = self.inverse.start(distance);
        // Second derivative of f: rho'' along the radius, 2 r L' across, both
        // bounded by the bend; 6 |q| from the tangential terms.
        let bend = 3.0 * bend + self.tangential_bend;
        // At the radial inverse f is off by the tangential terms alone. In
        // polar coordinates everything is known from the table: a first step,
        // then the curvature's share of it.
        let e = image * (1.0 / distance);
        let per_r = 1.0 / r;
        let (q_r, q_t) = (self.q.dot(e), self.q.dot(e.perp()));
        let (rho_slope, level) = (1.0 / slope, distance * per_r);
        let (a, b, c) = (rho_slope + 6.0 * q_r * r, 2.0 * q_t * r, level + 2.0 * q_r * r);
        let scale = 1.0 / (a * c - b * b);
        let solve =
            |along: f64, across: f64| ((c * along - b * across) * scale, (a * across - b * along) * scale);
        let (d_r, d_t) = solve(3.0 * q_r * r * r, q_t * r * r);
        let level_slope = (rho_slope - level) * per_r;
        let (c_r, c_t) =
            solve(0.5 * (bend_value * d_r * d_r + level_slope * d_t * d_t), level_slope * d_r * d_t);
        let mut x = e * (r - d_r - c_r) - e.perp() * (d_t + c_t);
        for _ in 0..QUICK_PLANE_STEPS {
            let (value, j) = self.image_with_slope(x);
            let error = value - image;
            let (a, b, c) = (j.x_axis.x, j.x_axis.y, j.y_axis.y);
            let determinant = a * c - b * b;
            let scale = 1.0 / determinant;
            let step = DVec2::new(c * error.x - b * error.y, a * error.y - b * error.x) * scale;
            x -= step;
            // What Newton's method leaves is at most |f''| step^2 / (2 s), with
            // the smaller eigenvalue s > determinant / trace.
            let left = step.length_squared() * bend * (a + c);
            let size = x.length_squared();
            if left * left <= 4e-34 * determinant * determinant * size {
                let inside = size <= self.end * self.end && determinant > 0.0;
                return inside.then_some(x);
            }
        }
        None
    }

    fn plane_of_tangential(&self, image: DVec2, distance: f64) -> Result<DVec2, LensLimit> {
        if distance > 0.0
            && distance <= self.inverse.end_image()
            && let Some(x) = self.quick_plane_of(image, distance)
        {
            return Ok(x);
        }
        let start = self
            .inverse
            .solve(distance.min(self.inverse.end_image()), |r| radius(&self.numerator, &self.denominator, r))
            .ok_or(self.domain.limit)?;
        let mut x = if distance > 0.0 { image * (start / distance) } else { image };
        let (mut value, mut slope) = self.continued(x);
        let mut error = (value - image).length();
        for _ in 0..MAX_PLANE_STEPS {
            let step = slope.inverse() * (value - image);
            if !step.is_finite() {
                break;
            }
            let (mut next, mut t) = (x - step, 1.0);
            let mut halvings = 0;
            loop {
                (value, slope) = self.continued(next);
                let next_error = (value - image).length();
                if next_error <= (1.0 - 0.25 * t) * error || halvings == MAX_HALVINGS {
                    error = next_error.min(error);
                    break;
                }
                if step.length_squared() <= 1e-28 * x.length_squared() {
                    break;
                }
                halvings += 1;
                t *= 0.5;
                next = x - step * t;
            }
            let moved = (next - x).length();
            x = next;
            if moved <= 2.0 * f64::EPSILON * x.length() || error == 0.0 {
                break;
            }
        }
        self.accept(x, image)
    }

    /// Sum of the sizes of all terms of `f` at radius `r`: its rounding error
    /// is a few ulp of this.
    fn size_of_terms(&self, r: f64) -> f64 {
        let u = r * r;
        let sum = |k: &[f64; 3]| 1.0 + u * (k[0].abs() + u * (k[1].abs() + u * k[2].abs()));
        let d = &self.denominator;
        let bottom = (1.0 + u * (d[0] + u * (d[1] + u * d[2]))).abs();
        let factor = sum(&self.numerator) / bottom;
        r * factor * (sum(d) / bottom) + 3.0 * self.q.length() * u
    }

    /// A point is an answer only if it lies in the domain and maps back, to the
    /// rounding of the formula.
    fn accept(&self, x: DVec2, image: DVec2) -> Result<DVec2, LensLimit> {
        let r = x.length();
        let rounding = 8.0 * f64::EPSILON * (self.size_of_terms(r) + image.length());
        let residual = (self.continued(x).0 - image).length();
        if r <= self.end * (1.0 + END_ROUNDING) && residual <= rounding {
            Ok(x)
        } else {
            Err(self.domain.limit)
        }
    }
}

/// Radius on the plane `z = 1` at which the domain of the formula ends, searched
/// up to `last`; the outer `None` says that the polynomials overflow.
fn first_fold(n: &[f64; 3], d: &[f64; 3], q: f64, last: f64) -> Option<Option<f64>> {
    let top = Polynomial::new(&[1.0, n[0], n[1], n[2]]);
    let bottom = Polynomial::new(&[1.0, d[0], d[1], d[2]]);
    // rho' = F / D^2 with F = (N + 2u N') D - 2u N D'.
    let f = top
        .plus(2.0, &top.derivative().shifted())
        .times(&bottom)
        .plus(-2.0, &top.times(&bottom.derivative()).shifted());
    let mut end: Option<f64> = None;
    let mut meet = |root: Option<f64>| {
        if let Some(root) = root {
            end = Some(end.map_or(root, |end| end.min(root)));
        }
        end.unwrap_or(last)
    };
    meet(f.first_root_after(0.0, last * last).map(f64::sqrt));
    let pole = bottom.first_root_after(0.0, last * last);
    let mut reach = meet(pole.map(|u| u.sqrt() * (1.0 - POLE_MARGIN)));
    let mut finite = f.is_finite();
    if q > 0.0 {
        let (f, top, bottom) = (f.of_square(), top.of_square(), bottom.of_square());
        let square = bottom.times(&bottom);
        // Opposite to q: rho' = 6 q r, or L = 2 q r.
        let radial = f.plus(-6.0 * q, &square.shifted());
        let around = top.plus(-2.0 * q, &bottom.shifted());
        for p in [&radial, &around] {
            finite &= p.is_finite();
            reach = meet(p.first_root_after(0.0, reach));
        }
        // At an azimuth between, cos = -(rho' + 3L) / (16 q r): the determinant
        // is zero where (rho' - L)(9L - rho') = 64 q^2 r^2.
        let l = top.times(&bottom);
        let between = f
            .plus(-1.0, &l)
            .times(&l.plus(8.0, &l).plus(-1.0, &f))
            .plus(-64.0 * q * q, &square.times(&square).shifted().shifted());
        finite &= between.is_finite();
        let inside = |&r: &f64| {
            let (rho, slope) = radius(n, d, r);
            r > 0.0 && slope + 3.0 * rho / r < 16.0 * q * r
        };
        let root = between.roots_in(0.0, reach).into_iter().find(inside);
        meet(root);
    }
    finite.then_some(end)
}
