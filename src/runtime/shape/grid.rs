//! The grids of the shape's linear system, and the multigrid cycle over them.

use std::ops::Range;

/// One grid: what each cell weighs, and its coupling with the next to the right and below.
#[derive(Debug, Clone, Default)]
pub(super) struct Grid {
    pub width: usize,
    pub own: Vec<f32>,
    /// One over what each cell weighs; 0 where nothing is known of it.
    pub per_own: Vec<f32>,
    pub right: Vec<f32>,
    pub below: Vec<f32>,
    pub wanted: Vec<f32>,
    pub found: Vec<f32>,
    pub left: Vec<f32>,
    /// The columns of each row that have equations.
    pub spans: Vec<Range<usize>>,
}

impl Grid {
    /// The cells of each row that may have equations.
    pub fn lines(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        let rows = self.spans.iter().enumerate();
        rows.map(|(row, span)| row * self.width + span.start..row * self.width + span.end)
    }

    /// The matrix times a vector, and the product of both.
    pub fn times(&self, vector: &[f64], out: &mut [f64]) -> f64 {
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

    /// The right side of a row less what the rows next to it take, into `left`: both, or the one above alone.
    fn lay_out(&mut self, row: usize, is_above_alone: bool) {
        let (w, n) = (self.width, self.own.len());
        let Range { start, end } = self.spans[row];
        let (from, to) = (row * w + start, row * w + end);
        let line = &mut self.left[from..to];
        line.copy_from_slice(&self.wanted[from..to]);
        if row > 0 {
            take(line, &self.below[from - w..to - w], &self.found[from - w..to - w]);
        }
        if !is_above_alone && from + w < n {
            take(line, &self.below[from..to], &self.found[from + w..to + w]);
        }
    }

    /// A pass of Gauss and Seidel, forwards or backwards; the first one takes what was found for 0.
    fn relax(&mut self, is_forward: bool, is_first: bool) {
        let (w, rows) = (self.width, self.spans.len());
        for k in 0..rows {
            let row = if is_forward { k } else { rows - 1 - k };
            let Range { start, end } = self.spans[row];
            if start == end {
                continue;
            }
            self.lay_out(row, is_first);
            let all = row * w + start..row * w + end;
            let (left, per_own) = (&mut self.left[all.clone()], &self.per_own[all.clone()]);
            let (right, found) = (&self.right[all.clone()], &mut self.found[all]);
            let inner = found.len() - 1;
            // The one that is not solved yet is known for all cells at once; what hangs on the cell before is kept short.
            let (mut coupling, mut before) = (0.0, 0.0);
            if is_forward {
                if !is_first {
                    take(&mut left[..inner], &right[..inner], &found[1..]);
                }
                for (((found, left), per_own), right) in found.iter_mut().zip(left).zip(per_own).zip(right) {
                    before = *left * per_own - coupling * per_own * before;
                    (*found, coupling) = (before, *right);
                }
            } else {
                take(&mut left[1..], &right[..inner], &found[..inner]);
                for (((found, left), per_own), right) in
                    found.iter_mut().zip(left).zip(per_own).zip(right).rev()
                {
                    before = *left * per_own - *right * per_own * before;
                    *found = before;
                }
            }
        }
    }

    /// What the values found by a first pass forwards leave over: what the cells after each take.
    fn leave(&mut self) {
        let (w, n) = (self.width, self.own.len());
        for (row, span) in self.spans.iter().enumerate().filter(|(_, span)| !span.is_empty()) {
            let (from, to) = (row * w + span.start, row * w + span.end);
            let line = &mut self.left[from..to];
            line.fill(0.0);
            let inner = line.len() - 1;
            take(&mut line[..inner], &self.right[from..to - 1], &self.found[from + 1..to]);
            if from + w < n {
                take(line, &self.below[from..to], &self.found[from + w..to + w]);
            }
        }
    }
}

/// Takes the products of two lists from a third.
#[inline]
fn take(from: &mut [f32], parts: &[f32], found: &[f32]) {
    for ((from, part), found) in from.iter_mut().zip(parts).zip(found) {
        *from -= part * found;
    }
}

/// One V-cycle for the residual, into the finest grid's `found`. Symmetric: what goes down forwards comes up backwards.
pub(super) fn precondition(grids: &mut [Grid], residual: &[f64]) {
    let Some(fine) = grids.first_mut() else { return };
    for (wanted, r) in fine.wanted.iter_mut().zip(residual) {
        *wanted = *r as f32;
    }
    let last = grids.len() - 1;
    for k in 0..last {
        let (finer, coarser) = grids.split_at_mut(k + 1);
        let (Some(fine), Some(coarse)) = (finer.last_mut(), coarser.first_mut()) else { return };
        fine.relax(true, true);
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
            coarsest.relax(true, false);
            coarsest.relax(false, false);
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
        fine.relax(false, false);
    }
}
