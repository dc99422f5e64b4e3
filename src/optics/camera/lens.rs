//! One lens: the model's formula between the camera matrix and the ray.

use glam::{DVec2, DVec3};
use nalgebra::{Matrix2x3, Matrix3x2};

use super::brown_conrady::BrownConrady;
use super::kannala_brandt::KannalaBrandt;
use super::lanes::Lanes;
use super::limit::Domain;
use super::pinhole::Pinhole;
use super::pupil::PupilPolynomial;
use super::thin_prism::{self, ThinPrism};
use super::{LensError, LensLimit, LensModel, LensSpec};
use crate::numeric::LengthMismatch;
use crate::numeric::batch::{fill, fill_runs};

/// A lens with its domain.
///
/// Directions are in the camera frame (x right, y down, z forward), pixels
/// count from the centre of the top-left one. Whether a pixel lies in the
/// image is not checked: a lens sees what its domain holds.
#[derive(Debug, Clone)]
pub struct Lens {
    spec: LensSpec,
    formula: Formula,
    pupil: PupilPolynomial,
    /// Reciprocals of the focal lengths: a product costs a quarter of a quotient.
    per_focal: DVec2,
}

/// Pixels that are computed side by side.
pub(crate) const LANES: usize = 16;

/// The direction that a pixel sees, and how it was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolvedRay {
    /// Unit direction, camera frame.
    pub ray: DVec3,
    /// Evaluations of the formula that it took.
    pub iterations: u32,
    /// Distance from the pixel to the projection of the ray, px.
    pub residual_px: f64,
}

#[derive(Debug, Clone)]
enum Formula {
    Pinhole(Pinhole),
    BrownConrady(BrownConrady),
    ThinPrism(ThinPrism),
    KannalaBrandt(KannalaBrandt),
}

macro_rules! each {
    ($formula:expr, $model:ident => $call:expr) => {
        match $formula {
            Formula::Pinhole($model) => $call,
            Formula::BrownConrady($model) => $call,
            Formula::ThinPrism($model) => $call,
            Formula::KannalaBrandt($model) => $call,
        }
    };
}

impl Lens {
    /// Checks the numbers and finds the domain, once.
    ///
    /// # Errors
    /// The first field that cannot be used.
    pub fn new(spec: LensSpec) -> Result<Self, LensError> {
        spec.check()?;
        let view = spec.field_of_view_rad;
        let formula = match (spec.model, spec.distortion.as_slice()) {
            (LensModel::KannalaBrandt, &[k1, k2, k3, k4]) => {
                KannalaBrandt::new([k1, k2, k3, k4], view).map(Formula::KannalaBrandt)
            }
            (LensModel::BrownConrady, distortion)
                if distortion.iter().skip(8).any(|coefficient| *coefficient != 0.0) =>
            {
                ThinPrism::new(distortion, view).map(Formula::ThinPrism)
            }
            (LensModel::BrownConrady, distortion) => {
                BrownConrady::new(distortion, view).map(Formula::BrownConrady)
            }
            _ => Some(Formula::Pinhole(Pinhole::new(view))),
        }
        .ok_or_else(LensSpec::no_domain)?;
        let end_rad = each!(&formula, model => model.domain().end_rad);
        let pupil = PupilPolynomial::new(&spec.pupil_shift_mm, end_rad);
        let per_focal = DVec2::new(1.0 / spec.matrix[0][0], 1.0 / spec.matrix[1][1]);
        Ok(Self { spec, formula, pupil, per_focal })
    }

    /// What the lens was made from.
    pub fn spec(&self) -> &LensSpec {
        &self.spec
    }

    fn domain(&self) -> &Domain {
        each!(&self.formula, model => model.domain())
    }

    /// The largest field angle that has a pixel, in radians: half the field of
    /// view, or the fold if that comes first. The domain is the cone of all
    /// rays up to and including this angle.
    pub fn max_field_angle_rad(&self) -> f64 {
        self.domain().end_rad
    }

    /// The field angle in radians at which the model folds (or, for a rational
    /// model, meets its pole), whether or not the field of view reaches it.
    ///
    /// With tangential terms the fold is nearer in one azimuth than in others;
    /// this is the nearest. With prism terms or a tilted sensor it may be nearer than the real one: up to
    /// it, no two rays share a pixel for certain.
    pub fn fold_angle_rad(&self) -> Option<f64> {
        self.domain().fold_rad
    }

    /// What lies past [`Lens::max_field_angle_rad`].
    pub fn end_limit(&self) -> LensLimit {
        self.domain().limit
    }

    /// No pixel farther than this from the principal point sees anything, in
    /// pixels. Exact for square pixels without prism terms and tilt, an upper bound otherwise.
    pub fn max_radius_px(&self) -> f64 {
        let [[fx, _, _], [_, fy, _], _] = self.spec.matrix;
        each!(&self.formula, model => model.max_radius()) * fx.max(fy)
    }

    fn pixel_of(&self, image: DVec2) -> DVec2 {
        let [[fx, _, cx], [_, fy, cy], _] = self.spec.matrix;
        DVec2::new(image.x * fx + cx, image.y * fy + cy)
    }

    fn image_of(&self, pixel: DVec2) -> DVec2 {
        let [[_, _, cx], [_, _, cy], _] = self.spec.matrix;
        DVec2::new((pixel.x - cx) * self.per_focal.x, (pixel.y - cy) * self.per_focal.y)
    }

    /// The pixel that sees a ray of this direction (any length).
    ///
    /// # Errors
    /// The limit that the ray is past.
    pub fn project(&self, ray: DVec3) -> Result<DVec2, LensLimit> {
        let ray = usable(ray)?;
        let image = each!(&self.formula, model => model.project(ray))?;
        Ok(self.pixel_of(image))
    }

    /// The unit direction that a pixel sees.
    ///
    /// # Errors
    /// The limit that the pixel is past.
    pub fn unproject(&self, pixel: DVec2) -> Result<DVec3, LensLimit> {
        if !pixel.is_finite() {
            return Err(LensLimit::NotFinite);
        }
        each!(&self.formula, model => model.unproject(self.image_of(pixel), self.slack(pixel)))
    }

    /// How far rounding of the pixel, and of its distance from the principal
    /// point, may have moved an image point.
    #[inline]
    fn slack(&self, pixel: DVec2) -> f64 {
        let [[_, _, cx], [_, _, cy], _] = self.spec.matrix;
        let size = pixel.abs().max(DVec2::new(cx.abs(), cy.abs())) * self.per_focal;
        2.0 * f64::EPSILON * (size.x + size.y)
    }

    /// No [`Lens::unproject`] evaluates the formula of its model more often.
    pub const MAX_UNPROJECT_ITERATIONS: u32 = thin_prism::MAX_STEPS;

    /// [`Lens::unproject`] and how it was found. A pinhole needs no iterations.
    ///
    /// # Errors
    /// As [`Lens::unproject`].
    pub fn unproject_solved(&self, pixel: DVec2) -> Result<SolvedRay, LensLimit> {
        let ray = self.unproject(pixel)?;
        let (image, slack) = (self.image_of(pixel), self.slack(pixel));
        let iterations = match &self.formula {
            Formula::Pinhole(_) => 0,
            Formula::BrownConrady(model) => model.plane_of(image, slack)?.1,
            Formula::ThinPrism(model) => model.plane_of(image, slack)?.1,
            Formula::KannalaBrandt(model) => model.angle_of(image, slack)?.1,
        };
        Ok(SolvedRay { ray, iterations, residual_px: (self.project(ray)? - pixel).length() })
    }

    /// [`Lens::project`] and the derivative of the pixel by the ray's three
    /// components, at the ray's own length.
    ///
    /// # Errors
    /// As [`Lens::project`].
    pub fn project_with_jacobian(&self, ray: DVec3) -> Result<(DVec2, Matrix2x3<f64>), LensLimit> {
        let ray = usable(ray)?;
        let [[fx, ..], [_, fy, _], _] = self.spec.matrix;
        let (image, mut jacobian) = each!(&self.formula, model => model.project_with_jacobian(ray))?;
        jacobian.row_mut(0).scale_mut(fx);
        jacobian.row_mut(1).scale_mut(fy);
        Ok((self.pixel_of(image), jacobian))
    }

    /// [`Lens::unproject`] and the derivative of the unit direction by the
    /// pixel.
    ///
    /// # Errors
    /// As [`Lens::unproject`].
    pub fn unproject_with_jacobian(&self, pixel: DVec2) -> Result<(DVec3, Matrix3x2<f64>), LensLimit> {
        if !pixel.is_finite() {
            return Err(LensLimit::NotFinite);
        }
        let [[fx, ..], [_, fy, _], _] = self.spec.matrix;
        let image = self.image_of(pixel);
        let (ray, mut jacobian) = {
            let slack = self.slack(pixel);
            each!(&self.formula, model => model.unproject_with_jacobian(image, slack))?
        };
        jacobian.column_mut(0).scale_mut(1.0 / fx);
        jacobian.column_mut(1).scale_mut(1.0 / fy);
        Ok((ray, jacobian))
    }

    /// [`Lens::unproject`] for each pixel, written to the place of the same
    /// number; see [`crate::numeric::batch::fill`].
    ///
    /// # Errors
    /// Slices of different length. The limits stand in the outputs.
    pub fn unproject_all(
        &self,
        pixels: &[DVec2],
        rays: &mut [Result<DVec3, LensLimit>],
    ) -> Result<(), LengthMismatch> {
        fill_runs(pixels, rays, |pixels, rays| self.unproject_run(pixels, rays))
    }

    /// [`Lens::unproject`] for each pixel on this thread; slices of one length.
    /// The same bits as one by one.
    pub(crate) fn unproject_run(&self, pixels: &[DVec2], rays: &mut [Result<DVec3, LensLimit>]) {
        let (pixels, left) = pixels.as_chunks::<LANES>();
        let (rays, left_rays) = rays.as_chunks_mut::<LANES>();
        each!(&self.formula, model => {
            for (pixels, rays) in pixels.iter().zip(rays) {
                let mut images = Lanes { x: [0.0; LANES], y: [0.0; LANES] };
                for (l, &pixel) in pixels.iter().enumerate() {
                    let image = self.image_of(pixel);
                    images.x[l] = image.x;
                    images.y[l] = image.y;
                }
                let (found, converged) = model.unproject_lanes(&images);
                for l in 0..LANES {
                    rays[l] = if converged[l] { Ok(found[l]) } else { self.unproject(pixels[l]) };
                }
            }
        });
        for (ray, &pixel) in left_rays.iter_mut().zip(left) {
            *ray = self.unproject(pixel);
        }
    }

    /// [`Lens::project`] for each ray.
    ///
    /// # Errors
    /// Slices of different length. The limits stand in the outputs.
    pub fn project_all(
        &self,
        rays: &[DVec3],
        pixels: &mut [Result<DVec2, LensLimit>],
    ) -> Result<(), LengthMismatch> {
        fill(rays, pixels, |&ray| self.project(ray))
    }

    /// Angle of a direction to the camera's axis, in radians.
    pub fn field_angle_rad(ray: DVec3) -> f64 {
        ray.x.hypot(ray.y).atan2(ray.z)
    }

    /// [`Lens::field_angle_rad`] of a unit vector, which cannot overflow.
    #[inline]
    pub(crate) fn field_angle_of_unit_rad(ray: DVec3) -> f64 {
        (ray.x * ray.x + ray.y * ray.y).sqrt().atan2(ray.z)
    }

    /// Where on the axis the rays of this field angle cross it, in millimetres
    /// in front of the camera's origin, and the derivative by the angle. Past
    /// the domain's end the value stays what it is there.
    pub fn pupil_shift_mm(&self, field_angle_rad: f64) -> (f64, f64) {
        self.pupil.at(field_angle_rad)
    }

    /// An interval, in millimetres, that holds the pupil for every ray.
    pub fn pupil_range_mm(&self) -> (f64, f64) {
        self.pupil.range_mm()
    }

    /// Whether all rays cross one point, the camera's origin.
    pub fn is_central(&self) -> bool {
        self.pupil.is_central()
    }
}

/// A direction that can be worked with: finite, and neither so long nor so
/// short that its square leaves the range of the numbers.
fn usable(ray: DVec3) -> Result<DVec3, LensLimit> {
    if !ray.is_finite() {
        return Err(LensLimit::NotFinite);
    }
    let size = ray.abs().max_element();
    if (1e-100..=1e100).contains(&size) {
        Ok(ray)
    } else if size == 0.0 {
        Err(LensLimit::NotFinite)
    } else {
        // Twice, since the reciprocal of a subnormal overflows.
        let ray = ray * if size < 1.0 { 1e200 } else { 1e-200 };
        Ok(ray / ray.abs().max_element())
    }
}
