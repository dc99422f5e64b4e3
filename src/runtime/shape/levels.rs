//! The picture as linear light of each cell.

use glam::Vec3A;

use super::cells::{Cells, View};
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
    for ((row, line), span) in out.chunks_mut(cells.width).enumerate().zip(&view.spans) {
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
    }
}
