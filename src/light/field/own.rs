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
        let Rings { rings, patches, face } = self.rings;
        let share = (direction.z - face.rim) / (1.0 - face.rim);
        let ring = (share * rings as f64 - 0.5).clamp(0.0, rings as f64 - 1.0);
        let turn = direction.y.atan2(direction.x) / std::f64::consts::TAU;
        let patch = (turn * patches as f64 - 0.5).rem_euclid(patches as f64);
        let low = (ring as usize).min(rings - 2);
        let (up, along) = (ring - low as f64, patch - patch.floor());
        let first = (patch as usize) % patches;
        let at = |ring: usize, patch: usize| self.indirect[ring * patches + patch % patches];
        let corners = [at(low, first), at(low, first + 1), at(low + 1, first), at(low + 1, first + 1)];
        std::array::from_fn(|c| {
            let mix = |a: f64, b: f64, part: f64| a + (b - a) * part;
            mix(mix(corners[0][c], corners[1][c], along), mix(corners[2][c], corners[3][c], along), up)
        })
    }
}
