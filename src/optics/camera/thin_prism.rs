//! Brown-Conrady with thin prism terms and a tilted sensor: OpenCV's lists of 12 and 14.
//!
//! On the plane `z = 1`, with `g` of [`super::brown_conrady`], `u = |x|^2`, `s = (s1, s3)` and
//! `t = (s2, s4)`,
//!
//! `f(x) = g(x) + s u + t u^2`.
//!
//! A sensor that is turned by `tau_x` and `tau_y` against the lens sees `P(f(x))`: with
//! `R = Ry(tau_y) Rx(tau_x)` in OpenCV's sense (`calib3d`, "tilted camera model"), `P` sends a point to
//! where its ray meets the turned plane, and leaves the principal point where it is.
//!
//! # Domain
//! The Jacobian of the prism terms is `2 c x^T` with `c = s + 2 t u`: `f` is no gradient any more. What makes
//! a map one-to-one on a convex set is that the symmetric part of its Jacobian is positive definite there.
//! With `q` of [`super::brown_conrady`], its smaller eigenvalue is at least
//!
//! `min(rho', L) - r (|4 q + c| + |2 q + c|)`,
//!
//! in whatever azimuth, so the domain is the disc up to the first zero of that bound: inside it no two rays
//! share a pixel. The map itself may hold a little longer, by the order of the prism terms; the fold that is
//! stated is that of the bound. `P` is one-to-one up to its horizon, and the disc ends before that.

use glam::{DMat2, DVec2, DVec3};
use nalgebra::{Matrix2x3, Matrix3x2};

use super::LensLimit;
use super::brown_conrady::{self, BrownConrady};
use super::brown_formula::{POLE_MARGIN, radius};
use super::lanes::Lanes;
use super::limit::Domain;
use super::perspective::{
    NEAR_RIGHT_ANGLE_RAD, half_view_rad, plane_by_ray, plane_point, ray_by_image, ray_of,
};
use super::tilt::SensorTilt;
use crate::numeric::Polynomial;

/// Evaluations of one Newton solve.
const MAX_NEWTON_STEPS: u32 = 30;
/// Pieces of the way from the centre to the point, where Newton's method alone does not arrive.
const MAX_PIECES: u32 = 16;

/// No inverse takes more evaluations of the formula than this.
pub(super) const MAX_STEPS: u32 = brown_conrady::MAX_STEPS + MAX_NEWTON_STEPS * (1 + MAX_PIECES);

/// The lens of calibrations with 12 or 14 coefficients.
#[derive(Debug, Clone)]
pub(super) struct ThinPrism {
    /// The formula without prism and tilt; its domain holds this one.
    gradient: BrownConrady,
    /// `(s1, s3)`.
    s: DVec2,
    /// `(s2, s4)`.
    t: DVec2,
    tilt: SensorTilt,
    domain: Domain,
    /// Radius of the domain on the plane `z = 1`.
    end: f64,
    /// No point of the domain has an image farther out than this, before the tilt.
    flat_radius: f64,
}

impl ThinPrism {
    /// `distortion` has 12 or 14 entries. `None` when there is no domain.
    pub fn new(distortion: &[f64], field_of_view_rad: f64) -> Option<Self> {
        let at = |i: usize| distortion.get(i).copied().unwrap_or(0.0);
        let gradient = BrownConrady::new(distortion.get(..8)?, field_of_view_rad)?;
        let (n, d, q) = ([at(0), at(1), at(4)], [at(5), at(6), at(7)], DVec2::new(at(3), at(2)));
        let (s, t) = (DVec2::new(at(8), at(10)), DVec2::new(at(9), at(11)));
        let tilt = SensorTilt::new(at(12), at(13))?;
        let last = (std::f64::consts::FRAC_PI_2 - NEAR_RIGHT_ANGLE_RAD).tan();
        let bound = [(4.0 * q + s).length() + (2.0 * q + s).length(), 4.0 * t.length()];
        let fold = first_zero(&n, &d, bound, last)?;
        let reach = |r: f64| {
            let u = r * r;
            radius(&n, &d, r).0 + u * (3.0 * q.length() + s.length() + t.length() * u)
        };
        let view = half_view_rad(field_of_view_rad);
        let widest = fold.unwrap_or(last).min(view.tan());
        let fold = tilt.horizon().and_then(|horizon| cut(reach, horizon, widest)).or(fold);
        let domain = Domain::new(view, fold.map(f64::atan));
        let end = match (fold, domain.limit) {
            (Some(fold), LensLimit::BeyondFold) => fold,
            _ => domain.end_rad.tan(),
        };
        let flat_radius = reach(end);
        let usable = end > 0.0 && flat_radius.is_finite();
        usable.then_some(Self { gradient, s, t, tilt, domain, end, flat_radius })
    }

    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// An upper bound of the image radius.
    pub fn max_radius(&self) -> f64 {
        self.tilt.max_radius(self.flat_radius)
    }

    /// `f` and its Jacobian.
    fn flat(&self, x: DVec2) -> (DVec2, DMat2) {
        let (value, slope) = self.gradient.image_with_slope(x);
        let u = x.length_squared();
        let c = 2.0 * (self.s + 2.0 * u * self.t);
        (value + u * (self.s + u * self.t), slope + DMat2::from_cols(c * x.x, c * x.y))
    }

    pub fn project(&self, ray: DVec3) -> Result<DVec2, LensLimit> {
        let point = plane_point(ray, self.end, &self.domain)?;
        Ok(self.tilt.apply(self.flat(point).0).0)
    }

    /// `P(f(x))` and its Jacobian.
    fn image_with_slope(&self, x: DVec2) -> (DVec2, DMat2) {
        let (flat, inner) = self.flat(x);
        let (image, outer) = self.tilt.apply(flat);
        (image, outer * inner)
    }

    pub fn project_with_jacobian(&self, ray: DVec3) -> Result<(DVec2, Matrix2x3<f64>), LensLimit> {
        let point = plane_point(ray, self.end, &self.domain)?;
        let (image, slope) = self.image_with_slope(point);
        Ok((image, plane_by_ray(ray, point, slope)))
    }

    /// The unit ray of an image point; `slack` is how far rounding may have
    /// moved the point.
    pub fn unproject(&self, image: DVec2, slack: f64) -> Result<DVec3, LensLimit> {
        Ok(ray_of(self.plane_of(image, slack)?.0))
    }

    /// Nothing is found side by side: every point is left to [`Self::unproject`].
    pub fn unproject_lanes<const N: usize>(&self, _: &Lanes<N>) -> ([DVec3; N], [bool; N]) {
        ([DVec3::Z; N], [false; N])
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

    /// The point of the domain that is seen at `image`, and the evaluations of the formula that it took.
    pub fn plane_of(&self, image: DVec2, slack: f64) -> Result<(DVec2, u32), LensLimit> {
        let limit = self.domain.limit;
        // Also refuses a distance that overflowed; what is nearer is judged below.
        let near = image.length() <= 2.0 * self.max_radius() + slack;
        let (flat, stretch) = self.tilt.invert(image).filter(|_| near).ok_or(limit)?;
        let rounding = self.gradient.rounding_at_rim() + 16.0 * f64::EPSILON * flat.length();
        let room = rounding + slack * stretch;
        if flat.length() > self.flat_radius + room {
            return Err(limit);
        }
        let (start, taken) = match self.gradient.plane_of(flat, slack) {
            Ok((x, steps)) => (x.clamp_length_max(self.end), steps),
            Err(_) => (flat.normalize_or_zero() * self.end, brown_conrady::MAX_STEPS),
        };
        let (mut x, mut miss, steps) = self.newton(flat, start);
        let mut taken = taken + steps;
        if miss > room {
            x = DVec2::ZERO;
            for piece in 1..=MAX_PIECES {
                let target = flat * (f64::from(piece) / f64::from(MAX_PIECES));
                let (next, left, steps) = self.newton(target, x);
                (x, miss, taken) = (next, left, taken + steps);
            }
        }
        if miss <= room {
            Ok((x, taken))
        } else if x.length() >= self.end * (1.0 - 1e-6) {
            Err(limit)
        } else {
            Err(LensLimit::NotConverged)
        }
    }

    /// Newton's method for `f(x) = target` in the disc, with halved steps where the miss would grow: the point,
    /// the miss that is left, and the evaluations.
    fn newton(&self, target: DVec2, start: DVec2) -> (DVec2, f64, u32) {
        let mut x = start;
        let (mut value, mut slope) = self.flat(x);
        let (mut miss, mut taken) = ((target - value).length(), 1);
        let mut step = slope.inverse() * (target - value);
        while taken < MAX_NEWTON_STEPS && miss > 0.0 && step.is_finite() {
            let next = (x + step).clamp_length_max(self.end);
            if (next - x).length() <= f64::EPSILON * next.length() {
                break;
            }
            let (at_next, slope_at_next) = self.flat(next);
            let left = (target - at_next).length();
            taken += 1;
            if left < miss {
                (x, value, slope, miss) = (next, at_next, slope_at_next, left);
                step = slope.inverse() * (target - value);
            } else {
                step *= 0.5;
            }
        }
        (x, miss, taken)
    }
}

/// First zero, up to `last`, of `min(rho', L) - r (bound[0] + bound[1] r^2)`, or the pole before it; the outer
/// `None` says that the polynomials overflow.
fn first_zero(n: &[f64; 3], d: &[f64; 3], bound: [f64; 2], last: f64) -> Option<Option<f64>> {
    let top = Polynomial::new(&[1.0, n[0], n[1], n[2]]);
    let bottom = Polynomial::new(&[1.0, d[0], d[1], d[2]]);
    // rho' = F / D^2 with F = (N + 2u N') D - 2u N D'; both are polynomials in u = r^2.
    let f = top
        .plus(2.0, &top.derivative().shifted())
        .times(&bottom)
        .plus(-2.0, &top.times(&bottom.derivative()).shifted())
        .of_square();
    let pole = bottom.first_root_after(0.0, last * last).map(|u| u.sqrt() * (1.0 - POLE_MARGIN));
    let (top, bottom) = (top.of_square(), bottom.of_square());
    let sides = Polynomial::new(&[0.0, bound[0], 0.0, bound[1]]);
    let along = f.plus(-1.0, &sides.times(&bottom).times(&bottom));
    let around = top.plus(-1.0, &sides.times(&bottom));
    let mut end = pole;
    for polynomial in [&along, &around] {
        let reach = end.unwrap_or(last);
        end = polynomial.first_root_after(0.0, reach).or(end);
    }
    (along.is_finite() && around.is_finite()).then_some(end)
}

/// Where the rising `reach` comes to `limit`, if that is within `[0, end]`: halved to the last digit, from below.
fn cut(reach: impl Fn(f64) -> f64, limit: f64, end: f64) -> Option<f64> {
    if reach(end) < limit {
        return None;
    }
    let (mut low, mut high) = (0.0, end);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if reach(middle) < limit {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(low)
}
