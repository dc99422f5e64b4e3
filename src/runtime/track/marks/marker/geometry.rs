//! Where the pixels of a marker's window lie to disc and rim.

use glam::{DMat2, DVec2};

use super::view::{GROUND_PX, MarkerView};

/// Half of the width over which an edge goes from one level to the other, px.
pub(super) const EDGE_PX: f64 = 1.1;
/// Octants around a disc's middle.
pub(super) const SECTORS: usize = 8;

/// Where the pixels of a window lie to disc and rim.
pub(super) struct Geometry {
    mm_by_px: DMat2,
    transposed: DMat2,
    place_mm: DVec2,
    radius_mm: f64,
    rim_mm: f64,
    /// Beyond this from the middle nothing is looked at, mm.
    far_mm: f64,
    /// Whether the rim enters the window at all, and pixels to a millimetre across it.
    has_rim: bool,
    rim_px_by_mm: f64,
}

/// What the model of a marker says of one pixel.
pub(super) struct PixelModel {
    /// Octant around the disc's middle.
    pub sector: usize,
    /// Signed distances from the disc's outline and from the dome's rim, px, positive outside.
    pub outside_px: f64,
    pub from_rim_px: f64,
    /// Parts of disc and dome in the pixel.
    pub disc: f64,
    pub dome: f64,
    /// Gradient of the distance from the disc's middle in the image, mm a px, and its length.
    pub gradient: DVec2,
    pub steep: f64,
    /// Change of the disc's part by a pixel outwards, and of the dome's.
    pub disc_slope: f64,
    pub dome_slope: f64,
}

impl Geometry {
    pub fn new(view: &MarkerView) -> Self {
        let transposed = view.mm_by_px.transpose();
        // A pixel is at most this many mm wide.
        let px_mm = view.mm_by_px.x_axis.length() + view.mm_by_px.y_axis.length();
        let far_mm = view.radius_mm + GROUND_PX * px_mm;
        let from_axis = view.place_mm.length().max(1e-9);
        Self {
            mm_by_px: view.mm_by_px,
            transposed,
            place_mm: view.place_mm,
            radius_mm: view.radius_mm,
            rim_mm: view.rim_mm,
            far_mm,
            has_rim: from_axis - far_mm < view.rim_mm + far_mm,
            // Over the window the rim's direction hardly changes.
            rim_px_by_mm: 1.0 / (transposed * (view.place_mm / from_axis)).length().max(1e-9),
        }
    }

    /// From the disc's outline to the dome's rim, px.
    pub fn gap_px(&self) -> f64 {
        (self.place_mm.length() - self.radius_mm - self.rim_mm) * self.rim_px_by_mm
    }

    /// The model of a pixel at `from` the disc's middle, px; `None` beyond the ground around.
    #[inline(always)]
    pub fn pixel(&self, from: DVec2) -> Option<PixelModel> {
        let u = self.mm_by_px * from;
        let square = u.length_squared();
        if square > self.far_mm * self.far_mm {
            return None;
        }
        let distance = square.sqrt().max(1e-9);
        let gradient = self.transposed * (u / distance);
        let steep = gradient.length().max(1e-9);
        let outside_px = (distance - self.radius_mm) / steep;
        if outside_px > GROUND_PX {
            return None;
        }
        let (disc, disc_slope) = edge(outside_px, EDGE_PX);
        let ((mut dome, mut dome_slope), mut from_rim_px) = ((0.0, 0.0), f64::INFINITY);
        if self.has_rim {
            from_rim_px = ((self.place_mm + u).length() - self.rim_mm) * self.rim_px_by_mm;
            (dome, dome_slope) = edge(from_rim_px, EDGE_PX);
        }
        Some(PixelModel {
            sector: octant(u),
            outside_px,
            from_rim_px,
            disc,
            dome,
            gradient,
            steep,
            disc_slope,
            dome_slope,
        })
    }
}

/// The octant of a place around the middle: bits for the sides of both axes, and for which axis is nearer.
#[inline(always)]
fn octant(place: DVec2) -> usize {
    4 * usize::from(place.x < 0.0)
        + 2 * usize::from(place.y < 0.0)
        + usize::from(place.x.abs() < place.y.abs())
}

/// The direction of an octant's middle, of length one.
pub(super) fn octant_middle(octant: usize) -> DVec2 {
    let (sin, cos) = std::f64::consts::FRAC_PI_8.sin_cos();
    let first = if octant & 1 == 0 { DVec2::new(cos, sin) } else { DVec2::new(sin, cos) };
    let side = |bit: usize| if octant & bit == 0 { 1.0 } else { -1.0 };
    first * DVec2::new(side(4), side(2))
}

/// From 1 inside to 0 outside of an outline, and the slope, over the distance from it, px; `half_px`: half of the edge's width.
#[inline(always)]
pub(super) fn edge(outside_px: f64, half_px: f64) -> (f64, f64) {
    let t = (0.5 - outside_px / (2.0 * half_px)).clamp(0.0, 1.0);
    (t * t * (3.0 - 2.0 * t), -6.0 * t * (1.0 - t) / (2.0 * half_px))
}
