//! c
pub mod model;
