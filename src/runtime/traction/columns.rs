//! The rows of a turn, dots, wrench and heights, and the columns of the nodes in them.

use glam::DVec3;
use rayon::prelude::*;

use super::active_set::Rows;
use super::forces::{ForceDistribution, MIN_WRENCH_SD_N, SHEAR_RATIO};
use super::model::AXES;
use super::wrench_rows::{SpringLoad, WrenchRows};
use crate::shape::rows::share;
use domecast_optics::numeric::Rigid;

/// How closely the forces must add to the wrench beside its own noise: a part of the force; moments by the dome's radius.
const WRENCH_PART: f64 = 0.002;

/// Columns that a thread fills at once, at least.
const MIN_COLUMNS: usize = 32;

fn six(force: DVec3, moment: DVec3) -> [f64; 6] {
    [force.x, force.y, force.z, moment.x, moment.y, moment.z]
}

impl ForceDistribution {
    /// The wrench as rows, where it is known.
    fn wrench_rows(&self, pose: &Rigid) -> Option<WrenchRows> {
        let (reference_mm, SpringLoad { wrench, sd }) = self.reference_mm.zip(self.load)?;
        // In the platform's frame, about where the reference point is in it.
        let platform_from_rest = pose.inverse();
        let force = platform_from_rest.vector(wrench.force_n);
        let moment = platform_from_rest.vector(wrench.moment_nmm);
        let (part_n, arm_mm) = (WRENCH_PART * force.length() + MIN_WRENCH_SD_N, self.radius_mm);
        let units = six(DVec3::ONE, DVec3::splat(arm_mm));
        let own = six(sd.force_n, sd.moment_nmm);
        Some(WrenchRows {
            about_mm: platform_from_rest.point(reference_mm),
            six: six(force, moment),
            per_sd: std::array::from_fn(|k| 1.0 / own[k].hypot(part_n * units[k])),
        })
    }

    /// Takes what a turn wants: dots, wrench, heights.
    pub(super) fn want(&mut self, pose: &Rigid) {
        self.wrench = self.wrench_rows(pose);
        self.wanted.clear();
        for k in 0..self.dots.len() {
            let px = (self.dots[k].seen_px - self.nonlinear_px(k)) * self.dots[k].per_sd;
            self.wanted.extend([px.x, px.y]);
        }
        if let Some(WrenchRows { six, per_sd, .. }) = self.wrench {
            self.wanted.extend(six.iter().zip(per_sd).map(|(value, per)| value * per));
        }
        for &node in &self.measured {
            let (height_mm, per_sd) = self.heights[node];
            self.wanted.push(height_mm * per_sd);
        }
    }

    /// What a traction on a node along an axis puts into the rows.
    fn fill_column(&self, axis: usize, node: usize, column: &mut [f64]) {
        let (n, d) = (self.model.nodes.len(), self.dots.len());
        let at = axis * n + node;
        let (dots, others) = column.split_at_mut(2 * d);
        let base = self.dot_columns[2 * at * d..2 * (at + 1) * d].chunks_exact(2);
        for ((dot, px), to) in self.dots.iter().zip(base).zip(dots.chunks_exact_mut(2)) {
            let per = dot.per_sd * self.softness;
            (to[0], to[1]) = (px[0] * per, px[1] * per);
        }
        let mut heights = others;
        if let Some(WrenchRows { about_mm, per_sd, .. }) = &self.wrench {
            let (wrench, rest) = heights.split_at_mut(6);
            let own = &self.model.nodes[node];
            let arm = own.at_mm + self.nodes_moved_mm[node] - about_mm;
            let force = self.turned[node].col(axis) * own.area_mm2;
            let values = six(force, arm.cross(force));
            for (to, (value, per)) in wrench.iter_mut().zip(values.iter().zip(per_sd)) {
                *to = value * per;
            }
            heights = rest;
        }
        let by_height = &self.height_columns[at * n..(at + 1) * n];
        for (to, &other) in heights.iter_mut().zip(&self.measured) {
            *to = by_height[other] * self.heights[other].1 * self.softness;
        }
    }

    /// Solves a turn for the tractions.
    pub(super) fn solve_turn(&mut self) -> super::active_set::Ended {
        let mut columns = std::mem::take(&mut self.columns);
        let mut set = std::mem::take(&mut self.set);
        let (n, rows) = (self.model.nodes.len(), self.wanted.len());
        let pressures = columns.par_chunks_exact_mut(rows.max(1)).take(n).enumerate();
        pressures.with_min_len(share(MIN_COLUMNS)).for_each(|(node, column)| {
            if self.needed[node] {
                self.fill_column(0, node, column);
            }
        });
        let shear = |node: usize, columns: &mut [f64]| {
            for axis in 1..AXES {
                if let Some(column) = columns.get_mut((axis * n + node) * rows..(axis * n + node + 1) * rows)
                {
                    self.fill_column(axis, node, column);
                }
            }
        };
        let mut turn = Rows {
            columns: &mut columns,
            wanted: &self.wanted,
            nodes: n,
            precision: &self.model.precision,
            shear_ratio: SHEAR_RATIO,
        };
        let ended = set.solve(&mut turn, shear);
        (self.columns, self.set) = (columns, set);
        ended
    }
}
