//! How far a height may be off.
//!
//! A height is what slopes add up to from the bonded rim. Slopes that err by `S` (their spectral density, rad^2 times cells^2) over
//! waves of all lengths make heights err by `S / k^2` at the wave number k: each octave of wavelengths adds `S ln 2 / (2 pi)`
//! squares of a cell's size, from a cell up to the way to the rim (Green's function of the Laplace equation in the plane).
//!
//! How large `S` is at each wavelength is not assumed but seen. Errors of slopes have two halves: one is the slope of some height, goes into the
//! heights, and cannot be seen; the other, the curl, is the slope of nothing, and is what the least squares leave over. Errors
//! that have no direction of their own (noise, what JPEG makes of blocks) give both halves alike at every wavelength, so the mean square of
//! what is left over in blocks of a size says how the heights err over that size.

use super::cells::{Cells, View};
use super::normals::CellReading;

/// Cells along the side of the smallest blocks, and how often these are doubled.
const BLOCK: usize = 4;
const LEVELS: usize = 3;

/// Share of a block's cells that must be read for it to count.
const MIN_READ: f32 = 0.5;

/// Squares of a cell's size by which waves shorter than a cell's own make a height err, over `S / (2 pi)`: slopes between cells
/// are means of two (by summation of the lattice's own spectrum).
const OWN_CELL: f32 = 0.546;

/// Slope that a skin may have besides, where it is filled in, rad.
const FILLED_SLOPE: f32 = 0.02;

/// Part of the depth: what is not known of the light on a skin that is far from its place.
const DEPTH_PART: f32 = 0.01;

/// What a block of cells has: sums over its cells.
#[derive(Debug, Clone, Copy, Default)]
struct Block {
    /// Expected squares of what is left between a cell and the next, across and down, mm^2, and the cells that are read.
    expected_mm2: [f32; 2],
    read: f32,
    /// What is left between them, mm.
    left_mm: [f32; 2],
    /// Sizes of a cell, mm, and the cells.
    size_mm: [f32; 2],
    cells: f32,
}

impl Block {
    fn add(&mut self, other: &Self) {
        for k in [0, 1] {
            self.expected_mm2[k] += other.expected_mm2[k];
            self.left_mm[k] += other.left_mm[k];
            self.size_mm[k] += other.size_mm[k];
        }
        self.read += other.read;
        self.cells += other.cells;
    }

    /// Variance of a cell's slope times the square of its size, mm^2.
    fn spread_mm2(&self) -> f32 {
        if self.read > 0.0 {
            return (self.expected_mm2[0] * self.expected_mm2[1]).sqrt() / self.read;
        }
        FILLED_SLOPE * FILLED_SLOPE * self.size_mm[0] * self.size_mm[1] / self.cells.max(1.0).powi(2)
    }
}

/// Blocks of a size.
#[derive(Debug, Clone, Default)]
struct Level {
    columns: usize,
    blocks: Vec<Block>,
    /// By how much errors are larger over this size than those of single cells say, as squares.
    factor: f32,
}

/// Deviations of the cells' heights, kept between frames.
#[derive(Debug, Clone, Default)]
pub(super) struct Deviations {
    levels: [Level; LEVELS],
    /// Cells to the rim, for each of the smallest blocks, and the most of them.
    to_rim: Vec<f32>,
    farthest: f32,
    /// Cells to the nearest reading.
    away: Vec<f32>,
}

impl Deviations {
    /// Takes a frame's readings; `left_mm` is what the solve leaves between a cell and the next one, across or down.
    pub fn measure(
        &mut self,
        cells: &Cells,
        view: &View,
        readings: &[CellReading],
        left_mm: impl Fn(usize, usize) -> f32,
    ) {
        let w = cells.width;
        let is_dome = |cell: usize| view.is_dome.get(cell).copied().unwrap_or(false);
        self.levels[0].clear(w.div_ceil(BLOCK), cells.height.div_ceil(BLOCK));
        let Level { columns, blocks, .. } = &mut self.levels[0];
        for (row, span) in view.spans.iter().enumerate() {
            for column in span.clone() {
                let cell = row * w + column;
                let [right, below] = [cell + 1, cell + w];
                if !(is_dome(cell) && is_dome(right) && is_dome(below)) {
                    continue;
                }
                let block = &mut blocks[row / BLOCK * *columns + column / BLOCK];
                let size_mm =
                    [right, below].map(|next| view.surface_mm[next].distance(view.surface_mm[cell]));
                block.cells += 1.0;
                block.size_mm[0] += size_mm[0];
                block.size_mm[1] += size_mm[1];
                if ![cell, right, below].into_iter().all(|cell| readings[cell].is_read) {
                    continue;
                }
                block.read += 1.0;
                for (k, next) in [right, below].into_iter().enumerate() {
                    let variance = 0.5 * (readings[cell].spread[k] + readings[next].spread[k]);
                    block.expected_mm2[k] += variance * size_mm[k] * size_mm[k];
                    block.left_mm[k] += left_mm(cell, next);
                }
            }
        }
        self.add_up(cells.height.div_ceil(BLOCK));
        self.walk_to_rim();
        self.away.clear();
        self.away.extend(readings.iter().map(|reading| if reading.is_read { 0.0 } else { f32::INFINITY }));
        self.walk(w, is_dome);
    }

    /// Makes the larger blocks of the smallest, and their factors.
    fn add_up(&mut self, rows: usize) {
        let mut rows = rows;
        for k in 0..LEVELS {
            let (finer, coarser) = self.levels.split_at_mut(k);
            let level = &mut coarser[0];
            if let Some(fine) = finer.last() {
                let columns = fine.columns.div_ceil(2);
                level.clear(columns, rows.div_ceil(2));
                for (i, block) in fine.blocks.iter().enumerate() {
                    let to = i / fine.columns / 2 * columns + i % fine.columns / 2;
                    level.blocks[to].add(block);
                }
                rows = rows.div_ceil(2);
            }
            let whole = ((BLOCK << k) * (BLOCK << k)) as f32;
            let (mut sum, mut count) = (0.0, 0.0);
            for block in level.blocks.iter().filter(|block| block.read >= MIN_READ * whole) {
                for k in [0, 1] {
                    // Of as many errors alike the sum's square is as large as that of one times their number.
                    sum += block.left_mm[k] * block.left_mm[k] / block.expected_mm2[k].max(1e-30);
                    count += 0.5;
                }
            }
            let before = finer.last().map_or(1.0, |fine| fine.factor);
            level.factor = if count > 0.0 { sum / count } else { before };
        }
    }

    /// Ways of the smallest blocks to the rim, in cells.
    fn walk_to_rim(&mut self) {
        let Level { columns, blocks, .. } = &self.levels[0];
        let (columns, rows) = (*columns, blocks.len() / (*columns).max(1));
        let is_in = |x: usize, y: usize| blocks[y * columns + x].cells > 0.0;
        self.to_rim.clear();
        self.to_rim.resize(blocks.len(), 1e4);
        const STEPS: [(i64, i64, f32); 4] = [(-1, 0, 1.0), (-1, -1, 1.414), (0, -1, 1.0), (1, -1, 1.414)];
        for sign in [1, -1] {
            for i in 0..blocks.len() {
                let at = if sign > 0 { i } else { blocks.len() - 1 - i };
                let (x, y) = (at % columns, at / columns);
                if !is_in(x, y) {
                    self.to_rim[at] = 0.0;
                    continue;
                }
                for (dx, dy, step) in STEPS {
                    let (nx, ny) = (x as i64 + sign * dx, y as i64 + sign * dy);
                    // Beyond the picture the dome goes on.
                    if nx >= 0 && ny >= 0 && nx < columns as i64 && ny < rows as i64 {
                        let from = self.to_rim[ny as usize * columns + nx as usize];
                        self.to_rim[at] = self.to_rim[at].min(from + step * BLOCK as f32);
                    }
                }
            }
        }
        self.farthest = self.to_rim.iter().fold(1.0, |far, way| far.max(*way));
    }

    /// Cells to the nearest reading, by two passes over the neighbours (G. Borgefors, Computer Vision 27, 1984).
    fn walk(&mut self, w: usize, is_dome: impl Fn(usize) -> bool) {
        let n = self.away.len();
        let near = |away: &[f32], i: usize, next: [Option<usize>; 2]| {
            let of = |next: Option<usize>| next.and_then(|k| away.get(k)).copied().unwrap_or(f32::INFINITY);
            away[i].min(of(next[0]).min(of(next[1])) + 1.0)
        };
        for i in (0..n).filter(|i| is_dome(*i)) {
            self.away[i] = near(&self.away, i, [i.checked_sub(1), i.checked_sub(w)]);
        }
        for i in (0..n).rev().filter(|i| is_dome(*i)) {
            self.away[i] = near(&self.away, i, [Some(i + 1), Some(i + w)]);
        }
    }

    /// Standard deviation of a cell's height, mm.
    pub fn of(&self, cell: usize, width: usize, height_mm: f32) -> f32 {
        let (row, column) = (cell / width / BLOCK, cell % width / BLOCK);
        let finest = &self.levels[0];
        let way = self.to_rim[row * finest.columns + column];
        // Of a round dome: the way that a place of a half-plane would have.
        let way = way * (2.0 - way / self.farthest);
        let octaves = way.max(1.0).log2();
        let mut slopes =
            finest.variance(row, column, 0) * (OWN_CELL + std::f32::consts::LN_2 * octaves.min(3.0));
        let mut left = octaves - 3.0;
        for (k, level) in self.levels.iter().enumerate().skip(1) {
            let part = if k + 1 == LEVELS { left.max(0.0) } else { left.clamp(0.0, 1.0) };
            slopes += std::f32::consts::LN_2 * part * level.variance(row, column, k);
            left -= 1.0;
        }
        slopes /= std::f32::consts::TAU;
        let own = &finest.blocks[row * finest.columns + column];
        let size_mm = own.size_mm[0] / own.cells.max(1.0);
        let filled = FILLED_SLOPE * size_mm * self.away[cell].min(1e4);
        (slopes + filled * filled + (DEPTH_PART * height_mm).powi(2)).sqrt()
    }
}

impl Level {
    fn clear(&mut self, columns: usize, rows: usize) {
        self.columns = columns;
        self.blocks.clear();
        self.blocks.resize(columns * rows, Block::default());
    }

    /// `S` times the square of a cell's size about one of the smallest blocks, mm^2.
    fn variance(&self, row: usize, column: usize, doubled: usize) -> f32 {
        self.factor * self.blocks[(row >> doubled) * self.columns + (column >> doubled)].spread_mm2()
    }
}
