//! Edges of dots in a drawn frame: exact areas against points in each pixel.

use glam::DVec2;

use super::clock::{TimeLimit, time};
use super::sweep::{Law, Sweep, SweepSample};
use domecast_design::layout::Layout;
use domecast_sim::edges::{Coverage, EDGE_GREY, RIM_POINTS, RimFit};

/// Points along a pixel's side.
const POINTS: [u32; 5] = [1, 2, 4, 8, 16];
const QUICK_POINTS: [u32; 3] = [2, 4, 8];
/// Corners of the reference's outlines for each piece of curve.
const FINE: u32 = 512;
/// White, in the codes of a picture.
const WHITE: f64 = 255.0;

/// The shares of the pixels of a box.
struct Raster {
    left: i64,
    top: i64,
    width: usize,
    shares: Vec<f32>,
}

impl Raster {
    /// Around an outline, inside a picture.
    fn around(outline: &[DVec2], (width, height): (usize, usize)) -> Self {
        let (low, high) = outline
            .iter()
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
        let clamp = |v: f64, max: usize| v.clamp(0.0, max as f64) as i64;
        let (left, top) = (clamp(low.x.floor() - 1.0, width), clamp(low.y.floor() - 1.0, height));
        let (right, bottom) = (clamp(high.x.ceil() + 2.0, width), clamp(high.y.ceil() + 2.0, height));
        let width = (right - left) as usize;
        Self { left, top, width, shares: vec![0.0; width * (bottom - top) as usize] }
    }

    /// By the exact areas of a polygon.
    fn fill_by_area(&mut self, coverage: &mut Coverage, polygon: &[DVec2], size: (usize, usize)) {
        self.shares.fill(0.0);
        coverage.fill(polygon);
        for (y, x, part) in coverage.rows(size.0, size.1) {
            let row = y as i64 - self.top;
            for (x, share) in (x as i64 - self.left..).zip(part) {
                if let Some(place) = self.place(x, row) {
                    *place = *share;
                }
            }
        }
    }

    /// By the points of an even raster inside a polygon, `count` along each side of a pixel.
    fn fill_by_points(&mut self, polygon: &[DVec2], count: u32, crossings: &mut Vec<f64>) {
        self.shares.fill(0.0);
        let n = f64::from(count);
        let share = 1.0 / (count * count) as f32;
        let rows = self.shares.len() / self.width.max(1);
        for line in 0..rows as i64 * i64::from(count) {
            let y = self.top as f64 - 0.5 + (line as f64 + 0.5) / n;
            crossings.clear();
            let mut from = polygon.last().copied().unwrap_or_default();
            for &to in polygon {
                if (from.y <= y) != (to.y <= y) {
                    crossings.push(from.x + (y - from.y) / (to.y - from.y) * (to.x - from.x));
                }
                from = to;
            }
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                // Point k of the line lies at left - 0.5 + (k + 0.5) / n.
                let number = |x: f64| ((x - self.left as f64 + 0.5) * n - 0.5).ceil() as i64;
                for k in number(pair[0])..number(pair[1]) {
                    if let Some(place) = self.place(k.div_euclid(count.into()), line / i64::from(count)) {
                        *place += share;
                    }
                }
            }
        }
    }

    fn place(&mut self, x: i64, row: i64) -> Option<&mut f32> {
        let x = usize::try_from(x).ok().filter(|x| *x < self.width)?;
        self.shares.get_mut(usize::try_from(row).ok()? * self.width + x)
    }
}

/// The sweep of points in a pixel; `None` where the pattern has no dots.
pub fn sweep(
    layout: &Layout,
    size: (usize, usize),
    asked_grey: Option<f64>,
    time_limit: TimeLimit,
    quick: bool,
) -> Option<Sweep> {
    let widths = layout.dots.iter().map(|dot| 0.5 * dot.image_outline.widths().1);
    let radius_px = widths.fold(1.0, f64::max);
    let fit = RimFit::new(radius_px, EDGE_GREY / WHITE);
    let fine_corners = FINE as usize * layout.dots.first().map_or(1, |dot| dot.image_outline.pieces().len());
    // A chord's sag, which is what a pixel along it lacks.
    let sag_px = 0.5 * radius_px * (std::f64::consts::PI / fine_corners as f64).powi(2);
    let (mut polygons, mut rasters) = (Vec::new(), Vec::new());
    let mut coverage = Coverage::default();
    for dot in &layout.dots {
        let pieces = dot.image_outline.pieces().len().max(1);
        let rim = dot.image_outline.polygon((RIM_POINTS / pieces).max(1) as u32);
        let Ok(rim) = <[DVec2; RIM_POINTS]>::try_from(rim) else { continue };
        let mut polygon = Vec::new();
        fit.polygon(&rim, &mut polygon);
        let fine = dot.image_outline.polygon(FINE);
        let mut raster = Raster::around(&fine, size);
        raster.fill_by_area(&mut coverage, &fine, size);
        polygons.push(polygon);
        rasters.push(raster);
    }
    if polygons.is_empty() {
        return None;
    }
    let truth: Vec<Vec<f32>> = rasters.iter().map(|raster| raster.shares.clone()).collect();
    let errors = |rasters: &[Raster]| -> Vec<f64> {
        let off = |(raster, truth): (&Raster, &Vec<f32>)| -> Vec<f64> {
            let both = raster.shares.iter().zip(truth);
            // Pixels inside a dot or beside it have no edge to be wrong about.
            both.filter(|(_, truth)| (0.001..0.999).contains(*truth))
                .map(|(a, b)| WHITE * f64::from(a - b).abs())
                .collect()
        };
        rasters.iter().zip(&truth).flat_map(off).collect()
    };
    let items = polygons.len();
    let mut crossings = Vec::new();
    let mut samples = Vec::new();
    for &count in if quick { &QUICK_POINTS[..] } else { &POINTS } {
        let mut draw = || {
            for (raster, polygon) in rasters.iter_mut().zip(&polygons) {
                raster.fill_by_points(polygon, count, &mut crossings);
            }
        };
        let timing = time(time_limit, &mut draw);
        let label = format!("{count} x {count} points");
        samples.push(SweepSample::of(
            ("points", label),
            f64::from(count),
            errors(&rasters).into_iter(),
            (timing, items),
            "",
        ));
    }
    let mut draw = || {
        for (raster, polygon) in rasters.iter_mut().zip(&polygons) {
            raster.fill_by_area(&mut coverage, polygon, size);
        }
    };
    let timing = time(time_limit, &mut draw);
    let corners = polygons.first().map_or(0, Vec::len);
    let label = format!("areas of polygons of {corners} corners");
    samples.push(SweepSample::of(("areas", label), 1.0, errors(&rasters).into_iter(), (timing, items), ""));
    Some(sweep_of(samples, items, fine_corners, sag_px, asked_grey))
}

/// The sweep of its samples; a chord of the reference lacks `sag_px` of a pixel along it.
fn sweep_of(
    samples: Vec<SweepSample>,
    items: usize,
    fine_corners: usize,
    sag_px: f64,
    asked_grey: Option<f64>,
) -> Sweep {
    Sweep {
            name: "supersampling",
            title: "Edges of dots in a drawn frame".into(),
            setting: "points along a pixel's side",
            error: "difference of an edge pixel of a black dot on white",
            unit: "grey levels",
            item: "dot",
            items,
            reference: format!("areas of polygons of {fine_corners} corners on the exact outlines"),
            // Shares are numbers of 24 bits, summed along a row.
            floor: WHITE * (sag_px + 1e-6),
            // Each line of points misses its edge by up to one of them, evenly, and the lines are independent: n^-1 n^-1/2.
            law: Law::Power { exponent: -1.5 },
            observed: None,
            in_use: Some(samples.len() - 1),
            samples,
            asked: asked_grey,
            meets: None,
            conclusion: "The simulator draws areas: what is left is how finely a polygon's corners follow the outline, and points \
                   in a pixel buy nothing."
                .into(),
        }
        .finish()
}
