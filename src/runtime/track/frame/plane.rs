//! One channel of a frame, read where it stands.

use super::camera_frame::CameraFrame;
use crate::track::options::Channel;

#[derive(Debug, Clone, Copy)]
enum Pick {
    Byte(usize),
    Luma,
}

/// One channel of a frame, read where it stands: no pixel is copied that is not looked at.
#[derive(Debug, Clone, Copy)]
pub struct Plane<'a> {
    width: usize,
    height: usize,
    step: usize,
    pick: Pick,
    bytes: &'a [u8],
}

/// Luma of ITU-R BT.601 in 256ths, the grey of OpenCV's `cvtColor`: in 16 bits, which white just does not fill.
fn luma([r, g, b]: [u8; 3]) -> u8 {
    ((77 * u16::from(r) + 150 * u16::from(g) + 29 * u16::from(b) + 128) >> 8) as u8
}

impl<'a> Plane<'a> {
    /// One channel of a frame; of a grey frame, the grey.
    pub fn new(frame: &CameraFrame<'a>, channel: Channel) -> Self {
        let pick = match (frame.channels(), channel) {
            (1, _) | (_, Channel::Red) => Pick::Byte(0),
            (_, Channel::Green) => Pick::Byte(1),
            (_, Channel::Blue) => Pick::Byte(2),
            (_, Channel::Luma) => Pick::Luma,
        };
        Self {
            width: frame.width(),
            height: frame.height(),
            step: frame.channels(),
            pick,
            bytes: frame.bytes(),
        }
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        self.height
    }

    /// A pixel; beyond the border, the nearest one.
    pub fn at(&self, x: i32, y: i32) -> u8 {
        let x = (x.max(0) as usize).min(self.width - 1);
        let y = (y.max(0) as usize).min(self.height - 1);
        let at = (y * self.width + x) * self.step;
        match self.pick {
            Pick::Byte(offset) => self.bytes.get(at + offset).copied().unwrap_or(0),
            Pick::Luma => self.bytes.get(at..).and_then(<[u8]>::first_chunk).map_or(0, |pixel| luma(*pixel)),
        }
    }

    /// A stretch of a row, from `x` on, as long as `out`; both must lie inside.
    pub fn row_into<T: From<u8>>(&self, x: usize, y: usize, out: &mut [T]) {
        let start = (y * self.width + x) * self.step;
        let end = start + out.len() * self.step;
        let Some(row) = self.bytes.get(start..end) else { return };
        match self.pick {
            Pick::Byte(_) if self.step == 1 => {
                for (to, from) in out.iter_mut().zip(row) {
                    *to = T::from(*from);
                }
            }
            Pick::Byte(offset) => {
                for (to, from) in out.iter_mut().zip(row.chunks_exact(self.step)) {
                    *to = T::from(from[offset]);
                }
            }
            // only frames of three channels have one to be made
            Pick::Luma => {
                for (to, from) in out.iter_mut().zip(row.as_chunks().0) {
                    *to = T::from(luma(*from));
                }
            }
        }
    }

    /// A square of side `side` with its top left pixel at (x, y), row by row; beyond the border the nearest pixels.
    pub fn square_into<T: From<u8>>(&self, x: i32, y: i32, side: usize, out: &mut [T]) {
        let inside = x >= 0 && y >= 0 && x as usize + side <= self.width && y as usize + side <= self.height;
        for (dy, row) in out.chunks_exact_mut(side).take(side).enumerate() {
            if inside {
                self.row_into(x as usize, y as usize + dy, row);
            } else {
                for (dx, to) in row.iter_mut().enumerate() {
                    *to = T::from(self.at(x + dx as i32, y + dy as i32));
                }
            }
        }
    }
}
