//! The touched part of the skin as a whole.

use glam::DVec3;

use super::forces::ForceDistribution;
use super::result::ContactEstimate;

/// A force below this many of its deviations is none.
const MIN_OVER_SD: f64 = 3.0;
/// Nor is one below this part of Young's modulus times the dome's radius squared (0.02 N on 10 mm of soft silicone): it moves dots by
/// hundredths of a pixel, which `track` is off by.
const MIN_FORCE_PART: f64 = 3.6e-4;
/// Shear from this part of the friction's limit on counts as slip.
const SLIPS_FROM: f64 = 0.95;

impl ForceDistribution {
    /// What touches, with the springs' deviations of the force where there are springs.
    pub(super) fn contact(&mut self, springs_sd_n: Option<DVec3>) -> Option<ContactEstimate> {
        let n = self.model.nodes.len();
        let nodes = &self.model.nodes;
        let (mut force_n, mut load_n, mut moment, mut normal) = (DVec3::ZERO, 0.0, DVec3::ZERO, DVec3::ZERO);
        let mut slips_n = 0.0;
        for &node in &self.set.active {
            let own = DVec3::from_array([0, 1, 2].map(|axis| self.set.tractions[axis * n + node]));
            let pressed_n = own.x * nodes[node].area_mm2;
            force_n += self.turned[node] * own * nodes[node].area_mm2;
            load_n += pressed_n;
            moment += (nodes[node].at_mm + self.nodes_moved_mm[node]) * pressed_n;
            normal -= self.turned[node].x_axis * pressed_n;
            if own.y.hypot(own.z) >= SLIPS_FROM * self.model.friction * own.x {
                slips_n += pressed_n;
            }
        }
        if load_n < MIN_FORCE_PART * self.model.young_mpa * self.radius_mm * self.radius_mm {
            return None;
        }
        let point_mm = moment / load_n;
        let normal = normal.normalize_or(DVec3::Z);
        let (first, second) = normal.any_orthonormal_pair();
        let mut spread = [0.0; 3];
        for &node in &self.set.active {
            let share = self.set.tractions[node] * nodes[node].area_mm2 / load_n;
            let arm = nodes[node].at_mm + self.nodes_moved_mm[node] - point_mm;
            let (x, y) = (arm.dot(first), arm.dot(second));
            // A node's own load lies spread over its area.
            let own = nodes[node].area_mm2 / 6.0;
            spread[0] += share * (x * x + own);
            spread[1] += share * (y * y + own);
            spread[2] += share * x * y;
        }
        let area_mm2 =
            5.0 * std::f64::consts::PI * (spread[0] * spread[1] - spread[2] * spread[2]).max(0.0).sqrt();
        let load_sd_n = self.posterior.sd_of(nodes.iter().map(|node| node.area_mm2).enumerate())?;
        let own_sd_n =
            load_sd_n.hypot(if springs_sd_n.is_some() { 0.0 } else { self.model.young_sd_part * load_n });
        let random_sd_n = self.load.map_or(own_sd_n, |load| load_sd_n.hypot(load.sd.force_n.length()));
        if load_n < MIN_OVER_SD * random_sd_n {
            return None;
        }
        let along = |axis: DVec3| {
            let weight = move |(node, at_mm, area_mm2): (usize, DVec3, f64)| {
                (node, (at_mm - point_mm).dot(axis) * area_mm2 / load_n)
            };
            nodes.iter().enumerate().map(|(k, node)| (k, node.at_mm, node.area_mm2)).map(weight)
        };
        let variances = [first, second].map(|axis| self.posterior.sd_of(along(axis)).unwrap_or(0.0).powi(2));
        let point_noise_sd_mm = (0.5 * (variances[0] + variances[1])).sqrt();
        Some(ContactEstimate {
            area_mm2,
            point_mm,
            point_noise_sd_mm,
            point_sd_mm: point_noise_sd_mm,
            normal,
            force_n,
            force_sd_n: springs_sd_n.unwrap_or(DVec3::splat(own_sd_n)),
            slip_share: slips_n / load_n,
        })
    }
}
