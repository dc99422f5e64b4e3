//! The lit membrane in the picture: exact at as few pixels as smoothness allows, a smooth surface in between.
//!
//! The picture is divided into squares of 32 px. Of each the brightness at its corners, sides' middles and middle is
//! worked out exactly (ray, deformed membrane, light). Where the middles are what the corners promise, within a
//! tolerance, or what the square of twice the size foretold, the square is filled by the biquadratic surface through
//! the nine; else it falls into four, down to single pixels. Pixels are their own nodes, so nothing is worked out twice.

mod points;
mod smooth;

use std::ops::Range;

use glam::{DVec2, DVec3};

use self::points::{Motion, Source};
use self::smooth::Verdict;
use super::coverage::LEAST_SHARE;
use super::dent::Dent;
use super::field::LensRays;
use super::shading::{Shading, SurfaceSample};
use super::work::Work;
use crate::optics::SensorOptics;

/// Side of the largest squares, px; a power of two.
pub(super) const LARGEST: usize = 32;
/// Squares that reach into the dent are divided at least down to this, px.
const IN_DENT: usize = 8;

/// Parts of the tolerance: a bound on what the surface through the nodes leaves that is above the first divides a
/// square whatever its nodes say, for it is that much larger than what is found; one below the second does not, for
/// then the nodes only differ as a surface of the second order does.
const HIDDEN: f32 = 3.0;
const TOLD: f32 = 0.5;
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
    /// How the membrane moved at the nodes of the largest squares; only where it did.
    motions: Vec<Motion>,
    /// Of each of the largest squares.
    sources: Vec<Source>,
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
    /// How far a middle may be from what the corners promise, full scales; with 0 every pixel has its own ray, followed
    /// all the way.
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
            motions: Vec::new(),
            sources: Vec::new(),
            moved_mm: DVec3::ZERO,
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
                let in_dent = dented.is_some_and(|dented| dented.meets(x, y, side));
                if side == LARGEST && surface.tolerance > 0.0 {
                    self.settle_source((x, y), in_dent, surface.tolerance);
                }
                let mut verdict = self.judge((x, y), half, in_dent, surface.tolerance);
                // What lies between the nodes, none of them shows: the light's own table does.
                if verdict != Verdict::Misses
                    && let Some(bend) = self.bend(surface, (x, y), side)
                {
                    if bend.most > HIDDEN * surface.tolerance {
                        verdict = Verdict::Rough;
                    } else if bend.most < TOLD * surface.tolerance && bend.is_inside {
                        verdict = Verdict::Smooth;
                    }
                }
                match verdict {
                    Verdict::Smooth if half > 1 && !(in_dent && side > IN_DENT) => {
                        self.biquadratic(x, y, half);
                        work.add_base((side * side) as u64 * units::FILL);
                    }
                    // A square whose nine rays all miss may still hold a corner of the dome; large ones are divided
                    // once more.
                    Verdict::Misses if side <= MISSED => {}
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

    fn node(&self, x: usize, y: usize) -> (Known, [f32; N]) {
        let at = y * self.width + x;
        let known = self.known.get(at).copied().unwrap_or(Known::Misses);
        let level = |lane: usize| self.levels[lane].get(at).copied().unwrap_or(0.0);
        (known, std::array::from_fn(level))
    }
}
