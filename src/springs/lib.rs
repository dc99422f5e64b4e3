//! Springs, stiffness, load limits: forces, not images.
//!
//! A [`Spring`] gives the figures of one spring; a [`Suspension`] sums them over any layout into a conservative
//! law between pose and [`Wrench`]. Lengths mm, forces N, moments N*mm, angles rad, stress MPa.

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
pub use load::Wrench;
pub use magnet::MagnetPair;
pub use spec::{EndType, SpecError, SpringSpec};
pub use spring::Spring;
pub use state::{Displacement, Equilibrium, MechanicsError, SpringState};
pub use suspension::{MAX_SPRINGS, Suspension, SuspensionSpec};

#[cfg(test)]
mod envelope_tests;
#[cfg(test)]
mod tests;
