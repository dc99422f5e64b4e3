//! Why a part cannot be made.

use std::fmt;

use crate::spec::DesignError;
use domecast_mesh::MeshError;

/// A part that cannot be made, and what to change.
#[derive(Debug, Clone, PartialEq)]
pub enum PartError {
    /// Dimensions of the design contradict each other.
    Infeasible {
        /// The part.
        part: String,
        /// Where in it, and what is wrong.
        place: String,
        /// What was found, mm.
        value_mm: f64,
        /// What it has to be, mm: the least allowed, or the largest where
        /// `place` says so.
        limit_mm: f64,
        /// The design field to change first.
        field: String,
    },
    /// A shape or a boolean failed.
    Mesh {
        /// The part.
        part: String,
        /// Why.
        error: MeshError,
    },
    /// The mesh came out, but is not the surface of the one solid that it
    /// should be.
    Broken {
        /// The part.
        part: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A file cannot be made.
    Unwritable {
        /// Which.
        path: String,
        /// Why.
        problem: String,
    },
    /// The camera's view cannot be computed.
    View {
        /// Why.
        problem: String,
        /// The design field to change first.
        field: String,
    },
}

/// [`PartError::Infeasible`] from borrowed names.
pub(super) fn infeasible(part: &str, place: String, value_mm: f64, limit_mm: f64, field: &str) -> PartError {
    PartError::Infeasible { part: part.to_owned(), place, value_mm, limit_mm, field: field.to_owned() }
}

impl fmt::Display for PartError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Infeasible { part, place, value_mm, limit_mm, field } => {
                write!(f, "{part}: {place}: {value_mm:.3} mm, limit {limit_mm:.3} mm; change {field}")
            }
            Self::Mesh { part, error } => write!(f, "{part}: {error}"),
            Self::Broken { part, problem } => write!(f, "{part}: {problem}"),
            Self::Unwritable { path, problem } => write!(f, "{path}: {problem}"),
            Self::View { problem, field } => write!(f, "the camera's view: {problem}; change {field}"),
        }
    }
}

impl std::error::Error for PartError {}

impl From<PartError> for DesignError {
    fn from(error: PartError) -> Self {
        match error {
            PartError::Infeasible { part, place, value_mm, limit_mm, field } => Self::at(
                field,
                "",
                format!("{part}: {place}: {value_mm:.4} mm"),
                format!("a limit of {limit_mm:.4} mm"),
            ),
            PartError::View { problem, field } => Self::at(
                field,
                "",
                format!("the camera's view: {problem}"),
                "a view that the platform leaves open",
            ),
            PartError::Mesh { part, error } => Self::at(
                "mesh.chord_tolerance_mm",
                "",
                format!("{part}: {error}"),
                "a tolerance that suits the size",
            ),
            PartError::Unwritable { path, problem } => Self::at(
                "mesh.chord_tolerance_mm",
                "",
                format!("{path}: {problem}"),
                "a tolerance that suits the size",
            ),
            PartError::Broken { part, problem } => Self::at(
                "platforms",
                "",
                format!("{part}: {problem}"),
                "features that neither touch nor overlap",
            ),
        }
    }
}

/// A dimension that the process or the assembly does not allow.
pub(super) fn infeasible(part: &str, place: String, value_mm: f64, limit_mm: f64, field: &str) -> PartError {
    PartError::Infeasible { part: part.to_owned(), place, value_mm, limit_mm, field: field.to_owned() }
}
