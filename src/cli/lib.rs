//! The command line of domecast, and what accuracy costs in time.

mod accuracy;
mod commands;
mod touch_scene;

pub use commands::run;
