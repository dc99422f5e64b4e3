//! A camera's frames as numbers, and the blobs in them. Knows only pixels: not what they show, nor through which lens.
//!
//! [`Gray`] is a frame of one channel; [`local_levels`] gives the level halfway between dark and bright around each
//! pixel, which follows shading; [`blobs`] are the connected sets of pixels on one side of a level; [`centroid`] is
//! a blob's middle to hundredths of a pixel, from its grey edge pixels. Pixels: the centre of the top-left one is (0, 0).

mod blobs;
mod centroid;
mod gray;
mod levels;

pub use blobs::{Blob, Side, blobs};
pub use centroid::{Centroid, centroid};
pub use gray::{FrameError, Gray, MAX_PIXELS};
pub use levels::{Levels, local_levels};

#[cfg(test)]
mod tests;
