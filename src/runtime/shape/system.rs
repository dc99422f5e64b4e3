//! The linear system for how far each cell's skin has moved along its ray: five-point stencils on the grid of cells, solved by
//! conjugate gradients with a multigrid cycle as preconditioner.
//!
//! Between two neighbouring cells the skin is perpendicular to their mean normal: `n . (X_q - X_p) = 0` with `X = X0 + d w`
//! is linear in the two `d`. Coarser grids sum up the equations of two by two cells (Galerkin's way with constant pieces),
//! their coupling halved as the steps are twice as long (D. Braess, Computing 55, 1995).

use std::ops::Range;

/// Bound on the rounds.
pub(super) const MAX_ROUNDS: usize = 60;

/// Largest motion of a cell in the last round, mm. A residual says little here: what is smooth over the dome hardly shows in it.
const END_MM: f64 = 1e-4;

/// The coarsest grid has no more cells.
const COARSEST: usize = 64;

/// Coupling of a coarser grid against the sum of the finer's.
const COARSE_COUPLING: f32 = 0.5;

/// One grid: what each cell weighs, and its coupling with the next to the right and below.
#[derive(Debug, Clone, Default)]
struct Grid {
    width: usize,
    own: Vec<f32>,
    right: Vec<f32>,
    below: Vec<f32>,
    wanted: Vec<f32>,
    found: Vec<f32>,
    left: Vec<f32>,
    /// The columns of each row that have equations.
    spans: Vec<Range<usize>>,
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SolveStatus {
    /// Rounds of conjugate gradients.
    pub rounds: usize,
    /// Residual, of the right side's size.
    pub residual: f64,
    /// Largest motion of a cell in the last round, mm.
    pub last_step_mm: f64,
    /// Whether that came below the bound, 0.0001 mm.
    pub is_converged: bool,
}

/// The system, kept between frames.
#[derive(Debug, Clone, Default)]
pub(super) struct System {
    grids: Vec<Grid>,
    residual: Vec<f64>,
    direction: Vec<f64>,
    product: Vec<f64>,
}

impl System {
    pub fn new(width: usize, height: usize) -> Self {
        let mut grids = Vec::new();
        let (mut w, mut h) = (width, height);
        loop {
            let zeros = vec![0.0; w * h];
            grids.push(Grid {
                width: w,
                own: zeros.clone(),
                right: zeros.clone(),
                below: zeros.clone(),
                wanted: zeros.clone(),
                found: zeros.clone(),
                left: zeros,
                spans: Vec::new(),
            });
            if w * h <= COARSEST {
                break;
            }
            (w, h) = (w.div_ceil(2), h.div_ceil(2));
        }
        let zeros = vec![0.0; width * height];
        Self { grids, residual: zeros.clone(), direction: zeros.clone(), product: zeros }
    }

    /// Empties the equations; those that come lie within these columns of each row.
    pub fn clear(&mut self, spans: &[Range<usize>]) {
        let mut finer = spans.to_vec();
        for grid in &mut self.grids {
            for list in [&mut grid.own, &mut grid.right, &mut grid.below] {
                list.fill(0.0);
            }
            let coarser = finer.chunks(2).map(|pair| {
                let filled = || pair.iter().filter(|span| !span.is_empty());
                let start = filled().map(|span| span.start).min().unwrap_or(0) / 2;
                start..filled().map(|span| span.end).max().unwrap_or(0).div_ceil(2).max(start)
            });
            let coarser = coarser.collect();
            grid.spans = std::mem::replace(&mut finer, coarser);
        }
        self.residual.fill(0.0);
    }

    /// Holds a cell at 0 with this weight.
    #[inline]
    pub fn hold(&mut self, cell: usize, weight: f32) {
        if let Some(own) = self.grids.first_mut().and_then(|grid| grid.own.get_mut(cell)) {
            *own += weight;
        }
    }

    /// Adds the equation `offset + q d_q - p d_p = 0` between a cell and the one to its right, or below it.
    #[inline]
    pub fn join(&mut self, cell: usize, is_right: bool, weight: f32, [p, q]: [f32; 2], offset: f32) {
        let Some(grid) = self.grids.first_mut() else { return };
        let next = if is_right { cell + 1 } else { cell + grid.width };
        if next >= grid.own.len() {
            return;
        }
        grid.own[cell] += weight * p * p;
        grid.own[next] += weight * q * q;
        let coupling = if is_right { &mut grid.right } else { &mut grid.below };
        coupling[cell] -= weight * p * q;
        self.residual[cell] += f64::from(weight * p * offset);
        self.residual[next] -= f64::from(weight * q * offset);
    }

    /// Solves from a first guess in `moved`; cells without equations stay 0.
    pub fn solve(&mut self, moved: &mut [f64]) -> SolveStatus {
        self.coarsen();
        let Self { grids, residual, direction, product } = self;
        let size = dot(residual, residual).sqrt();
        if !(size > 0.0 && size.is_finite()) {
            moved.fill(0.0);
            return SolveStatus { is_converged: size == 0.0, ..SolveStatus::default() };
        }
        let Some(fine) = grids.first() else { return SolveStatus::default() };
        fine.times(moved, product);
        for (r, p) in residual.iter_mut().zip(&*product) {
            *r -= p;
        }
        let mut status = SolveStatus::default();
        direction.fill(0.0);
        let mut before = f64::INFINITY;
        while !status.is_converged && status.rounds < MAX_ROUNDS {
            precondition(grids, residual);
            let Some(fine) = grids.first() else { break };
            let along: f64 = fine.cells().map(|i| residual[i] * f64::from(fine.found[i])).sum();
            let keep = along / before;
            let mut longest = 0.0_f64;
            for i in fine.cells() {
                direction[i] = f64::from(fine.found[i]) + keep * direction[i];
                longest = longest.max(direction[i].abs());
            }
            before = along;
            let curvature = fine.times(direction, product);
            if !(along > 0.0 && curvature > 0.0) {
                // Nothing is left, or rounding is all that is.
                status.is_converged = along == 0.0;
                break;
            }
            let step = along / curvature;
            for i in fine.cells() {
                moved[i] += step * direction[i];
                residual[i] -= step * product[i];
            }
            status.rounds += 1;
            status.last_step_mm = step * longest;
            status.is_converged = status.last_step_mm <= END_MM;
        }
        status.residual = dot(residual, residual).sqrt() / size;
        status
    }

    fn coarsen(&mut self) {
        for k in 1..self.grids.len() {
            let (finer, coarser) = self.grids.split_at_mut(k);
            let (Some(fine), Some(coarse)) = (finer.last(), coarser.first_mut()) else { return };
            for list in [&mut coarse.own, &mut coarse.right, &mut coarse.below] {
                list.fill(0.0);
            }
            for (y, span) in fine.spans.iter().enumerate() {
                for x in span.clone() {
                    let (i, to) = (y * fine.width + x, y / 2 * coarse.width + x / 2);
                    coarse.own[to] += fine.own[i];
                    let (right, below) = (fine.right[i], fine.below[i]);
                    if x % 2 == 0 {
                        coarse.own[to] += 2.0 * right
                    } else {
                        coarse.right[to] += right
                    }
                    if y % 2 == 0 { coarse.own[to] += 2.0 * below } else { coarse.below[to] += below }
                }
            }
            for list in [&mut coarse.own, &mut coarse.right, &mut coarse.below] {
                list.iter_mut().for_each(|v| *v *= COARSE_COUPLING);
            }
        }
    }
}

impl Grid {
    /// The cells that may have equations, row by row.
    fn cells(&self) -> impl Iterator<Item = usize> + '_ {
        let rows = self.spans.iter().enumerate();
        rows.flat_map(|(row, span)| row * self.width + span.start..row * self.width + span.end)
    }

    /// The matrix times a vector, and the product of both.
    fn times(&self, vector: &[f64], out: &mut [f64]) -> f64 {
        let (w, n) = (self.width, self.own.len());
        let mut sum = 0.0;
        for (row, span) in self.spans.iter().enumerate() {
            for i in row * w + span.start..row * w + span.end {
                let mut value = f64::from(self.own[i]) * vector[i];
                if i + 1 < n {
                    value += f64::from(self.right[i]) * vector[i + 1];
                }
                if i > 0 {
                    value += f64::from(self.right[i - 1]) * vector[i - 1];
                }
                if i + w < n {
                    value += f64::from(self.below[i]) * vector[i + w];
                }
                if i >= w {
                    value += f64::from(self.below[i - w]) * vector[i - w];
                }
                out[i] = value;
                sum += value * vector[i];
            }
        }
        sum
    }

    /// What the rows above and below take of a row's right side is put into `left`.
    fn lay_out(&mut self, row: usize) {
        let (w, n) = (self.width, self.own.len());
        let start = row * w;
        let (Some(line), Some(wanted)) =
            (self.left.get_mut(start..start + w), self.wanted.get(start..start + w))
        else {
            return;
        };
        line.copy_from_slice(wanted);
        if row > 0 {
            let (part, found) = (&self.below[start - w..start], &self.found[start - w..start]);
            for ((line, part), found) in line.iter_mut().zip(part).zip(found) {
                *line -= part * found;
            }
        }
        if start + w < n {
            let (part, found) = (&self.below[start..start + w], &self.found[start + w..start + 2 * w]);
            for ((line, part), found) in line.iter_mut().zip(part).zip(found) {
                *line -= part * found;
            }
        }
    }

    /// A pass of Gauss and Seidel, forwards or backwards.
    fn relax(&mut self, is_forward: bool) {
        let (w, rows) = (self.width, self.spans.len());
        for k in 0..rows {
            let row = if is_forward { k } else { rows - 1 - k };
            let Range { start, end } = self.spans[row];
            if start == end {
                continue;
            }
            self.lay_out(row);
            let all = row * w..(row + 1) * w;
            let (own, right, left) =
                (&self.own[all.clone()], &self.right[all.clone()], &self.left[all.clone()]);
            let found = &mut self.found[all];
            let mut one = |x: usize| {
                if own[x] > 0.0 {
                    let before = if x > 0 { right[x - 1] * found[x - 1] } else { 0.0 };
                    let after = if x + 1 < w { right[x] * found[x + 1] } else { 0.0 };
                    found[x] = (left[x] - before - after) / own[x];
                }
            };
            if is_forward { (start..end).for_each(&mut one) } else { (start..end).rev().for_each(&mut one) }
        }
    }

    /// What the found values leave over.
    fn leave(&mut self) {
        let w = self.width;
        for row in 0..self.spans.len() {
            let Range { start, end } = self.spans[row];
            if start == end {
                continue;
            }
            self.lay_out(row);
            let all = row * w..(row + 1) * w;
            let (own, right, found) =
                (&self.own[all.clone()], &self.right[all.clone()], &self.found[all.clone()]);
            let left = &mut self.left[all];
            for x in start..end {
                let before = if x > 0 { right[x - 1] * found[x - 1] } else { 0.0 };
                let after = if x + 1 < w { right[x] * found[x + 1] } else { 0.0 };
                left[x] -= own[x] * found[x] + before + after;
            }
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// One V-cycle for the residual, into the finest grid's `found`. Symmetric: what goes down forwards comes up backwards.
fn precondition(grids: &mut [Grid], residual: &[f64]) {
    let Some(fine) = grids.first_mut() else { return };
    for (wanted, r) in fine.wanted.iter_mut().zip(residual) {
        *wanted = *r as f32;
    }
    let last = grids.len() - 1;
    for k in 0..last {
        let (finer, coarser) = grids.split_at_mut(k + 1);
        let (Some(fine), Some(coarse)) = (finer.last_mut(), coarser.first_mut()) else { return };
        fine.found.fill(0.0);
        fine.relax(true);
        fine.leave();
        coarse.wanted.fill(0.0);
        for (y, span) in fine.spans.iter().enumerate() {
            for x in span.clone() {
                coarse.wanted[y / 2 * coarse.width + x / 2] += fine.left[y * fine.width + x];
            }
        }
    }
    if let Some(coarsest) = grids.last_mut() {
        coarsest.found.fill(0.0);
        for _ in 0..8 {
            coarsest.relax(true);
            coarsest.relax(false);
        }
    }
    for k in (0..last).rev() {
        let (finer, coarser) = grids.split_at_mut(k + 1);
        let (Some(fine), Some(coarse)) = (finer.last_mut(), coarser.first()) else { return };
        for (y, span) in fine.spans.iter().enumerate() {
            for x in span.clone() {
                let i = y * fine.width + x;
                if fine.own[i] > 0.0 {
                    fine.found[i] += coarse.found[y / 2 * coarse.width + x / 2];
                }
            }
        }
        fine.relax(false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_integrated_from_a_held_edge() {
        let (width, height) = (37, 29);
        let truth = |x: usize, y: usize| 0.01 * x as f64 + 0.002 * (y as f64 - 3.0).powi(2) - 0.018;
        let spans: Vec<Range<usize>> = (0..height).map(|_| 0..width).collect();
        let mut system = System::new(width, height);
        let mut moved = vec![0.0; width * height];
        for _ in 0..2 {
            system.clear(&spans);
            for y in 0..height {
                for x in 0..width {
                    let cell = y * width + x;
                    let step = |x2: usize, y2: usize| (truth(x, y) - truth(x2, y2)) as f32;
                    if x + 1 < width {
                        system.join(cell, true, 2.0, [1.0, 1.0], step(x + 1, y));
                    }
                    if y + 1 < height {
                        system.join(cell, false, 1.0, [1.0, 1.0], step(x, y + 1));
                    }
                }
            }
            // The truth is 0 at (0, 0) alone.
            system.hold(0, 1e4);
            let status = system.solve(&mut moved);
            assert!(status.is_converged && status.residual < 1e-2, "{status:?}");
        }
        for y in 0..height {
            for x in 0..width {
                let off = (moved[y * width + x] - truth(x, y)).abs();
                assert!(off < 2e-3, "{x} {y}: {off}");
            }
        }
    }

    #[test]
    fn nothing_asked_is_nothing_moved() {
        let mut system = System::new(20, 20);
        system.clear(&vec![3..17; 20]);
        let mut moved = vec![1.0; 400];
        let status = system.solve(&mut moved);
        assert!(status.is_converged && moved.iter().all(|v| *v == 0.0));
    }
}
