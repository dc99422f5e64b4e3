//! Why a model cannot be used.

use std::fmt;

/// Why a model file was refused: what of it, what is wrong there, and what would do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModelError {
    /// The part of the file: a node, a tensor, a member of the metadata.
    pub at: String,
    /// What is wrong with it.
    pub problem: String,
    /// What is allowed there.
    pub allowed: String,
}

impl ModelError {
    /// An error at a part of the file.
    pub fn new(at: impl Into<String>, problem: impl Into<String>, allowed: impl Into<String>) -> Self {
        Self { at: at.into(), problem: problem.into(), allowed: allowed.into() }
    }

    /// Bytes that end early or that are no ONNX at all.
    pub(crate) fn broken(problem: impl Into<String>) -> Self {
        Self::new("the file", problem, "a whole ONNX model as `domecast-learn` writes it")
    }
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}; allowed: {}", self.at, self.problem, self.allowed)
    }
}

impl std::error::Error for ModelError {}
