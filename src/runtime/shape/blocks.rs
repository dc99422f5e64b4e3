//! Sums over blocks of cells, of each size: what is read, what is a hole, and what the solve leaves over.

/// Cells along the side of the smallest blocks, those of a camera's JPEG, which are doubled until one covers the picture.
pub(super) const BLOCK: usize = 4;

/// Readings are taken to cover no less of a block.
const MIN_COVERED: f32 = 0.1;

/// Share of a block's cells that must be read for it to say what is left over, and how many such blocks there must be.
const MIN_READ: f32 = 0.9;
const MIN_BLOCKS: usize = 20;

/// Middle one of the squares of a normal number.
const CHI_MEDIAN: f32 = 0.455;

/// What reading leaves under a touch is at most this part of the slope, and what is left over by it no fault of the colours.
const MAX_SLOPE_PART: f32 = 0.04;

/// Cells that must be read about a hole for their tilt to count.
const MIN_AROUND: f32 = 4.0;

/// Sums over a block's cells.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Block {
    pub cells: f32,
    pub read: f32,
    /// Squares of their tilts less noise, rad^2.
    pub tilts: f32,
    /// Squares of their steps along the tilts, mm^2.
    pub slopes_mm2: f32,
    /// Cells that are filled in from around, and those that are neither that nor read: without light.
    pub holes: f32,
    pub unlit: f32,
    /// Logarithms of variances of a cell's step, mm^2: of those that are read, and of those that are not.
    pub logs: f32,
    pub other_logs: f32,
    /// Variances of the steps across and down, where they are read, mm^2, and what is left between the cells, mm.
    pub variances_mm2: [f32; 2],
    pub left_mm: [f32; 2],
    /// What is left between all cells that are read or filled in, and their number: it gathers in what is filled in, which counts little.
    pub all_left_mm: [f32; 2],
    pub joined: f32,
    /// What an octave of waves as long as the block adds to a height's variance, times `2 pi / ln 2`, mm^2, once all are added.
    pub variance_mm2: f32,
}

/// Blocks of a size.
#[derive(Debug, Clone, Default)]
pub(super) struct Size {
    pub columns: usize,
    pub blocks: Vec<Block>,
}

/// Tilt of what is read in the smallest block about a cell that is wider than a hole, rad.
pub(super) fn tilt_around(sizes: &[Size], column: usize, row: usize, wide: f32) -> f32 {
    for (k, size) in sizes.iter().enumerate() {
        let side = BLOCK << k;
        let Some(block) = size.blocks.get(row / side * size.columns + column / side) else { break };
        if side as f32 >= 2.0 * wide && block.read >= MIN_AROUND {
            return (block.tilts / block.read).max(0.0).sqrt();
        }
    }
    0.0
}

impl Size {
    pub fn clear(&mut self, columns: usize, rows: usize) {
        self.columns = columns;
        self.blocks.clear();
        self.blocks.resize(columns * rows, Block::default());
    }

    /// Squares of what blocks of so many cells leave over, over those that the readings promise: the middle one.
    pub fn factor(&self, whole: f32, ratios: &mut Vec<f32>) -> Option<f32> {
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
    pub fn covered(&self) -> f32 {
        (1.0 - self.holes / self.cells.max(1.0)).max(MIN_COVERED)
    }

    /// By how much errors over the block are larger than promised, as squares: as is usual, or what is left over in it where that is far more: a
    /// stain feigns slopes that are no surface's.
    pub fn factor(&self, usual: f32, far_more: f32) -> f32 {
        let stands_for = (self.joined / self.read.max(1.0)).powi(2);
        let promised_mm2 = 0.5 * self.variances_mm2.iter().sum::<f32>();
        // Half of the errors is left over, of each of the two.
        let left_mm2 = self.all_left_mm.iter().map(|left| left * left).sum::<f32>() / stands_for;
        let touched_mm2 = MAX_SLOPE_PART * MAX_SLOPE_PART * self.read * self.slopes_mm2;
        let is_far_more = left_mm2 > far_more * usual * promised_mm2 + touched_mm2;
        if self.read > 0.0 && is_far_more { left_mm2 / promised_mm2.max(1e-30) } else { usual }
    }

    /// What an octave adds: of readings with this factor; where there are none, as much as is open without light, or as `beyond` the holes.
    pub fn octave_mm2(&self, factor: f32, beyond: Option<f32>) -> f32 {
        let others = self.holes + self.unlit;
        match beyond {
            _ if self.read > 0.0 => (self.logs / self.read).exp() * factor,
            Some(beyond) if self.unlit <= 0.0 => beyond,
            _ if others > 0.0 => (self.other_logs / others).exp(),
            _ => 0.0,
        }
    }

    pub fn add(&mut self, other: &Self) {
        self.cells += other.cells;
        self.read += other.read;
        self.logs += other.logs;
        self.holes += other.holes;
        self.unlit += other.unlit;
        self.tilts += other.tilts;
        self.slopes_mm2 += other.slopes_mm2;
        self.joined += other.joined;
        self.other_logs += other.other_logs;
        for k in [0, 1] {
            self.variances_mm2[k] += other.variances_mm2[k];
            self.left_mm[k] += other.left_mm[k];
            self.all_left_mm[k] += other.all_left_mm[k];
        }
    }
}
