//! The arithmetic. Sums run in an order that does not depend on how wide the machine's registers are, so that the same
//! input gives the same bits everywhere.

mod conv;
mod gru;
mod linear;
mod pool;

pub(crate) use conv::Conv;
pub(crate) use gru::Gru;
pub(crate) use linear::{Linear, softmax};
pub(crate) use pool::{MaxPool, average};

/// A picture-like value: rows of pixels, the channels of a pixel side by side, with a border of zeros around.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Map {
    pub(crate) channels: usize,
    pub(crate) height: usize,
    pub(crate) width: usize,
    pub(crate) border: usize,
}

impl Map {
    /// Numbers of a row, its border included.
    pub(crate) fn stride(&self) -> usize {
        (self.width + 2 * self.border) * self.channels
    }

    /// Numbers of the whole, its border included.
    pub(crate) fn len(&self) -> usize {
        (self.height + 2 * self.border) * self.stride()
    }

    /// Where a pixel begins.
    pub(crate) fn at(&self, row: usize, column: usize) -> usize {
        (row + self.border) * self.stride() + (column + self.border) * self.channels
    }

    /// Where the pixels of a row are, without the border.
    pub(crate) fn row(&self, row: usize) -> std::ops::Range<usize> {
        let start = self.at(row, 0);
        start..start + self.width * self.channels
    }

    /// The same channels and pixels.
    pub(crate) fn alike(&self, other: &Self) -> bool {
        [self.channels, self.height, self.width] == [other.channels, other.height, other.width]
    }
}

/// Sides of what a window of `kernel` pixels leaves, moved by `stride` over `side` pixels with `pad` more at each end.
pub(crate) fn swept(side: usize, kernel: usize, stride: usize, pad: usize) -> Option<usize> {
    (side + 2 * pad).checked_sub(kernel).map(|span| span / stride + 1)
}
