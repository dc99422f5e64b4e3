//! The linear system for how far each cell's skin has moved along its ray: five-point stencils on the grid of cells, solved by
//! conjugate gradients with a multigrid cycle as preconditioner.
//!
//! Between two neighbouring cells the skin is perpendicular to their mean normal: `n . (X_q - X_p) = 0` with `X = X0 + d w`
//! is linear in the two `d`. Coarser grids sum up the equations of two by two cells (Galerkin's way with constant pieces),
//! their coupling halved as the steps are twice as long (D. Braess, Computing 55, 1995).

use std::ops::Range;

use rayon::prelude::*;

use super::grid::{GROUP, Grid, precondition};
use super::rows::{MIN_ROWS, share};

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

/// The equation `offset + q d_q - p d_p = 0` between two cells, with `along` p and q.
#[derive(Debug, Clone, Copy)]
pub(super) struct Joint {
    pub weight: f32,
    pub along: [f32; 2],
    pub offset: f32,
}

/// The system, kept between frames.
#[derive(Debug, Clone, Default)]
pub(super) struct System {
    grids: Vec<Grid>,
    asked: Vec<f64>,
    /// What a row's equations bring the next row: weight, and what is asked.
    passed: Vec<[f32; 2]>,
    direction: Vec<f32>,
    product: Vec<f32>,
    /// By group of rows: sums, and largest sizes.
    sums: Vec<(f64, f32)>,
    /// Size of the right side, and the last round's product of residual and step.
    size: f64,
    along: f64,
}

impl System {
    pub fn new(width: usize, height: usize) -> Self {
        let mut grids = Vec::new();
        let (mut w, mut h) = (width, height);
        loop {
            grids.push(Grid::new(w, h));
            if w * h <= COARSEST {
                break;
            }
            (w, h) = (w.div_ceil(2), h.div_ceil(2));
        }
        let groups = height.div_ceil(GROUP);
        let zeros = vec![0.0; width * GROUP * groups];
        Self {
            grids,
            asked: vec![0.0; width * height],
            passed: vec![[0.0; 2]; width * height],
            direction: zeros.clone(),
            product: zeros,
            sums: vec![(0.0, 0.0); groups],
            size: 0.0,
            along: 0.0,
        }
    }

    /// Takes the equations, which lie within these columns of each row: `hold` says with what weight a cell is held at 0, `join` what binds
    /// it to the next one across (side 0) or down (1).
    pub fn set(
        &mut self,
        spans: &[Range<usize>],
        hold: impl Fn(usize) -> Option<f32> + Sync,
        join: impl Fn(usize, usize, usize) -> Option<Joint> + Sync,
    ) {
        for (k, grid) in self.grids.iter_mut().enumerate() {
            grid.clear(spans, k);
        }
        let Some(Grid { width: w, own, right, below, .. }) = self.grids.first_mut() else { return };
        let w = *w;
        let weights = own.par_chunks_mut(w).zip(right.par_chunks_mut(w)).zip(below.par_chunks_mut(w));
        let lists = weights.zip(self.asked.par_chunks_mut(w)).zip(self.passed.par_chunks_mut(w));
        let rows = lists.zip(spans).enumerate().with_min_len(share(MIN_ROWS));
        rows.for_each(|(row, (((((own, right), below), asked), passed), span))| {
            [&mut *own, right, below].into_iter().for_each(|list| list.fill(0.0));
            asked.fill(0.0);
            passed.fill([0.0; 2]);
            for x in span.clone() {
                let cell = row * w + x;
                own[x] += hold(cell).unwrap_or(0.0);
                if x + 1 < span.end
                    && let Some(Joint { weight, along: [p, q], offset }) = join(cell, cell + 1, 0)
                {
                    own[x] += weight * p * p;
                    own[x + 1] += weight * q * q;
                    right[x] = -weight * p * q;
                    asked[x] += f64::from(weight * p * offset);
                    asked[x + 1] -= f64::from(weight * q * offset);
                }
                if let Some(Joint { weight, along: [p, q], offset }) = join(cell, cell + w, 1) {
                    own[x] += weight * p * p;
                    below[x] = -weight * p * q;
                    asked[x] += f64::from(weight * p * offset);
                    passed[x] = [weight * q * q, weight * q * offset];
                }
            }
        });
        // What the rows above bring.
        let above = self.passed.par_chunks(w).zip(spans);
        let rows = own[w..].par_chunks_mut(w).zip(self.asked[w..].par_chunks_mut(w)).zip(above);
        rows.with_min_len(share(MIN_ROWS)).for_each(|((own, asked), (passed, span))| {
            for x in span.clone() {
                own[x] += passed[x][0];
                asked[x] -= f64::from(passed[x][1]);
            }
        });
    }

    /// Solves from a first guess in `moved` until a round moves no cell by more than `end_mm`; cells without equations stay 0.
    pub fn solve(&mut self, moved: &mut [f64], end_mm: f64) -> SolveStatus {
        self.coarsen();
        let mut sums = [0.0; LANES];
        for lane in self.asked.chunks(LANES) {
            sums.iter_mut().zip(lane).for_each(|(sum, v)| *sum += v * v);
        }
        self.size = sums.iter().sum::<f64>().sqrt();
        if !(self.size > 0.0 && self.size.is_finite()) {
            moved.fill(0.0);
            return SolveStatus { is_converged: self.size == 0.0, ..SolveStatus::default() };
        }
        let Some(fine) = self.grids.first_mut() else { return SolveStatus::default() };
        fine.leave_of(&self.asked, moved);
        self.direction.fill(0.0);
        self.along = f64::INFINITY;
        self.go_on(moved, SolveStatus::default(), end_mm)
    }

    /// Goes on where [`System::solve`] ended, to a closer end.
    pub fn go_on(&mut self, moved: &mut [f64], so_far: SolveStatus, end_mm: f64) -> SolveStatus {
        let mut status = so_far;
        if !(self.size > 0.0 && self.size.is_finite()) {
            return status;
        }
        status.is_converged = status.rounds > 0 && status.last_step_mm <= end_mm;
        while !status.is_converged && status.rounds < MAX_ROUNDS {
            precondition(&mut self.grids);
            let along = self.turn();
            let (curvature, longest) = self.look_ahead();
            if !(along > 0.0 && curvature > 0.0) {
                // Nothing is left, or rounding is all that is.
                status.is_converged = along == 0.0;
                break;
            }
            let step = along / curvature;
            self.step(moved, step);
            status.rounds += 1;
            status.last_step_mm = step * f64::from(longest);
            status.is_converged = status.last_step_mm <= end_mm;
        }
        if let Some(fine) = self.grids.first() {
            let rows = fine.wanted.chunks(fine.width);
            status.residual = rows.map(|row| dot(row, row)).sum::<f64>().sqrt() / self.size;
        }
        status
    }

    /// Turns to the direction that the cycle found. The product of it and the residual.
    fn turn(&mut self) -> f64 {
        let Self { grids, direction, sums, .. } = self;
        let Some(fine) = grids.first() else { return 0.0 };
        let (w, min_rows) = (fine.width, fine.share());
        sums.par_iter_mut().zip(&fine.spans).enumerate().with_min_len(min_rows).for_each(
            |(group, (sum, span))| {
                let rows = group * GROUP..(group + 1) * GROUP;
                sum.0 = rows
                    .map(|row| dot(&fine.wanted[row * w..][span.clone()], &fine.found(row)[span.clone()]))
                    .sum();
            },
        );
        let along: f64 = sums.iter().map(|sum| sum.0).sum();
        let keep = (along / self.along) as f32;
        self.along = along;
        let groups = direction.par_chunks_mut(GROUP * w).zip(&fine.spans).enumerate().with_min_len(min_rows);
        groups.for_each(|(group, (direction, span))| {
            for (line, row) in direction.chunks_mut(w).zip(group * GROUP..) {
                let found = &fine.found(row)[span.clone()];
                line[span.clone()]
                    .iter_mut()
                    .zip(found)
                    .for_each(|(direction, found)| *direction = found + keep * *direction);
            }
        });
        along
    }

    /// What a step in the direction changes: the curvature along it, and its largest part.
    fn look_ahead(&mut self) -> (f64, f32) {
        let Self { grids, direction, product, sums, .. } = self;
        let Some(fine) = grids.first() else { return (0.0, 0.0) };
        let (w, min_rows, direction) = (fine.width, fine.share(), &*direction);
        let groups = product.par_chunks_mut(GROUP * w).zip(&mut *sums).zip(&fine.spans).enumerate();
        groups.with_min_len(min_rows).for_each(|(group, ((product, sum), span))| {
            fine.times(group, direction, product);
            *sum = (0.0, 0.0);
            for (product, row) in product.chunks(w).zip(group * GROUP..) {
                let direction = &direction[row * w..][span.clone()];
                sum.0 += dot(direction, &product[span.clone()]);
                sum.1 = sum.1.max(largest(direction));
            }
        });
        sums.iter().fold((0.0, 0.0), |(sum, high), own| (sum + own.0, high.max(own.1)))
    }

    /// Goes a step in the direction.
    fn step(&mut self, moved: &mut [f64], step: f64) {
        let Self { grids, direction, product, .. } = self;
        let Some(fine) = grids.first_mut() else { return };
        let (w, min_rows) = (fine.width, fine.share());
        let lists = fine.wanted.par_chunks_mut(GROUP * w).zip(moved.par_chunks_mut(GROUP * w));
        let groups = lists.zip(&fine.spans).enumerate().with_min_len(min_rows);
        let (direction, product) = (&*direction, &*product);
        groups.for_each(|(group, ((residual, moved), span))| {
            let rows = residual.chunks_mut(w).zip(moved.chunks_mut(w)).zip(group * GROUP..);
            for ((residual, moved), row) in rows {
                let all = row * w + span.start..row * w + span.end;
                let along = moved[span.clone()].iter_mut().zip(&direction[all.clone()]);
                along.for_each(|(moved, direction)| *moved += step * f64::from(*direction));
                let left = residual[span.clone()].iter_mut().zip(&product[all]);
                left.for_each(|(residual, product)| *residual -= step as f32 * product);
            }
        });
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
            let (w, own) = (coarse.width, coarse.own.par_chunks_mut(coarse.width));
            let rows =
                own.zip(coarse.right.par_chunks_mut(w)).zip(coarse.below.par_chunks_mut(w)).enumerate();
            let min_rows = fine.share().saturating_mul(GROUP / 2);
            rows.with_min_len(min_rows).for_each(|(row, ((own, right), below))| {
                [&mut *own, right, below].into_iter().for_each(|list| list.fill(0.0));
                let Some(span) = fine.spans.get(2 * row / GROUP) else { return };
                for x in span.clone() {
                    let (to, upper) = (x / 2, 2 * row * fine.width + x);
                    let lower = upper + fine.width;
                    own[to] += fine.own[upper] + fine.own[lower] + 2.0 * fine.below[upper];
                    let across = fine.right[upper] + fine.right[lower];
                    if x % 2 == 0 {
                        own[to] += 2.0 * across
                    } else {
                        right[to] += across
                    }
                    below[to] += fine.below[lower];
                }
                for list in [own, right, below] {
                    list.iter_mut().for_each(|v| *v *= COARSE_COUPLING);
                }
            });
        }
    }
}

/// Sums run side by side: one after the other they wait for each other.
const LANES: usize = 8;

/// The product of two rows.
fn dot(a: &[f32], b: &[f32]) -> f64 {
    let (mut sums, a_lanes, b_lanes) = ([0.0_f32; LANES], a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f32 = a_lanes.remainder().iter().zip(b_lanes.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a_lanes.zip(b_lanes) {
        sums.iter_mut().zip(a.iter().zip(b)).for_each(|(sum, (a, b))| *sum += a * b);
    }
    f64::from(sums.iter().sum::<f32>() + rest)
}

/// The largest size of a row's numbers.
fn largest(list: &[f32]) -> f32 {
    let (mut high, lanes) = ([0.0_f32; LANES], list.chunks_exact(LANES));
    let rest = lanes.remainder().iter().fold(0.0_f32, |high, v| high.max(v.abs()));
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
        let at = |cell: usize| truth(cell % width, cell / width);
        let join = |cell: usize, next: usize, side: usize| {
            let joint = |next| Joint {
                weight: [2.0, 1.0][side],
                along: [1.0; 2],
                offset: (at(cell) - at(next)) as f32,
            };
            (next < width * height).then(|| joint(next))
        };
        for _ in 0..2 {
            // The truth is 0 at (0, 0) alone.
            system.set(&spans, |cell| (cell == 0).then_some(1e4), join);
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
        system.set(&vec![3..17; 20], |_| None, |_, _, _| None);
        let mut moved = vec![1.0; 400];
        let status = system.solve(&mut moved, END_MM);
        assert!(status.is_converged && moved.iter().all(|v| *v == 0.0));
    }
}
