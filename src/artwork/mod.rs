//! Drawings of the layout and their writers.

pub mod drawing;
mod svg;

pub use drawing::Drawing;
pub use svg::to_svg;
