//! The affine motion that is nearest to those of many dots.

use glam::DVec2;
use nalgebra::{Matrix3, Vector3};

/// Sums of a least-squares fit of an affine motion.
#[derive(Debug, Clone, Default)]
pub(super) struct AffineSums {
    matrix: Matrix3<f64>,
    right: [Vector3<f64>; 2],
}

/// A motion that is affine in the place.
#[derive(Debug, Clone)]
pub(super) struct AffineMotion {
    by_place: [Vector3<f64>; 2],
    /// Inverse of the sums' matrix.
    pub inverse: Matrix3<f64>,
}

/// A place in the frame, as the fits have it: one, and both axes about `middle_px` in parts of it.
pub(super) fn row_of(at_px: DVec2, middle_px: DVec2) -> Vector3<f64> {
    let from = at_px / middle_px - 1.0;
    Vector3::new(1.0, from.x, from.y)
}

impl AffineSums {
    /// Adds a motion.
    pub fn add(&mut self, row: &Vector3<f64>, motion: DVec2) {
        self.matrix += row * row.transpose();
        self.right[0] += row * motion.x;
        self.right[1] += row * motion.y;
    }

    /// The nearest motion; `None` of too few places, or of places in one line.
    pub fn solve(&self) -> Option<AffineMotion> {
        let inverse = self.matrix.cholesky()?.inverse();
        let by_place = self.right.map(|right| inverse * right);
        by_place.iter().all(|v| v.iter().all(|v| v.is_finite())).then_some(AffineMotion { by_place, inverse })
    }
}

impl AffineMotion {
    /// Of a place.
    pub fn at(&self, row: &Vector3<f64>) -> DVec2 {
        DVec2::new(self.by_place[0].dot(row), self.by_place[1].dot(row))
    }
}
