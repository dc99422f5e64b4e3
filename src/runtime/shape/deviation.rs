//! How far a height may be off.
//!
//! A height is what slopes add up to from the bonded rim. Slopes whose errors have the spectral density `S` (rad^2 cells^2) make
//! heights err by `S / k^2` at the wave number k: each octave of wavelengths from a cell up to the dome adds `S ln 2 / (2 pi)` squares
//! of a cell's size (Green's function of the Laplace equation in the plane). Least squares go around places that say little, so what
//! counts of a region is the geometric mean of its `S` (A. M. Dykhne, Sov. Phys. JETP 32, 1971: conduction of a random sheet).
//!
//! How large errors are beside what the readings promise is seen at each size of block. They have two halves: one is the slope of some
//! height and cannot be seen; the other, the curl, is the slope of nothing, and is what the least squares leave over. Noise and what
//! JPEG makes of blocks have no direction of their own and give both alike. The middle one of all blocks counts: touches are few.

use glam::Vec3A;
use rayon::prelude::*;

use super::cells::{Cells, View};
use super::normals::CellReading;
use super::rows::share;

/// Cells along the side of the smallest blocks, those of a camera's JPEG, how often these are doubled, and for how many of the
/// doublings what is left over is looked at: there are few larger ones.
const BLOCK: usize = 4;
const LEVELS: usize = 5;
const MIN_STRIPS: usize = 6;
const SEEN_LEVELS: usize = 2;

/// Octaves from a cell to the smallest block.
const FIRST_OCTAVES: f32 = 2.0;

/// What waves shorter than two cells add, over `S / (2 pi)`: slopes between cells are means of two (summed over the lattice's
/// own spectrum).
const OWN_CELL: f32 = 0.546;

/// Share of a block's cells that must be read for it to say what is left over, and how many such blocks there must be.
const MIN_READ: f32 = 0.9;
const MIN_BLOCKS: usize = 20;

/// Middle one of the squares of a normal number.
const CHI_MEDIAN: f32 = 0.455;

/// Part of the depth: what reading at two shapes and cells of finite size leave under a touch (1 to 4 % without any noise, presses
/// of balls, edges and nuts on three designs).
const DEPTH_PART: f32 = 0.02;

/// Part of the slope of a hole that is filled in from around.
const HOLE_PART: f32 = 0.25;

/// Variance of the noise in a hole over that beside it: readings on one side only, not on two.
const HOLE_NOISE: f32 = 2.0;

/// Rounds of the walk: one more than the ways have turns back.
const WALKS: usize = 3;

/// Sums over a block's cells.
#[derive(Debug, Clone, Copy, Default)]
struct Block {
    cells: f32,
    read: f32,
    /// Logarithms of variances of a cell's step, mm^2: of those that are read, and of all.
    logs: f32,
    all_logs: f32,
    /// Variances of the steps across and down, where they are read, mm^2, and what is left between the cells, mm.
    variances_mm2: [f32; 2],
    left_mm: [f32; 2],
    /// Variance of a cell's step, mm^2, once all are added.
    variance_mm2: f32,
}

/// Blocks of a size.
#[derive(Debug, Clone, Default)]
struct Size {
    columns: usize,
    blocks: Vec<Block>,
}

/// Deviations of the cells' heights, kept between frames.
#[derive(Debug, Clone, Default)]
pub(super) struct Deviations {
    sizes: [Size; LEVELS],
    /// By how much errors over blocks of a size are larger than promised, as squares.
    factors: [f32; LEVELS],
    ratios: Vec<f32>,
    /// Variance of the noise of a height, mm^2, by smallest block.
    noise_mm2: Vec<f32>,
    /// Cells without readings on the way from the rim, where the skin is bonded: on the shortest in these.
    away: Vec<f32>,
    /// Slope of the skin in the holes over the dome's, times cells' size, mm; 0 beside them.
    hole_mm: Vec<f32>,
}

impl Deviations {
    /// Takes a frame's readings; `tilt` is what was filled in, `left_mm` what the solve leaves between a cell and the next one,
    /// across or down.
    pub fn measure(
        &mut self,
        cells: &Cells,
        view: &View,
        readings: &[CellReading],
        tilt: impl Fn(usize) -> Vec3A + Sync,
        left_mm: impl Fn(usize, usize) -> f32 + Sync,
    ) {
        let w = cells.width;
        let is_dome = |cell: usize| view.is_dome.get(cell).copied().unwrap_or(false);
        self.sizes[0].clear(w.div_ceil(BLOCK), cells.height.div_ceil(BLOCK));
        self.hole_mm.clear();
        self.hole_mm.resize(cells.count(), 0.0);
        let Size { columns, blocks } = &mut self.sizes[0];
        let strips = blocks.par_chunks_mut(*columns).zip(self.hole_mm.par_chunks_mut(BLOCK * w));
        let strips = strips.zip(view.spans.par_chunks(BLOCK)).enumerate().with_min_len(share(MIN_STRIPS));
        strips.for_each(|(strip, ((blocks, hole_mm), spans))| {
            let rows = spans.iter().enumerate();
            for (row, column) in rows.flat_map(|(row, span)| span.clone().map(move |column| (row, column))) {
                let cell = (strip * BLOCK + row) * w + column;
                let [right, below] = [cell + 1, cell + w];
                if !(is_dome(cell) && is_dome(right) && is_dome(below)) {
                    continue;
                }
                let block = &mut blocks[column / BLOCK];
                let mut variances_mm2 = [0.0; 2];
                for (k, next) in [right, below].into_iter().enumerate() {
                    let square = view.surface_mm[next].distance_squared(view.surface_mm[cell]);
                    variances_mm2[k] = square * 0.5 * (readings[cell].spread[k] + readings[next].spread[k]);
                }
                let log = 0.5 * (variances_mm2[0] * variances_mm2[1]).max(1e-30).ln();
                block.cells += 1.0;
                block.all_logs += log;
                if [cell, right, below].into_iter().all(|cell| readings[cell].is_read) {
                    block.read += 1.0;
                    block.logs += log;
                    for (k, next) in [right, below].into_iter().enumerate() {
                        block.variances_mm2[k] += variances_mm2[k];
                        block.left_mm[k] += left_mm(cell, next);
                    }
                } else {
                    let size_mm = view.surface_mm[right].distance(view.surface_mm[cell]);
                    hole_mm[row * w + column] = (HOLE_PART * tilt(cell).length() * size_mm).max(1e-6);
                }
            }
        });
        self.add_up(cells.height.div_ceil(BLOCK));
        self.add_noise();
        self.walk_from_rim(cells, view, readings);
    }

    /// Makes the larger blocks of the smallest, and their factors.
    fn add_up(&mut self, rows: usize) {
        let (mut rows, mut before) = (rows, 1.0);
        for k in 0..LEVELS {
            let (finer, coarser) = self.sizes.split_at_mut(k);
            let Some(size) = coarser.first_mut() else { return };
            if let Some(fine) = finer.last() {
                rows = rows.div_ceil(2);
                size.clear(fine.columns.div_ceil(2), rows);
                for (i, block) in fine.blocks.iter().enumerate() {
                    let to = i / fine.columns / 2 * size.columns + i % fine.columns / 2;
                    size.blocks[to].add(block);
                }
            }
            size.blocks.iter_mut().for_each(Block::find_variance);
            if k < SEEN_LEVELS {
                before =
                    size.factor(((BLOCK << k) * (BLOCK << k)) as f32, &mut self.ratios).unwrap_or(before);
            }
            self.factors[k] = before;
        }
    }

    /// Adds up the octaves for each of the smallest blocks.
    fn add_noise(&mut self) {
        let finest = &self.sizes[0];
        self.noise_mm2.clear();
        for i in 0..finest.blocks.len() {
            let (row, column) = (i / finest.columns.max(1), i % finest.columns.max(1));
            let mut sum = 0.0;
            for (k, (size, factor)) in self.sizes.iter().zip(self.factors).enumerate() {
                let block = &size.blocks[(row >> k) * size.columns + (column >> k)];
                let octaves = if k == 0 {
                    OWN_CELL + FIRST_OCTAVES * std::f32::consts::LN_2
                } else {
                    std::f32::consts::LN_2
                };
                sum += octaves * factor * block.variance_mm2;
            }
            self.noise_mm2.push(sum / std::f32::consts::TAU);
        }
    }

    fn walk_from_rim(&mut self, cells: &Cells, view: &View, readings: &[CellReading]) {
        let w = cells.width;
        let is_dome = |cell: usize| view.is_dome.get(cell).copied().unwrap_or(false);
        self.away.clear();
        self.away.resize(cells.count(), f32::INFINITY);
        for cell in (0..cells.count()).filter(|cell| view.is_dome[*cell]) {
            let around = [cell + 1, cell + w, cell.wrapping_sub(1), cell.wrapping_sub(w)];
            if !around.into_iter().all(is_dome) {
                self.away[cell] = 0.0;
            }
        }
        let cost = |cell: usize| if readings[cell].is_read { 0.0 } else { 1.0 };
        for _ in 0..WALKS {
            let is_down_new = self.walk(cells, view, true, cost);
            if !(self.walk(cells, view, false, cost) || is_down_new) {
                break;
            }
        }
    }

    /// Costs of the way by two passes over the neighbours (G. Borgefors, Computer Vision 27, 1984), of which this is one, down or up.
    /// Whether any has become less.
    fn walk(&mut self, cells: &Cells, view: &View, is_down: bool, cost: impl Fn(usize) -> f32) -> bool {
        let (w, rows, mut is_new) = (cells.width, cells.height, false);
        for k in 0..rows {
            let row = if is_down { k } else { rows - 1 - k };
            let (start, span) = (row * w, view.spans[row].clone());
            let mut beside = f32::INFINITY;
            for k in 0..span.len() {
                let cell = start + if is_down { span.start + k } else { span.end - 1 - k };
                let own = self.away[cell];
                // The rim, and what is reached without cost, comes no nearer.
                if own > 0.0 && view.is_dome[cell] {
                    let along = if is_down { cell.checked_sub(w) } else { Some(cell + w) };
                    let along = along.and_then(|cell| self.away.get(cell)).copied().unwrap_or(f32::INFINITY);
                    let found = own.min(along.min(beside) + cost(cell));
                    is_new |= found < own;
                    self.away[cell] = found;
                    beside = found;
                } else {
                    beside = own;
                }
            }
        }
        is_new
    }

    /// Cells without readings on the way from the rim to each cell.
    pub fn away(&self) -> &[f32] {
        &self.away
    }

    /// Variance of a cell's height less what a dark ring leaves, mm^2.
    pub fn variance_mm2(&self, cell: usize, width: usize, height_mm: f32) -> f32 {
        let (row, column) = (cell / width / BLOCK, cell % width / BLOCK);
        let noise = self.noise_mm2.get(row * self.sizes[0].columns + column).copied().unwrap_or(0.0);
        let hole_mm = self.hole_mm[cell];
        // What is read on a hole's border errs alike all through it.
        let noise = if hole_mm > 0.0 { HOLE_NOISE * noise } else { noise };
        noise + (DEPTH_PART * height_mm).powi(2) + hole_mm.powi(2) * BLOCK as f32
    }
}

impl Size {
    fn clear(&mut self, columns: usize, rows: usize) {
        self.columns = columns;
        self.blocks.clear();
        self.blocks.resize(columns * rows, Block::default());
    }

    /// Squares of what blocks of so many cells leave over, over those that the readings promise: the middle one.
    fn factor(&self, whole: f32, ratios: &mut Vec<f32>) -> Option<f32> {
        ratios.clear();
        for block in self.blocks.iter().filter(|block| block.read >= MIN_READ * whole) {
            for (left, variance) in block.left_mm.into_iter().zip(block.variances_mm2) {
                // Half of the errors is left over.
                ratios.push(2.0 * left * left / variance.max(1e-30));
            }
        }
        if ratios.len() < 2 * MIN_BLOCKS {
            return None;
        }
        let middle = ratios.len() / 2;
        Some(*ratios.select_nth_unstable_by(middle, f32::total_cmp).1 / CHI_MEDIAN)
    }
}

impl Block {
    /// Finds the variance of a cell's step. Holes are filled from what is read around them, and err as that does.
    fn find_variance(&mut self) {
        let (logs, cells) =
            if self.read > 0.0 { (self.logs, self.read) } else { (self.all_logs, self.cells) };
        self.variance_mm2 = if cells > 0.0 { (logs / cells).exp() } else { 0.0 };
    }

    fn add(&mut self, other: &Self) {
        self.cells += other.cells;
        self.read += other.read;
        self.logs += other.logs;
        self.all_logs += other.all_logs;
        for k in [0, 1] {
            self.variances_mm2[k] += other.variances_mm2[k];
            self.left_mm[k] += other.left_mm[k];
        }
    }
}
