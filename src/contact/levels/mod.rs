//! The two levels without equations to solve: geometric and closed form.

mod approach;
mod closed_form;
mod drag;
mod geometric;
mod overlap;

pub(crate) use closed_form::closed_form;
pub(crate) use geometric::geometric;
