//! What is wrong with a pattern.

use std::fmt;

use crate::spec::DesignError;

/// A pattern that cannot be laid out as the design asks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LayoutError {
    /// The field at fault, as a path in the design file.
    pub field: String,
    /// Its value, or what it led to.
    pub value: String,
    /// What is wrong.
    pub problem: String,
    /// What is allowed.
    pub allowed: String,
}

impl LayoutError {
    pub(super) fn new(
        field: impl Into<String>,
        value: impl ToString,
        problem: impl Into<String>,
        allowed: impl Into<String>,
    ) -> Self {
        Self {
            field: field.into(),
            value: value.to_string(),
            problem: problem.into(),
            allowed: allowed.into(),
        }
    }
}

impl fmt::Display for LayoutError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` is {}: {}; allowed: {}", self.field, self.value, self.problem, self.allowed)
    }
}

impl std::error::Error for LayoutError {}

impl From<LayoutError> for DesignError {
    fn from(error: LayoutError) -> Self {
        Self::at(error.field, error.value, error.problem, error.allowed)
    }
}
