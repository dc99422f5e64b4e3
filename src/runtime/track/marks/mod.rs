//! Stage 2: marks as pixels show them. Nothing here knows which mark is which.
//!
//! In: a [`Plane`](super::frame::Plane) and where a mark may be. Out: [`DarkSpot`], a dot measured in a window;
//! [`DarkBlob`], a dark patch of the whole frame; [`FittedDisc`], a white marker fitted to its pixels. Marks are
//! measured on the camera's own bytes, into buffers that are kept.

mod filter;
mod marker;
mod scan;
mod spot;
mod state;

pub(crate) use marker::marker_in_still;
pub(super) use marker::{Candidate, FIT_REACH_PX, FittedDisc, MAX_HALF_PX, MarkerView, ShadingSlope};
pub(super) use scan::{BlobScan, DarkBlob};
pub(super) use spot::{DarkSpot, MAX_RADIUS_PX, SpotFault, SpotMeter, SpotOutline, SpotShape};
pub use state::MarkState;
