//! What of the sensor lies where in the picture: the lens's field, the dome's rim.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::lit::LARGEST;
use domecast_optics::SensorOptics;
use domecast_optics::camera::Lens;

/// Points at which the dome's rim is projected; a circle of 200 px is then met within 0.06 px, and its
/// polygon is refined by [`RIM_BETWEEN`].
const RIM_AZIMUTHS: usize = 64;

/// Corners between two of them, on a cubic through the neighbours.
const RIM_BETWEEN: usize = 6;

/// The columns of each row that the lens shows, outside of which there is no light; and what its pixels see, which no
/// motion changes.
#[derive(Debug, Clone)]
pub struct LensField {
    rows: Vec<Range<usize>>,
    rays: LensRays,
}

impl LensField {
    /// From the lens; the field is taken to be one piece in each row.
    pub fn new(lens: &Lens, width: usize, height: usize) -> Self {
        let sees = |x: usize, y: usize| lens.unproject(DVec2::new(x as f64, y as f64)).is_ok();
        let [[_, _, cx], _, _] = lens.spec().matrix;
        let middle = (cx.round().max(0.0) as usize).min(width.saturating_sub(1));
        let row = |y: usize| {
            if !sees(middle, y) {
                return 0..0;
            }
            // Nearest to the edge that is still seen, on each side.
            let edge = |mut inside: usize, mut outside: usize| {
                if sees(outside, y) {
                    return outside;
                }
                while inside.abs_diff(outside) > 1 {
                    let half = inside.midpoint(outside);
                    if sees(half, y) { inside = half } else { outside = half }
                }
                inside
            };
            edge(middle, 0)..edge(middle, width - 1) + 1
        };
        Self { rows: (0..height).map(row).collect(), rays: LensRays::new(lens, width, height) }
    }

    /// What the pixels see.
    pub fn rays(&self) -> &LensRays {
        &self.rays
    }

    /// The columns of a row.
    pub fn row(&self, y: usize) -> Range<usize> {
        self.rows.get(y).cloned().unwrap_or(0..0)
    }
}

/// Distance of the nodes of [`LensRays`], px.
const RAY_STEP: usize = 8;
/// Nodes before the picture's first row and column.
const RAYS_BEFORE: usize = 1;
/// Directions are known between the nodes where the middle of four is right within this, rad: thousandths of a pixel.
const RAY_CLOSE_RAD: f64 = 1e-6;
/// Rays that leave the camera's axis by more than this cosine are not looked up.
const LEAST_COSINE: f64 = 0.05;

/// Directions that pixels see, from few of them: cubics through nodes each 8 px, where they are as good as the lens's
/// own formula; else each pixel's own.
#[derive(Debug, Clone)]
pub struct LensRays {
    across: usize,
    /// Components of the unit direction along the picture's axes; NaN where there is none.
    nodes: Vec<DVec2>,
    /// Of each cell, how its directions are known.
    cells: Vec<Cell>,
    /// Every pixel's direction, of cells that ask for it; NaN where there is none.
    own: Vec<DVec2>,
}

/// How the directions of a cell are known.
#[derive(Debug, Clone, Copy)]
enum Cell {
    /// By the cubics through the nodes about it.
    Good,
    /// Pixel by pixel, from this place on.
    Own(usize),
    /// Not at all.
    Dark,
}

/// Weights of four nodes at each pixel between the middle two: Lagrange's cubic.
const RAY_WEIGHTS: [[f64; 4]; RAY_STEP] = {
    let mut weights = [[0.0; 4]; RAY_STEP];
    let mut i = 0;
    while i < RAY_STEP {
        weights[i] = lagrange(i as f64 / RAY_STEP as f64);
        i += 1;
    }
    weights
};

/// Lagrange's weights of values at -1, 0, 1 and 2.
pub(super) const fn lagrange(t: f64) -> [f64; 4] {
    let (p, q, r) = (t + 1.0, t - 1.0, t - 2.0);
    [-t * q * r / 6.0, p * q * r / 2.0, -p * t * r / 2.0, p * t * q / 6.0]
}

impl LensRays {
    fn new(lens: &Lens, width: usize, height: usize) -> Self {
        // Pictures are laid out in squares of some cells, which may pass their end.
        let count = |n: usize| n.div_ceil(LARGEST) * (LARGEST / RAY_STEP) + 1 + RAYS_BEFORE + 2;
        let (across, down) = (count(width), count(height));
        let ray = |x: f64, y: f64| {
            let ray = lens.unproject(DVec2::new(x, y)).ok().filter(|ray| ray.z > LEAST_COSINE);
            ray.map_or(DVec2::NAN, |ray| ray.truncate())
        };
        let place = |i: usize| i as f64 * RAY_STEP as f64 - (RAYS_BEFORE * RAY_STEP) as f64;
        let nodes = (0..across * down).map(|i| ray(place(i % across), place(i / across))).collect();
        let mut rays = Self { across, nodes, cells: Vec::new(), own: Vec::new() };
        let middle = lagrange(0.5);
        let good = |i: usize| {
            let half = 0.5 * RAY_STEP as f64;
            if i % across < RAYS_BEFORE || i % across + 2 >= across {
                return false;
            }
            let exact = ray(place(i % across) + half, place(i / across) + half);
            // NaN is no match either.
            rays.mix(i, &middle, &middle).is_some_and(|found| (found - exact).length() < RAY_CLOSE_RAD)
        };
        let good: Vec<bool> = (0..across * down).map(good).collect();
        // Along the end of the field the lens's own formula, whose root takes long, is asked once and for all.
        for (i, good) in good.into_iter().enumerate() {
            let corner = [i % across, i / across].map(place);
            let pixels = (0..RAY_STEP * RAY_STEP)
                .map(|k| ray(corner[0] + (k % RAY_STEP) as f64, corner[1] + (k / RAY_STEP) as f64));
            let first = rays.own.len();
            rays.cells.push(if good {
                Cell::Good
            } else if corner.iter().any(|at| *at < 0.0) {
                Cell::Dark
            } else {
                rays.own.extend(pixels);
                if rays.own.iter().skip(first).all(|ray| ray.is_nan()) {
                    rays.own.truncate(first);
                    Cell::Dark
                } else {
                    Cell::Own(first)
                }
            });
        }
        rays
    }

    /// The unit direction that a pixel sees, camera frame; `None` where only the lens itself knows it.
    #[inline]
    pub fn at(&self, x: usize, y: usize) -> Option<DVec3> {
        let cell = (y / RAY_STEP + RAYS_BEFORE) * self.across + x / RAY_STEP + RAYS_BEFORE;
        if x / RAY_STEP + RAYS_BEFORE >= self.across {
            return None;
        }
        let (column, row) = (x % RAY_STEP, y % RAY_STEP);
        let flat = match *self.cells.get(cell)? {
            Cell::Good if column + row == 0 => *self.nodes.get(cell)?,
            Cell::Good => self.mix(cell, &RAY_WEIGHTS[column], &RAY_WEIGHTS[row])?,
            Cell::Own(first) => *self.own.get(first + row * RAY_STEP + column).filter(|ray| !ray.is_nan())?,
            Cell::Dark => return None,
        };
        Some(flat.extend((1.0 - flat.length_squared()).max(0.0).sqrt()))
    }

    /// Of the cell right and below of a node.
    #[inline]
    fn mix(&self, cell: usize, wx: &[f64; 4], wy: &[f64; 4]) -> Option<DVec2> {
        let start = cell.checked_sub(self.across + 1)?;
        let corner = self.nodes.get(start..start + 3 * self.across + 4)?;
        let mut sum = DVec2::ZERO;
        for (row, wy) in wy.iter().enumerate() {
            let row = &corner[row * self.across..row * self.across + 4];
            sum += ((row[0] * wx[0] + row[1] * wx[1]) + (row[2] * wx[2] + row[3] * wx[3])) * *wy;
        }
        Some(sum)
    }
}

/// The columns of a row of coverage that the lens shows, and their coverage.
pub fn inside(field: Range<usize>, x: usize, part: &[f32]) -> (Range<usize>, &[f32]) {
    let start = x.max(field.start).min(x + part.len());
    let end = (x + part.len()).min(field.end).max(start);
    (start..end, part.get(start - x..end - x).unwrap_or(&[]))
}

/// The dome's rim in the image, px. Where the lens does not see it, the polygon runs outside the lens's field.
pub fn rim_polygon(optics: &SensorOptics) -> Vec<DVec2> {
    let radius = optics.dome_radius_mm();
    let lens = optics.lens();
    let [[_, _, cx], [_, _, cy], _] = lens.spec().matrix;
    let center = DVec2::new(cx, cy);
    let camera_from_sensor = optics.sensor_from_camera().inverse();
    let place = |k: usize| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / RIM_AZIMUTHS as f64).sin_cos();
        let point = DVec3::new(radius * cos, radius * sin, 0.0);
        optics.project(point).unwrap_or_else(|_| {
            let aside = camera_from_sensor.point(point).truncate().normalize_or_zero();
            center + aside * (1.5 * lens.max_radius_px())
        })
    };
    let coarse: Vec<DVec2> = (0..RIM_AZIMUTHS).map(place).collect();
    let at = |k: usize| coarse[k % RIM_AZIMUTHS];
    let mut polygon = Vec::with_capacity(RIM_AZIMUTHS * RIM_BETWEEN);
    for k in 0..RIM_AZIMUTHS {
        let (a, b, c, d) = (at(k + RIM_AZIMUTHS - 1), at(k), at(k + 1), at(k + 2));
        for step in 0..RIM_BETWEEN {
            let t = step as f64 / RIM_BETWEEN as f64;
            let weights = lagrange(t);
            polygon.push(a * weights[0] + b * weights[1] + c * weights[2] + d * weights[3]);
        }
    }
    polygon
}
