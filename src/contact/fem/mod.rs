//! Linear finite elements of the bonded dome, as a body of revolution.
//!
//! The dome is the same at every azimuth, so its stiffness falls apart into harmonics; each is a small sparse
//! problem over the meridian ([`mesh`], [`element`], [`body`]), factored once ([`compliance`]). What remains per
//! frame lives on the surface: forces on the nodes of a [`grid`], and the field that they make ([`field`]). Loads that are the same at
//! every azimuth need one harmonic only ([`revolved`]).

mod between;
mod body;
mod compliance;
mod element;
mod field;
mod grid;
mod mesh;
mod revolved;

pub(crate) use between::Parts;
pub(crate) use compliance::Compliance;
pub(crate) use field::SurfaceField;
pub(crate) use grid::GridNode;
pub(crate) use revolved::Revolved;

#[cfg(test)]
mod tests;
