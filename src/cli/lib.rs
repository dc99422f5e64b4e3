//! The command line of domecast, and what accuracy costs in time.

mod accuracy;
mod commands;
mod touch_scene;
mod track_report;

pub use commands::points::{Unseen, projected, traced};
pub use commands::{CallError, Called, call, run, run_with, shape_members};
