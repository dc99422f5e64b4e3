//! How far a height may be off.

use super::cells::{Cells, View};
use super::normals::CellReading;

/// Cells along the side of a block over which errors of colour go together: a block of a camera's JPEG, 8 px.
const BLOCK: usize = 4;

/// Height over slope times block: slopes that err alike within blocks, integrated over a dome of some dozen blocks
/// (`sqrt(ln(L / l) / (2 pi))` of the Poisson equation in the plane).
const BLOCK_PART: f32 = 0.6;

/// Rounds of the walk: one more than the ways have turns back.
const WALKS: usize = 3;

/// Slope that a skin may have besides, where it is filled in, rad: alike over a block.
const FILLED_SLOPE: f32 = 0.05;

/// Part of the depth: what is not known of the light on a skin that is far from its place.
const DEPTH_PART: f32 = 0.01;

/// Deviations of the cells' heights, kept between frames.
#[derive(Debug, Clone, Default)]
pub(super) struct Deviations {
    /// Mean variance of the slopes in each block, rad^2, and size of a cell, mm.
    blocks: Vec<(f32, f32)>,
    columns: usize,
    /// Sums of each block: variances, sizes, and how many of these and of those there are.
    sums: Vec<(f32, f32, f32, f32)>,
    /// Cells without readings on the way from the rim, where the skin is bonded: on the shortest in these.
    away: Vec<f32>,
}

impl Deviations {
    /// Takes a frame's readings.
    pub fn measure(&mut self, cells: &Cells, view: &View, readings: &[CellReading]) {
        let is_read = |cell: usize| readings[cell].is_read;
        let w = cells.width;
        self.columns = w.div_ceil(BLOCK);
        let sums = &mut self.sums;
        sums.clear();
        sums.resize(self.columns * cells.height.div_ceil(BLOCK), (0.0, 0.0, 0.0, 0.0));
        self.away.clear();
        self.away.resize(cells.count(), f32::INFINITY);
        for (row, span) in view.spans.iter().enumerate() {
            for cell in row * w + span.start..row * w + span.end {
                if !view.is_dome[cell] {
                    continue;
                }
                let sum = &mut sums[row / BLOCK * self.columns + (cell - row * w) / BLOCK];
                if is_read(cell) {
                    sum.0 += 0.5 * (readings[cell].spread[0] + readings[cell].spread[1]);
                    sum.3 += 1.0;
                }
                if view.is_dome.get(cell + 1).copied().unwrap_or(false) {
                    sum.1 += view.surface_mm[cell + 1].distance(view.surface_mm[cell]);
                    sum.2 += 1.0;
                }
            }
        }
        let mean = |&(variance, size, count, read): &(f32, f32, f32, f32)| {
            let variance = if read > 0.0 { variance / read } else { FILLED_SLOPE * FILLED_SLOPE };
            (variance, size / count.max(1.0))
        };
        self.blocks.clear();
        self.blocks.extend(self.sums.iter().map(mean));
        let is_dome = |cell: usize| view.is_dome.get(cell).copied().unwrap_or(false);
        for cell in (0..cells.count()).filter(|cell| view.is_dome[*cell]) {
            let around = [cell + 1, cell + w, cell.wrapping_sub(1), cell.wrapping_sub(w)];
            if !around.into_iter().all(is_dome) {
                self.away[cell] = 0.0;
            }
        }
        for _ in 0..WALKS {
            self.walk(w, |cell| if is_read(cell) { 0.0 } else { 1.0 }, is_dome);
        }
    }

    /// Costs of the way by two passes over the neighbours (G. Borgefors, Computer Vision 27, 1984).
    fn walk(&mut self, w: usize, cost: impl Fn(usize) -> f32, is_dome: impl Fn(usize) -> bool) {
        let n = self.away.len();
        let near = |away: &[f32], i: usize, next: [Option<usize>; 2]| {
            let of = |next: Option<usize>| next.and_then(|k| away.get(k)).copied().unwrap_or(f32::INFINITY);
            away[i].min(of(next[0]).min(of(next[1])) + cost(i))
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
        let (row, column) = (cell / width, cell % width);
        let (variance, size_mm) = self.blocks[row / BLOCK * self.columns + column / BLOCK];
        let slopes = BLOCK_PART * BLOCK as f32 * size_mm * variance.sqrt();
        let filled = FILLED_SLOPE * size_mm * (BLOCK as f32 * self.away[cell].min(1e4)).sqrt();
        (slopes * slopes + filled * filled + (DEPTH_PART * height_mm).powi(2)).sqrt()
    }
}
