//! Why constants make no tracker.

/// A field of the constants that no tracker can be made from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TrackError {
    /// Path of the field, as in the file.
    pub field: String,
    /// What is wrong with it.
    pub problem: String,
}

impl TrackError {
    pub(crate) fn at(field: impl Into<String>, problem: impl Into<String>) -> Self {
        Self { field: field.into(), problem: problem.into() }
    }
}

impl std::fmt::Display for TrackError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.field, self.problem)
    }
}

impl std::error::Error for TrackError {}
