//! Why a scene cannot be simulated.

use std::fmt;

use domecast_design::DesignError;
use domecast_design::layout::LayoutError;

/// Why a scene cannot be simulated.
#[derive(Debug, Clone, PartialEq)]
pub enum SimError {
    /// The scene, its design or one of its meshes is at fault.
    Input(Box<DesignError>),
    /// A frame, by its number, has no answer.
    Frame {
        /// Number of the frame.
        frame: u32,
        /// What is wrong with it.
        problem: String,
    },
}

impl From<DesignError> for SimError {
    fn from(error: DesignError) -> Self {
        Self::Input(Box::new(error))
    }
}

impl From<LayoutError> for SimError {
    fn from(error: LayoutError) -> Self {
        DesignError::from(error).into()
    }
}

impl fmt::Display for SimError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(error) => error.fmt(f),
            Self::Frame { frame, problem } => write!(f, "frame {frame}: {problem}"),
        }
    }
}

impl std::error::Error for SimError {}
