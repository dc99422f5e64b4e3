//! Normal equations of the marker fit over a window of pixels.

use glam::DVec2;
use nalgebra::{SMatrix, SVector};

use super::geometry::{EDGE_PX, Geometry, PixelModel, SECTORS, octant_middle};
use super::view::MarkerView;
use crate::track::frame::Plane;

/// Pixels so far from every outline are flat: what is left of them is noise.
const FLAT_PX: f64 = 1.6;
/// Fewest flat pixels that determine a slope.
const MIN_SLOPE_PIXELS: f64 = 16.0;
/// Fewest pixels that determine a disc.
const MIN_PIXELS: f64 = 12.0;
/// The dome's image may end so far from where the constants have its rim, px: what that leaves is not another ground.
const RIM_PX: f64 = 0.3;
/// Fewest pixels of an octant's surroundings that have a mean.
const MIN_AROUND: f64 = 4.0;
/// What differs between the means of eight octants by more than this times their deviation is not the pixels' noise.
const FREE_OF_NOISE: f64 = 6.0;
/// Variance of rounding to whole levels.
const QUANTISATION: f64 = 1.0 / 12.0;

/// Columns of the equations: ground, disc, dome, and the place (x, y).
pub(super) type Unknowns = SVector<f64, 5>;
pub(super) type Normal = SMatrix<f64, 5, 5>;

/// Normal equations over a window, and what is left of its pixels.
pub(super) struct WindowSums {
    pub normal: Normal,
    /// Right side by octants, as [`octant`] numbers them.
    rights: [Unknowns; SECTORS],
    /// Sum of squared residuals, and the number of pixels.
    pub left: f64,
    pub count: f64,
    /// The smallest residual on the disc, and the largest anywhere.
    pub extremes: [f64; 2],
    /// Where no edge is near, on ground, disc and dome: pixels, sum of residuals, sum of squared ones.
    flats: [[f64; 3]; 3],
    /// Around the disc, by octants: pixels, sum of residuals, sum of squared ones.
    around: [[f64; 3]; SECTORS],
    /// Whether the dome's edge runs into the disc's.
    pub touches_rim: bool,
    /// Slope of the residuals on the disc's flat, levels a px.
    pub slope: Option<DVec2>,
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
    around: [[f64; 3]; SECTORS],
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
        self.count += 1.0;
    }

    #[inline(always)]
    fn add_extremes(&mut self, pixel: &PixelModel, rest: f64) {
        let [darkest, brightest] = &mut self.extremes;
        *brightest = brightest.max(rest);
        if pixel.outside_px < 0.0 {
            *darkest = darkest.min(rest);
        }
    }

    #[inline(always)]
    fn add_flat(&mut self, pixel: &PixelModel, from: DVec2, rest: f64, dome: f64) {
        if pixel.outside_px.abs() > FLAT_PX && pixel.from_rim_px.abs() > FLAT_PX + 1.0 {
            let place = if pixel.disc == 1.0 { 1 } else { 2 * usize::from(pixel.dome == 1.0) };
            let [n, sum, square] = &mut self.flats[place];
            *n += 1.0;
            *sum += rest;
            *square += rest * rest;
        }
        if pixel.outside_px > FLAT_PX {
            let allowed = RIM_PX * (pixel.dome_slope * dome).abs();
            let rest = rest - rest.clamp(-allowed, allowed);
            let [n, sum, square] = &mut self.around[pixel.sector % SECTORS];
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
                sums.add_extremes(&pixel, rest);
                sums.add_flat(&pixel, from, rest, known.map_or(0.0, |[_, _, dome]| dome));
            }
        }
        (sums.count > MIN_PIXELS).then(|| Self {
            normal: Normal::from_fn(|i, j| if i < j { sums.normal[j][i] } else { sums.normal[i][j] }),
            rights: sums.rights.map(Unknowns::from),
            left: sums.left,
            count: sums.count,
            extremes: sums.extremes,
            flats: sums.flats,
            around: sums.around,
            touches_rim: geometry.gap_px() < EDGE_PX,
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

    /// By how many levels what is around the disc differs from octant to octant, where that is more than one ground, the dome
    /// and noise explain; else zero.
    pub fn unevenness(&self) -> f64 {
        let (mut darkest, mut brightest) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut variances, mut octants, mut count) = ([0.0; SECTORS], 0, 0.0);
        for [n, sum, square] in self.around.iter().filter(|around| around[0] >= MIN_AROUND) {
            let mean = sum / n;
            (darkest, brightest) = (darkest.min(mean), brightest.max(mean));
            variances[octants] = (square - sum * mean) / (n - 1.0);
            octants += 1;
            count += n;
        }
        // The middle one: a speck scatters the pixels of its own octant.
        let variances = &mut variances[..octants];
        variances.sort_unstable_by(f64::total_cmp);
        let Some(variance) = variances.get(octants / 2) else { return 0.0 };
        let noise = (variance.max(QUANTISATION) * octants as f64 / count).sqrt();
        if brightest - darkest > FREE_OF_NOISE * noise { brightest - darkest } else { 0.0 }
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
