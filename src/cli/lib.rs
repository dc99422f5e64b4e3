//! The command line of domecast, and what accuracy costs in time.

mod accuracy;
mod commands;

pub use commands::run;
