//! What a print shop gets: films as drawings, their writers, and pictures of the result.
//!
//! A [`Drawing`] is a resolved tree in millimetres, y up; [`film`] makes one for each hit of a layout, and
//! each writer spells it in its format without deciding anything.
//!
//! ```
//! use domecast_design::Design;
//! use domecast_fab::artwork::{FilmLabel, film, to_svg};
//!
//! let design: Design = include_str!("../../../designs/thumb24.json").parse()?;
//! let label = FilmLabel { design: design.name().into(), hash: "0123456789ab".into() };
//! let pad_over_image = design.sections().print.pad_over_image;
//! let svg = to_svg(&film(&design.layout()?, 0, pad_over_image, &label).expect("finite dots"));
//! assert!(svg.starts_with(b"<"));
//! # Ok::<(), domecast_design::DesignError>(())
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
pub use film::{FilmLabel, film, target_film};
pub use outside_view::outside_view;
pub use pdf_file::to_pdf;
pub use svg_file::to_svg;
pub use tiff_file::to_tiff;

use domecast_design::layout::target::print_target;
use domecast_design::layout::{Layout, LayoutSpec};

/// A file of the artwork.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArtworkFile {
    /// Path in the build, with `/`: `artwork/dots.svg`.
    pub path: String,
    /// Content.
    pub bytes: Vec<u8>,
}

/// Path of the film of a hit in a build, for a kind of file (`svg`): `artwork/dots.svg` for the first hit,
/// `artwork/dots-2.svg` for the second.
pub fn film_path(hit: usize, kind: &str) -> String {
    if hit == 0 { format!("artwork/dots.{kind}") } else { format!("artwork/dots-{}.{kind}", hit + 1) }
}

/// All artwork of a layout, in a fixed order.
///
/// # Errors
/// See [`RenderError`].
pub fn files(spec: &LayoutSpec, layout: &Layout, label: &FilmLabel) -> Result<Vec<ArtworkFile>, RenderError> {
    let mut files = Vec::new();
    for hit in 0..layout.passes.len() {
        let drawing = film(layout, hit, spec.print.pad_over_image, label)?;
        files.extend(film_files(&drawing, |kind| film_path(hit, kind), spec)?);
    }
    let target = print_target(&layout.transfer, &spec.print);
    let drawing = target_film(&target, &layout.transfer, spec.print.pad_over_image, label)?;
    files.extend(film_files(&drawing, |kind| format!("artwork/print-target.{kind}"), spec)?);
    files.push(ArtworkFile { path: "artwork/camera-view.png".into(), bytes: camera_view(spec, layout)? });
    files.push(ArtworkFile { path: "artwork/outside-view.png".into(), bytes: outside_view(layout)? });
    Ok(files)
}

/// One film in every format.
fn film_files(
    drawing: &Drawing,
    path: impl Fn(&str) -> String,
    spec: &LayoutSpec,
) -> Result<[ArtworkFile; 4], RenderError> {
    let file = |kind: &str, bytes: Vec<u8>| ArtworkFile { path: path(kind), bytes };
    Ok([
        file("svg", to_svg(drawing)),
        file("pdf", to_pdf(drawing)?),
        file("dxf", to_dxf(drawing, spec.print.outline_mm())),
        file("tif", to_tiff(drawing, spec.print.dpi)?),
    ])
}
