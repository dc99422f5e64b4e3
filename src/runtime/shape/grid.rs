//! The grids of the shape's linear system, and the multigrid cycle over them.

use std::ops::Range;

/// Passes forwards and backwards on the coarsest grid.
const COARSEST_PASSES: usize = 8;

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

    /// The matrix times a vector.
    pub fn times(&self, vector: &[f64], out: &mut [f64]) {
        let (w, n) = (self.width, self.own.len());
        for (row, span) in self.spans.iter().enumerate().filter(|(_, span)| !span.is_empty()) {
            let (from, to) = (row * w + span.start, row * w + span.end);
            let line = &mut out[from..to];
            for ((out, own), v) in line.iter_mut().zip(&self.own[from..to]).zip(&vector[from..to]) {
                *out = f64::from(*own) * v;
            }
            // Cells beyond the span have no equations with those within.
            let inner = line.len() - 1;
            add(&mut line[..inner], &self.right[from..to - 1], &vector[from + 1..to]);
            add(&mut line[1..], &self.right[from..to - 1], &vector[from..to - 1]);
            if to + w <= n {
                add(line, &self.below[from..to], &vector[from + w..to + w]);
            }
            if from >= w {
                add(line, &self.below[from - w..to - w], &vector[from - w..to - w]);
            }
        }
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

    /// Sums of two by two cells go to the coarser grid as what it wants.
    fn sum_into(&self, coarse: &mut Self) {
        coarse.wanted.fill(0.0);
        for (y, span) in self.spans.iter().enumerate() {
            let left = &self.left[y * self.width + span.start..y * self.width + span.end];
            let wanted = &mut coarse.wanted[y / 2 * coarse.width + span.start / 2..];
            let pairs = left.chunks_exact(2);
            // Spans begin at even columns.
            if let (Some(last), Some(wanted)) = (pairs.remainder().first(), wanted.get_mut(left.len() / 2)) {
                *wanted += last;
            }
            pairs.zip(wanted).for_each(|(pair, wanted)| *wanted += pair[0] + pair[1]);
        }
    }

    /// Adds what the coarser grid found.
    fn add_from(&mut self, coarse: &Self) {
        for (y, span) in self.spans.iter().enumerate() {
            let all = y * self.width + span.start..y * self.width + span.end;
            let (own, found) = (&self.own[all.clone()], &mut self.found[all]);
            let coarse = &coarse.found[y / 2 * coarse.width + span.start / 2..];
            for ((found, own), coarse) in found.chunks_mut(2).zip(own.chunks(2)).zip(coarse) {
                for (found, own) in found.iter_mut().zip(own) {
                    *found += if *own > 0.0 { *coarse } else { 0.0 };
                }
            }
        }
    }
}

/// Adds the products of two lists to a third.
#[inline]
fn add(to: &mut [f64], parts: &[f32], values: &[f64]) {
    for ((to, part), value) in to.iter_mut().zip(parts).zip(values) {
        *to += f64::from(*part) * value;
    }
}

/// Takes the products of two lists from a third.
#[inline]
fn take(from: &mut [f32], parts: &[f32], found: &[f32]) {
    for ((from, part), found) in from.iter_mut().zip(parts).zip(found) {
        *from -= part * found;
    }
}

/// One V-cycle for the residual, into the finest grid's `found`. Symmetric: what goes down forwards comes up backwards. A second visit
/// of coarse grids (a W-cycle) is not positive: with their coupling halved, a cycle by itself may overshoot by more than twice.
pub(super) fn precondition(grids: &mut [Grid], residual: &[f64]) {
    let Some(fine) = grids.first_mut() else { return };
    for (wanted, r) in fine.wanted.iter_mut().zip(residual) {
        *wanted = *r as f32;
    }
    cycle(grids);
}

/// A cycle for what the first of these grids wants.
fn cycle(grids: &mut [Grid]) {
    let Some((fine, coarser)) = grids.split_first_mut() else { return };
    let Some(coarse) = coarser.first_mut() else {
        fine.found.fill(0.0);
        for _ in 0..COARSEST_PASSES {
            fine.relax(true, false);
            fine.relax(false, false);
        }
        return;
    };
    fine.relax(true, true);
    fine.leave();
    fine.sum_into(coarse);
    cycle(coarser);
    if let Some(coarse) = coarser.first() {
        fine.add_from(coarse);
    }
    fine.relax(false, false);
}
