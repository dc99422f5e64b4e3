//! What of the sensor lies where in the picture: the lens's field, the dome's rim.

use std::ops::Range;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

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
    rays: Option<LensRays>,
}

impl LensField {
    /// From the lens; the field is taken to be one piece in each row. Only a lit membrane asks for rays.
    pub fn new(lens: &Lens, (width, height): (usize, usize), with_rays: bool) -> Self {
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
        let rays = with_rays.then(|| LensRays::new(lens, width, height));
        Self { rows: (0..height).map(row).collect(), rays }
    }

    /// What the pixels see.
    pub fn rays(&self) -> Option<&LensRays> {
        self.rays.as_ref()
    }

    /// The columns of a row.
    pub fn row(&self, y: usize) -> Range<usize> {
        self.rows.get(y).cloned().unwrap_or(0..0)
    }
}

/// Distance of the nodes of the lattice that pictures of a lit membrane are made on, px.
pub(crate) const SPACING: usize = 4;
/// Nodes before the picture's first cell and after its last one's first: what cubics through every second node and their
/// error estimate look at.
pub(crate) const BEFORE: usize = 4;
pub(crate) const AFTER: usize = 7;
/// Rays that leave the camera's axis by more than this cosine are not followed.
const MIN_COSINE: f64 = 0.05;

/// Directions that pixels see, and the nodes of the lattice, some of which lie beside the picture.
#[derive(Debug, Clone)]
pub struct LensRays {
    width: usize,
    /// Components of the unit direction along the picture's axes; NaN where there is none.
    pixels: Vec<DVec2>,
    nodes_across: usize,
    nodes: Vec<DVec2>,
}

impl LensRays {
    fn new(lens: &Lens, width: usize, height: usize) -> Self {
        let ray = |at: DVec2| {
            let ray = lens.unproject(at).ok().filter(|ray| ray.z > MIN_COSINE);
            ray.map_or(DVec2::NAN, |ray| ray.truncate())
        };
        let count = |n: usize| n.saturating_sub(1) / SPACING + 1 + BEFORE + AFTER;
        let (across, down) = (count(width), count(height));
        let place = |i: usize| i as f64 * SPACING as f64 - (BEFORE * SPACING) as f64;
        let nodes = (0..across * down).into_par_iter();
        let pixels = (0..width * height).into_par_iter();
        Self {
            width,
            pixels: pixels.map(|i| ray(DVec2::new((i % width) as f64, (i / width) as f64))).collect(),
            nodes_across: across,
            nodes: nodes.map(|i| ray(DVec2::new(place(i % across), place(i / across)))).collect(),
        }
    }

    /// Pixels of each row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Nodes along each row of the lattice.
    pub fn nodes_across(&self) -> usize {
        self.nodes_across
    }

    /// All nodes.
    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// The unit direction that a pixel sees, camera frame; `None` where it sees nothing.
    #[inline]
    pub fn pixel(&self, x: usize, y: usize) -> Option<DVec3> {
        direction(self.pixels.get(y * self.width + x))
    }

    /// The unit direction that a node sees.
    #[inline]
    pub fn node(&self, index: usize) -> Option<DVec3> {
        direction(self.nodes.get(index))
    }
}

#[inline]
fn direction(flat: Option<&DVec2>) -> Option<DVec3> {
    let flat = flat.filter(|flat| !flat.is_nan())?;
    Some(flat.extend((1.0 - flat.length_squared()).max(0.0).sqrt()))
}

/// Lagrange's weights of values at -1, 0, 1 and 2.
pub(crate) const fn lagrange(t: f64) -> [f64; 4] {
    let (p, q, r) = (t + 1.0, t - 1.0, t - 2.0);
    [-t * q * r / 6.0, p * q * r / 2.0, -p * t * r / 2.0, p * t * q / 6.0]
}

/// The columns of a row of coverage that the lens shows, and their coverage.
pub fn inside(field: Range<usize>, x: usize, part: &[f32]) -> (Range<usize>, &[f32]) {
    let start = x.max(field.start).min(x + part.len());
    let end = (x + part.len()).min(field.end).max(start);
    (start..end, part.get(start - x..end - x).unwrap_or(&[]))
}

/// The dome's rim in the image, px. Where the lens does not see it, the polygon runs outside the lens's field.
pub fn rim_polygon(optics: &SensorOptics) -> Vec<DVec2> {
    let radius = optics.dome().rim_radius_mm();
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
