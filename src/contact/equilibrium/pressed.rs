//! An object pressed on the sprung dome, in balance.

use nalgebra::DMatrix;

use crate::state::ContactState;
use domecast_optics::numeric::Rigid;
use domecast_springs::Wrench;

/// How a balance ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PressStatus {
    /// Balanced, every spring within its travel.
    Balanced,
    /// Balanced, but this spring (by number) is pressed beyond its coils: the true platform stops there.
    SpringsBind {
        /// Number of the spring, from 0.
        spring: usize,
    },
    /// The bound on iterations, or the end of the springs' law, was reached with this residual, N.
    NotBalanced {
        /// Residual, N (moments counted over the springs' reach).
        residual_n: f64,
    },
}

/// An object pressed on the sprung dome.
#[derive(Debug, Clone, PartialEq)]
pub struct Pressed {
    /// Where the platform is.
    pub rest_from_platform: Rigid,
    /// Where the object is.
    pub rest_from_object: Rigid,
    /// The contact, in the moved sensor frame.
    pub state: ContactState,
    /// What the contact puts on the platform: rest frame, about the springs' reference point.
    pub wrench: Wrench,
    /// What the balance is off, N (moments counted over the springs' reach).
    pub residual_n: f64,
    /// Contact solves.
    pub iterations: u32,
    /// How the balance ended.
    pub status: PressStatus,
    /// Derivative of the residual, as the search knew it at last: a start for the next frame's.
    pub(super) learnt: Option<DMatrix<f64>>,
}
