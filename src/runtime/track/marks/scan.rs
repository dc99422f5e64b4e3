//! The whole frame searched for dark blobs: levels by neighbourhood, runs, components.

use glam::DVec2;

use super::filter::{self, Pads};
use crate::track::frame::Plane;

/// Least side of the blocks that levels are found in, px, and over the widest dot's diameter: the ground must be more than
/// half of a block, wherever a dot lies in it.
const MIN_BLOCK: usize = 16;
const BLOCK_BY_DIAMETER: f64 = 1.5;
/// Least difference between ground and mark, in parts of the ground's level.
const MIN_CONTRAST: f32 = 0.12;
/// Largest number of runs that a frame of marks could have; noise has more.
const MAX_RUNS: usize = 1 << 15;

/// A dark blob.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DarkBlob {
    /// Mean of its pixels' places.
    pub at_px: DVec2,
    /// Number of its pixels.
    pub area_px: f64,
    /// Mean square distance of its pixels from their mean, px^2.
    pub spread_px2: f64,
}

#[derive(Debug, Clone, Copy)]
struct Run {
    y: u32,
    start: u32,
    end: u32,
    label: u32,
}

#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    n: f64,
    x: f64,
    y: f64,
    square: f64,
}

/// The search and its buffers, which are kept.
#[derive(Debug, Clone, Default)]
pub struct BlobScan {
    width: usize,
    height: usize,
    /// Side of the blocks.
    block: usize,
    first: Vec<u8>,
    second: Vec<u8>,
    /// Middle and lowest level of each block, then the threshold.
    ground: Vec<u8>,
    low: Vec<u8>,
    levels: Vec<u8>,
    runs: Vec<Run>,
    parents: Vec<u32>,
    sums: Vec<Sum>,
    blobs: Vec<DarkBlob>,
    pads: Pads,
}

impl BlobScan {
    /// A search of frames of one size for dots of up to a radius, px.
    pub fn new(width: usize, height: usize, radius_px: f64) -> Self {
        let block = MIN_BLOCK.max((2.0 * BLOCK_BY_DIAMETER * radius_px).ceil() as usize);
        let blocks = width.div_ceil(block) * height.div_ceil(block);
        Self {
            width,
            height,
            block,
            first: vec![0; width * height],
            second: vec![0; width * height],
            ground: vec![0; blocks],
            low: vec![0; blocks],
            levels: vec![0; blocks],
            runs: Vec::with_capacity(MAX_RUNS),
            parents: Vec::with_capacity(MAX_RUNS),
            sums: Vec::with_capacity(MAX_RUNS),
            blobs: Vec::with_capacity(MAX_RUNS),
            pads: std::array::from_fn(|_| Vec::with_capacity(width + 2)),
        }
    }

    /// The dark blobs inside of the mask (`span(y)`: first and one past the last pixel of a row), by their first
    /// pixels; `None` where there are more than marks could make.
    pub fn dark_blobs(
        &mut self,
        plane: &Plane<'_>,
        span: impl Fn(usize) -> [usize; 2],
    ) -> Option<&[DarkBlob]> {
        let (width, height, side) = (self.width, self.height, self.block);
        if plane.width() != width || plane.height() != height {
            return None;
        }
        for (y, row) in self.first.chunks_exact_mut(width).enumerate() {
            plane.row_into(0, y, row);
        }
        // Noise of single pixels makes no blobs then.
        filter::blur(width, height, &self.first, &mut self.second, &mut self.pads);
        std::mem::swap(&mut self.first, &mut self.second);
        self.find_levels();
        // Marks become ones in the second buffer.
        let across = width.div_ceil(side);
        for y in 0..height {
            let row = &self.first[y * width..(y + 1) * width];
            let out = &mut self.second[y * width..(y + 1) * width];
            let [start, end] = span(y).map(|v| v.min(width));
            out[..start.min(end)].fill(0);
            out[end..].fill(0);
            let levels = &self.levels[y / side * across..(y / side + 1) * across];
            for (block, level) in levels.iter().enumerate() {
                let (a, b) = ((block * side).max(start), ((block + 1) * side).min(end));
                if a < b {
                    for (to, value) in out[a..b].iter_mut().zip(&row[a..b]) {
                        *to = u8::from(value < level);
                    }
                }
            }
        }
        self.components()
    }

    /// Threshold of each block: half way from the ground to the darkest in the blocks around; 0 where nothing there
    /// is dark enough.
    fn find_levels(&mut self) {
        let side = self.block;
        let (across, down) = (self.width.div_ceil(side), self.height.div_ceil(side));
        for by in 0..down {
            for bx in 0..across {
                // Every other pixel: 64 of them and more tell the middle level to a few parts of their noise.
                let mut counts = [0_u16; 256];
                let (mut total, mut low) = (0_u32, 255_u8);
                let end_x = ((bx + 1) * side).min(self.width);
                for y in (by * side..((by + 1) * side).min(self.height)).step_by(2) {
                    let row = &self.first[y * self.width + bx * side..y * self.width + end_x];
                    for value in row.iter().step_by(2) {
                        counts[usize::from(*value)] += 1;
                        total += 1;
                        low = low.min(*value);
                    }
                }
                let (mut below, mut middle) = (0_u32, 0_u8);
                for (value, count) in counts.iter().enumerate() {
                    below += u32::from(*count);
                    if 2 * below >= total {
                        middle = value as u8;
                        break;
                    }
                }
                self.ground[by * across + bx] = middle;
                self.low[by * across + bx] = low;
            }
        }
        for by in 0..down {
            for bx in 0..across {
                let own = self.ground[by * across + bx];
                let mut low = 255;
                for y in by.saturating_sub(1)..(by + 2).min(down) {
                    for x in bx.saturating_sub(1)..(bx + 2).min(across) {
                        low = low.min(self.low[y * across + x]);
                    }
                }
                let deep = f32::from(own) - f32::from(low);
                let enough = deep > MIN_CONTRAST * f32::from(own) && deep >= 6.0;
                self.levels[by * across + bx] =
                    if enough { ((u16::from(own) + u16::from(low)).div_ceil(2)) as u8 } else { 0 };
            }
        }
    }

    /// Runs of ones, joined over corners to components.
    fn components(&mut self) -> Option<&[DarkBlob]> {
        self.runs.clear();
        self.parents.clear();
        let (mut before, mut before_end) = (0, 0);
        for y in 0..self.height {
            let row = &self.second[y * self.width..(y + 1) * self.width];
            let first = self.runs.len();
            let mut x = 0;
            while let Some(skip) = row[x..].iter().position(|v| *v != 0) {
                let start = x + skip;
                let end = row[start..].iter().position(|v| *v == 0).map_or(self.width, |n| start + n);
                if self.runs.len() == MAX_RUNS {
                    return None;
                }
                let label = self.runs.len() as u32;
                self.runs.push(Run { y: y as u32, start: start as u32, end: end as u32, label });
                self.parents.push(label);
                x = end;
            }
            // Two sorted rows of runs: walk both.
            let (mut above, mut here) = (before, first);
            while above < before_end && here < self.runs.len() {
                let (a, h) = (self.runs[above], self.runs[here]);
                if a.end >= h.start && h.end >= a.start {
                    join(&mut self.parents, a.label, h.label);
                }
                if a.end < h.end { above += 1 } else { here += 1 }
            }
            (before, before_end) = (first, self.runs.len());
        }
        self.sums.clear();
        self.sums.resize(self.runs.len(), Sum::default());
        for index in 0..self.runs.len() {
            let run = self.runs[index];
            let root = root_of(&mut self.parents, run.label);
            let n = f64::from(run.end - run.start);
            let x = 0.5 * f64::from(run.start + run.end - 1);
            let y = f64::from(run.y);
            let sum = &mut self.sums[root as usize];
            sum.n += n;
            sum.x += n * x;
            sum.y += n * y;
            // Sum of squares along a run: n (mean^2 + (n^2 - 1) / 12).
            sum.square += n * (x * x + y * y + (n * n - 1.0) / 12.0);
        }
        self.blobs.clear();
        for sum in self.sums.iter().filter(|s| s.n > 0.0) {
            let at_px = DVec2::new(sum.x, sum.y) / sum.n;
            // A pixel is a square: it has a sixth of its own.
            let spread_px2 = sum.square / sum.n - at_px.length_squared() + 1.0 / 6.0;
            self.blobs.push(DarkBlob { at_px, area_px: sum.n, spread_px2 });
        }
        Some(&self.blobs)
    }
}

fn root_of(parents: &mut [u32], label: u32) -> u32 {
    let mut at = label;
    while parents[at as usize] != at {
        // Path halving: each look shortens the way.
        let next = parents[parents[at as usize] as usize];
        parents[at as usize] = next;
        at = next;
    }
    at
}

fn join(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root_of(parents, a), root_of(parents, b));
    // The earlier run names the component, so that the order does not depend on how it was joined.
    let (low, high) = (a.min(b), a.max(b));
    parents[high as usize] = low;
}
