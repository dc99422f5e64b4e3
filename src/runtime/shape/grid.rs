//! The grids of the shape's linear system, and the multigrid cycle over them.
//!
//! A pass goes over all even rows, then over all odd ones (zebra; backwards the other way round), and along each row as Gauss and Seidel
//! do. Rows of one kind do not ask each other, so four are computed side by side, and threads share them.

use std::ops::Range;

use rayon::prelude::*;

use super::rows::share;

/// Passes forwards and backwards on the coarsest grid.
const COARSEST_PASSES: usize = 8;

/// Rows of one kind that are computed side by side.
const LANES: usize = 4;

/// Rows of a group: as many of each kind.
pub(super) const GROUP: usize = 2 * LANES;

/// Cells of a grid from which on threads share its rows: less is done before another thread wakes.
const MIN_SHARED: usize = 1 << 14;

/// Groups that a thread takes at once, at least.
const MIN_GROUPS: usize = 5;

/// What hangs on a value that is not there yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Found {
    /// Nothing was found.
    Nothing,
    /// The rows between those of the pass were.
    Others,
    /// All were.
    All,
}

/// One grid: what each cell weighs, and its coupling with the next to the right and below. Its rows are filled up to whole groups.
#[derive(Debug, Clone, Default)]
pub(super) struct Grid {
    pub width: usize,
    pub own: Vec<f32>,
    /// One over what each cell weighs; 0 where nothing is known of it.
    pub per_own: Vec<f32>,
    pub right: Vec<f32>,
    pub below: Vec<f32>,
    pub wanted: Vec<f32>,
    /// The even rows, and the odd ones.
    found: [Vec<f32>; 2],
    /// Room for the rows of a pass.
    left: Vec<f32>,
    /// The columns of each group of rows that have equations.
    pub spans: Vec<Range<usize>>,
}

impl Grid {
    pub fn new(width: usize, height: usize) -> Self {
        let groups = height.div_ceil(GROUP);
        let (all, half) = (vec![0.0; width * groups * GROUP], vec![0.0; width * groups * LANES]);
        Self {
            width,
            own: all.clone(),
            per_own: all.clone(),
            right: all.clone(),
            below: all.clone(),
            wanted: all,
            found: [half.clone(), half.clone()],
            left: half,
            spans: vec![0..0; groups],
        }
    }

    /// Empties what was solved; the equations that come lie within these columns of each row of the finest grid, of which a row of this one
    /// holds `2^k`.
    pub fn clear(&mut self, spans: &[Range<usize>], k: usize) {
        let [even, odd] = &mut self.found;
        [&mut self.wanted, even, odd].into_iter().for_each(|list| list.fill(0.0));
        let widest = |rows: &[Range<usize>]| {
            let filled = || rows.iter().filter(|span| !span.is_empty());
            // At even columns, so that pairs of cells are one of the coarser grid.
            let start = (filled().map(|span| span.start).min().unwrap_or(0) >> k) & !1;
            start..filled().map(|span| span.end).max().unwrap_or(0).div_ceil(1 << k).max(start)
        };
        self.spans.fill(0..0);
        for (own, rows) in self.spans.iter_mut().zip(spans.chunks(GROUP << k)) {
            *own = widest(rows);
        }
    }

    /// The fewest groups that a thread takes at once.
    pub fn share(&self) -> usize {
        if self.own.len() < MIN_SHARED { usize::MAX } else { share(MIN_GROUPS) }
    }

    /// What was found for a row.
    #[inline]
    pub fn found(&self, row: usize) -> &[f32] {
        &self.found[row % 2][row / 2 * self.width..(row / 2 + 1) * self.width]
    }

    /// The matrix times a vector, of which a group's rows are wanted.
    pub fn times(&self, group: usize, vector: &[f32], out: &mut [f32]) {
        let (w, Range { start, end }) = (self.width, self.spans[group].clone());
        for (line, row) in out.chunks_mut(w).zip(group * GROUP..).filter(|_| start < end) {
            let (from, to) = (row * w + start, row * w + end);
            let line = &mut line[start..end];
            for ((out, own), v) in line.iter_mut().zip(&self.own[from..to]).zip(&vector[from..to]) {
                *out = own * v;
            }
            // Cells beyond the span have no equations with those within.
            let inner = line.len() - 1;
            add(&mut line[..inner], &self.right[from..to - 1], &vector[from + 1..to]);
            add(&mut line[1..], &self.right[from..to - 1], &vector[from..to - 1]);
            if let Some(below) = vector.get(from + w..to + w) {
                add(line, &self.below[from..to], below);
            }
            if from >= w {
                add(line, &self.below[from - w..to - w], &vector[from - w..to - w]);
            }
        }
    }

    /// What a vector, given for the rows that there are, leaves of what is asked: into what is wanted.
    pub fn leave_of(&mut self, asked: &[f64], vector: &[f64]) {
        let min_rows = self.share();
        let Self { width: w, own, right, below, wanted, spans, .. } = self;
        let w = *w;
        let groups = wanted.par_chunks_mut(GROUP * w).zip(&*spans).enumerate().with_min_len(min_rows);
        groups.for_each(|(group, (wanted, span))| {
            for (line, row) in wanted.chunks_mut(w).zip(group * GROUP..) {
                for column in span.clone() {
                    let cell = row * w + column;
                    let Some(asked) = asked.get(cell) else { return };
                    let part = |list: &[f32], at: usize, to: usize| {
                        vector.get(to).map_or(0.0, |v| f64::from(list[at]) * v)
                    };
                    let mut taken =
                        part(own, cell, cell) + part(right, cell, cell + 1) + part(below, cell, cell + w);
                    if column > 0 {
                        taken += part(right, cell - 1, cell - 1);
                    }
                    if row > 0 {
                        taken += part(below, cell - w, cell - w);
                    }
                    line[column] = (asked - taken) as f32;
                }
            }
        });
    }

    /// A pass over the even or the odd rows, forwards or backwards along them.
    fn relax(&mut self, kind: usize, is_forward: bool, known: Found) {
        let min_rows = self.share();
        let Self { width: w, per_own, right, below, wanted, found, left, spans, .. } = self;
        let (w, [even, odd]) = (*w, found);
        let (own, others) = if kind == 0 { (even, &*odd) } else { (odd, &*even) };
        let (per_own, right, below, wanted) = (&*per_own, &*right, &*below, &*wanted);
        let groups = own.par_chunks_mut(LANES * w).zip(left.par_chunks_mut(LANES * w)).zip(&*spans);
        groups.enumerate().with_min_len(min_rows).for_each(|(group, ((found, left), span))| {
            let Range { start, end } = span.clone();
            if start == end {
                return;
            }
            for (k, (left, found)) in left.chunks_mut(w).zip(found.chunks(w)).enumerate() {
                let i = group * LANES + k;
                let row = 2 * i + kind;
                let (left, found, at) = (&mut left[start..end], &found[start..end], row * w);
                left.copy_from_slice(&wanted[at + start..at + end]);
                let inner = left.len() - 1;
                if known != Found::Nothing {
                    // Rows of the other kind above and below are those of the same number and of one less or one more.
                    if row > 0 {
                        let above = (i + kind - 1) * w;
                        take(left, &below[at - w + start..at - w + end], &others[above + start..above + end]);
                    }
                    if let Some(next) = others.get((i + kind) * w + start..(i + kind) * w + end) {
                        take(left, &below[at + start..at + end], next);
                    }
                }
                // The one along the row that is not computed yet is known for all cells at once.
                let right = &right[at + start..at + end];
                match (is_forward, known) {
                    (true, Found::All) => take(&mut left[..inner], &right[..inner], &found[1..]),
                    (false, _) => take(&mut left[1..], &right[..inner], &found[..inner]),
                    _ => {}
                }
                let per_own = &per_own[at + start..at + end];
                left.iter_mut().zip(per_own).for_each(|(left, per_own)| *left *= per_own);
            }
            let first = (group * GROUP + kind) * w + start;
            let lines = |list| rows_of(list, first, 2 * w, end - start);
            let left = rows_of(left, start, w, end - start);
            let mut rows = found.chunks_mut(w);
            let found = std::array::from_fn(|_| rows.next().map_or(&mut [][..], |row| &mut row[start..end]));
            let pass = if is_forward { forwards } else { backwards };
            pass(found, left, lines(per_own), lines(right));
        });
    }

    /// What the values found by a first pass forwards leave over, what the cells after each take, goes to the coarser grid as what it
    /// wants: sums of two by two cells.
    fn leave(&mut self, coarse: &mut Self) {
        let min_rows = self.share();
        let Self { width: w, right, below, found: [even, odd], left, spans, .. } = self;
        let (w, coarse_w, spans) = (*w, coarse.width, &*spans);
        let (right, below, even, odd) = (&*right, &*below, &*even, &*odd);
        let rows = coarse.wanted.par_chunks_mut(coarse_w).zip(left.par_chunks_mut(w)).enumerate();
        rows.with_min_len(min_rows.saturating_mul(LANES)).for_each(|(i, (wanted, left))| {
            let Some(Range { start, end }) = spans.get(i / LANES).cloned() else { return };
            if start == end {
                return;
            }
            let (at, left) = (2 * i * w, &mut left[start..end]);
            let inner = left.len() - 1;
            let line = |row: usize| row * w + start..row * w + end;
            let (own, next) = (&even[line(i)], &odd[line(i)]);
            left.fill(0.0);
            take(&mut left[..inner], &right[at + start..at + start + inner], &own[1..]);
            take(left, &below[at + start..at + end], next);
            if i > 0 {
                take(left, &below[at - w + start..at - w + end], &odd[line(i - 1)]);
            }
            take(&mut left[..inner], &right[at + w + start..at + w + start + inner], &next[1..]);
            // Spans begin at even columns.
            let (pairs, wanted) = (left.chunks(2), &mut wanted[start / 2..]);
            pairs.zip(wanted).for_each(|(pair, wanted)| *wanted = pair.iter().sum());
        });
    }

    /// Adds what the coarser grid found.
    fn add_from(&mut self, coarse: &Self) {
        let min_rows = self.share();
        let (w, spans, own) = (self.width, &self.spans, &self.own);
        let [even, odd] = &mut self.found;
        let groups = even.par_chunks_mut(LANES * w).zip(odd.par_chunks_mut(LANES * w)).zip(spans);
        groups.enumerate().with_min_len(min_rows).for_each(|(group, ((even, odd), span))| {
            let Range { start, end } = span.clone();
            for (i, (even, odd)) in even.chunks_mut(w).zip(odd.chunks_mut(w)).enumerate() {
                let i = group * LANES + i;
                if i * 2 >= own.len() / w {
                    return;
                }
                let coarse = &coarse.found(i)[start / 2..];
                for (found, row) in [(even, 2 * i), (odd, 2 * i + 1)] {
                    let own = &own[row * w + start..row * w + end];
                    for ((found, own), coarse) in
                        found[start..end].chunks_mut(2).zip(own.chunks(2)).zip(coarse)
                    {
                        for (found, own) in found.iter_mut().zip(own) {
                            *found += if *own > 0.0 { *coarse } else { 0.0 };
                        }
                    }
                }
            }
        });
    }
}

/// Pieces of the rows that are computed side by side.
type Lanes<'a> = [&'a [f32]; LANES];

/// A piece of as many rows as are computed side by side.
fn rows_of(list: &[f32], first: usize, step: usize, length: usize) -> Lanes<'_> {
    std::array::from_fn(|k| &list[first + k * step..][..length])
}

/// Passes along rows side by side: what hangs on the cell before is one product, and rows do not wait for each other.
#[inline]
fn forwards(found: [&mut [f32]; LANES], left: Lanes<'_>, per_own: Lanes<'_>, right: Lanes<'_>) {
    let length = left[0].len();
    let (mut before, mut coupling) = ([0.0; LANES], [0.0; LANES]);
    for x in 0..length {
        for k in 0..LANES {
            before[k] = left[k][x] - coupling[k] * per_own[k][x] * before[k];
            found[k][x] = before[k];
            coupling[k] = right[k][x];
        }
    }
}

/// The same backwards.
#[inline]
fn backwards(found: [&mut [f32]; LANES], left: Lanes<'_>, per_own: Lanes<'_>, right: Lanes<'_>) {
    let length = left[0].len();
    let mut before = [0.0; LANES];
    for x in (0..length).rev() {
        for k in 0..LANES {
            before[k] = left[k][x] - right[k][x] * per_own[k][x] * before[k];
            found[k][x] = before[k];
        }
    }
}

/// Adds the products of two lists to a third.
#[inline]
fn add(to: &mut [f32], parts: &[f32], values: &[f32]) {
    for ((to, part), value) in to.iter_mut().zip(parts).zip(values) {
        *to += part * value;
    }
}

/// Takes the products of two lists from a third.
#[inline]
fn take(from: &mut [f32], parts: &[f32], found: &[f32]) {
    for ((from, part), found) in from.iter_mut().zip(parts).zip(found) {
        *from -= part * found;
    }
}

/// One V-cycle for what the finest grid wants, into what it found. Symmetric: what goes down forwards comes up backwards. A second visit
/// of coarse grids (a W-cycle) is not positive: with their coupling halved, a cycle by itself may overshoot by more than twice.
pub(super) fn precondition(grids: &mut [Grid]) {
    let Some((fine, coarser)) = grids.split_first_mut() else { return };
    let Some(coarse) = coarser.first_mut() else {
        fine.found.iter_mut().for_each(|found| found.fill(0.0));
        for _ in 0..COARSEST_PASSES {
            fine.relax(0, true, Found::All);
            fine.relax(1, true, Found::All);
            fine.relax(1, false, Found::All);
            fine.relax(0, false, Found::All);
        }
        return;
    };
    fine.relax(0, true, Found::Nothing);
    fine.relax(1, true, Found::Others);
    fine.leave(coarse);
    precondition(coarser);
    if let Some(coarse) = coarser.first() {
        fine.add_from(coarse);
    }
    fine.relax(1, false, Found::All);
    fine.relax(0, false, Found::All);
}
