//! Numbers that know nothing of sensors: rigid motions, bracketed roots, real
//! roots of polynomials.
//!
//! Every solver here has a bound on its iterations and answers either with a
//! [`Root`], which carries its residual and the iterations it took, or with a
//! [`RootError`] that names what went wrong. No function returns NaN for a
//! finite input.
//!
//! # Example
//! ```
//! use domecast_optics::numeric::bracketed_newton;
//!
//! // the square root of 2: a function with its derivative, a bracket and a start
//! let root = bracketed_newton(|x| (x * x - 2.0, 2.0 * x), 0.0, 2.0, 1.0)?;
//! assert!((root.value - 2.0_f64.sqrt()).abs() < 1e-15);
//! # Ok::<(), domecast_optics::numeric::RootError>(())
//! ```

pub mod batch;
pub mod csv;
mod polynomial;
mod random;
mod rigid;
mod roots;
mod rotation;
mod spectral;

pub use batch::LengthMismatch;
pub use polynomial::Polynomial;
pub use random::{SeededRandom, mix64};
pub use rigid::{ROTATION_TOLERANCE, Rigid, RigidError};
pub use roots::{MAX_ITERATIONS, Root, RootError, bracketed_newton};
pub use rotation::{cross_matrix, rotation_from_vector, vector_from_rotation};
pub use spectral::{pseudo_inverse, singular_values, symmetric_eigen};

#[cfg(test)]
mod tests;
