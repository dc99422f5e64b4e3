//! The lit membrane in the picture: exact at as few pixels as smoothness allows, a smooth surface in between.
//!
//! The picture is divided into squares of 16 px. Of each the brightness at its corners, sides' middles and middle is
//! worked out exactly (ray, deformed membrane, light). Where the middles are what the corners promise, within a
//! tolerance, or what the square of twice the size foretold, the square is filled by the biquadratic surface through
//! the nine; else it falls into four, down to single pixels. Pixels are their own nodes, so nothing is worked out twice.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::coverage::LEAST_SHARE;
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
    /// It shows the dome where that is as it was made, or would if dome and lens went on beyond their ends, and its
    /// brightness stands.
    Still,
    /// The same where the dome is dented.
    Moved,
    /// It has no ray.
    Misses,
}

impl Known {
    fn is_lit(self) -> bool {
        matches!(self, Self::Still | Self::Moved)
    }
}

/// Brightness of the membrane over the picture, for `N` channels that share their rays.
#[derive(Debug, Clone)]
pub struct Lit<const N: usize> {
    width: usize,
    height: usize,
    /// Channel by channel.
    levels: [Vec<f32>; N],
    known: Vec<Known>,
    pixels: Vec<(usize, usize)>,
    samples: Vec<SurfaceSample>,
    /// Of each sample the pixel, and the share that it has in its brightness.
    places: Vec<(usize, f32)>,
    answers: Vec<[f32; 3]>,
}

/// The membrane that is lit.
pub struct LitSurface<'a> {
    /// Slices of rows that see it at times of their own, from the first row; not empty.
    pub slices: &'a [LitSlice<'a>],
    /// The light.
    pub shading: &'a dyn Shading,
    /// The first channel whose brightness is wanted, 0 to 2.
    pub channel: usize,
    /// How far a middle may be from what the corners promise, full scales.
    pub tolerance: f32,
}

/// The membrane as some rows see it.
pub struct LitSlice<'a> {
    /// The row after the last.
    pub end: usize,
    /// Camera, layers and dome, for the channel.
    pub optics: &'a SensorOptics,
    /// The deformed part.
    pub dent: Option<&'a Dent>,
}

impl<'a> LitSurface<'a> {
    /// As a row sees it; the nodes below the picture belong to the last slice.
    fn at(&self, y: usize) -> Option<&LitSlice<'a>> {
        match self.slices {
            [only] => Some(only),
            slices => slices.get(slices.partition_point(|slice| slice.end <= y)).or(slices.last()),
        }
    }
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
    /// The box around both.
    pub fn with(&self, other: &Self) -> Self {
        Self {
            left: self.left.min(other.left),
            top: self.top.min(other.top),
            right: self.right.max(other.right),
            bottom: self.bottom.max(other.bottom),
        }
    }

    fn meets(&self, x: usize, y: usize, side: usize) -> bool {
        x < self.right && y < self.bottom && x + side >= self.left && y + side >= self.top
    }
}

impl<const N: usize> Default for Lit<N> {
    fn default() -> Self {
        Self {
            width: 0,
            height: 0,
            levels: [const { Vec::new() }; N],
            known: Vec::new(),
            pixels: Vec::new(),
            samples: Vec::new(),
            places: Vec::new(),
            answers: Vec::new(),
        }
    }
}

impl<const N: usize> Lit<N> {
    /// Works out the brightness of the pixels of `spans`, by row, those of the picture that show the dome; `dented` holds
    /// all pixels that may show its deformed part.
    pub fn fill(
        &mut self,
        surface: &LitSurface<'_>,
        size: (usize, usize),
        spans: &[Range<usize>],
        dented: Option<PixelBox>,
        work: &mut Work,
    ) {
        // Nodes lie on the corners of squares, so the grid reaches one pixel past the last square.
        let grid = |n: usize| n.div_ceil(LARGEST) * LARGEST + 1;
        (self.width, self.height) = (grid(size.0), grid(size.1));
        let count = self.width * self.height;
        self.levels.iter_mut().for_each(|levels| levels.resize(count, 0.0));
        self.known.clear();
        self.known.resize(count, Known::Nothing);
        let mut squares = Vec::new();
        // Squares that share their sides share their nodes, of which one of them shows the dome: nothing else is asked.
        let shows = |(x, y): &(usize, usize), side: usize| {
            let rows = spans.get(*y..(y + side + 1).min(spans.len())).unwrap_or_default();
            rows.iter().any(|span| span.start <= x + side && span.end > *x)
        };
        for y in (0..size.1).step_by(LARGEST) {
            for x in (0..size.0).step_by(LARGEST) {
                if shows(&(x, y), LARGEST) {
                    squares.push((x, y));
                }
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
                let in_dent = dented.is_some_and(|dented| dented.meets(x, y, side));
                match self.judge((x, y), half, in_dent, surface.tolerance) {
                    Verdict::Smooth if half > 1 && !(in_dent && side > IN_DENT) => {
                        self.biquadratic(x, y, half);
                        work.add_base((side * side) as u64 * units::FILL);
                    }
                    // A square whose nine rays all miss may still hold a corner of the dome; the largest squares
                    // are wide, so they are divided once more.
                    Verdict::Misses if side <= LARGEST / 2 => {}
                    _ if half > 1 => {
                        let parts = [(x, y), (x + half, y), (x, y + half), (x + half, y + half)];
                        next.extend(parts.into_iter().filter(|part| shows(part, half)));
                    }
                    _ => {}
                }
            }
            squares = next;
            side = half;
        }
    }

    /// Brightness of a row's pixels in a channel. Only what [`Self::complete`] was told of has a meaning.
    pub fn row(&self, lane: usize, y: usize, columns: Range<usize>) -> &[f32] {
        let place = |x: usize| y * self.width + x;
        let levels = self.levels.get(lane);
        levels.and_then(|levels| levels.get(place(columns.start)..place(columns.end))).unwrap_or_default()
    }

    /// Gives the pixels of a row that have a share in the dome but no ray of their own the brightness of the nearest one
    /// that shows it, towards `inwards`.
    pub fn complete(&mut self, y: usize, columns: Range<usize>, shares: &[f32], inwards: DVec2) {
        let place = |x: usize| y * self.width + x;
        let known = self.known.get(place(columns.start)..place(columns.end)).unwrap_or_default();
        let lacks = |(known, share): (&Known, &f32)| u32::from(!known.is_lit() && *share > LEAST_SHARE);
        // A sum, and no look for the first: machines add several at once.
        if known.iter().zip(shares).map(lacks).sum::<u32>() == 0 {
            return;
        }
        for (x, share) in columns.zip(shares) {
            let at = y * self.width + x;
            if *share > LEAST_SHARE && self.known.get(at).is_some_and(|known| !known.is_lit()) {
                let near = self.near(x, y, inwards);
                for (levels, value) in self.levels.iter_mut().zip(near) {
                    if let Some(level) = levels.get_mut(at) {
                        *level = value;
                    }
                }
            }
        }
    }

    #[cold]
    fn near(&self, x: usize, y: usize, inwards: DVec2) -> [f32; N] {
        let from = DVec2::new(x as f64, y as f64);
        let step = (inwards - from).normalize_or_zero();
        let beside = |k: u32| {
            let place = (from + step * f64::from(k)).round().max(DVec2::ZERO);
            let (known, level) = self.node(place.x as usize, place.y as usize);
            known.is_lit().then_some(level)
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
        // Neighbours move alike: the last one's motion is where the next one's search begins.
        let mut moved_mm = DVec3::ZERO;
        for (x, y) in pixels.drain(..) {
            let at = y * self.width + x;
            match (self.known.get_mut(at), surface.at(y)) {
                (Some(known @ Known::Nothing), Some(seen)) => {
                    *known = Known::Misses;
                    let pixel = DVec2::new(x as f64, y as f64);
                    let rays = match seen.optics.trace_continued(pixel) {
                        Ok(ray) => [Some((ray, 1.0)), None],
                        Err(_) => continued(seen.optics, pixel),
                    };
                    for ((surface_mm, inside), weight) in rays.into_iter().flatten() {
                        self.places.push((at, weight));
                        let sample = sample(seen, surface_mm, inside, moved_mm, work);
                        moved_mm = sample.point_mm - sample.rest_mm;
                        let moved = moved_mm.length_squared() > STILL_MM * STILL_MM;
                        *known = if moved { Known::Moved } else { Known::Still };
                        self.samples.push(sample);
                    }
                    if *known != Known::Misses {
                        self.levels
                            .iter_mut()
                            .filter_map(|levels| levels.get_mut(at))
                            .for_each(|level| *level = 0.0);
                    }
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
        for ((at, weight), answer) in self.places.iter().zip(&self.answers) {
            for (lane, levels) in self.levels.iter_mut().enumerate() {
                if let Some(level) = levels.get_mut(*at) {
                    *level += weight * answer[(surface.channel + lane).min(2)];
                }
            }
        }
        self.samples.clear();
        self.places.clear();
    }

    fn node(&self, x: usize, y: usize) -> (Known, [f32; N]) {
        let at = y * self.width + x;
        let known = self.known.get(at).copied().unwrap_or(Known::Misses);
        let level = |lane: usize| self.levels[lane].get(at).copied().unwrap_or(0.0);
        (known, std::array::from_fn(level))
    }

    fn judge(&self, (x, y): (usize, usize), half: usize, creased: bool, tolerance: f32) -> Verdict {
        let nine = match self.nine((x, y), half, creased) {
            Ok(nine) => nine,
            Err(verdict) => return verdict,
        };
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
        if smooth || self.foreseen((x, y), half, creased, tolerance) {
            Verdict::Smooth
        } else {
            Verdict::Rough
        }
    }

    /// The nine nodes of a square, or what it is if they do not belong together.
    fn nine(
        &self,
        (x, y): (usize, usize),
        half: usize,
        creased: bool,
    ) -> Result<[[[f32; N]; 3]; 3], Verdict> {
        let mut nine = [[[0.0_f32; N]; 3]; 3];
        let (mut misses, mut moved) = (0, 0);
        for (j, row) in nine.iter_mut().enumerate() {
            for (i, value) in row.iter_mut().enumerate() {
                let (known, level) = self.node(x + i * half, y + j * half);
                misses += usize::from(!known.is_lit());
                moved += usize::from(known == Known::Moved);
                *value = level;
            }
        }
        match misses {
            // Between nodes in the dent and beside it there may be a crease that none of them shows.
            0 if !creased || moved == 0 || moved == 9 => Ok(nine),
            9 => Err(Verdict::Misses),
            _ => Err(Verdict::Rough),
        }
    }

    /// Whether the surface through the nine nodes of the square that this one is a quarter of has told this one's own new
    /// nodes beforehand: it is of the third order, so what is left between this one's nodes is an eighth of its misses.
    fn foreseen(&self, (x, y): (usize, usize), half: usize, creased: bool, tolerance: f32) -> bool {
        let side = 2 * half;
        if side >= LARGEST {
            return false;
        }
        let (left, top) = (x / (2 * side) * (2 * side), y / (2 * side) * (2 * side));
        let Ok(nine) = self.nine((left, top), side, creased) else { return false };
        let (x0, y0) = ((x - left) / half, (y - top) / half);
        let new = [(1, 0), (0, 1), (1, 1), (2, 1), (1, 2)];
        (0..N).all(|lane| {
            let row = |j: usize| Parabola::through(nine[j][0][lane], nine[j][1][lane], nine[j][2][lane]);
            let rows = [row(0), row(1), row(2)];
            new.iter().all(|(i, j)| {
                let (u, v) = (0.5 * (x0 + i) as f32, 0.5 * (y0 + j) as f32);
                let told = Parabola::through(rows[0].at(u), rows[1].at(u), rows[2].at(u)).at(v);
                let (_, found) = self.node(x + i * half, y + j * half);
                (told - found[lane]).abs() <= FORESEEN * tolerance
            })
        })
    }

    /// Fills a square by the biquadratic surface through its nine nodes. Nodes keep their values, and a side that a
    /// neighbour has filled already gets the same parabola again.
    fn biquadratic(&mut self, x: usize, y: usize, half: usize) {
        let side = 2 * half;
        let per_half = 1.0 / half as f32;
        let nine: [[[f32; N]; 3]; 3] =
            std::array::from_fn(|j| std::array::from_fn(|i| self.node(x + i * half, y + j * half).1));
        for (lane, levels) in self.levels.iter_mut().enumerate() {
            let column = |i: usize| Parabola::through(nine[0][i][lane], nine[1][i][lane], nine[2][i][lane]);
            let (left, middle, right) = (column(0), column(1), column(2));
            for j in 0..=side {
                let start = (y + j) * self.width + x;
                let Some(row) = levels.get_mut(start..=start + side) else { continue };
                // Along y in the three columns that are known, then along x.
                let t = j as f32 * per_half;
                let across = Parabola::through(left.at(t), middle.at(t), right.at(t));
                for (level, step) in row.iter_mut().zip(&STEPS) {
                    *level = across.at(step * per_half);
                }
            }
        }
        for j in 0..=side {
            let start = (y + j) * self.width + x;
            if let Some(known) = self.known.get_mut(start..=start + side) {
                let moved = known.contains(&Known::Moved);
                known.fill(if moved { Known::Moved } else { Known::Still });
            }
        }
    }
}

/// Columns of a square.
const STEPS: [f32; LARGEST + 1] = {
    let mut steps = [0.0; LARGEST + 1];
    let mut i = 0;
    while i <= LARGEST {
        steps[i] = i as f32;
        i += 1;
    }
    steps
};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    Smooth,
    Rough,
    Misses,
}

/// The parabola through values at 0, 1 and 2.
#[derive(Clone, Copy)]
struct Parabola {
    start: f32,
    slope: f32,
    bend: f32,
}

impl Parabola {
    #[inline]
    fn through(a: f32, b: f32, c: f32) -> Self {
        Self { start: a, slope: b - a, bend: 0.5 * (c - 2.0 * b + a) }
    }

    #[inline]
    fn at(self, t: f32) -> f32 {
        self.start + t * (self.slope + (t - 1.0) * self.bend)
    }
}

/// Part of the tolerance within which a square's nodes are foreseen.
const FORESEEN: f32 = 0.5;

/// Squares that reach further than this beyond the lens's field are all outside it, px.
const BEYOND_PX: f64 = 2.0 * LARGEST as f64;
/// What moves by less is not dented, mm.
const STILL_MM: f64 = 1e-6;

/// Stands in for a pixel without a ray, a little beyond the end of the lens's field: twice the brightness at the end less
/// that as far inside, so that it goes on smoothly. Rays, and the shares of their brightness.
#[cold]
fn continued(optics: &SensorOptics, pixel: DVec2) -> [Option<((DVec3, DVec3), f32)>; 2] {
    let [[_, _, cx], [_, _, cy], _] = optics.lens().spec().matrix;
    let center = DVec2::new(cx, cy);
    let away = pixel - center;
    let (radius_px, mut end_px) = (away.length(), optics.lens().max_radius_px());
    if radius_px > end_px + BEYOND_PX {
        return [None; 2];
    }
    let at = |radius: f64| optics.trace_continued(center + away * (radius / radius_px)).ok();
    // The end is known as a circle that holds the field.
    for _ in 0..8 {
        end_px -= 0.25;
        if let (Some(end), Some(inside)) = (at(end_px), at(2.0 * end_px - radius_px)) {
            return [Some((end, 2.0)), Some((inside, -1.0))];
        }
    }
    [None; 2]
}

/// What a ray that meets the undeformed dome shows; a point nearby moved by `near_mm`.
fn sample(
    seen: &LitSlice<'_>,
    surface_mm: DVec3,
    inside: DVec3,
    near_mm: DVec3,
    work: &mut Work,
) -> SurfaceSample {
    let radius_mm = seen.optics.dome_radius_mm();
    if let Some(dent) = seen.dent {
        work.add(EffectName::Contact, units::DENT);
        if let Some((rest_mm, dented)) = dent.meet(surface_mm, inside, near_mm) {
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
