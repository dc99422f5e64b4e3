//! The smooth motion that is nearest to those of many dots: affine, or what a camera can make of a picture.

use glam::DVec2;
use nalgebra::{SMatrix, SVector};

/// Terms of what a camera can make of a picture; the first three are affine.
const TERMS: usize = 8;
const AFFINE_TERMS: usize = 3;
/// What a motion has at a place.
pub(super) type Terms = SVector<f64, TERMS>;

/// Sums of a least-squares fit.
#[derive(Debug, Clone)]
pub(super) struct MotionSums {
    matrix: SMatrix<f64, TERMS, TERMS>,
    right: [Terms; 2],
    places: usize,
}

/// A smooth motion.
#[derive(Debug, Clone)]
pub(super) struct SmoothMotion {
    by_place: [Terms; 2],
    /// Inverse of the sums' matrix.
    pub inverse: SMatrix<f64, TERMS, TERMS>,
}

/// The terms of an affine motion at a place in the frame: one, and both axes about `middle_px` in parts of it.
pub(super) fn affine_terms(at_px: DVec2, middle_px: DVec2) -> Terms {
    let from = at_px / middle_px - 1.0;
    Terms::from([1.0, from.x, from.y, 0.0, 0.0, 0.0, 0.0, 0.0])
}

/// The terms of what becomes of a picture where the camera is another: the affine ones, those of second order (a principal
/// point elsewhere, seen from a pose that makes up for it; perspective) and those of radial distortion.
pub(super) fn camera_terms(at_px: DVec2, middle_px: DVec2) -> Terms {
    // one scale for both axes: distortion is round
    let DVec2 { x, y } = (at_px - middle_px) / middle_px.max_element();
    let r2 = x * x + y * y;
    Terms::from([1.0, x, y, x * x, x * y, y * y, r2 * x, r2 * y])
}

impl MotionSums {
    /// For [`affine_terms`]: the others stay zero.
    pub fn affine() -> Self {
        let mut sums = Self::camera();
        (AFFINE_TERMS..TERMS).for_each(|term| sums.matrix[(term, term)] = 1.0);
        sums
    }

    /// For [`camera_terms`].
    pub fn camera() -> Self {
        Self { matrix: SMatrix::zeros(), right: [Terms::zeros(); 2], places: 0 }
    }

    /// Adds a motion.
    pub fn add(&mut self, terms: &Terms, motion: DVec2) {
        self.matrix += terms * terms.transpose();
        self.right[0] += terms * motion.x;
        self.right[1] += terms * motion.y;
        self.places += 1;
    }

    /// How many motions were added.
    pub fn places(&self) -> usize {
        self.places
    }

    /// The nearest motion; `None` of fewer than `min_places`, or of places that do not tell its terms apart.
    pub fn solve(&self, min_places: usize) -> Option<SmoothMotion> {
        let inverse = self.matrix.cholesky().filter(|_| self.places >= min_places)?.inverse();
        let by_place = self.right.map(|right| inverse * right);
        by_place.iter().all(|v| v.iter().all(|v| v.is_finite())).then_some(SmoothMotion { by_place, inverse })
    }
}

impl SmoothMotion {
    /// Of a place.
    pub fn at(&self, terms: &Terms) -> DVec2 {
        DVec2::new(self.by_place[0].dot(terms), self.by_place[1].dot(terms))
    }
}
