//! The membrane's own light: what it throws back onto itself.

use glam::DVec3;

use crate::dome_map::{DomeGrid, bicubic};
use crate::radiosity::Rings;
use crate::tables::{Prepared, Ways};

/// The membrane's own light at the patches of a room.
#[derive(Debug, Clone)]
pub(super) struct OwnLight {
    rings: Rings,
    pub indirect: Vec<[f64; 3]>,
    pub exitance: [Vec<f64>; 3],
}

impl OwnLight {
    pub fn new(
        ways: &Ways,
        prepared: &Prepared,
        albedo: [f64; 3],
        grid: &DomeGrid,
        table: &[[f64; 3]],
    ) -> Self {
        let rings = Rings::usual(grid.face);
        let patch = |i: usize| rings.place(i / rings.patches, i % rings.patches);
        let lit = |i: usize| bicubic(grid, table, grid.coordinates(patch(i)));
        let light: Vec<[f64; 3]> = (0..rings.count()).map(lit).collect();
        let mut indirect = vec![[0.0; 3]; rings.count()];
        let mut exitance = [const { Vec::new() }; 3];
        for (c, room) in prepared.rooms(ways).iter().enumerate().take(3) {
            let own: Vec<f64> = light.iter().map(|e| e[c].max(0.0)).collect();
            let balance = room.solve(&own, albedo[c]);
            for (sum, value) in indirect.iter_mut().zip(&balance.indirect) {
                sum[c] = *value;
            }
            exitance[c] = balance.exitance;
        }
        Self { rings, indirect, exitance }
    }

    /// Linear between rings and patches; level beyond the first and last ring.
    pub fn at(&self, direction: DVec3) -> [f64; 3] {
        let around = self.rings.around(direction);
        std::array::from_fn(|c| around.iter().map(|(patch, weight)| weight * self.indirect[*patch][c]).sum())
    }
}
