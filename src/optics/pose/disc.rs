//! The image of a painted disc: its centre, and the centroid that image processing finds.

use glam::{DVec2, DVec3};
use nalgebra::Matrix2x6;

use crate::refraction::{RayLimit, SensorOptics};

/// A white disc on the sheet's top face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Marker {
    /// Its number, unique among the markers of a sensor.
    pub id: u32,
    /// Centre, sensor frame, mm.
    pub position_mm: DVec3,
    /// Diameter, mm; 0 for a point.
    pub diameter_mm: f64,
}

/// What the camera sees of a disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscImage {
    /// Image of the disc's centre, raw px.
    pub center_px: DVec2,
    /// Centroid of the disc's image, raw px.
    pub centroid_px: DVec2,
    /// Least and largest distance of the outline from the centroid, px: half the image's diameters.
    pub half_axes_px: [f64; 2],
}

/// Points of the outline that carry the centroid.
pub(super) const OUTLINE: usize = 8;

/// cos and sin of the outline's azimuths.
pub(super) const DIRECTIONS: [[f64; 2]; OUTLINE] = {
    const H: f64 = std::f64::consts::FRAC_1_SQRT_2;
    [[1.0, 0.0], [H, H], [0.0, 1.0], [-H, H], [-1.0, 0.0], [-H, -H], [0.0, -1.0], [H, -H]]
};

impl Marker {
    /// The outline in the image, raw px, every 45 degrees from +x; the disc lies parallel to the sheet.
    ///
    /// # Errors
    /// The limit of the first outline point that the camera cannot see.
    pub fn outline_px(&self, optics: &SensorOptics) -> Result<[DVec2; OUTLINE], RayLimit> {
        let radius = 0.5 * self.diameter_mm;
        let mut outline = [DVec2::ZERO; OUTLINE];
        for (point, [cos, sin]) in outline.iter_mut().zip(DIRECTIONS) {
            *point = optics.project(self.position_mm + DVec3::new(radius * cos, radius * sin, 0.0))?;
        }
        Ok(outline)
    }

    /// Centre, centroid and size of the image at the pose that the optics are placed at.
    ///
    /// # Errors
    /// The limit that the disc's centre or a point of its outline is past.
    pub fn image(&self, optics: &SensorOptics) -> Result<DiscImage, RayLimit> {
        let center_px = optics.project(self.position_mm)?;
        let outline = self.outline_px(optics)?;
        let centroid_px = center_px + centroid_offset(center_px, &outline);
        let distance = |p: &DVec2| (*p - centroid_px).length();
        let near = outline.iter().map(distance).fold(f64::INFINITY, f64::min);
        let far = outline.iter().map(distance).fold(0.0, f64::max);
        Ok(DiscImage { center_px, centroid_px, half_axes_px: [near, far] })
    }

    /// How far the centroid of the image lies from the centre's image, px: the side of the disc that is nearer,
    /// and less foreshortened by layers and lens, weighs more.
    ///
    /// # Errors
    /// As [`Marker::image`].
    pub fn centroid_offset_px(&self, optics: &SensorOptics, center_px: DVec2) -> Result<DVec2, RayLimit> {
        if self.diameter_mm == 0.0 {
            return Ok(DVec2::ZERO);
        }
        Ok(centroid_offset(center_px, &self.outline_px(optics)?))
    }

    /// Centroid of the image and how it moves with the platform (px per mm and per rad about the rest frame's
    /// origin). The motion is that of the centre: the offset's own is a hundredth of it.
    ///
    /// # Errors
    /// As [`Marker::image`].
    pub fn centroid_with_motion(&self, optics: &SensorOptics) -> Result<(DVec2, Matrix2x6<f64>), RayLimit> {
        let motion = optics.project_with_motion(self.position_mm)?;
        let offset = self.centroid_offset_px(optics, motion.pixel)?;
        Ok((motion.pixel + offset, motion.by_pose))
    }
}

/// Centroid of the image of any smooth small outline, less the image of its centre: `see(cos, sin)` gives the pixel
/// of the outline's point at that azimuth. `None` where a point is not seen.
pub fn outline_centroid_offset(
    center_px: DVec2,
    mut see: impl FnMut(f64, f64) -> Option<DVec2>,
) -> Option<DVec2> {
    let mut outline = [DVec2::ZERO; OUTLINE];
    for (point, [cos, sin]) in outline.iter_mut().zip(DIRECTIONS) {
        *point = see(cos, sin)?;
    }
    Some(centroid_offset(center_px, &outline))
}

/// Area centroid of the region inside a smooth closed outline, from `center`.
///
/// Green's theorem with x(phi) a trigonometric polynomial through the eight points: its derivative at the points
/// is exact, and so is the sum over them up to the outline's third harmonic, which has the size of the disc's
/// radius over its distance to the third power.
pub(super) fn centroid_offset(center: DVec2, outline: &[DVec2; OUTLINE]) -> DVec2 {
    // Derivative of the interpolant at a point: sum over odd and even steps k of (-1)^(k+1)/2 cot(k pi / 8) x_k.
    const COT: [f64; 3] = [2.414_213_562_373_095, 1.0, 0.414_213_562_373_095_1];
    let at = |i: usize| outline[i % OUTLINE] - center;
    let mut area = 0.0;
    let mut moment = DVec2::ZERO;
    for i in 0..OUTLINE {
        let x = at(i);
        let pair = |k: usize| at(i + k) - at(i + OUTLINE - k);
        let slope = 0.5 * (pair(1) * COT[0] - pair(2) * COT[1] + pair(3) * COT[2]);
        // Twice the area and three times the moment, swept from the centre.
        let swept = x.perp_dot(slope);
        area += swept;
        moment += x * swept;
    }
    if area.abs() > 0.0 { moment * (2.0 / (3.0 * area)) } else { DVec2::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    // A projective image of a circle is an ellipse whose centre is known in closed form; its area centroid is that.
    #[test]
    fn centroid_of_a_projected_circle_is_the_ellipse_centre() {
        // x = (u, v) / (1 + w u): circle of radius r about the origin.
        let (r, w) = (0.05, 0.8);
        let center = DVec2::ZERO;
        let image = |u: f64, v: f64| DVec2::new(u, v) / (1.0 + w * u);
        let outline = DIRECTIONS.map(|[c, s]| image(r * c, r * s));
        // Ends of the axis on v = 0: r/(1 + w r), -r/(1 - w r); the centre is their mean.
        let exact = 0.5 * (r / (1.0 + w * r) - r / (1.0 - w * r));
        let found = centroid_offset(center, &outline);
        assert!((found.x - exact).abs() < 1e-6 * exact.abs() && found.y.abs() < 1e-16, "{} {exact}", found.x);
    }

    #[test]
    fn an_affine_image_has_no_offset() {
        let outline = DIRECTIONS.map(|[c, s]| DVec2::new(3.0 + c - 0.2 * s, -1.0 + 0.4 * c + 0.5 * s));
        assert!(centroid_offset(DVec2::new(3.0, -1.0), &outline).length() < 1e-15);
    }
}
