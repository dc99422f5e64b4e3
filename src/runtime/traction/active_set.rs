//! Least squares with pressures that are not negative, shear only where there is pressure.
//!
//! Minimises half of `|A x - b|^2 + x^T Q x` over the tractions of all nodes. Nodes come in one by one, the one whose pressure would gain
//! most, and go where their pressure would be negative (C. L. Lawson and R. J. Hanson, Solving Least Squares Problems, 1974, ch. 23);
//! their shear comes and goes with them, for which the proof of the end does not hold: a node that went stays out until the next
//! solve, so there are at most twice as many steps as nodes.

use super::model::AXES;
use crate::cholesky::{factor, solve};

/// Most nodes that bear a pressure at once.
pub(super) const MAX_ACTIVE: usize = 96;
const WIDTH: usize = AXES * MAX_ACTIVE;
/// A node comes in when its pressure would be more than this many of its own deviations: less is noise.
const MIN_OVER_SD: f64 = 1.5;
/// Nodes that come in at once, and the part of the best one's gain that the others must have.
const AT_ONCE: usize = 4;
const ALMOST: f64 = 0.5;
/// Steps at most of one solve.
const MAX_STEPS: u32 = 60;

/// The rows of a frame: columns by axis and node, each of `rows` values, already over their deviations.
pub(super) struct Rows<'a> {
    pub columns: &'a mut [f64],
    pub wanted: &'a [f64],
    /// Nodes.
    pub nodes: usize,
    /// Inverse covariance of the pressures, and the variance of shear over that of pressure.
    pub precision: &'a [f64],
    pub shear_ratio: f64,
}

impl Rows<'_> {
    fn column(&self, axis: usize, node: usize) -> &[f64] {
        let rows = self.wanted.len();
        self.columns.get((axis * self.nodes + node) * rows..).and_then(|c| c.get(..rows)).unwrap_or(&[])
    }

    /// Scalar product of two columns.
    pub fn product(&self, (axis, node): (usize, usize), (other_axis, other): (usize, usize)) -> f64 {
        dot(self.column(axis, node), self.column(other_axis, other))
    }

    /// The prior's entry of one axis.
    pub fn prior(&self, axis: usize, node: usize, other: usize) -> f64 {
        let value = self.precision.get(node * self.nodes + other).copied().unwrap_or(0.0);
        if axis == 0 { value } else { value / self.shear_ratio }
    }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums at a time: one after the other they wait for each other.
    let mut sums = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a4.zip(b4) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ended {
    /// Nothing can be gained any more.
    Solved,
    /// A bound on steps or nodes was reached; the answer is a good one, not the best.
    Bound,
}

/// The nodes that bear a pressure, and their tractions; warm from frame to frame.
#[derive(Debug, Clone, Default)]
pub(super) struct ActiveSet {
    /// The nodes, by slot.
    pub active: Vec<usize>,
    /// Tractions by axis and node, N/mm2.
    pub tractions: Vec<f64>,
    /// Products of the active columns.
    gram: Vec<f64>,
    /// Products of the active columns with what is wanted.
    gains: Vec<f64>,
    factored: Vec<f64>,
    found: Vec<f64>,
    residual: Vec<f64>,
    went: Vec<bool>,
    /// Nodes that may bear a pressure.
    pub allowed: Vec<bool>,
    /// One over the deviation that each pressure alone would have.
    per_sd: Vec<f64>,
}

impl ActiveSet {
    pub fn new(nodes: usize, max_rows: usize) -> Self {
        Self {
            active: Vec::with_capacity(MAX_ACTIVE),
            tractions: vec![0.0; AXES * nodes],
            gram: vec![0.0; WIDTH * WIDTH],
            gains: vec![0.0; WIDTH],
            factored: vec![0.0; WIDTH * WIDTH],
            found: Vec::with_capacity(WIDTH),
            residual: Vec::with_capacity(max_rows),
            went: vec![false; nodes],
            allowed: vec![true; nodes],
            per_sd: vec![0.0; nodes],
        }
    }

    pub fn clear(&mut self) {
        self.active.clear();
        self.tractions.fill(0.0);
    }

    /// Solves a frame from the nodes of the last one; `shear` fills a node's columns of shear, which nodes without pressure do not have.
    pub fn solve(&mut self, rows: &mut Rows<'_>, shear: impl Fn(usize, &mut [f64])) -> Ended {
        for (went, is_allowed) in self.went.iter_mut().zip(&self.allowed) {
            *went = !is_allowed;
        }
        let Self { active, tractions, allowed, .. } = self;
        active.retain(|&node| {
            if !allowed[node] {
                (0..AXES).for_each(|axis| tractions[axis * rows.nodes + node] = 0.0);
            }
            allowed[node]
        });
        for (node, per_sd) in self.per_sd.iter_mut().enumerate().filter(|(node, _)| allowed[*node]) {
            *per_sd = 1.0 / (rows.product((0, node), (0, node)) + rows.prior(0, node, node)).sqrt();
        }
        for slot in 0..self.active.len() {
            shear(self.active[slot], rows.columns);
            self.enter(rows, slot);
        }
        let mut ended = self.solve_active(rows);
        for _ in 0..MAX_STEPS {
            let best = self.best(rows);
            if best[0].is_none() {
                return ended;
            }
            for node in best.into_iter().flatten() {
                if self.active.len() >= MAX_ACTIVE {
                    return Ended::Bound;
                }
                self.active.push(node);
                shear(node, rows.columns);
                self.enter(rows, self.active.len() - 1);
            }
            ended = self.solve_active(rows);
        }
        Ended::Bound
    }

    /// Fills the products of a slot with itself and those before it.
    fn enter(&mut self, rows: &Rows<'_>, slot: usize) {
        let node = self.active[slot];
        for (other_slot, &other) in self.active.iter().enumerate().take(slot + 1) {
            for axis in 0..AXES {
                for other_axis in 0..AXES {
                    let mut value = rows.product((axis, node), (other_axis, other));
                    if axis == other_axis {
                        value += rows.prior(axis, node, other);
                    }
                    let (i, j) = (AXES * slot + axis, AXES * other_slot + other_axis);
                    self.gram[i * WIDTH + j] = value;
                    self.gram[j * WIDTH + i] = value;
                }
            }
        }
        for axis in 0..AXES {
            self.gains[AXES * slot + axis] = dot(rows.column(axis, node), rows.wanted);
        }
    }

    /// Takes a slot out; the last one takes its place.
    fn leave(&mut self, slot: usize) {
        let last = self.active.len() - 1;
        for axis in 0..AXES {
            let (to, from) = (AXES * slot + axis, AXES * last + axis);
            self.gains[to] = self.gains[from];
            for j in 0..AXES * (last + 1) {
                self.gram[to * WIDTH + j] = self.gram[from * WIDTH + j];
            }
        }
        for axis in 0..AXES {
            let (to, from) = (AXES * slot + axis, AXES * last + axis);
            for i in 0..AXES * (last + 1) {
                self.gram[i * WIDTH + to] = self.gram[i * WIDTH + from];
            }
        }
        self.active.swap_remove(slot);
    }

    /// Solves for the active nodes; those whose pressure would be negative go, until none is.
    fn solve_active(&mut self, rows: &Rows<'_>) -> Ended {
        let n = rows.nodes;
        // Each turn takes a node out or is the last.
        for _ in 0..=MAX_ACTIVE {
            let size = AXES * self.active.len();
            for i in 0..size {
                let row = i * WIDTH;
                self.factored[row..row + i + 1].copy_from_slice(&self.gram[row..row + i + 1]);
            }
            if !factor(&mut self.factored, size, WIDTH) {
                return Ended::Bound;
            }
            self.found.clear();
            self.found.extend_from_slice(&self.gains[..size]);
            solve(&self.factored, WIDTH, &mut self.found);
            // As far from the last answer to this one as no pressure is negative.
            let mut part = 1.0_f64;
            for (slot, &node) in self.active.iter().enumerate() {
                let (before, now) = (self.tractions[node], self.found[AXES * slot]);
                if now <= 0.0 {
                    part = part.min(if before > 0.0 { before / (before - now) } else { 0.0 });
                }
            }
            for (slot, &node) in self.active.iter().enumerate() {
                for axis in 0..AXES {
                    let value = &mut self.tractions[axis * n + node];
                    *value += part * (self.found[AXES * slot + axis] - *value);
                }
            }
            if part >= 1.0 {
                return Ended::Solved;
            }
            for slot in (0..self.active.len()).rev() {
                let node = self.active[slot];
                let reached = self.tractions[node] <= 1e-12 * self.found[AXES * slot].abs();
                if self.found[AXES * slot] <= 0.0 && reached {
                    (0..AXES).for_each(|axis| self.tractions[axis * n + node] = 0.0);
                    self.went[node] = true;
                    self.leave(slot);
                    // Slots of `found` beyond are looked at already.
                }
            }
        }
        Ended::Bound
    }

    /// The nodes whose pressure would gain most, if any would.
    fn best(&mut self, rows: &Rows<'_>) -> [Option<usize>; AT_ONCE] {
        let n = rows.nodes;
        self.residual.clear();
        self.residual.extend_from_slice(rows.wanted);
        for &node in &self.active {
            for axis in 0..AXES {
                let value = self.tractions[axis * n + node];
                for (r, c) in self.residual.iter_mut().zip(rows.column(axis, node)) {
                    *r -= c * value;
                }
            }
        }
        let mut best = [(MIN_OVER_SD, None); AT_ONCE];
        for node in 0..n {
            if self.went[node] || self.tractions[node] > 0.0 {
                continue;
            }
            let prior: f64 = self.active.iter().map(|k| rows.prior(0, node, *k) * self.tractions[*k]).sum();
            let gain = (dot(rows.column(0, node), &self.residual) - prior) * self.per_sd[node];
            if let Some(place) = best.iter().position(|(highest, _)| gain > *highest) {
                best[place..].rotate_right(1);
                best[place] = (gain, Some(node));
            }
        }
        let highest = best[0].0;
        best.map(|(gain, node)| node.filter(|_| gain >= ALMOST * highest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use domecast_optics::numeric::SeededRandom;

    /// What is found meets the conditions of the least: no pressure is negative, no active traction can gain, and no other
    /// node's pressure would be more than noise, but for those that went.
    #[test]
    fn what_is_found_is_a_minimum() {
        let (nodes, count) = (24, 31);
        let mut random = SeededRandom::new(3);
        let mut precision = vec![0.0; nodes * nodes];
        (0..nodes).for_each(|k| precision[k * nodes + k] = 0.2);
        let mut set = ActiveSet::new(nodes, count);
        for _ in 0..20 {
            let columns: Vec<f64> = (0..AXES * nodes * count).map(|_| random.normal()).collect();
            let wanted: Vec<f64> = (0..count).map(|_| 3.0 * random.normal()).collect();
            let mut of_rows = columns.clone();
            let mut rows = Rows {
                columns: &mut of_rows,
                wanted: &wanted,
                nodes,
                precision: &precision,
                shear_ratio: 0.09,
            };
            assert_eq!(set.solve(&mut rows, |_, _| ()), Ended::Solved);
            let mut left = wanted.clone();
            for k in 0..AXES * nodes {
                let column = &columns[k * count..(k + 1) * count];
                left.iter_mut().zip(column).for_each(|(left, c)| *left -= c * set.tractions[k]);
            }
            for node in 0..nodes {
                let is_active = set.active.contains(&node);
                assert!(set.tractions[node] >= 0.0 && is_active == (set.tractions[node] > 0.0));
                for axis in 0..AXES {
                    let k = axis * nodes + node;
                    let gain = dot(&columns[k * count..(k + 1) * count], &left)
                        - rows.prior(axis, node, node) * set.tractions[k];
                    if is_active {
                        assert!(gain.abs() < 1e-9, "{gain}");
                    } else {
                        assert!(set.tractions[k] == 0.0);
                        assert!(axis > 0 || set.went[node] || gain * set.per_sd[node] <= MIN_OVER_SD);
                    }
                }
            }
        }
    }
}
