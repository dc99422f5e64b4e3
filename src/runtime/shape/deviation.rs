//! How far a height may be off.
//!
//! A height is what slopes add up to from the bonded rim. Slopes whose errors have the spectral density `S` (rad^2 cells^2) make
//! heights err by `S / k^2` at the wave number k: each octave of wavelengths from a cell up to the dome adds `S ln 2 / (2 pi)` squares
//! of a cell's size (Green's function of the Laplace equation in the plane: `S (ln R + 0.546) / (2 pi)` in the middle of a disc of R
//! cells). Least squares go around places that say little, so what counts of a region is the geometric mean of its `S` (A. M. Dykhne,
//! Sov. Phys. JETP 32, 1971: conduction of a random sheet).
//!
//! Holes, dots among them, are filled from around: a region's slope rests on the readings that it has, so `S` is that of a reading
//! over the share of the region that is no hole. A hole itself errs as what is around it. A reading that was drawn towards its
//! surroundings errs less from cell to cell, but over many cells as much as it did before.
//!
//! How large errors are beside what the readings promise is seen at each size of block. They have two halves: one is the slope of some
//! height and cannot be seen; the other, the curl, is the slope of nothing, and is what the least squares leave over. Noise and what
//! JPEG makes of blocks have no direction of their own and give both alike. The middle one of all blocks counts: touches are few.

use glam::Vec3A;
use rayon::prelude::*;

use super::cells::{Cells, View};
use super::normals::CellReading;
use super::rows::share;

/// Cells along the side of the smallest blocks, those of a camera's JPEG, which are doubled until one covers the picture, and for how
/// many of the sizes what is left over is looked at: there are few larger ones.
const BLOCK: usize = 4;
const MIN_STRIPS: usize = 6;
const SEEN_LEVELS: usize = 2;

/// Part of the noise of the frame at rest, whose cells are smoothed before they are divided by, that is left in means over blocks of
/// these sizes. In larger ones all of it is: errors there are those of two frames.
const REST_LEFT: [f32; SEEN_LEVELS] = [0.373, 0.644];

/// The size from which on blocks say what share of them is holes: smaller ones may lie within one.
const HOLE_LEVEL: usize = 2;

/// Readings are taken to cover no less of a block.
const MIN_COVERED: f32 = 0.1;

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

/// Rounds of the walk: one more than the ways have turns back.
const WALKS: usize = 3;

/// Sums over a block's cells.
#[derive(Debug, Clone, Copy, Default)]
struct Block {
    cells: f32,
    read: f32,
    /// Cells that are filled in from around, and those that are neither that nor read: without light.
    holes: f32,
    unlit: f32,
    /// Logarithms of variances of a cell's step, mm^2: of those that are read, and of those that are not.
    logs: f32,
    other_logs: f32,
    /// Variances of the steps across and down, where they are read, mm^2, and what is left between the cells, mm.
    variances_mm2: [f32; 2],
    left_mm: [f32; 2],
    /// What an octave of waves as long as the block adds to a height's variance, times `2 pi / ln 2`, mm^2, once all are added.
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
    sizes: Vec<Size>,
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
        self.clear(w.div_ceil(BLOCK), cells.height.div_ceil(BLOCK));
        self.hole_mm.clear();
        self.hole_mm.resize(cells.count(), 0.0);
        let Some(Size { columns, blocks }) = self.sizes.first_mut() else { return };
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
                    variances_mm2[k] = square * 0.5 * (readings[cell].noise[k] + readings[next].noise[k]);
                }
                let log = 0.5 * (variances_mm2[0] * variances_mm2[1]).max(1e-30).ln();
                block.cells += 1.0;
                if [cell, right, below].into_iter().all(|cell| readings[cell].is_read) {
                    block.read += 1.0;
                    block.logs += log;
                    for (k, next) in [right, below].into_iter().enumerate() {
                        block.variances_mm2[k] += variances_mm2[k];
                        block.left_mm[k] += left_mm(cell, next);
                    }
                } else {
                    let size_mm = view.surface_mm[right].distance(view.surface_mm[cell]);
                    hole_mm[row * w + column] = HOLE_PART * tilt(cell).length() * size_mm;
                    if !readings[cell].is_read {
                        block.other_logs += log;
                        let is_hole = readings[cell].tilt.weight() < 1.0;
                        *(if is_hole { &mut block.holes } else { &mut block.unlit }) += 1.0;
                    }
                }
            }
        });
        let factors = self.factors();
        self.find_variances(factors);
        self.add_noise();
        self.walk_from_rim(cells, view, readings);
    }

    /// Empties the blocks, of which the smallest have so many columns and rows; the largest is one.
    fn clear(&mut self, mut columns: usize, mut rows: usize) {
        for k in 0.. {
            if self.sizes.len() == k {
                self.sizes.push(Size::default());
            }
            self.sizes[k].clear(columns, rows);
            if columns * rows <= 1 {
                break;
            }
            (columns, rows) = (columns.div_ceil(2), rows.div_ceil(2));
        }
    }

    /// Makes the larger blocks of the smallest. By how much errors over blocks are larger than promised, as squares: of each size that is
    /// looked at, and of all larger ones.
    fn factors(&mut self) -> [f32; SEEN_LEVELS + 1] {
        for k in 1..self.sizes.len() {
            let (finer, coarser) = self.sizes.split_at_mut(k);
            let (Some(fine), Some(size)) = (finer.last(), coarser.first_mut()) else { break };
            for (i, block) in fine.blocks.iter().enumerate() {
                size.blocks[i / fine.columns / 2 * size.columns + i % fine.columns / 2].add(block);
            }
        }
        // Of a size without blocks to look at, that of the smaller one, with what more of the noise at rest is left in it; before the
        // first, what noise promises.
        let (mut factor, mut left) = (1.0, 0.0);
        let mut factors = [1.0; SEEN_LEVELS + 1];
        for (k, out) in factors.iter_mut().enumerate() {
            let own_left = REST_LEFT.get(k).copied().unwrap_or(1.0);
            let whole = ((BLOCK << k) * (BLOCK << k)) as f32;
            let size = self.sizes.get(k).filter(|_| k < SEEN_LEVELS);
            let seen = size.and_then(|size| size.factor(whole, &mut self.ratios));
            factor = seen.unwrap_or(factor * (1.0 + own_left) / (1.0 + left));
            (left, *out) = (own_left, factor);
        }
        factors
    }

    /// Finds what each block's octave adds, the largest first: one in a hole errs as what is around it.
    fn find_variances(&mut self, factors: [f32; SEEN_LEVELS + 1]) {
        for k in (0..self.sizes.len()).rev() {
            let (finer, coarser) = self.sizes.split_at_mut(k + 1);
            let (smaller, own) = finer.split_at_mut(k);
            let Some(Size { columns, blocks }) = own.first_mut() else { break };
            let columns = *columns;
            let around = |i: usize, up: usize| {
                let size = coarser.get(up.checked_sub(1)?)?;
                size.blocks.get(((i / columns) >> up) * size.columns + ((i % columns) >> up))
            };
            let factor = factors[k.min(SEEN_LEVELS)];
            let to_holes = HOLE_LEVEL.saturating_sub(smaller.len());
            for (i, block) in blocks.iter_mut().enumerate() {
                let beyond = around(i, 1).map(|block| block.variance_mm2);
                let covered = around(i, to_holes).unwrap_or(block).covered();
                block.variance_mm2 = block.octave_mm2(factor / covered, beyond);
            }
        }
    }

    /// Adds up the octaves for each of the smallest blocks.
    fn add_noise(&mut self) {
        self.noise_mm2.clear();
        let [Some(finest), Some(largest)] = [self.sizes.first(), self.sizes.last()] else { return };
        let dome: f32 = largest.blocks.iter().map(|block| block.cells).sum();
        // Of the disc's radius in cells, with as many cells as the dome.
        let all_octaves = (0.5 * (dome / std::f32::consts::PI).log2()).max(0.0);
        for i in 0..finest.blocks.len() {
            let (row, column) = (i / finest.columns.max(1), i % finest.columns.max(1));
            let (mut sum, mut left) = (0.0, all_octaves);
            for (k, size) in self.sizes.iter().enumerate() {
                let block = &size.blocks[(row >> k) * size.columns + (column >> k)];
                let is_last = k + 1 == self.sizes.len();
                let octaves = if is_last { left } else { left.min(if k == 0 { FIRST_OCTAVES } else { 1.0 }) };
                let own_cell = if k == 0 { OWN_CELL } else { 0.0 };
                sum += (own_cell + octaves * std::f32::consts::LN_2) * block.variance_mm2;
                left -= octaves;
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
        let noise = self.noise_mm2.get(row * width.div_ceil(BLOCK) + column).copied().unwrap_or(0.0);
        noise + (DEPTH_PART * height_mm).powi(2) + self.hole_mm[cell].powi(2) * BLOCK as f32
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
    /// Share of the block that is no hole.
    fn covered(&self) -> f32 {
        (1.0 - self.holes / self.cells.max(1.0)).max(MIN_COVERED)
    }

    /// What an octave adds: of readings with this factor; where there are none, as much as is open without light, or as `beyond` the holes.
    fn octave_mm2(&self, factor: f32, beyond: Option<f32>) -> f32 {
        let others = self.holes + self.unlit;
        match beyond {
            _ if self.read > 0.0 => (self.logs / self.read).exp() * factor,
            Some(beyond) if self.unlit <= 0.0 => beyond,
            _ if others > 0.0 => (self.other_logs / others).exp(),
            _ => 0.0,
        }
    }

    fn add(&mut self, other: &Self) {
        self.cells += other.cells;
        self.read += other.read;
        self.logs += other.logs;
        self.holes += other.holes;
        self.unlit += other.unlit;
        self.other_logs += other.other_logs;
        for k in [0, 1] {
            self.variances_mm2[k] += other.variances_mm2[k];
            self.left_mm[k] += other.left_mm[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::rest::SMOOTHING;
    use super::*;

    #[test]
    fn what_smoothing_leaves_of_the_noise_at_rest_is_that_of_its_means() {
        for (k, left) in REST_LEFT.into_iter().enumerate() {
            let block = BLOCK << k;
            let mut sums = vec![0.0_f32; block + 2 * SMOOTHING];
            sums[SMOOTHING..SMOOTHING + block].fill(1.0);
            for _ in 0..SMOOTHING {
                let at = |i: Option<usize>| i.and_then(|i| sums.get(i)).copied().unwrap_or(0.0);
                let mean = |i: usize| (at(i.checked_sub(1)) + at(Some(i)) + at(Some(i + 1))) / 3.0;
                sums = (0..sums.len()).map(mean).collect();
            }
            // Across and down alike.
            let share = sums.iter().map(|v| v * v).sum::<f32>() / block as f32;
            assert!((share * share - left).abs() < 1e-3, "{block}: {}", share * share);
        }
    }
}
