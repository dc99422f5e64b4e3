//! The lit membrane in the picture: exact at as few pixels as smoothness allows, a smooth surface in between.
//!
//! The picture is divided into squares of 16 px. Of each the brightness at its corners, sides' middles and middle is
//! worked out exactly (ray, deformed membrane, light). Where the middles are what the corners promise, within a
//! tolerance, or what the square of twice the size foretold, the square is filled by the biquadratic surface through
//! the nine; else it falls into four, down to single pixels. Pixels are their own nodes, so nothing is worked out twice.
//!
//! What lies between its nodes, a square cannot know from them: the edge of a dent or of a shadow may pass there. The tables
//! of the membrane and of its light tell it: each bounds what a surface of the second order can leave of it over a part of
//! the dome ([`super::dent::Dent::bend`], [`Shading::bend`]), and where the bounds are above the tolerance the square is
//! divided whatever its nodes say.

mod motion;
mod points;
mod smooth;

use std::ops::Range;

use glam::{DVec2, DVec3};

use self::motion::{Motion, Square};
use self::smooth::Verdict;
use super::coverage::LEAST_SHARE;
use super::dent::Dent;
use super::field::LensRays;
use super::shading::{Shading, SurfaceSample};
use super::work::Work;
use crate::optics::SensorOptics;

/// Side of the largest squares, px; a power of two.
pub(super) const LARGEST: usize = 16;
/// Parts of the tolerance: a bound on what the surface through the nodes leaves that is above the first divides a
/// square whatever its nodes say; one below the second does not, for then the nodes only differ as a surface of the
/// second order does. The bounds take the worst of all directions, cells and phases at once, some ten times what is
/// found; with these parts no pixel of many objects' pictures was found further off than the tolerance.
const HIDDEN: f32 = 2.3;
const TOLD: f32 = 0.3;
/// Squares up to this size, px, whose nine rays miss the dome show none of it.
const MISSED: usize = 8;

/// Counted work of a ray to the dome, and of a point of the deformed membrane.
pub(super) mod units {
    /// A ray through lens, layers and dome.
    pub const RAY: u64 = 60;
    /// Its way to the deformed membrane.
    pub const DENT: u64 = 250;
    /// The same told from nine nodes.
    pub const SMOOTH: u64 = 60;
    /// A pixel filled in.
    pub const FILL: u64 = 4;
}

/// What is known of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Known {
    Nothing,
    /// It shows the dome, or would if dome and lens went on beyond their ends, and its brightness stands.
    Lit,
    /// It has no ray.
    Misses,
}

/// Brightness of the membrane over the picture, for `N` channels that share their rays.
#[derive(Debug, Clone)]
pub struct Lit<const N: usize> {
    width: usize,
    height: usize,
    /// Channel by channel.
    levels: [Vec<f32>; N],
    known: Vec<Known>,
    /// How the membrane moved at the nodes of the largest squares; only where it did.
    motions: Vec<Motion>,
    squares: Vec<Square>,
    /// The motion of the pixel that was asked last, mm.
    moved_mm: DVec3,
    samples: Vec<SurfaceSample>,
    /// Of each sample the pixel, and the share that it has in its brightness.
    places: Vec<(usize, f32)>,
    answers: Vec<[f32; 3]>,
}

/// The membrane that is lit.
pub struct LitSurface<'a> {
    /// Slices of rows that see it at times of their own, from the first row; not empty.
    pub slices: &'a [LitSlice<'a>],
    /// What the pixels see, where it is known.
    pub rays: Option<&'a LensRays>,
    /// The light.
    pub shading: &'a dyn Shading,
    /// The first channel whose brightness is wanted, 0 to 2.
    pub channel: usize,
    /// How far a pixel that is filled in may be from what its own ray shows, full scales; with 0 every pixel has its own
    /// ray, followed all the way.
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

    /// The dents that some rows see.
    fn dents(&self, top: usize, bottom: usize) -> impl Iterator<Item = &'a Dent> {
        let first =
            self.slices.partition_point(|slice| slice.end <= top).min(self.slices.len().saturating_sub(1));
        let last = self.slices.partition_point(|slice| slice.end <= bottom);
        let slices = self.slices.get(first..=last.min(self.slices.len().saturating_sub(1)));
        slices.unwrap_or_default().iter().filter_map(|slice| slice.dent)
    }
}

impl<const N: usize> Default for Lit<N> {
    fn default() -> Self {
        Self {
            width: 0,
            height: 0,
            levels: [const { Vec::new() }; N],
            known: Vec::new(),
            motions: Vec::new(),
            squares: Vec::new(),
            moved_mm: DVec3::ZERO,
            samples: Vec::new(),
            places: Vec::new(),
            answers: Vec::new(),
        }
    }
}

impl<const N: usize> Lit<N> {
    /// Works out the brightness of the pixels of `spans`, by row, those of the picture that show the dome.
    pub fn fill(
        &mut self,
        surface: &LitSurface<'_>,
        size: (usize, usize),
        spans: &[Range<usize>],
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
        self.lay_out_motions();
        let mut side = LARGEST;
        for (x, y) in &squares {
            let corners = [(*x, *y), (x + side, *y), (*x, y + side), (x + side, y + side)];
            self.ask(surface, (*x, *y), corners, work);
        }
        while side >= 2 && !squares.is_empty() {
            let half = side / 2;
            for (x, y) in &squares {
                let inner = [(half, 0), (0, half), (half, half), (side, half), (half, side)];
                let largest = (x / LARGEST * LARGEST, y / LARGEST * LARGEST);
                self.ask(surface, largest, inner.map(|(dx, dy)| (x + dx, y + dy)), work);
            }
            self.light(surface, work);
            let mut next = Vec::new();
            for (x, y) in squares {
                if side == LARGEST && surface.tolerance > 0.0 {
                    self.settle(surface, (x, y));
                }
                // The smallest squares have no pixels between their nodes.
                if half == 1 {
                    continue;
                }
                match self.verdict(surface, (x, y), half) {
                    Verdict::Smooth => {
                        self.biquadratic(x, y, half);
                        work.add_base((side * side) as u64 * units::FILL);
                    }
                    // A square whose nine rays all miss may still hold a corner of the dome; large ones are divided
                    // once more.
                    Verdict::Misses if side <= MISSED => {}
                    _ => {
                        let parts = [(x, y), (x + half, y), (x, y + half), (x + half, y + half)];
                        next.extend(parts.into_iter().filter(|part| shows(part, half)));
                    }
                }
            }
            squares = next;
            side = half;
        }
    }

    /// Whether a square may be filled in: what its nodes say, and what the tables say that none of them shows.
    fn verdict(&self, surface: &LitSurface<'_>, (x, y): (usize, usize), half: usize) -> Verdict {
        let told = self.judge((x, y), half, surface.tolerance);
        if told == Verdict::Misses || surface.tolerance <= 0.0 {
            return if told == Verdict::Misses { told } else { Verdict::Rough };
        }
        match self.bend(surface, (x, y), 2 * half, told) {
            Some(bend) if bend.most > HIDDEN * surface.tolerance => Verdict::Rough,
            Some(bend) if bend.most < TOLD * surface.tolerance && bend.is_inside => Verdict::Smooth,
            Some(_) => told,
            None => Verdict::Rough,
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
        let lacks = |(known, share): (&Known, &f32)| u32::from(*known != Known::Lit && *share > LEAST_SHARE);
        // A sum, and no look for the first: machines add several at once.
        if known.iter().zip(shares).map(lacks).sum::<u32>() == 0 {
            return;
        }
        for (x, share) in columns.zip(shares) {
            let at = y * self.width + x;
            if *share > LEAST_SHARE && self.known.get(at).is_some_and(|known| *known != Known::Lit) {
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
            (known == Known::Lit).then_some(level)
        };
        (0..=4).find_map(beside).unwrap_or([0.0; N])
    }

    fn node(&self, x: usize, y: usize) -> (Known, [f32; N]) {
        let at = y * self.width + x;
        let known = self.known.get(at).copied().unwrap_or(Known::Misses);
        let level = |lane: usize| self.levels[lane].get(at).copied().unwrap_or(0.0);
        (known, std::array::from_fn(level))
    }
}
