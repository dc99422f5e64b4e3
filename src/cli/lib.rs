//! The command line of domecast, and what accuracy costs in time.

mod accuracy;
mod commands;
mod touch_scene;
mod track_report;

pub use commands::run;
