//! Why the shape of a sensor cannot be read.

use std::fmt;

/// A field that is at fault, what is wrong with it, and what cures it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ShapeError {
    /// The field of the constants, or `rest` for the frame at rest.
    pub field: &'static str,
    /// What is wrong.
    pub problem: String,
    /// What to do.
    pub cure: &'static str,
    /// Two colours of a frame that fit only when they are swapped.
    pub swapped: Option<[&'static str; 2]>,
}

impl ShapeError {
    pub(super) fn new(field: &'static str, problem: impl Into<String>, cure: &'static str) -> Self {
        Self { field, problem: problem.into(), cure, swapped: None }
    }

    /// The same fault, of two colours that fit only when they are swapped.
    pub(super) fn of_swapped(mut self, colours: [&'static str; 2]) -> Self {
        self.swapped = Some(colours);
        self
    }
}

impl fmt::Display for ShapeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}; {}", self.field, self.problem, self.cure)
    }
}

impl std::error::Error for ShapeError {}
