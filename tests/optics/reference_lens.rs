//! The same optics again: slow, bracketed, in double-double, from the formulas.
//!
//! Nothing here calls the crate's solvers. The lens inverse bisects (radial
//! lenses) or refines a candidate and proves it by its place in the domain (the
//! map is one-to-one there); the way from a point to the camera bisects the
//! rising reach.

use domecast::camera::{LensModel, LensSpec};
use glam::DVec2;

use super::dd::{Dd, dd};

pub type V3 = [Dd; 3];

pub fn v3(v: glam::DVec3) -> V3 {
    v.to_array().map(dd)
}

pub fn dot(a: V3, b: V3) -> Dd {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn unit(a: V3) -> V3 {
    let length = dot(a, a).sqrt();
    a.map(|v| v / length)
}

/// Distance of two vectors, as a double.
pub fn distance(a: V3, b: V3) -> f64 {
    let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    dot(d, d).sqrt().f64()
}

fn horner(u: Dd, coefficients: &[f64]) -> Dd {
    coefficients.iter().rev().fold(dd(0.0), |s, &c| s * u + dd(c))
}

fn horner_f64(u: f64, coefficients: &[f64]) -> f64 {
    coefficients.iter().rev().fold(0.0, |s, &c| s * u + c)
}

/// The root in `[0, end]` of a function that rises from below zero: bisected in
/// doubles by `rough`, then bracketed and closed in on in double-double. `None`
/// where the function stays below zero.
pub fn rising_root(exact: impl Fn(Dd) -> Dd, rough: impl Fn(f64) -> f64, end: f64) -> Option<Dd> {
    let (mut low, mut high) = (0.0, end);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if rough(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let mut width = 4.0 * f64::EPSILON * high + f64::MIN_POSITIVE;
    let (mut a, mut b) = loop {
        let (a, b) = ((low - width).max(0.0), (high + width).min(end));
        let (at_a, at_b) = (exact(dd(a)), exact(dd(b)));
        if at_a.hi <= 0.0 && at_b.hi >= 0.0 {
            break ((dd(a), at_a), (dd(b), at_b));
        }
        if width > end {
            return None;
        }
        width *= 64.0;
    };
    // Regula falsi; an end that stays counts half (the Illinois rule).
    let (mut stays, mut x) = (0, if -a.1.hi < b.1.hi { a.0 } else { b.0 });
    for _ in 0..60 {
        let (rise, before) = (b.1 - a.1, x);
        if rise.hi <= 0.0 {
            break;
        }
        x = a.0 - a.1 * (b.0 - a.0) / rise;
        if (x - before).hi.abs() <= 1e-26 * x.hi {
            break;
        }
        let at_x = exact(x);
        if at_x.hi < 0.0 {
            if stays == 1 {
                b.1 = b.1 * dd(0.5);
            }
            (a, stays) = ((x, at_x), 1);
        } else {
            if stays == -1 {
                a.1 = a.1 * dd(0.5);
            }
            (b, stays) = ((x, at_x), -1);
        }
    }
    Some(x)
}

pub struct Lens<'a> {
    pub spec: &'a LensSpec,
    numerator: [f64; 4],
    denominator: [f64; 4],
    q: [f64; 2],
}

impl<'a> Lens<'a> {
    pub fn new(spec: &'a LensSpec) -> Self {
        let k = |i: usize| spec.distortion.get(i).copied().unwrap_or(0.0);
        if spec.model == LensModel::BrownConrady {
            Self {
                spec,
                numerator: [1.0, k(0), k(1), k(4)],
                denominator: [1.0, k(5), k(6), k(7)],
                q: [k(3), k(2)],
            }
        } else {
            Self { spec, numerator: [1.0, 0.0, 0.0, 0.0], denominator: [1.0, 0.0, 0.0, 0.0], q: [0.0; 2] }
        }
    }

    fn is_fisheye(&self) -> bool {
        self.spec.model == LensModel::KannalaBrandt
    }

    /// Image radius of tan(theta), or of theta for a fisheye.
    pub fn radius(&self, a: Dd) -> Dd {
        let u = a * a;
        if self.is_fisheye() {
            let k = &self.spec.distortion;
            return a * horner(u, &[1.0, k[0], k[1], k[2], k[3]]);
        }
        a * horner(u, &self.numerator) / horner(u, &self.denominator)
    }

    /// Image point (focal length 1) of a point of the plane z = 1.
    fn plane_image(&self, x: Dd, y: Dd) -> [Dd; 2] {
        let u = x * x + y * y;
        let factor = horner(u, &self.numerator) / horner(u, &self.denominator);
        let [qx, qy] = self.q.map(dd);
        let along = factor + dd(2.0) * (qx * x + qy * y);
        [x * along + qx * u, y * along + qy * u]
    }

    pub fn image(&self, ray: V3) -> [Dd; 2] {
        if self.is_fisheye() {
            let across = (ray[0] * ray[0] + ray[1] * ray[1]).sqrt();
            let theta = Dd::atan2(across, ray[2]);
            if across.hi == 0.0 {
                return [dd(0.0); 2];
            }
            let scale = self.radius(theta) / across;
            [ray[0] * scale, ray[1] * scale]
        } else {
            self.plane_image(ray[0] / ray[2], ray[1] / ray[2])
        }
    }

    pub fn pixel(&self, ray: V3) -> [Dd; 2] {
        let [[fx, _, cx], [_, fy, cy], _] = self.spec.matrix;
        let [x, y] = self.image(ray);
        [x * dd(fx) + dd(cx), y * dd(fy) + dd(cy)]
    }

    /// How far 8 ulp of each coefficient move the pixel of a ray: the lens is an
    /// input as well, and where large terms cancel the one that counts.
    pub fn coefficient_ulps(&self, ray: glam::DVec3) -> f64 {
        let ulp = |k: f64| k.abs().next_up() - k.abs();
        let across = ray.x.hypot(ray.y);
        let a = if self.is_fisheye() { across.atan2(ray.z) } else { across / ray.z };
        let u = a * a;
        let ulps = |k: &[f64]| k.iter().rev().fold(0.0, |s, &k| s * u + ulp(k));
        let moved = if self.is_fisheye() {
            a * u * ulps(&self.spec.distortion)
        } else {
            let bottom = horner_f64(u, &self.denominator);
            let level = horner_f64(u, &self.numerator) / bottom;
            let by_bottom = level.abs() * ulps(&self.denominator[1..]);
            a * u * (ulps(&self.numerator[1..]) + by_bottom) / bottom.abs()
                + 3.0 * u * (ulp(self.q[0]) + ulp(self.q[1]))
        };
        8.0 * moved * self.spec.matrix[0][0].max(self.spec.matrix[1][1])
    }

    pub fn image_of_pixel(&self, pixel: DVec2) -> [Dd; 2] {
        let [[fx, _, cx], [_, fy, cy], _] = self.spec.matrix;
        [(dd(pixel.x) - dd(cx)) / dd(fx), (dd(pixel.y) - dd(cy)) / dd(fy)]
    }

    /// [`Lens::radius`] in doubles.
    fn radius_f64(&self, a: f64) -> f64 {
        let u = a * a;
        if self.is_fisheye() {
            return a * (1.0 + u * horner_f64(u, &self.spec.distortion));
        }
        a * horner_f64(u, &self.numerator) / horner_f64(u, &self.denominator)
    }

    /// The angle variable in `[0, end]` whose image radius is `rho`.
    fn bisect(&self, rho: Dd, end: f64) -> Option<Dd> {
        if self.radius(dd(end)) < rho {
            return None;
        }
        rising_root(|a| self.radius(a) - rho, |a| self.radius_f64(a) - rho.f64(), end)
    }

    /// The ray of a pixel whose field angle is at most `end_rad`; `near` is a
    /// candidate, used for tangential lenses only.
    pub fn ray(&self, pixel: DVec2, end_rad: f64, near: Option<glam::DVec3>) -> Option<V3> {
        let [x, y] = self.image_of_pixel(pixel);
        let rho = (x * x + y * y).sqrt();
        if self.is_fisheye() {
            let theta = self.bisect(rho, end_rad)?;
            let (sin, cos) = theta.sin_cos();
            if rho.hi == 0.0 {
                return Some([dd(0.0), dd(0.0), dd(1.0)]);
            }
            return Some([x * sin / rho, y * sin / rho, cos]);
        }
        if self.q == [0.0; 2] {
            let r = self.bisect(rho, end_rad.tan() * (1.0 + 1e-15))?;
            if rho.hi == 0.0 {
                return Some([dd(0.0), dd(0.0), dd(1.0)]);
            }
            return Some(unit([x * r / rho, y * r / rho, dd(1.0)]));
        }
        let near = near?;
        let (mut a, mut b) = (dd(near.x / near.z), dd(near.y / near.z));
        let size = 1e-3 * (1.0 + a.hi.abs().max(b.hi.abs()));
        for _ in 0..40 {
            let at = self.plane_image(a, b);
            let (ex, ey) = (at[0] - x, at[1] - y);
            // The Jacobian in plain doubles: Newton's steps then gain a
            // dozen digits each instead of doubling them.
            let h = 1e-6 * size;
            let d = |da: f64, db: f64| self.plane_image(a + dd(da), b + dd(db)).map(Dd::f64);
            let (px, mx, py, my) = (d(h, 0.0), d(-h, 0.0), d(0.0, h), d(0.0, -h));
            let j = [
                [(px[0] - mx[0]) / (2.0 * h), (py[0] - my[0]) / (2.0 * h)],
                [(px[1] - mx[1]) / (2.0 * h), (py[1] - my[1]) / (2.0 * h)],
            ];
            let det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
            let sx = (ex * dd(j[1][1]) - ey * dd(j[0][1])) / dd(det);
            let sy = (ey * dd(j[0][0]) - ex * dd(j[1][0])) / dd(det);
            if !sx.hi.is_finite() || !sy.hi.is_finite() {
                return None;
            }
            a = a - sx;
            b = b - sy;
            if sx.hi.abs() + sy.hi.abs() < 1e-20 * (a.hi.abs() + b.hi.abs() + 1e-6) {
                return Some(unit([a, b, dd(1.0)]));
            }
        }
        None
    }

    pub fn shift(&self, theta: Dd) -> Dd {
        let u = theta * theta;
        u * horner(u, &self.spec.pupil_shift_mm)
    }
}

pub fn field_angle(ray: V3) -> Dd {
    Dd::atan2((ray[0] * ray[0] + ray[1] * ray[1]).sqrt(), ray[2])
}
