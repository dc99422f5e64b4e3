//! From eight points of a smooth outline to a polygon of its area.

use std::f64::consts::TAU;

use glam::DVec2;

use crate::scene::RIM_POINTS;

/// Interpolates closed outlines by the trigonometric polynomial through their eight points, and places a polygon
/// on it whose area is that of the smooth curve.
#[derive(Debug, Clone)]
pub struct RimFit {
    /// One row of eight weights for each corner.
    weights: Vec<[f64; RIM_POINTS]>,
}

/// Fewest and most corners.
const CORNERS: [f64; 2] = [16.0, 96.0];

impl RimFit {
    /// Corners for outlines of this radius such that no edge is further from the curve than `tolerance_px`: an
    /// inscribed edge is off by r (1 - cos(pi/n)), half of that after the polygon is grown to the curve's area.
    pub fn new(radius_px: f64, tolerance_px: f64) -> Self {
        let wanted = std::f64::consts::PI * (0.25 * radius_px / tolerance_px).sqrt();
        let count = wanted.clamp(CORNERS[0], CORNERS[1]).ceil() as usize;
        let step = TAU / count as f64;
        // An inscribed regular polygon has sin(step)/step of the circle's area.
        let grow = (step / step.sin()).sqrt();
        let row = |corner: usize| {
            let angle = step * corner as f64;
            // Dirichlet's kernel for an even number of points, with half of the highest harmonic; the mean is kept, the
            // rest is grown.
            std::array::from_fn(|k| {
                let delta = angle - TAU * k as f64 / RIM_POINTS as f64;
                let half = RIM_POINTS / 2;
                let waves: f64 = (1..half).map(|m| 2.0 * (m as f64 * delta).cos()).sum();
                let last = (half as f64 * delta).cos();
                (1.0 + grow * (waves + last)) / RIM_POINTS as f64
            })
        };
        Self { weights: (0..count).map(row).collect() }
    }

    /// The polygon of an outline, written over `polygon`.
    pub fn polygon(&self, rim: &[DVec2; RIM_POINTS], polygon: &mut Vec<DVec2>) {
        polygon.clear();
        polygon.extend(
            self.weights.iter().map(|row| row.iter().zip(rim).fold(DVec2::ZERO, |sum, (w, p)| sum + *p * *w)),
        );
    }
}
