//! How exact the pressures are: the covariance that rows and prior leave them about the touched nodes.

use glam::DVec3;

use super::active_set::{ActiveSet, Rows};
use super::model::{Dot, ElasticModel};
use crate::cholesky::{factor, forward};

/// A dot without a deviation of its own, px.
pub(super) const USUAL_DOT_SD_PX: f64 = 0.02;

/// Nodes that are looked at: those that bear a pressure, and those beside them.
const MAX_NODES: usize = 160;

/// Covariance of the pressures about the touched nodes, as the factor of its inverse.
#[derive(Debug, Clone)]
pub(super) struct Posterior {
    /// The nodes, and the place of each in that list.
    pub nodes: Vec<usize>,
    place: Vec<Option<usize>>,
    factored: Vec<f64>,
    is_known: bool,
    /// By how much deviations are larger than the rows' own say.
    wider: f64,
    solved: Vec<f64>,
    /// By dot: deviation of its depth by such a pressure, mm; likewise.
    alone_mm: Vec<[f64; 2]>,
    /// By dot: deviation of a pressure about it that nothing else is near, N/mm2; where its place at rest was seen, and where it is
    /// the constants'.
    alone_n_mm2: Vec<[f64; 2]>,
}

impl Posterior {
    /// For dots at these places, whose images move so with them.
    pub fn new(model: &ElasticModel, dots: &[Dot]) -> Self {
        let n = model.nodes.len();
        let alone = |(number, dot): (usize, &Dot)| {
            // A smooth pressure about the dot, of height 1.
            let height = |k: usize| {
                let q = model.nodes[k].at_mm.distance_squared(dot.surface_mm);
                (-q / (2.0 * model.correlation_mm * model.correlation_mm)).exp()
            };
            let heights: Vec<(usize, f64)> =
                (0..n).map(|k| (k, height(k))).filter(|(_, height)| *height > 0.01).collect();
            let mut seen = [1.0 / (model.pressure_sd_n_mm2 * model.pressure_sd_n_mm2); 2];
            for (d, other) in dots.iter().enumerate() {
                let u: DVec3 = heights.iter().map(|(k, h)| model.dots_mm[k * dots.len() + d] * *h).sum();
                let squares: f64 = other.by_point.iter().map(|by| by.dot(u).powi(2)).sum();
                for (seen, place_sd_px) in seen.iter_mut().zip([USUAL_DOT_SD_PX, other.place_sd_px]) {
                    *seen += squares / (USUAL_DOT_SD_PX.powi(2) + place_sd_px.powi(2));
                }
            }
            let own: DVec3 = heights.iter().map(|(k, h)| model.dots_mm[k * dots.len() + number] * *h).sum();
            let sds = seen.map(|seen| 1.0 / seen.sqrt());
            (sds, sds.map(|sd| sd * dot.ray().dot(own).abs()))
        };
        let (alone_n_mm2, alone_mm) = dots.iter().enumerate().map(alone).unzip();
        Self {
            nodes: Vec::with_capacity(MAX_NODES),
            place: vec![None; n],
            factored: vec![0.0; MAX_NODES * MAX_NODES],
            is_known: false,
            wider: 1.0,
            solved: Vec::with_capacity(MAX_NODES),
            alone_mm,
            alone_n_mm2,
        }
    }

    /// Takes a frame's rows.
    pub fn take(&mut self, model: &ElasticModel, set: &ActiveSet, rows: &Rows<'_>) {
        self.nodes.iter().for_each(|node| self.place[*node] = None);
        self.nodes.clear();
        let own = set.active.iter().copied();
        let beside = set.active.iter().flat_map(|node| model.nodes[*node].beside.iter().map(|b| b.0));
        for node in own.chain(beside) {
            if self.place[node].is_none() && self.nodes.len() < MAX_NODES {
                self.place[node] = Some(self.nodes.len());
                self.nodes.push(node);
            }
        }
        // Pressures of neighbouring nodes are taken for independent: edges of objects make them so, and deviations must cover that.
        let prior = 1.0 / (model.pressure_sd_n_mm2 * model.pressure_sd_n_mm2);
        for (i, &node) in self.nodes.iter().enumerate() {
            for (j, &other) in self.nodes.iter().enumerate().take(i + 1) {
                self.factored[i * MAX_NODES + j] =
                    rows.product((0, node), (0, other)) + if i == j { prior } else { 0.0 };
            }
        }
        self.is_known = factor(&mut self.factored, self.nodes.len(), MAX_NODES);
    }

    /// Makes all deviations of the frame larger by a factor.
    pub fn widen(&mut self, factor: f64) {
        self.wider = factor;
    }

    /// Deviation of a weighted sum of pressures; nodes that are not looked at count nothing.
    pub fn sd_of(&mut self, weights: impl Iterator<Item = (usize, f64)>) -> Option<f64> {
        if !self.is_known || self.nodes.is_empty() {
            return None;
        }
        self.solved.clear();
        self.solved.resize(self.nodes.len(), 0.0);
        let mut any = false;
        for (node, weight) in weights {
            if let Some(place) = self.place[node] {
                self.solved[place] += weight;
                any = true;
            }
        }
        if !any {
            return None;
        }
        Some(self.sd_of_weights())
    }

    /// Of the pressures weighted as `solved` has them.
    fn sd_of_weights(&mut self) -> f64 {
        forward(&self.factored, MAX_NODES, &mut self.solved);
        self.wider * self.solved.iter().map(|v| v * v).sum::<f64>().sqrt()
    }

    /// Deviation of a dot's depth, mm; `by_node`: what a pressure of 1 N/mm2 on a node moves it by along its ray, mm.
    pub fn depth_sd_mm(&mut self, number: usize, rest_frames: u32, by_node: impl Fn(usize) -> f64) -> f64 {
        let alone = self.alone_mm.get(number).map_or(0.0, |alone| alone[usize::from(rest_frames == 0)]);
        if !self.is_known {
            return alone;
        }
        self.solved.clear();
        self.solved.extend(self.nodes.iter().map(|node| by_node(*node)));
        self.sd_of_weights().max(alone)
    }

    /// Deviation of the pressure at a dot, N/mm2.
    pub fn sd_at(&mut self, model: &ElasticModel, number: usize, dot: &Dot) -> f64 {
        let alone = self.alone_n_mm2.get(number).map(|[seen, of_constants]| match dot.rest_frames {
            0 => *of_constants,
            _ => *seen,
        });
        self.sd_of(model.about(dot.surface_mm)).or(alone).unwrap_or(model.pressure_sd_n_mm2)
    }
}
