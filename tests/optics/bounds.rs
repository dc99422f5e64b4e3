//! How exact an answer must be, and what a run of the fuzz has met.

use domecast::camera::Lens;
use glam::{DVec2, DVec3};
use nalgebra::Matrix2x3;

pub const EPS: f64 = f64::EPSILON;

/// The last part of the domain: the bounds hold up to it. What is found in it
/// must still map back to its pixel.
pub const LAST: f64 = 1e-6;

pub fn ulp(x: f64) -> f64 {
    x.abs().next_up() - x.abs()
}

/// 8 ulp of a pixel. The lens takes its distance from the principal point, so
/// where that is the larger number its ulp counts.
pub fn pixel_ulps(lens: &Lens, pixel: DVec2) -> f64 {
    let [[_, _, cx], [_, _, cy], _] = lens.spec().matrix;
    8.0 * ulp(pixel.x.abs().max(cx.abs())).hypot(ulp(pixel.y.abs().max(cy.abs())))
}

/// How far 8 ulp of each of a ray's components move the pixel.
pub fn ray_ulps(slope: &Matrix2x3<f64>, ray: DVec3) -> f64 {
    (0..3).map(|j| slope.column(j).norm() * 8.0 * ulp(ray[j])).sum()
}

/// How far a pixel at most moves a ray, rad/px: the inverse of the smallest
/// stretch of the ray's plane onto the image.
pub fn condition(slope: &Matrix2x3<f64>, length: f64) -> f64 {
    let gram = slope * slope.transpose();
    let (half, det) = (0.5 * gram.trace(), gram.determinant());
    let smallest = (det / (half + (half * half - det).max(0.0).sqrt())).max(0.0);
    1.0 / (smallest.sqrt() * length)
}

/// What a run has seen.
#[derive(Default, Clone, Copy)]
pub struct Seen {
    pub lenses: u64,
    pub checks: u64,
    pub ok: u64,
    pub limits: u64,
    pub max: Iterations,
}

/// The largest numbers of iterations met.
#[derive(Default, Clone, Copy)]
pub struct Iterations {
    pub lens: u32,
    pub climb: u32,
    pub pupil: u32,
}

impl Seen {
    pub fn plus(self, o: Self) -> Self {
        Self {
            lenses: self.lenses + o.lenses,
            checks: self.checks + o.checks,
            ok: self.ok + o.ok,
            limits: self.limits + o.limits,
            max: Iterations {
                lens: self.max.lens.max(o.max.lens),
                climb: self.max.climb.max(o.max.climb),
                pupil: self.max.pupil.max(o.max.pupil),
            },
        }
    }
}
