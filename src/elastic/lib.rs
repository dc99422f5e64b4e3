//! Linear elasticity of the bonded dome: finite elements of it as a body of revolution.
//!
//! The dome is the same at every azimuth, so its stiffness falls apart into harmonics; each is a small sparse
//! problem over the meridian (modules `mesh`, `element`, `body`), factored once ([`Compliance`]). What remains per
//! frame lives on the surface: forces on the nodes of a [`Grid`], and the field that they make ([`SurfaceField`]).
//! Loads that are the same at every azimuth need one harmonic only ([`Revolved`]).

mod between;
mod body;
mod cholesky;
mod compliance;
mod dome;
mod element;
mod field;
mod grid;
mod held;
mod mesh;
mod revolved;

pub use between::{NodeParts, NodePlaces, Row};
pub use cholesky::{Cholesky, Elimination, Factors};
pub use compliance::Compliance;
pub use dome::{ElasticDome, Extent, FactorError};
pub use field::SurfaceField;
pub use grid::{Grid, GridNode};
pub use held::HeldBack;
pub use revolved::{Revolved, Ring};

#[cfg(test)]
mod tests;
