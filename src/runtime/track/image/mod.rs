//! Pictures as bytes: what is measured in a window, what is searched for in the whole frame. Knows only pixels.
//!
//! A frame has a millisecond: marks are measured where they are expected, on the camera's own bytes, into buffers that
//! are kept.

pub mod filter;
pub mod flow;
pub mod scan;
pub mod spot;
