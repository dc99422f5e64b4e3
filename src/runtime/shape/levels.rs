//! The picture as linear light of each cell.

use glam::Vec3A;
use rayon::prelude::*;

use super::cells::{Cells, View};
use super::rows::{MIN_ROWS, share};
use crate::track::CameraFrame;

/// From this code on a channel may have been cut off.
const SATURATED: u8 = 254;

/// What the picture has at a cell.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Level {
    /// Linear light of red, green and blue, full scale 1.
    pub light: Vec3A,
    /// 1 for each channel that says something, 0 where it is cut off.
    pub is_known: Vec3A,
}

/// The levels of the cells that may see the dome, in a picture of three channels; `linear` is the light of each code.
pub(super) fn read(
    frame: &CameraFrame<'_>,
    cells: &Cells,
    view: &View,
    linear: &[f32],
    out: &mut Vec<Level>,
) {
    out.resize(cells.count(), Level::default());
    let (width, bytes, px) = (frame.width(), frame.bytes(), cells.px);
    let light = |code: u8| linear.get(code as usize).copied().unwrap_or(1.0);
    let rows = out.par_chunks_mut(cells.width).zip(&view.spans).enumerate();
    rows.with_min_len(share(MIN_ROWS)).for_each(|(row, (line, span))| {
        for (column, level) in line.iter_mut().enumerate().take(span.end).skip(span.start) {
            let (mut sum, mut highest) = (Vec3A::ZERO, [0_u8; 3]);
            for y in 0..px {
                let start = 3 * ((row * px + y) * width + column * px);
                let Some(pixels) = bytes.get(start..start + 3 * px) else { continue };
                for pixel in pixels.chunks_exact(3) {
                    let &[r, g, b] = pixel else { continue };
                    sum += Vec3A::new(light(r), light(g), light(b));
                    highest = [highest[0].max(r), highest[1].max(g), highest[2].max(b)];
                }
            }
            let known = highest.map(|code| if code < SATURATED { 1.0 } else { 0.0 });
            *level = Level { light: sum / (px * px) as f32, is_known: Vec3A::from_array(known) };
        }
    });
}

/// Cells between those at which noise is looked for.
const NOISE_STEP: usize = 3;

/// Noise is not taken for less, levels: JPEG hides a camera's from squares of four pixels, but not what it did to dark places.
const MIN_NOISE: f32 = 2.0;

/// Differences larger than so many times the middle one are no noise but edges.
const EDGE: f32 = 4.0;

/// Standard deviation of a pixel's light by noise, channel by channel, full scale 1: from what four pixels in a square have beside a
/// plane, over the bare membrane. What a camera's JPEG does to larger blocks does not show in it.
pub(super) fn noise(
    frame: &CameraFrame<'_>,
    cells: &Cells,
    is_bare: impl Fn(usize) -> bool,
    linear: &[f32],
    found: &mut Vec<f32>,
) -> Vec3A {
    let (width, bytes, px) = (frame.width(), frame.bytes(), cells.px);
    let mut sds = [0.0; 3];
    for (channel, sd) in sds.iter_mut().enumerate() {
        found.clear();
        for row in (0..cells.height).step_by(NOISE_STEP) {
            for column in
                (0..cells.width).step_by(NOISE_STEP).filter(|column| is_bare(row * cells.width + column))
            {
                let start = 3 * (row * px * width + column * px) + channel;
                let at = |i: usize| bytes.get(start + i).and_then(|code| linear.get(*code as usize)).copied();
                if let (Some(a), Some(b), Some(c), Some(d)) = (at(0), at(3), at(3 * width), at(3 * width + 3))
                {
                    found.push((0.5 * (a - b - c + d)).abs());
                }
            }
        }
        let middle = found.len() / 2;
        let min_sd = MIN_NOISE / 255.0;
        *sd = min_sd;
        if middle > 0 {
            let max_step = EDGE * *found.select_nth_unstable_by(middle, f32::total_cmp).1 + min_sd;
            let (sum, count) =
                found.iter().filter(|v| **v <= max_step).fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
            // The mean of a normal number's size is sqrt(2 / pi) of its deviation.
            *sd = (sum / count * (0.5 * std::f32::consts::PI).sqrt()).max(min_sd);
        }
    }
    Vec3A::from_array(sds)
}
