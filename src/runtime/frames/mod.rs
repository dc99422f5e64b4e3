//! A camera's frames as numbers, and the blobs in them. Knows only pixels: not what they show, nor through which lens.
//!
//! [`Gray`] is a frame of one channel; [`local_levels`] gives the level halfway between dark and bright around each
//! pixel, which follows shading; [`blobs`] are the connected sets of pixels on one side of a level; [`centroid`] is
//! a blob's middle to hundredths of a pixel, from its grey edge pixels. Pixels: the centre of the top-left one is (0, 0).
//!
//! ```
//! use domecast_runtime::frames::{BlobSide, Gray, blobs, local_levels};
//!
//! // One dark pixel in the middle of a bright frame.
//! let mut values = vec![0.8; 7 * 7];
//! values[3 * 7 + 3] = 0.1;
//! let frame = Gray::new(7, 7, values)?;
//! let levels = local_levels(&frame, 3);
//! let dark = blobs(&frame, BlobSide::Dark, |i| (levels.contrast[i] > 0.2).then_some(levels.middle[i]));
//! assert_eq!(dark.len(), 1);
//! assert_eq!(dark[0].pixels, [[3, 3]]);
//! # Ok::<(), domecast_runtime::frames::FrameError>(())
//! ```

mod blobs;
mod centroid;
mod gray;
mod levels;

pub use blobs::{Blob, BlobSide, blobs};
pub use centroid::{Centroid, centroid};
pub use gray::{FrameError, Gray, MAX_PIXELS};
pub use levels::{Levels, local_levels};

#[cfg(test)]
mod tests;
