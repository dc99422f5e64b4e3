//! What the models that divide by z share: the plane `z = 1`.

use glam::{DMat2, DVec2, DVec3};
use nalgebra::{Matrix2x3, Matrix3x2};

use super::LensLimit;
use super::limit::{Domain, END_ROUNDING};

/// Nearest approach of a perspective model to 90 degrees, in radians.
pub(super) const NEAR_RIGHT_ANGLE_RAD: f64 = 1e-6;

/// Half the field of view that a perspective model can have.
pub(super) fn half_view_rad(field_of_view_rad: f64) -> f64 {
    (0.5 * field_of_view_rad).min(std::f64::consts::FRAC_PI_2 - NEAR_RIGHT_ANGLE_RAD)
}

/// The ray's point on the plane `z = 1`, inside the domain.
pub(super) fn plane_point(ray: DVec3, end: f64, domain: &Domain) -> Result<DVec2, LensLimit> {
    if ray.z <= 0.0 {
        return Err(LensLimit::BehindCamera);
    }
    let point = DVec2::new(ray.x / ray.z, ray.y / ray.z);
    // Also false for a quotient that overflowed to infinity or NaN.
    if point.length_squared() <= end * end * (1.0 + 2.0 * END_ROUNDING) {
        Ok(point)
    } else {
        Err(domain.limit)
    }
}

/// Derivative of [`plane_point`] by the ray's components.
pub(super) fn plane_by_ray(ray: DVec3, point: DVec2, inner: DMat2) -> Matrix2x3<f64> {
    let w = 1.0 / ray.z;
    let [a, b] = [inner.x_axis * w, inner.y_axis * w];
    let c = -(a * point.x + b * point.y);
    Matrix2x3::new(a.x, b.x, c.x, a.y, b.y, c.y)
}

/// The unit ray through a point of the plane `z = 1`.
#[inline]
pub(super) fn ray_of(point: DVec2) -> DVec3 {
    let w = 1.0 / (1.0 + point.length_squared()).sqrt();
    DVec3::new(point.x * w, point.y * w, w)
}

/// Derivative of [`ray_of`] by the image point, given the derivative of the
/// image point by the plane point.
pub(super) fn ray_by_image(ray: DVec3, image_by_plane: DMat2) -> Matrix3x2<f64> {
    let plane_by_image = image_by_plane.inverse();
    let column = |dx: DVec2| {
        // d(ray) = w ((dx, 0) - ray (ray . (dx, 0))), w = ray.z.
        let d = DVec3::new(dx.x, dx.y, 0.0);
        (d - ray * ray.dot(d)) * ray.z
    };
    let a = column(plane_by_image.x_axis);
    let b = column(plane_by_image.y_axis);
    Matrix3x2::new(a.x, b.x, a.y, b.y, a.z, b.z)
}
