//! Everything that is needed to make a sensor: artwork, constants, report, and the build that writes them.

pub mod artwork;
pub mod build;
pub mod chart;
pub mod compare;
pub mod constants;
mod hash;
pub mod html;
pub mod illuminate;
pub mod led_board;
pub mod light;
pub mod numbers;
pub mod report;
