//! The soft round window on a spot's darkness.

use super::stencil::{LANES, Stencil};

/// How much darker than the ground the pixels of a stencil's window are, and where in it the window's middle is.
pub(super) struct SoftWindow<'a> {
    columns: &'a [f32],
    dark: &'a [f32],
    disc_half: f32,
    center: [f32; 2],
    end: f32,
    per: f32,
}

/// A row of the window that is not all outside.
pub(super) struct WindowRow<'a> {
    columns: &'a [f32],
    values: &'a [f32],
    /// Number of the row.
    pub index: usize,
    /// The row from the window's middle, px, and the middle's column.
    pub dy: f32,
    pub center_x: f32,
    end: f32,
    per: f32,
}

impl<'a> SoftWindow<'a> {
    /// With its middle at `center` from the middle pixel.
    pub fn new(stencil: &'a Stencil, dark: &'a [f32], center: glam::DVec2) -> Self {
        let end = stencil.reach_px + 0.5;
        Self {
            columns: &stencil.columns,
            dark,
            disc_half: stencil.disc_half as f32,
            center: [center.x as f32, center.y as f32],
            end: end * end,
            per: 1.0 / (2.0 * stencil.reach_px),
        }
    }

    /// What the first moment of the rim, each pixel by its weight times what it lacks of the whole, would be if all of it lay
    /// on one side, px^2: over the pixel that the window takes to end, the weight times the rest is a sixth in the mean.
    pub fn rim_px2(&self) -> f64 {
        let reach_px = 0.5 / f64::from(self.per);
        std::f64::consts::TAU * reach_px * reach_px / 6.0
    }

    /// Its rows from the top.
    #[inline(always)]
    pub fn rows(&self) -> impl Iterator<Item = WindowRow<'_>> {
        let rows = self.dark.chunks_exact(self.columns.len()).enumerate();
        rows.filter_map(|(index, values)| {
            let dy = index as f32 - self.disc_half - self.center[1];
            let end = self.end - dy * dy;
            let row = WindowRow {
                columns: self.columns,
                values,
                index,
                dy,
                center_x: self.center[0],
                end,
                per: self.per,
            };
            (end > 0.0).then_some(row)
        })
    }
}

impl WindowRow<'_> {
    /// How much a pixel at `dx` from the middle's column counts: 1 to half a pixel within the window's radius, 0 to half
    /// a pixel beyond.
    #[inline(always)]
    pub fn weight(&self, dx: f32) -> f32 {
        ((self.end - dx * dx) * self.per).clamp(0.0, 1.0)
    }

    /// Darkness and columns, in lanes: sums in lanes of their own have a fixed order, and the loop goes in vectors.
    #[inline(always)]
    pub fn lanes(&self) -> impl Iterator<Item = (&[f32; LANES], &[f32; LANES])> {
        self.values.as_chunks::<LANES>().0.iter().zip(self.columns.as_chunks::<LANES>().0)
    }
}
