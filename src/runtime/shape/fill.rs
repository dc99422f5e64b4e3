//! Values where nothing is known, from what is known around: pushed up a pyramid and pulled down again.
//!
//! S. J. Gortler et al., The Lumigraph, SIGGRAPH 1996 (pull and push).

use glam::Vec3A;

/// A value and its weight, 0 to 1.
pub(super) type Weighted = (Vec3A, f32);

/// Levels above the finest, kept between frames.
#[derive(Debug, Clone, Default)]
pub(super) struct Pyramid {
    levels: Vec<(usize, usize, Vec<Weighted>)>,
}

impl Pyramid {
    /// Gives each place of weight below 1 what its surroundings have, in so far as its own weight lacks. Places stay 0
    /// where nothing at all is known.
    pub fn fill(&mut self, width: usize, values: &mut [Weighted]) {
        let height = values.len() / width.max(1);
        self.shape(width, height);
        let mut below: (usize, usize, &[Weighted]) = (width, height, values);
        for (w, h, level) in &mut self.levels {
            reduce(below, (*w, *h), level);
            below = (*w, *h, level);
        }
        for k in (0..self.levels.len()).rev() {
            let (finer, coarser) = self.levels.split_at_mut(k);
            let Some((w, h, coarse)) = coarser.first() else { continue };
            match finer.last_mut() {
                Some((fw, _, fine)) => expand((*w, *h, coarse), *fw, fine),
                None => expand((*w, *h, coarse), width, values),
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
            self.levels.push((w, h, vec![(Vec3A::ZERO, 0.0); w * h]));
            if w * h <= 1 {
                break;
            }
            (w, h) = (w.div_ceil(2), h.div_ceil(2));
        }
    }
}

/// Means of four; their weight is at most 1.
fn reduce(fine: (usize, usize, &[Weighted]), (w, h): (usize, usize), coarse: &mut [Weighted]) {
    let (fw, fh, fine) = fine;
    for row in 0..h {
        for column in 0..w {
            let (mut sum, mut weights) = (Vec3A::ZERO, 0.0);
            for y in 2 * row..(2 * row + 2).min(fh) {
                for x in 2 * column..(2 * column + 2).min(fw) {
                    let (value, weight) = fine[y * fw + x];
                    sum += value * weight;
                    weights += weight;
                }
            }
            let mean = if weights > 0.0 { sum / weights } else { Vec3A::ZERO };
            coarse[row * w + column] = (mean, weights.min(1.0));
        }
    }
}

/// Fills what the fine level lacks from the coarse one, linear between its places.
fn expand(coarse: (usize, usize, &[Weighted]), fw: usize, fine: &mut [Weighted]) {
    let (w, h, coarse) = coarse;
    for (y, line) in fine.chunks_mut(fw).enumerate() {
        for (x, place) in line.iter_mut().enumerate() {
            if place.1 >= 1.0 {
                continue;
            }
            let (mut sum, mut weights) = (Vec3A::ZERO, 0.0);
            // three quarters from the own place, one quarter from the next
            let side = |i: usize, n: usize| {
                if i.is_multiple_of(2) { (i / 2).saturating_sub(1) } else { (i / 2 + 1).min(n - 1) }
            };
            for (cy, wy) in [(y / 2, 0.75), (side(y, h), 0.25)] {
                for (cx, wx) in [(x / 2, 0.75), (side(x, w), 0.25)] {
                    let (value, weight) = coarse[cy * w + cx];
                    let weight = weight * (wx * wy);
                    sum += value * weight;
                    weights += weight;
                }
            }
            if weights > 0.0 {
                let (value, weight) = *place;
                *place = (value * weight + sum / weights * (1.0 - weight), 1.0);
            }
        }
    }
}
