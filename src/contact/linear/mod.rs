//! The linear level: the elastic dome's own compliance under unilateral contact with Coulomb friction.
//!
//! The compliance is that of the dome at rest, but the object bears on a surface that has turned. At small strain and any
//! turn R the stress of the dome at rest, S, has P N = R S N for the traction P N of its undeformed surface (second
//! Piola-Kirchhoff stress; J. Bonet and R. D. Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2008, ch. 5): a
//! force f on the turned surface is R^T f on the dome at rest ([`Candidate::back`]). R takes the dome's normal to the
//! face that it lies along. Without it a ball pushes the dome aside by more than the dome goes. What the turns do inside
//! the dome, and large strain, are left out. Against scikit-fem (tests/cases/golden_neo_hookean.json), elements of
//! R/20, force off and largest displacement off over the dome's radius R:
//!
//! | depth / R | ball of R/2 | plate | ball of 3 R | punch of 0.3 R |
//! |---|---|---|---|---|
//! | 0.03 to 0.06 | +6 %, 0.002 | +4 %, 0.001 | +4 %, 0.001 | +3 %, 0.001 |
//! | 0.08 to 0.12 | +4 %, 0.004 | +2 %, 0.002 | +2 %, 0.003 | +6 %, 0.008 |
//! | 0.15 to 0.18 | -1 %, 0.007 | +1 %, 0.004 | 0 %, 0.006 | +9 %, 0.019 |
//! | 0.21 to 0.24 | -4 %, 0.015 | -4 %, 0.007 | -3 %, 0.010 | +17 %, 0.049 |
//!
//! (Without the turns: the ball -17 %, 0.047 at 0.24 R, the plate -15 %, 0.026 at 0.22 R.) On few elements the force is
//! too large: by 6 % at a contact's radius of 2.5 elements, 13 % at 1.5.
//!
//! An elastic object yields its share of what the dome does, and what a half-space moves beyond that ([`beyond`]).
//!
//! [`candidate`] is one node that may touch, [`gauss_seidel`] finds forces for given planes, [`rounds`] lays the planes
//! anew until nothing moves, [`faces`] takes over where an object is finer than the nodes, and [`solver`] chooses who
//! takes part and goes from pose to pose.

mod beyond;
mod candidate;
mod faces;
mod gauss_seidel;
mod rounds;
mod solver;

pub(crate) use candidate::{Candidate, Spot, Way};
pub(crate) use rounds::Touch;
pub(crate) use solver::{Solver, linear};
