//! Pictures as bytes: what is measured in a window, what is searched for in the whole frame. Knows only pixels.
//!
//! `frames` (for calibration) does the like on whole frames of floats, once and at leisure; here a frame has a
//! millisecond, so marks are measured where they are expected, on the camera's own bytes, into buffers that are kept.

pub mod filter;
pub mod flow;
pub mod scan;
pub mod spot;
