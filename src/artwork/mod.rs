//! What a print shop gets: films as drawings, their writers, and pictures of the result.
//!
//! A [`Drawing`] is a resolved tree in millimetres, y up; [`film`] makes one for each hit of a layout, and
//! each writer spells it in its format without deciding anything.

mod camera_view;
pub mod drawing;
mod film;
mod svg_file;
#[cfg(test)]
mod tests;

use std::fmt;

pub use camera_view::camera_view;
pub use drawing::Drawing;
pub use film::{FilmLabel, film};
pub use svg_file::to_svg;

use crate::layout::{Layout, LayoutSpec};

/// A file of the artwork.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArtworkFile {
    /// Path in the build, with `/`: `artwork/dots.svg`.
    pub path: String,
    /// Content.
    pub bytes: Vec<u8>,
}

/// Artwork that could not be drawn. None of these follows from a resolved design.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RenderError {
    /// A coordinate is not a finite number.
    NotFinite,
    /// A picture has no size that can be drawn.
    Size,
    /// A library could not write the picture.
    Encode(String),
}

impl fmt::Display for RenderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite => write!(f, "a coordinate of the drawing is not a finite number"),
            Self::Size => write!(f, "the picture has no size that can be drawn"),
            Self::Encode(what) => write!(f, "the picture could not be written: {what}"),
        }
    }
}

impl std::error::Error for RenderError {}

impl From<drawing::NotFinite> for RenderError {
    fn from(_: drawing::NotFinite) -> Self {
        Self::NotFinite
    }
}

/// All artwork of a layout, in a fixed order.
///
/// # Errors
/// See [`RenderError`].
pub fn files(spec: &LayoutSpec, layout: &Layout, label: &FilmLabel) -> Result<Vec<ArtworkFile>, RenderError> {
    let drawing = film(layout, 0, spec.print.pad_over_image, label)?;
    Ok(vec![
        ArtworkFile { path: "artwork/dots.svg".into(), bytes: to_svg(&drawing) },
        ArtworkFile { path: "artwork/camera-view.png".into(), bytes: camera_view(spec, layout)? },
    ])
}
