//! The lit membrane in the picture: exact at as few pixels as smoothness allows, a smooth surface in between.
//!
//! The picture is divided into squares of 16 px. Of each the brightness at its corners, sides' middles and middle is
//! worked out exactly (ray, deformed membrane, light). Where the middles are what the corners promise, within a
//! tolerance, the square is filled by the biquadratic surface through the nine; else it falls into four, down to
//! single pixels. Pixels are their own nodes, so nothing is worked out twice.

use std::ops::Range;

use glam::DVec2;

use super::dent::Dent;
use super::effect::EffectName;
use super::shading::{Shading, SurfaceSample};
use super::work::Work;
use crate::optics::SensorOptics;

/// Side of the largest squares, px; a power of two.
const LARGEST: usize = 16;
/// Squares that reach into the dent are divided at least down to this, px.
const IN_DENT: usize = 8;
/// Rays are traced and lit this many at a time.
const BATCH: usize = 512;

/// Counted work of a ray to the dome, and of a point of the deformed membrane.
pub(super) mod units {
    /// A ray through lens, layers and dome.
    pub const RAY: u64 = 60;
    /// Its way to the deformed membrane.
    pub const DENT: u64 = 250;
    /// A pixel filled in.
    pub const FILL: u64 = 4;
}

/// What is known of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Known {
    Nothing,
    /// Its brightness is exact.
    Exact,
    /// Its ray misses the dome.
    Misses,
}

/// Brightness of the membrane over the picture, for `N` channels that share their rays.
#[derive(Debug, Clone)]
pub struct Lit<const N: usize> {
    width: usize,
    height: usize,
    levels: Vec<[f32; N]>,
    known: Vec<Known>,
    pixels: Vec<(usize, usize)>,
    samples: Vec<SurfaceSample>,
    places: Vec<usize>,
    answers: Vec<[f32; 3]>,
}

/// The membrane that is lit.
pub struct LitSurface<'a> {
    /// Camera, layers and dome at the instant, for the channel.
    pub optics: &'a SensorOptics,
    /// The deformed part.
    pub dent: Option<&'a Dent>,
    /// The light.
    pub shading: &'a dyn Shading,
    /// The first channel whose brightness is wanted, 0 to 2.
    pub channel: usize,
    /// How far a middle may be from what the corners promise, full scales.
    pub tolerance: f32,
}

/// A box of pixels, ends excluded.
#[derive(Debug, Clone, Copy)]
pub struct PixelBox {
    /// First column.
    pub left: usize,
    /// First row.
    pub top: usize,
    /// Column after the last.
    pub right: usize,
    /// Row after the last.
    pub bottom: usize,
}

impl PixelBox {
    fn meets(&self, x: usize, y: usize, side: usize) -> bool {
        x < self.right && y < self.bottom && x + side >= self.left && y + side >= self.top
    }
}

impl<const N: usize> Default for Lit<N> {
    fn default() -> Self {
        Self {
            width: 0,
            height: 0,
            levels: Vec::new(),
            known: Vec::new(),
            pixels: Vec::new(),
            samples: Vec::new(),
            places: Vec::new(),
            answers: Vec::new(),
        }
    }
}

impl<const N: usize> Lit<N> {
    /// Works out the brightness of every pixel of `within` that shows the dome; `dented` holds all pixels that may
    /// show its deformed part.
    pub fn fill(
        &mut self,
        surface: &LitSurface<'_>,
        size: (usize, usize),
        within: PixelBox,
        dented: Option<PixelBox>,
        work: &mut Work,
    ) {
        // Nodes lie on the corners of squares, so the grid reaches one pixel past the last square.
        let grid = |n: usize| n.div_ceil(LARGEST) * LARGEST + 1;
        (self.width, self.height) = (grid(size.0), grid(size.1));
        let count = self.width * self.height;
        self.levels.resize(count, [0.0; N]);
        self.known.clear();
        self.known.resize(count, Known::Nothing);
        let mut squares = Vec::new();
        for y in (within.top / LARGEST * LARGEST..within.bottom).step_by(LARGEST) {
            for x in (within.left / LARGEST * LARGEST..within.right).step_by(LARGEST) {
                squares.push((x, y));
            }
        }
        let mut side = LARGEST;
        self.ask_corners(&squares, side, surface, work);
        while side >= 2 && !squares.is_empty() {
            let half = side / 2;
            for (x, y) in &squares {
                for (dx, dy) in [(half, 0), (0, half), (half, half), (side, half), (half, side)] {
                    self.pixels.push((x + dx, y + dy));
                }
            }
            self.ask(surface, work);
            let mut next = Vec::new();
            for (x, y) in squares {
                let in_dent = side > IN_DENT && dented.is_some_and(|dented| dented.meets(x, y, side));
                match self.judge(x, y, half, surface.tolerance) {
                    Verdict::Smooth if !in_dent && half > 1 => {
                        self.biquadratic(x, y, half);
                        work.add_base((side * side) as u64 * units::FILL);
                    }
                    // A square whose nine rays all miss may still hold a corner of the dome; the largest squares
                    // are wide, so they are divided once more.
                    Verdict::Misses if side <= LARGEST / 2 => {}
                    _ if half > 1 => {
                        next.extend([(x, y), (x + half, y), (x, y + half), (x + half, y + half)]);
                    }
                    _ => {}
                }
            }
            squares = next;
            side = half;
        }
    }

    /// Brightness of a row's pixels from a column on, as many as wanted: its own, or that of the nearest pixel that shows the dome.
    ///
    /// A pixel without a share in the dome has none.
    pub fn row<'a>(
        &'a self,
        y: usize,
        columns: Range<usize>,
        shares: &'a [f32],
        inwards: DVec2,
    ) -> impl Iterator<Item = [f32; N]> + 'a {
        let place = |x: usize| y * self.width + x;
        let range = place(columns.start)..place(columns.end);
        let levels = self.levels.get(range.clone()).unwrap_or_default();
        let known = self.known.get(range).unwrap_or_default();
        columns.zip(levels.iter().zip(known)).zip(shares).map(move |((x, (level, known)), share)| match known
        {
            Known::Exact => *level,
            _ if *share <= 0.0 => [0.0; N],
            _ => self.near(x, y, inwards),
        })
    }

    /// Brightness of the nearest pixel towards `inwards` that shows the dome: for one whose own ray misses it (the
    /// rim covers a part of it).
    #[cold]
    fn near(&self, x: usize, y: usize, inwards: DVec2) -> [f32; N] {
        let at = |x: usize, y: usize| {
            let place = y * self.width + x;
            self.levels.get(place).copied().filter(|_| self.known.get(place) == Some(&Known::Exact))
        };
        let from = DVec2::new(x as f64, y as f64);
        let step = (inwards - from).normalize_or_zero();
        let beside = |k: u32| {
            let place = (from + step * f64::from(k)).round().max(DVec2::ZERO);
            at(place.x as usize, place.y as usize)
        };
        (0..=4).find_map(beside).unwrap_or([0.0; N])
    }

    fn ask_corners(
        &mut self,
        squares: &[(usize, usize)],
        side: usize,
        surface: &LitSurface<'_>,
        work: &mut Work,
    ) {
        for (x, y) in squares {
            self.pixels.extend([(*x, *y), (x + side, *y), (*x, y + side), (x + side, y + side)]);
        }
        self.ask(surface, work);
    }

    /// Traces and lights the pixels of the list that are not known yet.
    fn ask(&mut self, surface: &LitSurface<'_>, work: &mut Work) {
        let mut pixels = std::mem::take(&mut self.pixels);
        for (x, y) in pixels.drain(..) {
            let at = y * self.width + x;
            match self.known.get_mut(at) {
                Some(known @ Known::Nothing) => {
                    *known = Known::Misses;
                    let Ok((hit, inside)) = surface.optics.trace_inside(DVec2::new(x as f64, y as f64))
                    else {
                        continue;
                    };
                    *known = Known::Exact;
                    self.places.push(at);
                    self.samples.push(sample(surface, hit.surface_mm, inside, work));
                    if self.samples.len() >= BATCH {
                        self.light(surface, work);
                    }
                }
                _ => continue,
            }
        }
        self.pixels = pixels;
        self.light(surface, work);
    }

    fn light(&mut self, surface: &LitSurface<'_>, work: &mut Work) {
        self.answers.clear();
        self.answers.resize(self.samples.len(), [0.0; 3]);
        surface.shading.levels(&self.samples, &mut self.answers, work);
        work.add_base(self.samples.len() as u64 * units::RAY);
        for (at, answer) in self.places.iter().zip(&self.answers) {
            if let Some(level) = self.levels.get_mut(*at) {
                for (lane, level) in level.iter_mut().enumerate() {
                    *level = answer[(surface.channel + lane).min(2)];
                }
            }
        }
        self.samples.clear();
        self.places.clear();
    }

    fn node(&self, x: usize, y: usize) -> (Known, [f32; N]) {
        let at = y * self.width + x;
        let known = self.known.get(at).copied().unwrap_or(Known::Misses);
        (known, self.levels.get(at).copied().unwrap_or([0.0; N]))
    }

    fn judge(&self, x: usize, y: usize, half: usize, tolerance: f32) -> Verdict {
        let mut nine = [[[0.0_f32; N]; 3]; 3];
        let mut misses = 0;
        for (j, row) in nine.iter_mut().enumerate() {
            for (i, value) in row.iter_mut().enumerate() {
                let (known, level) = self.node(x + i * half, y + j * half);
                misses += usize::from(known != Known::Exact);
                *value = level;
            }
        }
        match misses {
            0 => {}
            9 => return Verdict::Misses,
            _ => return Verdict::Rough,
        }
        let [[a, ab, b], [ac, m, bd], [c, cd, d]] = nine;
        let smooth = (0..N).all(|n| {
            let off = [
                ab[n] - 0.5 * (a[n] + b[n]),
                cd[n] - 0.5 * (c[n] + d[n]),
                ac[n] - 0.5 * (a[n] + c[n]),
                bd[n] - 0.5 * (b[n] + d[n]),
                m[n] - 0.25 * (a[n] + b[n] + c[n] + d[n]),
            ];
            // Written so that a NaN, which no light gives, counts as rough.
            off.iter().all(|off| off.abs() <= tolerance)
        });
        if smooth { Verdict::Smooth } else { Verdict::Rough }
    }

    /// Fills a square by the biquadratic surface through its nine nodes.
    fn biquadratic(&mut self, x: usize, y: usize, half: usize) {
        let side = 2 * half;
        let mut columns = [[[0.0_f32; N]; 3]; LARGEST + 1];
        // Along x in the three rows that are known, then along y.
        for (j, row) in [0, half, side].into_iter().enumerate() {
            let three = [0, half, side].map(|i| self.node(x + i, y + row).1);
            for (i, column) in columns.iter_mut().enumerate().take(side + 1) {
                column[j] = quadratic(three, i as f32 / half as f32);
            }
        }
        for j in 0..=side {
            let start = (y + j) * self.width + x;
            let t = j as f32 / half as f32;
            let (Some(levels), Some(known)) =
                (self.levels.get_mut(start..=start + side), self.known.get_mut(start..=start + side))
            else {
                continue;
            };
            for ((level, known), column) in levels.iter_mut().zip(known).zip(&columns) {
                if *known == Known::Nothing {
                    *level = quadratic(*column, t);
                    *known = Known::Exact;
                }
            }
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    Smooth,
    Rough,
    Misses,
}

/// The parabola through values at 0, 1 and 2.
#[inline]
fn quadratic<const N: usize>([a, b, c]: [[f32; N]; 3], t: f32) -> [f32; N] {
    std::array::from_fn(|n| {
        let (slope, bend) = (b[n] - a[n], 0.5 * (c[n] - 2.0 * b[n] + a[n]));
        a[n] + t * (slope + (t - 1.0) * bend)
    })
}

/// What a ray that meets the undeformed dome shows.
fn sample(
    surface: &LitSurface<'_>,
    surface_mm: glam::DVec3,
    inside: glam::DVec3,
    work: &mut Work,
) -> SurfaceSample {
    let radius_mm = surface.optics.dome_radius_mm();
    if let Some(dent) = surface.dent {
        work.add(EffectName::Contact, units::DENT);
        if let Some((rest_mm, dented)) = dent.meet(surface_mm, inside) {
            return SurfaceSample {
                rest_mm,
                point_mm: rest_mm + dented.displacement_mm,
                normal: dented.normal,
                to_camera: -inside,
                deformed: true,
            };
        }
    }
    SurfaceSample {
        rest_mm: surface_mm,
        point_mm: surface_mm,
        normal: surface_mm / radius_mm,
        to_camera: -inside,
        deformed: false,
    }
}
