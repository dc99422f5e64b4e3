//! Perspective without distortion: `image = (x / z, y / z)`.

use glam::{DMat2, DVec2, DVec3};
use nalgebra::{Matrix2x3, Matrix3x2};

use super::LensLimit;
use super::lanes::Lanes;
use super::limit::{Domain, END_ROUNDING};
use super::perspective::{half_view_rad, plane_by_ray, plane_point, ray_by_image, ray_of};

/// The ideal camera; its domain ends at half the field of view.
#[derive(Debug, Clone)]
pub(super) struct Pinhole {
    domain: Domain,
    end: f64,
}

impl Pinhole {
    pub fn new(field_of_view_rad: f64) -> Self {
        let domain = Domain::new(half_view_rad(field_of_view_rad), None);
        Self { domain, end: domain.end_rad.tan() }
    }

    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    pub fn max_radius(&self) -> f64 {
        self.end
    }

    pub fn project(&self, ray: DVec3) -> Result<DVec2, LensLimit> {
        plane_point(ray, self.end, &self.domain)
    }

    pub fn project_with_jacobian(&self, ray: DVec3) -> Result<(DVec2, Matrix2x3<f64>), LensLimit> {
        let point = self.project(ray)?;
        Ok((point, plane_by_ray(ray, point, DMat2::IDENTITY)))
    }

    /// The unit ray of an image point; `slack` is how far rounding may have
    /// moved the point.
    pub fn unproject(&self, image: DVec2, slack: f64) -> Result<DVec3, LensLimit> {
        let end = self.end * (1.0 + END_ROUNDING) + slack;
        let square = image.length_squared();
        // A square that overflowed is past any end.
        if square <= end * end && square.is_finite() { Ok(ray_of(image)) } else { Err(self.domain.limit) }
    }

    /// [`Self::unproject`] for many at a time, and the same bits. What is not
    /// `converged` is left to it.
    #[inline]
    pub fn unproject_lanes<const N: usize>(&self, images: &Lanes<N>) -> ([DVec3; N], [bool; N]) {
        let squares = images.squares();
        let converged = squares.map(|square| square <= self.end * self.end);
        (std::array::from_fn(|l| ray_of(images.at(l))), converged)
    }

    pub fn unproject_with_jacobian(
        &self,
        image: DVec2,
        slack: f64,
    ) -> Result<(DVec3, Matrix3x2<f64>), LensLimit> {
        let ray = self.unproject(image, slack)?;
        Ok((ray, ray_by_image(ray, DMat2::IDENTITY)))
    }
}
