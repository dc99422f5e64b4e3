//! Closed forms of the elastic half-space, and what the dome's bonded base adds to them.

mod bonded_base;
mod hertz;
mod mindlin;

pub(crate) use bonded_base::held;
pub(crate) use hertz::{Patch, axes, cone, ellipse};
pub(crate) use mindlin::{Disc, Drag, drag};
