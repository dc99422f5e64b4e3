//! Springs, stiffness, load limits: forces, not images.
//!
//! A [`Spring`] gives the figures of one spring; a [`Suspension`] sums them over any layout into a conservative
//! law between pose and [`Wrench`]. Lengths mm, forces N, moments N*mm, angles rad, stress MPa.
//!
//! ```
//! use domecast_springs::{EndType, Spring, SpringSpec};
//!
//! let spring = Spring::new(SpringSpec {
//!     wire_diameter_mm: 0.3,
//!     outer_diameter_mm: 3.0,
//!     free_length_mm: 5.0,
//!     active_coils: 4.0,
//!     ends: EndType::ClosedGround,
//!     shear_modulus_mpa: 79_000.0,
//!     elastic_modulus_mpa: 203_000.0,
//!     allowable_shear_mpa: 1_100.0,
//! })?;
//! // G d^4 / (8 D^3 n)
//! assert!((spring.axial_n_per_mm() - 1.016).abs() < 1e-3);
//! assert!((spring.solid_height_mm() - 1.8).abs() < 1e-12);
//! # Ok::<(), domecast_springs::SpecError>(())
//! ```

mod balance;
mod column;
mod dual;
mod envelope;
mod law;
mod limits;
mod load;
mod magnet;
mod spec;
mod spring;
mod state;
mod suspension;

pub use column::{Column, EndStiffness};
pub use envelope::{
    Choice, Direction, LARGEST_FACTOR, MoreChecks, Reach, choices, push_press_border, reach,
    standard_directions, try_all,
};
pub use limits::{Check, Limit, Limits, LoadCase, Stop, StopShape, checks_at, sort_worst_first, try_load};
pub use load::{N_PER_G_MPS2, STANDARD_GRAVITY_MPS2, Wrench};
pub use magnet::MagnetPair;
pub use spec::{EndType, SpecError, SpringSpec};
pub use spring::Spring;
pub use state::{Displacement, Equilibrium, MechanicsError, SpringState};
pub use suspension::{MAX_SPRINGS, Suspension, SuspensionSpec};

#[cfg(test)]
mod envelope_tests;
#[cfg(test)]
mod tests;
