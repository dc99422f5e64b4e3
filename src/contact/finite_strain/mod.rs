//! The dome at large strain: nearly incompressible neo-Hookean hexahedra under frictional contact.

mod deformed;
mod element;
mod krylov;
mod mesh;
mod newton;
mod system;
mod touch;
mod way;

#[cfg(test)]
mod tests;

pub(crate) use deformed::{Deformed, Tried};
pub(crate) use mesh::Grading;
pub(crate) use touch::Law;
pub(crate) use way::{Way, taken};
