//! The command line of domecast, and what accuracy costs in time.

pub mod accuracy;
mod commands;

pub use commands::run;
