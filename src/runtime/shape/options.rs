//! Settings of the reading of shapes.

use super::error::ShapeError;

/// Settings of a [`ShapeFromColor`](super::ShapeFromColor).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeOptions {
    /// Pixels along each side of a cell that is solved for, 1 to 16: half of the picture's resolution halves the noise, and colour
    /// comes no finer from a camera whose chroma is halved.
    pub cell_px: usize,
    /// How often normals are read, integrated, and read again with the light at the moved skin, 1 to 16.
    pub max_passes: usize,
}

impl Default for ShapeOptions {
    fn default() -> Self {
        Self { cell_px: 2, max_passes: 2 }
    }
}

impl ShapeOptions {
    pub(super) fn check(&self) -> Result<(), ShapeError> {
        for (name, value) in [("cell_px", self.cell_px), ("max_passes", self.max_passes)] {
            if !(1..=16).contains(&value) {
                return Err(ShapeError::new(name, format!("is {value}"), "give a number from 1 to 16"));
            }
        }
        Ok(())
    }
}
