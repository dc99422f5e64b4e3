//! Levels by the object's overlap with the dome: geometric, closed form, and the finite elements that are laid out about it.

mod approach;
mod closed_form;
mod drag;
mod finite_strain;
mod geometric;
mod overlap;

pub(crate) use closed_form::closed_form;
pub(crate) use finite_strain::finite_strain;
pub(crate) use geometric::geometric;
pub(crate) use overlap::{FOUNDATION, overlap};
