//! The lit membrane in the picture: exact at as few pixels as smoothness allows, a smooth surface in between.
//!
//! The picture is divided into squares of 32 px. Of each the brightness at its corners, sides' middles and middle is
//! worked out exactly (ray, deformed membrane, light). Where the middles are what the corners promise, within a
//! tolerance, or what the square of twice the size foretold, the square is filled by the biquadratic surface through
//! the nine; else it falls into four, down to single pixels. Pixels are their own nodes, so nothing is worked out twice.
//!
//! What lies between its nodes, a square cannot know from them: the edge of a dent or of a shadow may pass there. The tables
//! of the membrane and of its light tell it: each bounds what a surface of the second order can leave of it over a part of
//! the dome ([`super::dent::Dent::bend`], [`Shading::bend`]), and where the bounds are above the tolerance the square is
//! divided whatever its nodes say.
//!
//! What the lens and the layers do is smooth whatever the membrane does: cubics through a lattice of rays tell the others
//! ([`rays`]). Where besides nothing moves, or so that the change of the light is smooth, squares of 8 px are divided with
//! nodes that are told, and those of 4 px that are still not smooth are lit pixel by pixel ([`paint`]).

mod motion;
mod paint;
mod points;
mod rays;
mod settle;
mod smooth;

use std::ops::Range;

use glam::{DVec2, Vec3A, Vec4};

use self::motion::{Motion, SMALLEST, Square};
use self::rays::Rays;
use self::smooth::Verdict;
use super::coverage::LEAST_SHARE;
use super::dent::Dent;
use super::field::LensRays;
use super::shading::{PlainSample, Shading, SurfaceSample};
use super::work::Work;
use domecast_optics::SensorOptics;

/// Side of the largest squares, px; a power of two.
pub(super) const LARGEST: usize = 32;
/// Parts of the tolerance: a bound on what the surface through the nodes leaves that is above the first divides a
/// square whatever its nodes say; one below the second does not, for then the nodes only differ as a surface of the
/// second order does. The bounds take the worst of all directions, cells and phases at once, some ten times what is
/// found; with these parts no pixel of many objects' pictures was found further off than the tolerance.
const HIDDEN: f32 = 2.3;
const TOLD: f32 = 0.3;
/// Pixels without a ray take the brightness of others up to so many pixels away.
const NEAR_PX: usize = 4;
/// Squares up to this size, px, whose nine rays miss the dome show none of it.
const MISSED: usize = 8;

/// Counted work of a ray to the dome, and of a point of the deformed membrane.
pub(super) mod units {
    /// A ray through lens, layers and dome.
    pub const RAY: u64 = 60;
    /// The same told from the rays about it.
    pub const TOLD_RAY: u64 = 12;
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

/// Brightness of the membrane over the picture, for channels that share their rays.
#[derive(Debug, Clone, Default)]
pub struct Lit {
    width: usize,
    height: usize,
    /// Red, green and blue; the fourth number is nothing.
    levels: Vec<Vec4>,
    /// 1 for the channels whose brightness is asked, else 0.
    asked: Vec4,
    known: Vec<Known>,
    /// Rays and motions of nodes.
    motions: Vec<Motion>,
    /// Of each pixel that may be a node, which of these is its own.
    kept: Vec<u32>,
    /// What is known of squares as a whole, of nothing first; and which of these is each smallest square's own.
    known_squares: Vec<Square>,
    squares: Vec<u32>,
    known_rays: Vec<Rays>,
    rays: Vec<u32>,
    /// The motion of the pixel that was asked last, mm.
    moved_mm: Vec3A,
    samples: Vec<SurfaceSample>,
    /// Of each sample the pixel, and the share that it has in its brightness.
    places: Vec<(usize, f32)>,
    /// What the samples show.
    shown: Vec<Vec4>,
    plain: Vec<PlainSample>,
    /// Of each plain sample the pixel.
    painted: Vec<usize>,
}

/// The membrane that is lit.
pub struct LitSurface<'a> {
    /// Slices of rows that see it at times of their own, from the first row; not empty.
    pub slices: &'a [LitSlice<'a>],
    /// What the pixels see, where it is known.
    pub rays: Option<&'a LensRays>,
    /// The light.
    pub shading: &'a dyn Shading,
    /// The channels whose brightness is wanted, of 0 to 2.
    pub channels: Range<usize>,
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

/// Whether pixels of some spans, by row, lie in a square. Squares that share their sides share their nodes, of which one of
/// them shows the dome: nothing else is asked.
fn shows(spans: &[Range<usize>], (x, y): (usize, usize), side: usize) -> bool {
    let rows = spans.get(y..(y + side + 1).min(spans.len())).unwrap_or_default();
    rows.iter().any(|span| span.start <= x + side && span.end > x)
}

/// The nodes of a square, row by row.
fn nine((x, y): (usize, usize), side: usize) -> [(usize, usize); 9] {
    std::array::from_fn(|i| (x + i % 3 * (side / 2), y + i / 3 * (side / 2)))
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

impl Lit {
    /// Works out the brightness of the pixels of `spans`, by row, those of the picture that show the dome. Whenever more rows
    /// are known, with what [`Self::complete`] takes from others, `take` is given them, from the first row to the last.
    pub fn fill(
        &mut self,
        surface: &LitSurface<'_>,
        size: (usize, usize),
        spans: &[Range<usize>],
        work: &mut Work,
        mut take: impl FnMut(&mut Self, Range<usize>),
    ) {
        // Nodes lie on the corners of squares, so the grid reaches one pixel past the last square.
        let grid = |n: usize| n.div_ceil(LARGEST) * LARGEST + 1;
        (self.width, self.height) = (grid(size.0), grid(size.1));
        let count = self.width * self.height;
        self.levels.resize(count, Vec4::ZERO);
        let asked = |lane: usize| if surface.channels.contains(&lane) { 1.0 } else { 0.0 };
        self.asked = Vec4::new(asked(0), asked(1), asked(2), 0.0);
        self.known.clear();
        self.known.resize(count, Known::Nothing);
        self.lay_out_motions();
        // Rows of squares one after the other, so that what a row is made of stays near at hand; each once the nodes of the
        // next are known as well.
        let rows = size.1.div_ceil(LARGEST);
        let (mut squares, mut next, mut taken) = (Vec::new(), Vec::new(), 0);
        for row in 0..=rows {
            std::mem::swap(&mut squares, &mut next);
            next.clear();
            let columns = (0..size.0).step_by(LARGEST).map(|x| (x, row * LARGEST));
            next.extend(columns.filter(|corner| row < rows && shows(spans, *corner, LARGEST)));
            for (x, y) in &next {
                self.ask(surface, (*x, *y), nine((*x, *y), LARGEST), work);
            }
            self.light(surface, work);
            self.divide(surface, spans, &mut squares, work);
            let known = if row < rows { (row * LARGEST).saturating_sub(NEAR_PX + 1) } else { size.1 };
            take(self, taken..known);
            taken = known;
        }
    }

    /// Fills in largest squares of which the nodes are known, or divides them.
    fn divide(
        &mut self,
        surface: &LitSurface<'_>,
        spans: &[Range<usize>],
        squares: &mut Vec<(usize, usize)>,
        work: &mut Work,
    ) {
        let mut next = Vec::new();
        let mut side = LARGEST;
        while side >= 2 && !squares.is_empty() {
            let half = side / 2;
            if side < LARGEST {
                for (x, y) in squares.iter() {
                    if side == SMALLEST && surface.tolerance > 0.0 {
                        self.find_rays(surface, (*x, *y), work);
                    }
                    self.ask(surface, (*x, *y), nine((*x, *y), side), work);
                }
                self.light(surface, work);
            }
            for (x, y) in squares.drain(..) {
                if side >= SMALLEST && surface.tolerance > 0.0 && self.square((x, y)).is_open() {
                    self.settle(surface, (x, y), side, work);
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
                    // Pixel by pixel, if the smaller nodes were told as well.
                    Verdict::Rough if side < SMALLEST && self.paint(surface, (x, y), (side, 1), work) => {}
                    _ => {
                        if side == SMALLEST {
                            self.paint(surface, (x, y), (side, 2), work);
                        }
                        let parts = [(x, y), (x + half, y), (x, y + half), (x + half, y + half)];
                        next.extend(parts.into_iter().filter(|part| shows(spans, *part, half)));
                    }
                }
            }
            std::mem::swap(squares, &mut next);
            side = half;
        }
        squares.clear();
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

    /// Brightness of a row's pixels, red, green, blue. Only the channels asked for, and what [`Self::complete`] was told of,
    /// have a meaning.
    pub fn row(&self, y: usize, columns: Range<usize>) -> &[Vec4] {
        let place = |x: usize| y * self.width + x;
        self.levels.get(place(columns.start)..place(columns.end)).unwrap_or_default()
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
                self.levels.get_mut(at).into_iter().for_each(|level| *level = near);
            }
        }
    }

    #[cold]
    fn near(&self, x: usize, y: usize, inwards: DVec2) -> Vec4 {
        let from = DVec2::new(x as f64, y as f64);
        let step = (inwards - from).normalize_or_zero();
        let beside = |k: u32| {
            let place = (from + step * f64::from(k)).round().max(DVec2::ZERO);
            let (known, level) = self.node(place.x as usize, place.y as usize);
            (known == Known::Lit).then_some(level)
        };
        (0..=NEAR_PX as u32).find_map(beside).unwrap_or(Vec4::ZERO)
    }

    fn node(&self, x: usize, y: usize) -> (Known, Vec4) {
        let at = y * self.width + x;
        let known = self.known.get(at).copied().unwrap_or(Known::Misses);
        (known, self.levels.get(at).copied().unwrap_or(Vec4::ZERO))
    }
}
