//! Levels that follow the shading of a frame.

use super::Gray;

/// For each pixel, the level halfway between the darkest and the brightest pixel around it, and their distance.
#[derive(Debug, Clone, PartialEq)]
pub struct Levels {
    /// Halfway level, row by row.
    pub middle: Vec<f32>,
    /// Brightest less darkest, row by row.
    pub contrast: Vec<f32>,
}

/// The levels over squares of `2 reach + 1` pixels. A mark's edge at its half height is then where its outline is,
/// whatever the light, as long as the square holds both the mark and its surroundings.
pub fn local_levels(frame: &Gray, reach: usize) -> Levels {
    let low = extreme(frame, reach, f32::min, f32::INFINITY);
    let high = extreme(frame, reach, f32::max, f32::NEG_INFINITY);
    let pairs = || low.iter().zip(&high);
    Levels {
        middle: pairs().map(|(l, h)| 0.5 * (l + h)).collect(),
        contrast: pairs().map(|(l, h)| h - l).collect(),
    }
}

/// Minimum or maximum over squares: rows, then columns, each by van Herk's running blocks, so that the cost does not
/// depend on the reach.
fn extreme(frame: &Gray, reach: usize, pick: fn(f32, f32) -> f32, nothing: f32) -> Vec<f32> {
    let (width, height) = (frame.width(), frame.height());
    let mut out = frame.values().to_vec();
    let mut line = Line::new(reach, pick, nothing);
    for row in out.chunks_mut(width) {
        line.load(row.iter().copied());
        for (x, value) in row.iter_mut().enumerate() {
            *value = line.around(x);
        }
    }
    for x in 0..width {
        line.load((0..height).map(|y| out[y * width + x]));
        for y in 0..height {
            out[y * width + x] = line.around(y);
        }
    }
    out
}

struct Line {
    reach: usize,
    pick: fn(f32, f32) -> f32,
    nothing: f32,
    /// Extremes from the start of each block up to a place, and from a place to its block's end.
    up: Vec<f32>,
    down: Vec<f32>,
}

impl Line {
    fn new(reach: usize, pick: fn(f32, f32) -> f32, nothing: f32) -> Self {
        Self { reach, pick, nothing, up: Vec::new(), down: Vec::new() }
    }

    fn load(&mut self, values: impl Iterator<Item = f32>) {
        let block = 2 * self.reach + 1;
        self.up.clear();
        self.up.extend(std::iter::repeat_n(self.nothing, self.reach));
        self.up.extend(values);
        self.up.extend(std::iter::repeat_n(self.nothing, self.reach));
        self.down.clone_from(&self.up);
        for part in self.up.chunks_mut(block) {
            for i in 1..part.len() {
                part[i] = (self.pick)(part[i], part[i - 1]);
            }
        }
        for part in self.down.chunks_mut(block) {
            for i in (1..part.len()).rev() {
                part[i - 1] = (self.pick)(part[i - 1], part[i]);
            }
        }
    }

    /// The extreme over the places from `at - reach` to `at + reach`.
    fn around(&self, at: usize) -> f32 {
        (self.pick)(self.down[at], self.up[at + 2 * self.reach])
    }
}
