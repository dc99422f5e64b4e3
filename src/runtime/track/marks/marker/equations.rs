//! Normal equations of the marker fit over a window of pixels.

use glam::{DMat2, DVec2};
use nalgebra::{SMatrix, SVector};

use super::view::{GROUND_PX, MarkerView};
use crate::track::frame::Plane;

/// Half of the width over which an edge goes from one level to the other, px.
const EDGE_PX: f64 = 1.1;
/// Pixels so far from every outline are flat: what is left of them is noise.
const FLAT_PX: f64 = 1.6;
/// Fewest flat pixels that determine a slope.
const MIN_SLOPE_PIXELS: f64 = 16.0;
/// Fewest pixels that determine a disc.
const MIN_PIXELS: f64 = 12.0;
/// Variance of rounding to whole levels.
const QUANTISATION: f64 = 1.0 / 12.0;

/// Columns of the equations: ground, disc, dome, and the place (x, y).
pub(super) type Unknowns = SVector<f64, 5>;
pub(super) type Normal = SMatrix<f64, 5, 5>;

/// Octants around a disc's middle.
const SECTORS: usize = 8;

/// Normal equations over a window, and what is left of its pixels.
pub(super) struct WindowSums {
    pub normal: Normal,
    /// Right side by octants, as [`octant`] numbers them.
    rights: [Unknowns; SECTORS],
    /// Sum of squared residuals, and the number of pixels.
    pub left: f64,
    pub count: f64,
    /// The smallest and the largest residual.
    pub extremes: [f64; 2],
    /// Where no edge is near, on ground, disc and dome: pixels, sum of residuals, sum of squared ones.
    flats: [[f64; 3]; 3],
    /// Slope of the residuals on the disc's flat, levels a px.
    pub slope: Option<DVec2>,
}

/// Where the pixels of a window lie to disc and rim.
struct Geometry {
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
struct PixelModel {
    /// Octant around the disc's middle.
    sector: usize,
    /// Signed distances from the disc's outline and from the dome's rim, px, positive outside.
    outside_px: f64,
    from_rim_px: f64,
    /// Parts of disc and dome in the pixel.
    disc: f64,
    dome: f64,
    /// Gradient of the distance from the disc's middle in the image, mm a px, and its length.
    gradient: DVec2,
    steep: f64,
    /// Change of the disc's part by a pixel outwards.
    disc_slope: f64,
}

impl Geometry {
    fn new(view: &MarkerView) -> Self {
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

    /// The model of a pixel at `from` the disc's middle, px; `None` beyond the ground around.
    #[inline(always)]
    fn pixel(&self, from: DVec2) -> Option<PixelModel> {
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
        let (disc, disc_slope) = edge(outside_px);
        let (mut dome, mut from_rim_px) = (0.0, f64::INFINITY);
        if self.has_rim {
            from_rim_px = ((self.place_mm + u).length() - self.rim_mm) * self.rim_px_by_mm;
            dome = edge(from_rim_px).0;
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
        })
    }
}

/// Sums over the pixels, as plain arrays that stay in registers.
#[derive(Default)]
struct Accumulator {
    normal: [[f64; 5]; 5],
    rights: [[f64; 5]; SECTORS],
    left: f64,
    extremes: [f64; 2],
    count: f64,
    flats: [[f64; 3]; 3],
    /// On the disc's flat, for the slope of the residuals: pixels, sums of x, y, xx, xy, yy, of the residuals, and of
    /// their products with x and y.
    lean: [f64; 9],
}

impl Accumulator {
    #[inline(always)]
    fn add(&mut self, sector: usize, row: &[f64; 5], rest: f64) {
        let right = &mut self.rights[sector % SECTORS];
        for i in 0..5 {
            right[i] += row[i] * rest;
            for j in 0..=i {
                self.normal[i][j] += row[i] * row[j];
            }
        }
        self.left += rest * rest;
        self.extremes = [self.extremes[0].min(rest), self.extremes[1].max(rest)];
        self.count += 1.0;
    }

    #[inline(always)]
    fn add_flat(&mut self, pixel: &PixelModel, from: DVec2, rest: f64) {
        if pixel.outside_px.abs() > FLAT_PX && pixel.from_rim_px.abs() > FLAT_PX + 1.0 {
            let place = if pixel.disc == 1.0 { 1 } else { 2 * usize::from(pixel.dome == 1.0) };
            let [n, sum, square] = &mut self.flats[place];
            *n += 1.0;
            *sum += rest;
            *square += rest * rest;
        }
        if pixel.outside_px < -FLAT_PX {
            let (x, y) = (from.x, from.y);
            let add = [1.0, x, y, x * x, x * y, y * y, rest, x * rest, y * rest];
            self.lean.iter_mut().zip(add).for_each(|(sum, add)| *sum += add);
        }
    }
}

impl WindowSums {
    /// Sums over the window with the disc at `at`: columns ground, disc, dome, and the place where `levels` of the
    /// first three are given; `shading`: how the light falls off. `None` where too few pixels are in the window.
    pub fn over(
        view: &MarkerView,
        plane: &Plane<'_>,
        at: DVec2,
        levels: Option<&SVector<f64, 3>>,
        shading: DVec2,
    ) -> Option<Self> {
        let geometry = Geometry::new(view);
        let mut sums = Accumulator::default();
        let known = levels.map(|levels| [levels[0], levels[1], levels[2]]);
        let (cx, cy) = (at.x.round() as i32, at.y.round() as i32);
        for y in cy - view.half_px..=cy + view.half_px {
            for x in cx - view.half_px..=cx + view.half_px {
                let from = DVec2::new(f64::from(x), f64::from(y)) - at;
                let Some(pixel) = geometry.pixel(from) else { continue };
                let beside = pixel.dome * (1.0 - pixel.disc);
                // The light falls off over disc and what it hides alike.
                let shade = shading.dot(from);
                let mut row = [1.0 + pixel.disc * shade, pixel.disc * (1.0 + shade), beside, 0.0, 0.0];
                let mut rest = f64::from(plane.at(x, y));
                if let Some([ground, disc, dome]) = known {
                    // The outline moves with the place: outside falls by the unit normal.
                    let (step, whole) = (disc - pixel.dome * dome, ground + disc);
                    let by_place = pixel.gradient
                        * (-pixel.disc_slope * (step + whole * shade) / pixel.steep)
                        - shading * (pixel.disc * whole);
                    row[3] = by_place.x;
                    row[4] = by_place.y;
                    rest -= ground * row[0] + disc * row[1] + dome * beside;
                }
                sums.add(pixel.sector, &row, rest);
                sums.add_flat(&pixel, from, rest);
            }
        }
        (sums.count > MIN_PIXELS).then(|| Self {
            normal: Normal::from_fn(|i, j| if i < j { sums.normal[j][i] } else { sums.normal[i][j] }),
            rights: sums.rights.map(Unknowns::from),
            left: sums.left,
            count: sums.count,
            extremes: sums.extremes,
            flats: sums.flats,
            slope: slope_of(&sums.lean),
        })
    }

    /// Standard deviation of a pixel, levels.
    pub fn noise(&self) -> f64 {
        // About each flat's own mean: edges that are not quite like the model's shift the levels of the fit.
        let (mut left, mut freedom) = (0.0, 0.0);
        for [n, sum, square] in self.flats.iter().filter(|flat| flat[0] >= 4.0) {
            left += (square - sum * sum / n).max(0.0);
            freedom += n - 1.0;
        }
        if freedom < 9.0 {
            (left, freedom) = (self.left, self.count - 5.0);
        }
        (left / freedom.max(1.0)).max(QUANTISATION).sqrt()
    }

    /// Root mean square of the residuals, levels.
    pub fn rms(&self) -> f64 {
        (self.left / (self.count - 5.0).max(1.0)).max(QUANTISATION).sqrt()
    }

    fn right(&self) -> Unknowns {
        self.rights.iter().sum()
    }

    /// Variance of the place, px2 on each axis, by how far the octants of the outline pull it each its own way: the sum of
    /// squares of what each octant alone would add to the step (the covariance of clustered residuals of Liang and Zeger,
    /// Biometrika 73, 1986). What pulls all octants outwards alike is a marker of another size and does not count; an edge
    /// that is softer than the model's pulls none.
    pub fn variance_between_octants(&self, view: &MarkerView, inverse: &Normal) -> f64 {
        let px_by_mm = view.mm_by_px.inverse();
        let mut pulls = [(DVec2::ZERO, DVec2::ZERO); SECTORS];
        let (mut outwards, mut square) = (0.0, 0.0);
        for (sector, (pull, way)) in pulls.iter_mut().enumerate() {
            let step = inverse * self.rights[sector];
            (*pull, *way) = (DVec2::new(step[3], step[4]), px_by_mm * octant_middle(sector));
            outwards += pull.dot(*way);
            square += way.length_squared();
        }
        let outwards = outwards / square;
        0.5 * pulls.iter().map(|(pull, way)| (pull - outwards * way).length_squared()).sum::<f64>()
    }

    /// The three levels alone.
    pub fn solve_levels(&self) -> Option<SVector<f64, 3>> {
        let matrix = self.floored().fixed_view::<3, 3>(0, 0).into_owned();
        Some(matrix.cholesky()?.solve(&self.right().fixed_rows::<3>(0).into_owned()))
    }

    /// A Gauss-Newton step of levels and place.
    pub fn solve_all(&self) -> Option<Unknowns> {
        let step = self.floored().cholesky()?.solve(&self.right());
        step.iter().all(|v| v.is_finite()).then_some(step)
    }

    /// Inverse of the normal matrix.
    pub fn inverse(&self) -> Option<Normal> {
        Some(self.floored().cholesky()?.inverse())
    }

    /// A rim that hardly enters the window has no level of its own.
    fn floored(&self) -> Normal {
        let mut floored = self.normal;
        floored[(2, 2)] += 0.5;
        for i in 3..5 {
            floored[(i, i)] += 1e-6;
        }
        floored
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
fn octant_middle(octant: usize) -> DVec2 {
    let (sin, cos) = std::f64::consts::FRAC_PI_8.sin_cos();
    let first = if octant & 1 == 0 { DVec2::new(cos, sin) } else { DVec2::new(sin, cos) };
    let side = |bit: usize| if octant & bit == 0 { 1.0 } else { -1.0 };
    first * DVec2::new(side(4), side(2))
}

/// The slope of a plane through residuals, from their number, sums of x, y, xx, xy, yy, theirs, and of xr, yr.
fn slope_of([n, x, y, xx, xy, yy, rest, xr, yr]: &[f64; 9]) -> Option<DVec2> {
    if *n < MIN_SLOPE_PIXELS {
        return None;
    }
    let [cxx, cxy, cyy] = [xx - x * x / n, xy - x * y / n, yy - y * y / n];
    let [cxr, cyr] = [xr - x * rest / n, yr - y * rest / n];
    let det = cxx * cyy - cxy * cxy;
    (det > 1e-3 * cxx * cyy).then(|| DVec2::new(cxr * cyy - cyr * cxy, cyr * cxx - cxr * cxy) / det)
}

/// From 1 inside to 0 outside of an outline, and the slope, over the distance from it, px.
fn edge(outside_px: f64) -> (f64, f64) {
    let t = (0.5 - outside_px / (2.0 * EDGE_PX)).clamp(0.0, 1.0);
    (t * t * (3.0 - 2.0 * t), -6.0 * t * (1.0 - t) / (2.0 * EDGE_PX))
}
