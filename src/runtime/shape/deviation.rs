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
//! JPEG makes of blocks have no direction of their own and give both alike. The middle one of all blocks counts: touches are few. A block
//! of which far more is left over than chance has it counts for itself: a stain feigns slopes that are no surface's.
//!
//! A hole may hide what none around shows: as much of a touch as it is wide.

use glam::Vec3A;
use rayon::prelude::*;

use super::blocks::{BLOCK, Size, tilt_around};
use super::cells::{Cells, View};
use super::holes::Holes;
use super::normals::{CellReading, FILLED_SD_RAD};
use super::rows::{MIN_ROWS, share};

/// Rows of blocks that a thread takes at once, at least, and for how many of the sizes what is left over is looked at: there are few larger
/// ones.
const MIN_STRIPS: usize = 6;
const SEEN_LEVELS: usize = 2;

/// Part of the noise of the frame at rest, whose cells are smoothed before they are divided by, that is left in means over blocks of
/// these sizes. In larger ones all of it is: errors there are those of two frames.
const REST_LEFT: [f32; SEEN_LEVELS] = [0.373, 0.644];

/// The size from which on blocks say what share of them is holes: smaller ones may lie within one.
const HOLE_LEVEL: usize = 2;

/// Octaves from a cell to the smallest block.
const FIRST_OCTAVES: f32 = 2.0;

/// What waves shorter than two cells add, over `S / (2 pi)`: slopes between cells are means of two (summed over the lattice's
/// own spectrum).
const OWN_CELL: f32 = 0.546;

/// What is left over in a block counts for itself from where one of so many pictures has a block of its size with as much by chance.
const BY_CHANCE: f32 = 1000.0;

/// Part of the depth: what reading at two shapes and cells of finite size leave under a touch (1 to 4 % without any noise, presses
/// of balls, edges and nuts on three designs).
const DEPTH_PART: f32 = 0.02;

/// Part of the slope of a hole that is filled in from around.
const HOLE_PART: f32 = 0.25;

/// Radius of the smallest touch, part of the dome's: a hole so wide may hide it.
const TOUCH_PART: f32 = 0.1;

/// Rounds of the walk: one more than the ways have turns back.
const WALKS: usize = 3;

/// Deviations of the cells' heights, kept between frames.
#[derive(Debug, Clone, Default)]
pub(super) struct Deviations {
    sizes: Vec<Size>,
    ratios: Vec<f32>,
    /// Variance of the noise of a height, mm^2, by smallest block.
    noise_mm2: Vec<f32>,
    /// Cells without readings on the way from the rim, where the skin is bonded: on the shortest in these.
    away: Vec<f32>,
    /// How far heights in the holes may be off by what is filled in, mm; 0 beside them.
    hole_mm: Vec<f32>,
    holes: Holes,
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
        radius_mm: f32,
    ) {
        let w = cells.width;
        let is_dome = |cell: usize| view.is_dome.get(cell).copied().unwrap_or(false);
        self.clear(w.div_ceil(BLOCK), cells.height.div_ceil(BLOCK));
        let Some(Size { columns, blocks }) = self.sizes.first_mut() else { return };
        let strips = blocks.par_chunks_mut(*columns).zip(view.spans.par_chunks(BLOCK));
        strips.enumerate().with_min_len(share(MIN_STRIPS)).for_each(|(strip, (blocks, spans))| {
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
                let left_mm = [right, below].map(|next| left_mm(cell, next));
                let is_unlit = |cell: usize| !readings[cell].is_read && !readings[cell].is_hole();
                if ![cell, right, below].into_iter().any(is_unlit) {
                    block.joined += 1.0;
                    for (sum, left_mm) in block.all_left_mm.iter_mut().zip(left_mm) {
                        *sum += left_mm;
                    }
                }
                if [cell, right, below].into_iter().all(|cell| readings[cell].is_read) {
                    block.read += 1.0;
                    let tilt = tilt(cell).length_squared();
                    block.tilts += tilt - readings[cell].noise.iter().sum::<f32>();
                    block.slopes_mm2 += tilt * view.surface_mm[right].distance_squared(view.surface_mm[cell]);
                    block.logs += log;
                    for k in [0, 1] {
                        block.variances_mm2[k] += variances_mm2[k];
                        block.left_mm[k] += left_mm[k];
                    }
                } else if !readings[cell].is_read {
                    block.other_logs += log;
                    *(if readings[cell].is_hole() { &mut block.holes } else { &mut block.unlit }) += 1.0;
                }
            }
        });
        let factors = self.factors();
        self.find_variances(factors);
        self.add_noise();
        self.holes.find(cells, view, |cell| readings[cell].is_hole());
        self.bridge(view, w, radius_mm);
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
            let usual = factors[k.min(SEEN_LEVELS)];
            // Half of a sum of two squares of normal numbers.
            let far_more = (BY_CHANCE * blocks.len() as f32).ln();
            let to_holes = HOLE_LEVEL.saturating_sub(smaller.len());
            for (i, block) in blocks.iter_mut().enumerate() {
                let beyond = around(i, 1).map(|block| block.variance_mm2);
                let covered = around(i, to_holes).unwrap_or(block).covered();
                let factor = block.factor(usual, far_more);
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

    /// How far heights in holes may be off: across a hole as narrow as a dot the skin's slope is what it is around but for a part; one as wide
    /// as a touch may hide it.
    fn bridge(&mut self, view: &View, width: usize, radius_mm: f32) {
        self.hole_mm.clear();
        self.hole_mm.resize(view.is_dome.len(), 0.0);
        let (sizes, holes) = (&self.sizes, &self.holes);
        let rows = self.hole_mm.par_chunks_mut(width).zip(&view.spans).enumerate();
        rows.with_min_len(share(MIN_ROWS)).for_each(|(row, (hole_mm, span))| {
            for column in span.clone() {
                let cell = row * width + column;
                let (deep, wide) = (holes.deep[cell], holes.wide[cell]);
                let next = view.surface_mm.get(cell + 1).copied().unwrap_or_default();
                if deep > 0.0 {
                    let size_mm = next.distance(view.surface_mm[cell]).min(0.1 * radius_mm);
                    let hidden = (wide * size_mm / (TOUCH_PART * radius_mm)).powi(4).min(1.0) * FILLED_SD_RAD;
                    let around = tilt_around(sizes, column, row, wide);
                    hole_mm[column] = deep * size_mm * hidden.hypot(HOLE_PART * around);
                }
            }
        });
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
        noise + (DEPTH_PART * height_mm).powi(2) + self.hole_mm[cell].powi(2)
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
