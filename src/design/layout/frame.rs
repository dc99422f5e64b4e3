//! The frame in which a pattern is even: the raw image or the runtime's undistorted one.
//!
//! # Example
//! ```
//! use domecast_design::Design;
//! use domecast_design::glam::DVec3;
//! use domecast_design::layout::frame::UndistortedFrame;
//!
//! # const THUMB24: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json");
//! let design = Design::load(THUMB24.as_ref())?;
//! let matrix = design.undistorted_matrix();
//! let frame = UndistortedFrame::new(&matrix).ok_or("the matrix has no inverse")?;
//! // the camera's axis appears at the principal point
//! let place = frame.from_ray(DVec3::Z)?;
//! assert!((place.x - matrix[0][2]).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use glam::{DMat3, DVec2, DVec3};
use nalgebra::Vector3;

use crate::spec::sections::EvenIn;
use domecast_optics::camera::{Lens, LensLimit};

/// The undistorted frame: what a pinhole camera with this matrix would show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UndistortedFrame {
    matrix: DMat3,
    inverse: DMat3,
}

impl UndistortedFrame {
    /// The frame of a camera matrix (rows); `None` if the matrix cannot be inverted.
    pub fn new(matrix: &[[f64; 3]; 3]) -> Option<Self> {
        let matrix = DMat3::from_cols_array_2d(matrix).transpose();
        let inverse = matrix.inverse();
        (matrix.is_finite() && inverse.is_finite()).then_some(Self { matrix, inverse })
    }

    /// Where in this frame a ray (camera frame) appears.
    ///
    /// # Errors
    /// The ray does not point forwards: no flat frame shows it.
    pub fn from_ray(&self, ray: DVec3) -> Result<DVec2, LensLimit> {
        if ray.z <= 0.0 {
            return Err(LensLimit::BehindCamera);
        }
        let place = self.matrix * (ray / ray.z);
        if place.is_finite() { Ok(place.truncate()) } else { Err(LensLimit::NotFinite) }
    }

    /// The ray (camera frame) that appears there; not of unit length.
    pub fn ray(&self, place: DVec2) -> DVec3 {
        self.inverse * place.extend(1.0)
    }

    /// The place in this frame of a raw pixel.
    ///
    /// # Errors
    /// The lens does not see the pixel, or this frame cannot show it.
    pub fn from_raw(&self, lens: &Lens, pixel: DVec2) -> Result<DVec2, LensLimit> {
        self.from_ray(lens.unproject(pixel)?)
    }
}

/// A frame with the lens that leads to the raw image.
#[derive(Debug, Clone, Copy)]
pub struct EvenFrame<'a> {
    lens: &'a Lens,
    undistorted: Option<UndistortedFrame>,
}

impl<'a> EvenFrame<'a> {
    /// The frame that a pattern names.
    pub fn new(lens: &'a Lens, even_in: EvenIn, undistorted: UndistortedFrame) -> Self {
        let undistorted = match even_in {
            EvenIn::Raw => None,
            EvenIn::Undistorted => Some(undistorted),
        };
        Self { lens, undistorted }
    }

    /// The raw pixel of a place in this frame.
    ///
    /// # Errors
    /// The lens does not see it.
    pub fn raw_from_even(&self, place: DVec2) -> Result<DVec2, LensLimit> {
        match &self.undistorted {
            None => Ok(place),
            Some(frame) => self.lens.project(frame.ray(place)),
        }
    }

    /// The raw pixel of a place in this frame, and how it moves as the place moves by `slope`.
    ///
    /// # Errors
    /// The lens does not see it.
    pub fn raw_from_even_with_slope(&self, place: DVec2, slope: DVec2) -> Result<(DVec2, DVec2), LensLimit> {
        let Some(frame) = &self.undistorted else { return Ok((place, slope)) };
        let (pixel, by_ray) = self.lens.project_with_jacobian(frame.ray(place))?;
        let moved = by_ray * Vector3::from((frame.inverse * slope.extend(0.0)).to_array());
        Ok((pixel, DVec2::new(moved.x, moved.y)))
    }

    /// The place in this frame of a raw pixel.
    ///
    /// # Errors
    /// The lens does not see it, or the frame cannot show it.
    pub fn even_from_raw(&self, pixel: DVec2) -> Result<DVec2, LensLimit> {
        match &self.undistorted {
            None => Ok(pixel),
            Some(frame) => frame.from_raw(self.lens, pixel),
        }
    }
}
