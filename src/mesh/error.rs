//! What can go wrong while a solid is made.

use std::fmt;

/// A failure of this module's functions.
#[derive(Debug, Clone, PartialEq)]
pub enum MeshError {
    /// A length, count or angle has no meaning for the shape that was asked for.
    Dimension {
        /// The shape's name.
        shape: String,
        /// Which dimension.
        dimension: &'static str,
        /// What was given.
        value: f64,
        /// What is allowed, as a phrase: "more than 0".
        allowed: &'static str,
    },
    /// The boolean kernel refused its input or gave up.
    Kernel {
        /// What was being done: "union", "difference", "import".
        operation: &'static str,
        /// The kernel's own word for it.
        reason: String,
    },
    /// Nothing is left of the solid.
    Empty {
        /// What was being done.
        operation: &'static str,
    },
    /// More triangles than an index or an STL's count can hold.
    TooManyTriangles {
        /// How many there would be.
        count: f64,
        /// The limit.
        limit: usize,
    },
}

impl fmt::Display for MeshError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Dimension { shape, dimension, value, allowed } => {
                write!(f, "{shape}: {dimension} is {value}, must be {allowed}")
            }
            Self::Kernel { operation, reason } => {
                write!(f, "the boolean kernel failed in {operation}: {reason}")
            }
            Self::Empty { operation } => write!(f, "nothing is left after {operation}"),
            Self::TooManyTriangles { count, limit } => {
                write!(f, "{count:.0} triangles are too many (limit {limit}): raise the chord tolerance")
            }
        }
    }
}

impl std::error::Error for MeshError {}
