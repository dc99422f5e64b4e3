//! What can go wrong while artwork is drawn.

use std::fmt;

use super::drawing::NotFinite;

/// Artwork that could not be drawn. None of these follows from a resolved design and a pass that it has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RenderError {
    /// A coordinate is not a finite number.
    NotFinite,
    /// A picture has no size that can be drawn.
    Size,
    /// A film of a print pass that the layout does not have.
    NoSuchPass {
        /// The pass that was asked for, counted from 0.
        pass: usize,
        /// The number of passes of the layout.
        passes: usize,
    },
    /// A library could not write the picture.
    Encode(String),
}

impl fmt::Display for RenderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite => write!(f, "a coordinate of the drawing is not a finite number"),
            Self::Size => write!(f, "the picture has no size that can be drawn"),
            Self::NoSuchPass { pass, passes } => {
                write!(
                    f,
                    "film {pass}: the layout has {passes} print passes; allowed: 0 to {}",
                    passes.saturating_sub(1)
                )
            }
            Self::Encode(what) => write!(f, "the picture could not be written: {what}"),
        }
    }
}

impl std::error::Error for RenderError {}

impl From<NotFinite> for RenderError {
    fn from(_: NotFinite) -> Self {
        Self::NotFinite
    }
}
