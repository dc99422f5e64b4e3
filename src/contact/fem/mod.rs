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

pub(super) use between::Parts;
pub(super) use compliance::Compliance;
pub(super) use field::SurfaceField;
pub(super) use grid::GridNode;
pub(super) use revolved::Revolved;

#[cfg(test)]
mod tests;
