//! What a print shop gets: films as drawings, their writers, and pictures of the result.
//!
//! A [`Film`] belongs to a layout and takes its scale, its sheet and its notes from it: [`Films::film`] has one for
//! each print pass. A [`Drawing`] is the same as a resolved tree in millimetres, y up; each writer spells it in its format
//! without deciding anything.
//!
//! ```
//! use domecast_design::Design;
//! use domecast_fab::artwork::Films;
//!
//! let design: Design = include_str!("../../../designs/thumb24.json").parse()?;
//! let svg = design.layout()?.film(0).to_svg()?;
//! assert!(svg.starts_with(b"<"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod camera_view;
pub mod canvas;
pub mod drawing;
mod dxf_file;
mod error;
mod film;
mod outside_view;
mod pdf_file;
pub mod strokes;
mod svg_file;
#[cfg(test)]
mod tests;
mod tiff_file;

pub use camera_view::camera_view;
pub use drawing::Drawing;
pub use dxf_file::to_dxf;
pub use error::RenderError;
pub use film::{Film, Films};
pub use outside_view::outside_view;
pub use pdf_file::to_pdf;
pub use svg_file::to_svg;
pub use tiff_file::to_tiff;

use domecast_design::layout::{Layout, LayoutSpec};

/// A file of the artwork.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArtworkFile {
    /// Path in the build, with `/`: `artwork/dots.svg`.
    pub path: String,
    /// Content.
    pub bytes: Vec<u8>,
}

/// Path of the film of a print pass in a build, for a kind of file (`svg`): `artwork/dots.svg` for the first pass,
/// `artwork/dots-2.svg` for the second.
pub fn film_path(pass: usize, kind: &str) -> String {
    if pass == 0 { format!("artwork/dots.{kind}") } else { format!("artwork/dots-{}.{kind}", pass + 1) }
}

/// All artwork of a layout, in a fixed order.
///
/// # Errors
/// See [`RenderError`].
pub fn files(spec: &LayoutSpec, layout: &Layout) -> Result<Vec<ArtworkFile>, RenderError> {
    let mut files = Vec::new();
    for pass in 0..layout.passes.len() {
        files.extend(film_files(layout, &layout.film(pass), |kind| film_path(pass, kind))?);
    }
    let target = layout.target_film();
    files.extend(film_files(layout, &target, |kind| format!("artwork/print-target.{kind}"))?);
    files.push(ArtworkFile { path: "artwork/camera-view.png".into(), bytes: camera_view(spec, layout)? });
    files.push(ArtworkFile { path: "artwork/outside-view.png".into(), bytes: outside_view(layout)? });
    Ok(files)
}

/// One film in every format; it is drawn once.
fn film_files(
    layout: &Layout,
    film: &Film<'_>,
    path: impl Fn(&str) -> String,
) -> Result<[ArtworkFile; 4], RenderError> {
    let file = |kind: &str, bytes: Vec<u8>| ArtworkFile { path: path(kind), bytes };
    let drawing = film.drawing()?;
    Ok([
        file("svg", to_svg(&drawing)),
        file("pdf", to_pdf(&drawing)?),
        file("dxf", to_dxf(&drawing, layout.print().outline_mm())),
        file("tif", to_tiff(&drawing, layout.print().dpi)?),
    ])
}
