//! Analytic derivatives of trace and project.
//!
//! Each step of the way is differentiated where it stands; the chain is
//! multiplied out with small fixed matrices. Finite differences check every
//! one of them in the tests.

use glam::{DMat3, DVec2, DVec3};
use nalgebra::{Matrix2x3, Matrix2x6, Matrix3x2};

use super::limit::RayLimit;
use super::sensor::SensorOptics;
use super::stack::{travel, travel_by_cos};
use super::trace::SurfacePoint;
use crate::camera::Lens;
use crate::numeric::cross_matrix;

/// Gradient of the field angle by the ray's components (any length); zero on
/// the axis, where the angle has no derivative but every even power of it has
/// the derivative zero.
fn field_angle_gradient(ray: DVec3) -> DVec3 {
    let across = ray.x.hypot(ray.y);
    if across == 0.0 {
        return DVec3::ZERO;
    }
    let scale = ray.z / across;
    DVec3::new(ray.x * scale, ray.y * scale, -across) / ray.length_squared()
}

fn column(m: &Matrix3x2<f64>, j: usize) -> DVec3 {
    DVec3::new(m[(0, j)], m[(1, j)], m[(2, j)])
}

/// `m` (rows by a vector of the target) times the columns of a 3x3 matrix.
fn times(m: &Matrix2x3<f64>, by: DMat3) -> Matrix2x3<f64> {
    let at = |v: DVec3| {
        let row = |i: usize| m[(i, 0)] * v.x + m[(i, 1)] * v.y + m[(i, 2)] * v.z;
        [row(0), row(1)]
    };
    let (x, y, z) = (at(by.x_axis), at(by.y_axis), at(by.z_axis));
    Matrix2x3::new(x[0], y[0], z[0], x[1], y[1], z[1])
}

/// The matrix `a b^T`.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// How a pixel moves with what it sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelMotion {
    /// The pixel.
    pub pixel: DVec2,
    /// Pixels per millimetre of the point in the sensor frame.
    pub by_point: Matrix2x3<f64>,
    /// Pixels per motion of the platform, with all that it carries, in the rest
    /// frame: three columns per millimetre of translation, three per radian of
    /// rotation about the rest frame's origin (rotation after the present
    /// pose: `exp([w]) T`).
    pub by_pose: Matrix2x6<f64>,
}

impl SensorOptics {
    /// [`SensorOptics::trace`] and the derivative of the surface point by the
    /// pixel, mm/px.
    ///
    /// # Errors
    /// As `trace`; and [`RayLimit::MissesDome`] where the ray is tangent to the
    /// dome and no derivative exists.
    pub fn trace_with_jacobian(&self, pixel: DVec2) -> Result<(SurfacePoint, Matrix3x2<f64>), RayLimit> {
        let (ray, ray_by_pixel) = self.lens.unproject_with_jacobian(pixel)?;
        let field_angle_rad = Lens::field_angle_of_unit_rad(ray);
        let hit = self.intersect_dome(ray, field_angle_rad)?;
        let rotation = self.sensor_from_camera.rotation;
        let cos = hit.direction.z;
        let p = DVec2::new(hit.direction.x, hit.direction.y);
        let per_p = hit.gap_mm / cos + travel(&self.plates, cos);
        let per_p_by_cos = travel_by_cos(&self.plates, cos) - hit.gap_mm / (cos * cos);
        let (n, up) = (self.fill.index, hit.inside.z);
        let shift_slope = self.lens.pupil_shift_mm(field_angle_rad).1;
        let angle_gradient = field_angle_gradient(ray);
        let outward = self.dome.outward_mm(hit.point);
        let grazing = outward.dot(hit.inside);
        let mut jacobian = Matrix3x2::zeros();
        for j in 0..2 {
            let ray_motion = column(&ray_by_pixel, j);
            let d = rotation * ray_motion;
            let dp = DVec2::new(d.x, d.y);
            let origin = rotation.z_axis * (shift_slope * angle_gradient.dot(ray_motion));
            let base =
                DVec2::new(origin.x, origin.y) + dp * per_p + p * (per_p_by_cos * d.z - origin.z / cos);
            let inside = DVec3::new(dp.x / n, dp.y / n, cos * d.z / (n * n * up));
            let moved = DVec3::new(base.x, base.y, 0.0) + inside * hit.inside_mm;
            let surface = moved - hit.inside * (outward.dot(moved) / grazing);
            for i in 0..3 {
                jacobian[(i, j)] = surface[i];
            }
        }
        if jacobian.iter().all(|v| v.is_finite()) {
            Ok((self.surface_point(pixel, field_angle_rad, &hit), jacobian))
        } else {
            Err(RayLimit::MissesDome)
        }
    }

    /// [`SensorOptics::project`] and the derivative of the pixel by the point,
    /// px/mm. For a point on the sheet's top the height counts as height in the
    /// dome's medium.
    ///
    /// # Errors
    /// As `project`.
    pub fn project_with_jacobian(&self, point_mm: DVec3) -> Result<(DVec2, Matrix2x3<f64>), RayLimit> {
        let motion = self.project_with_motion(point_mm)?;
        Ok((motion.pixel, motion.by_point))
    }

    /// The pixel of a point and how it moves with the point and with the
    /// platform.
    ///
    /// # Errors
    /// As `project`.
    pub fn project_with_motion(&self, point_mm: DVec3) -> Result<PixelMotion, RayLimit> {
        let point = self.usable_point(point_mm)?;
        let (pupil, _) = self.chief_pupil(point)?;
        let sideways = DVec2::new(point.x - pupil.x, point.y - pupil.y);
        let reach = sideways.length();
        let air = self.path(point, pupil)?.air_ray(reach)?;
        let tangent = sideways * air.tangent_per_mm;
        let direction = DVec3::new(tangent.x, tangent.y, 1.0);
        // direction = (tangent e, 1): along e by the reach, around it by
        // tangent / reach, and along e by the heights.
        let e = if reach > 0.0 { sideways / reach } else { DVec2::ZERO };
        let (around, mix) = (air.tangent_per_mm, air.by_reach - air.tangent_per_mm);
        let flat = |height: f64| {
            DMat3::from_cols(
                DVec3::new(around + mix * e.x * e.x, mix * e.x * e.y, 0.0),
                DVec3::new(mix * e.x * e.y, around + mix * e.y * e.y, 0.0),
                DVec3::new(e.x * height, e.y * height, 0.0),
            )
        };
        // A point below the sheet ends the air itself.
        let point_in_air = point.z < self.bottom_mm;
        let by_point = flat(if point_in_air { air.by_air } else { air.by_height });
        let by_pupil = flat(air.by_air) * -1.0;

        let camera_from_sensor = self.sensor_from_camera.rotation.transpose();
        let ray = camera_from_sensor * direction;
        let (pixel, pixel_by_ray) = self.lens.project_with_jacobian(ray)?;

        // The pupil follows the field angle: d = A dx + B axis s' dangle, with
        // dangle = g . d.
        let gradient = self.sensor_from_camera.rotation * field_angle_gradient(ray);
        let angle = Lens::field_angle_rad(ray);
        let shift_slope = self.lens.pupil_shift_mm(angle).1;
        let follow = by_pupil * self.sensor_from_camera.rotation.z_axis * shift_slope;
        let feedback = 1.0 - gradient.dot(follow);
        let feedback_matrix = DMat3::IDENTITY + outer(follow, gradient) * (1.0 / feedback);

        let pixel_by_direction = times(&pixel_by_ray, camera_from_sensor);
        let pixel_by_point = times(&pixel_by_direction, feedback_matrix * by_point);

        // Moving the platform by (v, w) in the rest frame moves the camera by
        // the opposite, seen from the sensor: pupil and axes.
        let sensor_from_rest = self.sensor_from_camera.compose(&self.rest_from_camera.inverse());
        let turn = sensor_from_rest.rotation;
        let rest_pupil = sensor_from_rest.inverse().point(pupil);
        // pupil: -(v + w x c); the direction that the camera sees: + w x d.
        // The field angle changes by the turn of the axes as well.
        let pupil_by_turn = turn * cross_matrix(rest_pupil);
        let seen_by_turn = turn * cross_matrix(turn.transpose() * direction) * -1.0;
        let by_shift = feedback_matrix * by_pupil * turn * -1.0;
        let by_turn = by_pupil * pupil_by_turn;
        // d_seen = d_free + follow dangle, dangle = g . (d_free + turn part) / feedback.
        let turned = by_turn + seen_by_turn;
        let by_turn = turned + outer(follow, gradient) * turned * (1.0 / feedback);
        let pixel_by_shift = times(&pixel_by_direction, by_shift);
        let pixel_by_turn = times(&pixel_by_direction, by_turn);
        let mut by_pose = Matrix2x6::zeros();
        by_pose.fixed_columns_mut::<3>(0).copy_from(&pixel_by_shift);
        by_pose.fixed_columns_mut::<3>(3).copy_from(&pixel_by_turn);
        if pixel_by_point.iter().chain(by_pose.iter()).all(|v| v.is_finite()) {
            Ok(PixelMotion { pixel, by_point: pixel_by_point, by_pose })
        } else {
            Err(RayLimit::NotConverged)
        }
    }
}
