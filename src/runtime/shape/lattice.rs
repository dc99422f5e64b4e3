//! What varies slowly over the picture: computed at some cells, linear between them.

use glam::Vec3A;
use rayon::prelude::*;

use super::cells::{Cells, View};
use super::fill::{Pyramid, Weighted};
use super::rows::share;

/// Cells between two places of the lattice.
const STEP: usize = 8;

/// Places that a thread takes at once, at least.
const MIN_PLACES: usize = 100;

/// Values at every eighth cell, those beside the dome filled in from the dome; kept between frames.
#[derive(Debug, Clone, Default)]
pub(super) struct Lattice {
    columns: usize,
    values: Vec<Weighted>,
    pyramid: Pyramid,
}

impl Lattice {
    /// Asks for the value of cells that look at the dome.
    pub fn take(&mut self, cells: &Cells, view: &View, value: impl Fn(usize) -> Option<Vec3A> + Sync) {
        let (columns, rows) = (cells.width.div_ceil(STEP) + 1, cells.height.div_ceil(STEP) + 1);
        let at = |i: usize| {
            let column = (i % columns * STEP).min(cells.width - 1);
            let row = (i / columns * STEP).min(cells.height - 1);
            let cell = row * cells.width + column;
            let known = if view.is_dome[cell] { value(cell) } else { None };
            known
                .filter(|value| value.is_finite())
                .map_or(Weighted::default(), |value| Weighted::new(value, 1.0))
        };
        self.columns = columns;
        self.values.resize(columns * rows, Weighted::default());
        let places = self.values.par_iter_mut().enumerate().with_min_len(share(MIN_PLACES));
        places.for_each(|(i, place)| *place = at(i));
        self.pyramid.fill(columns, &mut self.values);
    }

    /// The value at a cell.
    #[inline]
    pub fn at(&self, column: usize, row: usize) -> Vec3A {
        let (x, y) = (column / STEP, row / STEP);
        let (px, py) = ((column % STEP) as f32 / STEP as f32, (row % STEP) as f32 / STEP as f32);
        let of = |x: usize, y: usize| self.values[y * self.columns + x].value();
        let (upper, lower) = (of(x, y).lerp(of(x + 1, y), px), of(x, y + 1).lerp(of(x + 1, y + 1), px));
        upper.lerp(lower, py)
    }
}
