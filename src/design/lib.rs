//! The design file, and what follows from it: dots, their way to the printing plate, springs, parts.

pub mod layout;
pub mod parts;
mod spec;
mod suspension;
pub mod transfer;

pub use spec::*;
pub use suspension::{claims_of, limits_of, suspension_of};
