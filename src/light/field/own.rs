//! The membrane's own light: what it throws back onto itself.

use glam::DVec3;

use crate::dome_map::{DomeGrid, bicubic};
use crate::radiosity::Rings;
use crate::tables::{Prepared, Ways};

/// The membrane's own light at the patches of a room.
#[derive(Debug, Clone)]
pub(super) struct OwnLight {
    rings: Rings,
    indirect: Vec<[f64; 3]>,
    /// Vector irradiance: x, y and z of each channel.
    vectors: Vec<[f64; 9]>,
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
        let mut vectors = vec![[0.0; 9]; rings.count()];
        let mut exitance = [const { Vec::new() }; 3];
        for (c, room) in prepared.rooms(ways).iter().enumerate().take(3) {
            let own: Vec<f64> = light.iter().map(|e| e[c].max(0.0)).collect();
            let balance = room.solve(&own, albedo[c]);
            for (sum, value) in indirect.iter_mut().zip(&balance.indirect) {
                sum[c] = *value;
            }
            for (own, vector) in vectors.iter_mut().zip(room.vector_irradiance(&balance.exitance)) {
                own[3 * c..3 * c + 3].copy_from_slice(&vector.to_array());
            }
            exitance[c] = balance.exitance;
        }
        Self { rings, indirect, vectors, exitance }
    }

    /// Irradiance of the undeformed membrane.
    pub fn at(&self, direction: DVec3) -> [f64; 3] {
        self.between(&self.indirect, direction)
    }

    /// Vector irradiance there, x, y and z of each channel.
    pub fn vectors_at(&self, direction: DVec3) -> [f64; 9] {
        self.between(&self.vectors, direction)
    }

    /// Linear between rings and patches; level beyond the first ring, and to the mean of the last one at the pole.
    fn between<const K: usize>(&self, table: &[[f64; K]], direction: DVec3) -> [f64; K] {
        let Rings { rings, patches, face } = self.rings;
        let share = (direction.z - face.rim) / (1.0 - face.rim);
        let ring = (share * rings as f64 - 0.5).clamp(0.0, rings as f64 - 1.0);
        let turn = direction.y.atan2(direction.x) / std::f64::consts::TAU;
        let patch = (turn * patches as f64 - 0.5).rem_euclid(patches as f64);
        let low = (ring as usize).min(rings - 2);
        let (up, along) = (ring - low as f64, patch - patch.floor());
        let first = (patch as usize) % patches;
        let at = |ring: usize, patch: usize| table[ring * patches + patch % patches];
        let corners = [at(low, first), at(low, first + 1), at(low + 1, first), at(low + 1, first + 1)];
        let mix = |a: f64, b: f64, part: f64| a + (b - a) * part;
        let found: [f64; K] = std::array::from_fn(|k| {
            mix(mix(corners[0][k], corners[1][k], along), mix(corners[2][k], corners[3][k], along), up)
        });
        // Within the last ring what differs around falls with the distance from the axis.
        let aside = (2.0 * rings as f64 * (1.0 - share).max(0.0)).sqrt();
        if aside >= 1.0 {
            return found;
        }
        let last = &table[(rings - 1) * patches..];
        let mean = |k: usize| last.iter().map(|values| values[k]).sum::<f64>() / patches as f64;
        std::array::from_fn(|k| mix(mean(k), found[k], aside))
    }
}
