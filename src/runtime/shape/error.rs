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
    /// The order in which a frame has its colours, where it is not red, green, blue.
    pub colour_order: Option<[&'static str; 3]>,
}

impl ShapeError {
    pub(super) fn new(field: &'static str, problem: impl Into<String>, cure: &'static str) -> Self {
        Self { field, problem: problem.into(), cure, colour_order: None }
    }

    /// The same fault, of colours that fit only in another order.
    pub(super) fn of_other_order(mut self, colours: [&'static str; 3]) -> Self {
        self.colour_order = Some(colours);
        self
    }
}

impl fmt::Display for ShapeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}; {}", self.field, self.problem, self.cure)
    }
}

impl std::error::Error for ShapeError {}
