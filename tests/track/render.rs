//! A small renderer from the constants alone: dome, dots and markers as outlines, each pixel covered exactly.
//! It shares no code with the simulator, so a fault there does not hide here.
#![allow(dead_code, reason = "shared by a test and a benchmark, each of which uses a part")]

use domecast::constants::Constants;
use domecast::numeric::Rigid;
use domecast::optics::SensorOptics;
use glam::{DVec2, DVec3};

/// What a frame shows.
#[derive(Clone)]
pub struct Picture<'a> {
    pub pose: Rigid,
    /// Moves a dot's points on the dome, sensor frame.
    pub displace: &'a dyn Fn(DVec3) -> DVec3,
    /// Dots that are not printed.
    pub missing: &'a [u32],
    /// Dark dots that are no dots, px, with their radius.
    pub extra: &'a [(DVec2, f64)],
    pub membrane: f64,
    /// Brightness across the dome changes by this part from left to right.
    pub shading: f64,
    pub ink: f64,
    pub marker: f64,
    pub surround: f64,
    /// Standard deviation of the noise, levels.
    pub noise: f64,
    pub seed: u64,
}

pub fn still(pose: Rigid) -> Picture<'static> {
    Picture {
        pose,
        displace: &|p| p,
        missing: &[],
        extra: &[],
        membrane: 150.0,
        shading: 0.4,
        ink: 25.0,
        marker: 240.0,
        surround: 38.0,
        noise: 2.0,
        seed: 1,
    }
}

/// A frame and where things are in it.
pub struct Drawn {
    /// Without noise.
    levels: Vec<f32>,
    pub bytes: Vec<u8>,
    /// By number, in the order of the constants: image of the centre and centroid of the outline.
    pub dots: Vec<Option<[DVec2; 2]>>,
    pub markers: Vec<Option<[DVec2; 2]>>,
}

struct Coverage {
    width: usize,
    height: usize,
    cells: Vec<f64>,
}

impl Coverage {
    /// Signed area of a polygon in each pixel: every edge adds, row by row, its height and the area to its right.
    fn fill(&mut self, polygon: &[DVec2]) -> Option<[usize; 4]> {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for p in polygon {
            low = low.min(*p);
            high = high.max(*p);
        }
        let clamp = |v: f64, end: usize| (v + 0.5).floor().clamp(0.0, end as f64 - 1.0) as usize;
        let bounds = [
            clamp(low.x, self.width),
            clamp(low.y, self.height),
            clamp(high.x, self.width),
            clamp(high.y, self.height),
        ];
        let [x0, y0, x1, y1] = bounds;
        for y in y0..=y1 {
            self.cells[y * self.width + x0..=y * self.width + x1].fill(0.0);
        }
        let n = polygon.len();
        for i in 0..n {
            // Pixel (x, y) is the square from x - 1/2 to x + 1/2.
            let (a, b) = (polygon[i] + 0.5, polygon[(i + 1) % n] + 0.5);
            if a.y == b.y {
                continue;
            }
            let (sign, top, bottom) = if a.y < b.y { (1.0, a, b) } else { (-1.0, b, a) };
            let slope = (bottom.x - top.x) / (bottom.y - top.y);
            for y in
                (top.y.floor().max(y0 as f64) as usize)..=(bottom.y.floor().min(y1 as f64).max(0.0) as usize)
            {
                let (from, to) = (top.y.max(y as f64), bottom.y.min(y as f64 + 1.0));
                if to <= from {
                    continue;
                }
                // Split at pixel borders in x, so that each piece lies in one column.
                let (xa, xb) = (top.x + slope * (from - top.y), top.x + slope * (to - top.y));
                let (left, right) = (xa.min(xb), xa.max(xb));
                let total = to - from;
                for x in x0..=x1 {
                    // Area of the strip between the edge and the right border of pixel x.
                    let (px, px1) = (x as f64, x as f64 + 1.0);
                    let covered = if right <= px {
                        total
                    } else if left >= px1 {
                        0.0
                    } else if right - left < 1e-12 {
                        total * (px1 - left).clamp(0.0, 1.0)
                    } else {
                        // Integral over the edge of clamp(px1 - x, 0, 1).
                        let part = |v: f64| {
                            let t = (px1 - v).clamp(0.0, 1.0);
                            // Antiderivative by v of clamp(px1 - v, 0, 1).
                            if v <= px { v - px - 0.5 } else { -0.5 * t * t }
                        };
                        total * (part(right) - part(left)) / (right - left)
                    };
                    self.cells[y * self.width + x] += sign * covered;
                }
            }
        }
        Some(bounds)
    }
}

fn hash(mut v: u64) -> u64 {
    v = (v ^ (v >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    v = (v ^ (v >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    v ^ (v >> 31)
}

/// Noise that depends on seed and pixel only; nearly Gaussian (four uniforms), standard deviation 1.
pub fn noise(seed: u64, pixel: usize) -> f64 {
    let h = hash(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ pixel as u64);
    let sum: f64 = (0..4).map(|k| f64::from((h >> (16 * k)) as u16) / 65535.0 - 0.5).sum();
    sum * 3.0_f64.sqrt()
}

fn centroid(polygon: &[DVec2]) -> DVec2 {
    let (mut area, mut moment) = (0.0, DVec2::ZERO);
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let swept = a.perp_dot(b);
        area += swept;
        moment += (*a + b) * swept;
    }
    moment / (3.0 * area)
}

pub fn draw(constants: &Constants, rest: &SensorOptics, picture: &Picture) -> Drawn {
    let (width, height) = (constants.camera.width as usize, constants.camera.height as usize);
    let optics = rest.at_pose(&picture.pose).expect("a pose that the camera survives");
    let mut levels = vec![picture.surround; width * height];
    let mut coverage = Coverage { width, height, cells: vec![0.0; width * height] };
    let mut paint = |polygon: &[DVec2], level: &dyn Fn(usize, usize) -> f64| {
        let Some([x0, y0, x1, y1]) = coverage.fill(polygon) else { return };
        for y in y0..=y1 {
            for x in x0..=x1 {
                let part = coverage.cells[y * width + x].abs().min(1.0);
                let to = &mut levels[y * width + x];
                *to += part * (level(x, y) - *to);
            }
        }
    };
    let radius = constants.optics.dome_radius_mm;
    let around = |n: usize| (0..n).map(move |i| std::f64::consts::TAU * i as f64 / n as f64);
    let rim: Vec<DVec2> = around(256)
        .filter_map(|a| optics.project(DVec3::new(radius * a.cos(), radius * a.sin(), 0.0)).ok())
        .collect();
    let shade = |x: usize| 1.0 + picture.shading * (x as f64 / width as f64 - 0.5);
    paint(&rim, &|x, _| picture.membrane * shade(x));
    let ink = picture.ink / picture.membrane;
    let mut dots = Vec::new();
    for dot in &constants.black_dots {
        let at = DVec3::from_array(dot.surface_mm);
        let east = DVec3::new(-at.y, at.x, 0.0).normalize();
        let north = at.cross(east).normalize();
        let see = |p: DVec3| {
            let moved = (picture.displace)(p * (radius / p.length()));
            optics.project(moved).ok()
        };
        let outline: Option<Vec<DVec2>> = around(24)
            .map(|a| see(at + (east * a.cos() + north * a.sin()) * (0.5 * dot.diameter_mm)))
            .collect();
        let here = outline.zip(see(at)).filter(|_| !picture.missing.contains(&(dot.id as u32)));
        dots.push(here.map(|(outline, center)| {
            paint(&outline, &|x, _| ink * picture.membrane * shade(x));
            [center, centroid(&outline)]
        }));
    }
    for (at, r) in picture.extra {
        let outline: Vec<DVec2> = around(24).map(|a| *at + DVec2::new(a.cos(), a.sin()) * *r).collect();
        paint(&outline, &|x, _| ink * picture.membrane * shade(x));
    }
    let mut markers = Vec::new();
    for marker in &constants.white_markers {
        let at = DVec3::from_array(marker.position_mm);
        let r = 0.5 * marker.diameter_mm;
        let outline: Option<Vec<DVec2>> =
            around(32).map(|a| optics.project(at + DVec3::new(r * a.cos(), r * a.sin(), 0.0)).ok()).collect();
        markers.push(outline.zip(optics.project(at).ok()).map(|(outline, center)| {
            paint(&outline, &|_, _| picture.marker);
            [center, centroid(&outline)]
        }));
    }
    let mut drawn =
        Drawn { levels: levels.iter().map(|v| *v as f32).collect(), bytes: Vec::new(), dots, markers };
    drawn.code(picture.noise, picture.seed);
    drawn
}

impl Drawn {
    /// The same picture with other noise.
    pub fn code(&mut self, sd: f64, seed: u64) {
        self.bytes.clear();
        // One draw of noise in a strip, laid over the frame from another place on each row: cheap, and no row is like
        // the next.
        const STRIP: usize = 1 << 14;
        let strip: Vec<f32> = (0..STRIP).map(|i| (sd * noise(seed, i)) as f32).collect();
        let mut at = hash(seed) as usize;
        for (pixel, level) in self.levels.iter().enumerate() {
            if pixel % 509 == 0 {
                at = hash(seed ^ pixel as u64) as usize;
            }
            at += 1;
            let value = level + strip[at % STRIP];
            self.bytes.push((value + 0.5).clamp(0.0, 255.0) as u8);
        }
    }

    /// Blurred by the mean over squares of `2 reach + 1` pixels, twice.
    pub fn blur(&mut self, width: usize, reach: usize) {
        for _ in 0..2 {
            for step in [1, width] {
                let from = self.levels.clone();
                for (pixel, to) in self.levels.iter_mut().enumerate() {
                    let mut sum = 0.0;
                    for k in 0..=2 * reach {
                        let at = (pixel + k * step).saturating_sub(reach * step).min(from.len() - 1);
                        sum += from[at];
                    }
                    *to = sum / (2 * reach + 1) as f32;
                }
            }
        }
    }
}
