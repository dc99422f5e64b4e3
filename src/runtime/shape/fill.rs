//! Values where nothing is known, from what is known around: pushed up a pyramid and pulled down again.
//!
//! S. J. Gortler et al., The Lumigraph, SIGGRAPH 1996 (pull and push).

use std::ops::Range;

use glam::{Vec3A, Vec4};
use rayon::prelude::*;

use super::rows::share;

/// Rows of a level that a thread takes at once, at least, and places from which on a level is shared.
const MIN_ROWS: usize = 16;
const MIN_SHARED: usize = 1 << 13;

/// A value and its weight, 0 to 1.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Weighted(Vec4);

impl Weighted {
    #[inline]
    pub fn new(value: Vec3A, weight: f32) -> Self {
        Self(value.extend(weight))
    }

    #[inline]
    pub fn value(self) -> Vec3A {
        Vec3A::from_vec4(self.0)
    }

    #[inline]
    pub fn weight(self) -> f32 {
        self.0.w
    }

    /// Adds a value to a sum, which [`Weighted::mean`] ends.
    #[inline]
    pub fn add(&mut self, value: Vec3A, weight: f32) {
        self.0 += value.extend(1.0) * weight;
    }

    /// The mean of a sum; its weight is at most 1.
    #[inline]
    pub fn mean(self) -> Self {
        if self.0.w > 0.0 { Self::new(self.value() / self.0.w, self.0.w.min(1.0)) } else { Self::default() }
    }
}
/// Levels above the finest, kept between frames.
#[derive(Debug, Clone, Default)]
pub(super) struct Pyramid {
    levels: Vec<(usize, usize, Vec<Weighted>)>,
}

impl Pyramid {
    /// Gives each place of weight below 1 what its surroundings have, in so far as its own weight lacks. Places stay 0
    /// where nothing at all is known.
    pub fn fill(&mut self, width: usize, values: &mut [Weighted]) {
        self.fill_within(width, values, |_| 0..width);
    }

    /// The same for these columns of each row alone.
    pub fn fill_within(
        &mut self,
        width: usize,
        values: &mut [Weighted],
        span: impl Fn(usize) -> Range<usize> + Sync,
    ) {
        let height = values.len() / width.max(1);
        self.shape(width, height);
        let mut below: (usize, usize, &[Weighted]) = (width, height, values);
        for (w, h, level) in &mut self.levels {
            reduce(below, *w, level);
            below = (*w, *h, level);
        }
        for k in (0..self.levels.len()).rev() {
            let (finer, coarser) = self.levels.split_at_mut(k);
            let Some((w, h, coarse)) = coarser.first() else { continue };
            match finer.last_mut() {
                Some((fw, _, fine)) => expand((*w, *h, coarse), *fw, fine, |_| 0..*fw),
                None => expand((*w, *h, coarse), width, values, &span),
            }
        }
    }

    fn shape(&mut self, width: usize, height: usize) {
        let (mut w, mut h) = (width.div_ceil(2), height.div_ceil(2));
        if self.levels.first().is_some_and(|(have_w, have_h, _)| (*have_w, *have_h) == (w, h)) {
            return;
        }
        self.levels.clear();
        loop {
            self.levels.push((w, h, vec![Weighted::default(); w * h]));
            if w * h <= 1 {
                break;
            }
            (w, h) = (w.div_ceil(2), h.div_ceil(2));
        }
    }
}

/// The fewest rows of a level that a thread takes at once.
fn rows_at_once(places: usize) -> usize {
    if places < MIN_SHARED { usize::MAX } else { share(MIN_ROWS) }
}

/// Means of four; their weight is at most 1.
fn reduce((fw, fh, fine): (usize, usize, &[Weighted]), w: usize, coarse: &mut [Weighted]) {
    let min_rows = rows_at_once(fine.len());
    coarse.par_chunks_mut(w).enumerate().with_min_len(min_rows).for_each(|(row, line)| {
        for (column, mean) in line.iter_mut().enumerate() {
            let mut sum = Weighted::default();
            for y in 2 * row..(2 * row + 2).min(fh) {
                for one in &fine[y * fw + 2 * column..y * fw + (2 * column + 2).min(fw)] {
                    sum.add(one.value(), one.weight());
                }
            }
            *mean = sum.mean();
        }
    });
}

/// Fills what the fine level lacks from the coarse one, linear between its places.
fn expand(
    (w, h, coarse): (usize, usize, &[Weighted]),
    fw: usize,
    fine: &mut [Weighted],
    span: impl Fn(usize) -> Range<usize> + Sync,
) {
    // Three quarters from the own place, one quarter from the next.
    let side = |i: usize, n: usize| {
        if i.is_multiple_of(2) { (i / 2).saturating_sub(1) } else { (i / 2 + 1).min(n - 1) }
    };
    let min_rows = rows_at_once(fine.len());
    fine.par_chunks_mut(fw).enumerate().with_min_len(min_rows).for_each(|(y, line)| {
        let [near, far] = [y / 2, side(y, h)].map(|row| &coarse[row * w..(row + 1) * w]);
        let span = span(y);
        for (x, place) in line[span.clone()].iter_mut().enumerate() {
            let weight = place.weight();
            if weight >= 1.0 {
                continue;
            }
            let x = x + span.start;
            let (own, next) = (x / 2, side(x, w));
            let four = [(near[own], 0.5625), (near[next], 0.1875), (far[own], 0.1875), (far[next], 0.0625)];
            let mut sum = Weighted::default();
            four.into_iter().for_each(|(one, part)| sum.add(one.value(), one.weight() * part));
            if sum.weight() > 0.0 {
                *place = Weighted::new(place.value() * weight + sum.mean().value() * (1.0 - weight), 1.0);
            }
        }
    });
}
