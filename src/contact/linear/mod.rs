//! The linear level: the elastic dome's own compliance under unilateral contact with Coulomb friction.
//!
//! [`candidate`] is one node that may touch, [`gauss_seidel`] finds forces for given planes, [`rounds`] lays the planes
//! anew until nothing moves, [`faces`] takes over where an object is finer than the nodes, and [`solver`] chooses who
//! takes part and goes from pose to pose.

mod candidate;
mod faces;
mod gauss_seidel;
mod rounds;
mod solver;

pub(crate) use candidate::{Candidate, Spot, Way};
pub(crate) use rounds::Touch;
pub(crate) use solver::{Solver, linear};
