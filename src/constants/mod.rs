//! Constants.

pub mod model;
