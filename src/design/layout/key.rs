//! The key: one dot left out, so that a turned or mirrored picture shows itself.
//!
//! A lattice looks the same after some turns and mirrorings, and so do markers at the corners of a square: every dot
//! of a picture turned so would carry another dot's number, and nothing would look wrong. One dot left out where no
//! turn or mirroring leads back to it breaks that. Its *images* are the dots where the gap would be seen then. A
//! runtime looks whether the gap is at the key, and dots at all of its images.
//!
//! One gap is enough. With one dot broken or one speck of dirt among these places, either no place is empty or two
//! are, and a runtime says that it is unsure; a wrong answer takes dirt on the gap and a broken dot at one of its
//! images at the same time.
//!
//! # Example
//! ```
//! use domecast_design::Design;
//!
//! # const THUMB24: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json");
//! let layout = Design::load(THUMB24.as_ref())?.layout()?;
//! let key = layout.key.ok_or("the lattice is symmetric")?;
//! // a square lattice: three turns, four mirrorings
//! assert_eq!(key.images.len(), 7);
//! println!("no dot at {} px", key.dot.image_px);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::f64::consts::TAU;

use glam::DVec2;

use super::dot::Dot;

/// Turns that are tried: multiples of 15 degrees hold those of square and hexagonal lattices.
const TURNS: u32 = 24;
/// A pattern is taken to map onto itself where this share of its dots meets dots.
const MIN_SHARE: f64 = 0.5;
/// Dots meet within this part of their spacing.
const REACH: f64 = 0.25;
/// Dots that a symmetry is judged by, and dots that are weighed as keys.
const MAX_JUDGED: usize = 2000;
/// Images farther from the key than so many spacings are as good as any.
const ENOUGH_APART: f64 = 2.5;
/// Images nearer than this many spacings cannot be distinguished from the key.
const MIN_APART: f64 = 0.9;

/// The dot that is left out.
#[derive(Debug, Clone, PartialEq)]
pub struct PatternKey {
    /// The dot as it would be. Its number is that of no dot; its neighbours are those that it would have.
    pub dot: Dot,
    /// Where the gap would be seen in a turned or mirrored picture.
    pub images: Vec<KeyImage>,
}

/// A dot where a turned or mirrored picture would show the gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyImage {
    /// By how much the picture would be turned about the pattern's centre, from image x towards image y, rad; after
    /// it was mirrored, if it is.
    pub turned_rad: f64,
    /// Whether the picture would be mirrored left to right.
    pub is_mirrored: bool,
    /// The dot.
    pub dot: u32,
}

/// A turn of the picture, after a mirroring or not.
#[derive(Debug, Clone, Copy)]
struct Symmetry {
    turned_rad: f64,
    is_mirrored: bool,
}

impl Symmetry {
    /// Where the picture so changed shows a place, both about the centre.
    fn apply(self, place: DVec2) -> DVec2 {
        let mirrored = if self.is_mirrored { DVec2::new(-place.x, place.y) } else { place };
        DVec2::from_angle(self.turned_rad).rotate(mirrored)
    }
}

/// Dots by place, about the pattern's centre.
struct Places {
    at: Vec<DVec2>,
    spacing: Vec<f64>,
    cell: f64,
    half: i64,
    cells: Vec<Vec<u32>>,
}

impl Places {
    fn new(at: Vec<DVec2>) -> Self {
        let reach = at.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        // About one dot a cell.
        let cell = (2.0 * reach / (at.len() as f64).sqrt()).max(1e-6);
        let half = (reach / cell).ceil() as i64 + 1;
        let mut places = Self { spacing: vec![f64::INFINITY; at.len()], cell, half, cells: Vec::new(), at };
        let side = (2 * half + 1) as usize;
        places.cells.resize(side * side, Vec::new());
        for index in 0..places.at.len() {
            if let Some(cell) = places.cell_at(places.at[index], [0, 0]) {
                places.cells[cell].push(index as u32);
            }
        }
        for index in 0..places.at.len() {
            let from = places.at[index];
            let others = places.around(from).filter(|other| *other != index);
            let nearest = others.map(|other| places.at[other].distance(from)).fold(f64::INFINITY, f64::min);
            places.spacing[index] = nearest;
        }
        places
    }

    fn cell_at(&self, at: DVec2, step: [i64; 2]) -> Option<usize> {
        let index = |v: f64, step: i64| (v / self.cell).round() as i64 + self.half + step;
        let (x, y) = (index(at.x, step[0]), index(at.y, step[1]));
        let side = 2 * self.half + 1;
        ((0..side).contains(&x) && (0..side).contains(&y)).then(|| (y * side + x) as usize)
    }

    fn around(&self, at: DVec2) -> impl Iterator<Item = usize> + '_ {
        let steps = (-2..=2).flat_map(|y| (-2..=2).map(move |x| [x, y]));
        let cells = steps.filter_map(move |step| self.cell_at(at, step));
        cells.flat_map(|cell| self.cells[cell].iter().map(|index| *index as usize))
    }

    /// The dot at a place.
    fn dot_at(&self, at: DVec2) -> Option<usize> {
        let near = self.around(at).map(|index| (self.at[index].distance(at), index));
        let (distance, index) = near.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?;
        (distance < REACH * self.spacing[index]).then_some(index)
    }

    /// The turns and mirrorings that map the pattern onto itself; `rotation_rad`: the pattern's own turn, about which
    /// its mirror lines lie.
    fn symmetries(&self, rotation_rad: f64) -> Vec<Symmetry> {
        let step = self.at.len().div_ceil(MAX_JUDGED);
        let all = [false, true].into_iter().flat_map(|is_mirrored| {
            (0..TURNS).map(move |k| {
                let own = if is_mirrored { 2.0 * rotation_rad } else { 0.0 };
                let turned_rad = (TAU * f64::from(k) / f64::from(TURNS) + own).rem_euclid(TAU);
                Symmetry { turned_rad, is_mirrored }
            })
        });
        // The first changes nothing.
        let kept = all.skip(1).filter(|symmetry| {
            let judged = self.at.iter().step_by(step);
            let count = judged.len() as f64;
            let met = judged.filter(|at| self.dot_at(symmetry.apply(**at)).is_some()).count();
            met as f64 >= MIN_SHARE * count
        });
        kept.collect()
    }
}

/// What there is to leave out.
pub(super) enum KeyChoice {
    /// No turn or mirroring maps the pattern onto itself: no key is needed.
    NotNeeded,
    /// The pattern is symmetric, and no dot of it is off all its mirror lines.
    None,
    /// The index of the dot, and its images as turn, mirroring and index.
    Dot(usize, Vec<(f64, bool, usize)>),
}

/// Chooses the key among the dots: off the mirror lines by two and a half spacings where there is one, all of its images
/// dots, and as near as can be to half of the pattern's polar angle. There it is seen at rest and under load, clear of
/// markers, mask and rim, the pad prints safely, and the pole's first touch stays as it is.
pub(super) fn choose(dots: &[Dot], center_px: DVec2, rotation_rad: f64) -> KeyChoice {
    let places = Places::new(dots.iter().map(|dot| dot.image_px - center_px).collect());
    let symmetries = places.symmetries(rotation_rad);
    if symmetries.is_empty() {
        return KeyChoice::NotNeeded;
    }
    let furthest_rad = dots.iter().map(Dot::polar_rad).fold(1e-9, f64::max);
    let off_middle = |index: usize| (dots[index].polar_rad() / furthest_rad - 0.5).abs();
    let mut order: Vec<usize> = (0..dots.len()).collect();
    order.sort_by(|a, b| off_middle(*a).total_cmp(&off_middle(*b)).then(a.cmp(b)));
    let mut best: Option<(f64, usize)> = None;
    for index in order.into_iter().take(MAX_JUDGED) {
        let at = places.at[index];
        let images = symmetries.iter().map(|symmetry| symmetry.apply(at));
        let apart = images.clone().map(|image| image.distance(at)).fold(f64::INFINITY, f64::min);
        let apart = apart / places.spacing[index];
        if apart < MIN_APART {
            continue;
        }
        let missing = images.filter(|image| places.dot_at(*image).is_none()).count();
        let score = apart.min(ENOUGH_APART) - off_middle(index) - missing as f64;
        if best.is_none_or(|(so_far, _)| score > so_far) {
            best = Some((score, index));
        }
    }
    let Some((_, index)) = best else { return KeyChoice::None };
    let image = |symmetry: &Symmetry| {
        let dot = places.dot_at(symmetry.apply(places.at[index]))?;
        Some((symmetry.turned_rad, symmetry.is_mirrored, dot))
    };
    KeyChoice::Dot(index, symmetries.iter().filter_map(image).collect())
}
