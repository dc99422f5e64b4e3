//! Numbers that know nothing of sensors: rigid motions, bracketed roots, real
//! roots of polynomials.
//!
//! Every solver here has a bound on its iterations and answers either with a
//! [`Root`], which carries its residual and the iterations it took, or with a
//! [`RootError`] that names what went wrong. No function returns NaN for a
//! finite input.

pub mod batch;
mod polynomial;
mod random;
mod rigid;
mod roots;
mod rotation;

pub use batch::LengthMismatch;
pub use polynomial::Polynomial;
pub use random::{SeededRandom, mix64};
pub use rigid::{ROTATION_TOLERANCE, Rigid, RigidError};
pub use roots::{MAX_ITERATIONS, Root, RootError, bracketed_newton};
pub use rotation::{cross_matrix, rotation_from_vector, vector_from_rotation};

#[cfg(test)]
mod tests;
