//! Many image points side by side.

use glam::DVec2;

/// The coordinates of `N` points, each in an array of its own, so that the same
/// step is taken for all of them before the next: the processor works on many
/// points at once instead of waiting for one.
///
/// Nothing is summed across points, so every point gets the same bits whatever
/// stands beside it and whatever `N` is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lanes<const N: usize> {
    pub x: [f64; N],
    pub y: [f64; N],
}

impl<const N: usize> Lanes<N> {
    #[inline(always)]
    pub fn at(&self, l: usize) -> DVec2 {
        DVec2::new(self.x[l], self.y[l])
    }

    #[inline(always)]
    pub fn set(&mut self, l: usize, point: DVec2) {
        self.x[l] = point.x;
        self.y[l] = point.y;
    }

    /// Squares of the distances from the origin.
    #[inline(always)]
    pub fn squares(&self) -> [f64; N] {
        let mut squares = [0.0; N];
        for ((square, x), y) in squares.iter_mut().zip(&self.x).zip(&self.y) {
            *square = x * x + y * y;
        }
        squares
    }

    /// Each point times its factor.
    #[inline(always)]
    pub fn times(&self, factors: &[f64; N]) -> Self {
        let mut product = *self;
        for ((x, y), factor) in product.x.iter_mut().zip(&mut product.y).zip(factors) {
            *x *= factor;
            *y *= factor;
        }
        product
    }
}
