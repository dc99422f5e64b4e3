//! The design file, and what follows from it: dots, their way to the printing plate, springs, parts.
//!
//! ```
//! use domecast_design::Design;
//!
//! # const THUMB24: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json");
//! let design = Design::load(THUMB24.as_ref())?;
//! let layout = design.layout()?;
//! println!("{}: {} dots", design.name(), layout.dots.len());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod electrical;
pub mod layout;
pub mod parts;
mod spec;
mod suspension;
pub mod transfer;

pub use glam;
pub use spec::*;
pub use suspension::{claims_of, limits_of, suspension_of};
