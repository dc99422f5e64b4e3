//! The linear system for how far each cell's skin has moved along its ray: five-point stencils on the grid of cells, solved by
//! conjugate gradients with a multigrid cycle as preconditioner.
//!
//! Between two neighbouring cells the skin is perpendicular to their mean normal: `n . (X_q - X_p) = 0` with `X = X0 + d w`
//! is linear in the two `d`. Coarser grids sum up the equations of two by two cells (Galerkin's way with constant pieces),
//! their coupling halved as the steps are twice as long (D. Braess, Computing 55, 1995).

use std::ops::Range;

use super::grid::{Grid, precondition};

/// Bound on the rounds.
pub(super) const MAX_ROUNDS: usize = 60;

/// Largest motion of a cell in the last round, mm. A residual says little here: what is smooth over the dome hardly shows in it.
pub(super) const END_MM: f64 = 2e-4;

/// The coarsest grid has no more cells.
const COARSEST: usize = 64;

/// Coupling of a coarser grid against the sum of the finer's.
const COARSE_COUPLING: f32 = 0.5;

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SolveStatus {
    /// Rounds of conjugate gradients.
    pub rounds: usize,
    /// Residual, of the right side's size.
    pub residual: f64,
    /// Largest motion of a cell in the last round, mm.
    pub last_step_mm: f64,
    /// Whether that came below the bound, 0.0002 mm.
    pub is_converged: bool,
}

/// The system, kept between frames.
#[derive(Debug, Clone, Default)]
pub(super) struct System {
    grids: Vec<Grid>,
    residual: Vec<f64>,
    direction: Vec<f64>,
    product: Vec<f64>,
    /// Size of the right side, and the last round's product of residual and step.
    size: f64,
    along: f64,
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
                per_own: zeros.clone(),
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
        Self {
            grids,
            residual: zeros.clone(),
            direction: zeros.clone(),
            product: zeros,
            size: 0.0,
            along: 0.0,
        }
    }

    /// Empties the equations; those that come lie within these columns of each row.
    pub fn clear(&mut self, spans: &[Range<usize>]) {
        for (k, grid) in self.grids.iter_mut().enumerate() {
            for list in [&mut grid.own, &mut grid.right, &mut grid.below] {
                list.fill(0.0);
            }
            // Rows of the grid hold 2^k of the finest's.
            let widest = |rows: &[Range<usize>]| {
                let filled = || rows.iter().filter(|span| !span.is_empty());
                // At even columns, so that pairs of cells are one of the coarser grid.
                let start = (filled().map(|span| span.start).min().unwrap_or(0) >> k) & !1;
                start..filled().map(|span| span.end).max().unwrap_or(0).div_ceil(1 << k).max(start)
            };
            grid.spans.clear();
            grid.spans.extend(spans.chunks(1 << k).map(widest));
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

    /// Solves from a first guess in `moved` until a round moves no cell by more than `end_mm`; cells without equations stay 0.
    pub fn solve(&mut self, moved: &mut [f64], end_mm: f64) -> SolveStatus {
        self.coarsen();
        let Self { grids, residual, direction, product, size, .. } = self;
        *size = dot(residual, residual).sqrt();
        if !(*size > 0.0 && size.is_finite()) {
            moved.fill(0.0);
            return SolveStatus { is_converged: *size == 0.0, ..SolveStatus::default() };
        }
        let Some(fine) = grids.first() else { return SolveStatus::default() };
        fine.times(moved, product);
        for (r, p) in residual.iter_mut().zip(&*product) {
            *r -= p;
        }
        direction.fill(0.0);
        self.along = f64::INFINITY;
        self.go_on(moved, SolveStatus::default(), end_mm)
    }

    /// Goes on where [`System::solve`] ended, to a closer end.
    pub fn go_on(&mut self, moved: &mut [f64], so_far: SolveStatus, end_mm: f64) -> SolveStatus {
        let Self { grids, residual, direction, product, size, along: before, .. } = self;
        let mut status = so_far;
        if !(*size > 0.0 && size.is_finite()) {
            return status;
        }
        status.is_converged = status.rounds > 0 && status.last_step_mm <= end_mm;
        while !status.is_converged && status.rounds < MAX_ROUNDS {
            precondition(grids, residual);
            let Some(fine) = grids.first() else { break };
            let along: f64 = fine.lines().map(|line| dot(&residual[line.clone()], &fine.found[line])).sum();
            let keep = along / *before;
            for line in fine.lines() {
                let found = direction[line.clone()].iter_mut().zip(&fine.found[line]);
                found.for_each(|(direction, found)| *direction = f64::from(*found) + keep * *direction);
            }
            *before = along;
            fine.times(direction, product);
            let (mut curvature, mut longest) = (0.0, 0.0_f64);
            for line in fine.lines() {
                curvature += dot(&direction[line.clone()], &product[line.clone()]);
                longest = longest.max(largest(&direction[line]));
            }
            if !(along > 0.0 && curvature > 0.0) {
                // Nothing is left, or rounding is all that is.
                status.is_converged = along == 0.0;
                break;
            }
            let step = along / curvature;
            for line in fine.lines() {
                let along = moved[line.clone()].iter_mut().zip(&direction[line.clone()]);
                along.for_each(|(moved, direction)| *moved += step * direction);
                let left = residual[line.clone()].iter_mut().zip(&product[line]);
                left.for_each(|(residual, product)| *residual -= step * product);
            }
            status.rounds += 1;
            status.last_step_mm = step * longest;
            status.is_converged = status.last_step_mm <= end_mm;
        }
        status.residual = dot(residual, residual).sqrt() / *size;
        status
    }

    fn coarsen(&mut self) {
        self.add_up();
        for grid in &mut self.grids {
            for (per_own, own) in grid.per_own.iter_mut().zip(&grid.own) {
                *per_own = if *own > 0.0 { 1.0 / own } else { 0.0 };
            }
        }
    }

    fn add_up(&mut self) {
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

/// Sums run side by side: one after the other they wait for each other.
const LANES: usize = 8;

fn dot<T: Copy + Into<f64>>(a: &[f64], b: &[T]) -> f64 {
    let (mut sums, a_lanes, b_lanes) = ([0.0; LANES], a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest = a_lanes.remainder().iter().zip(b_lanes.remainder()).map(|(a, b)| a * (*b).into());
    let rest: f64 = rest.sum();
    for (a, b) in a_lanes.zip(b_lanes) {
        sums.iter_mut().zip(a.iter().zip(b)).for_each(|(sum, (a, b))| *sum += a * (*b).into());
    }
    sums.iter().sum::<f64>() + rest
}

/// The largest size of a list's numbers.
fn largest(list: &[f64]) -> f64 {
    let (mut high, lanes) = ([0.0_f64; LANES], list.chunks_exact(LANES));
    let rest = lanes.remainder().iter().fold(0.0_f64, |high, v| high.max(v.abs()));
    for lane in lanes {
        high.iter_mut().zip(lane).for_each(|(high, v)| *high = if v.abs() > *high { v.abs() } else { *high });
    }
    high.iter().fold(rest, |high, v| high.max(*v))
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
            let status = system.solve(&mut moved, END_MM);
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
        let status = system.solve(&mut moved, END_MM);
        assert!(status.is_converged && moved.iter().all(|v| *v == 0.0));
    }
}
