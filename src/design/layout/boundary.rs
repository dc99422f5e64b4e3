//! The edge of a pattern: a closed curve around the pattern's centre that every ray from there meets once.
//!
//! # Example
//! ```
//! use domecast_design::glam::DVec2;
//! use domecast_design::layout::boundary::Boundary;
//!
//! let circle = Boundary::new(|_| 100.0).inset(10.0);
//! assert!(circle.contains(DVec2::new(0.0, 89.0)) && !circle.contains(DVec2::new(0.0, 91.0)));
//! ```

use std::f64::consts::TAU;

use glam::DVec2;

/// Directions in which the edge is held. The edge of a camera that is off the axis is close to an ellipse;
/// linear interpolation over half a degree errs by a hundred-thousandth of its *deviation* from a circle.
const DIRECTIONS: usize = 720;

/// A star-shaped edge: a radius for each direction, px.
#[derive(Debug, Clone, PartialEq)]
pub struct Boundary {
    radius_px: Vec<f64>,
}

impl Boundary {
    /// The edge whose radius (px) in the direction of the unit vector is `radius`. A radius that is not
    /// finite or is negative counts as zero.
    pub fn new(mut radius: impl FnMut(DVec2) -> f64) -> Self {
        let radius_px = (0..DIRECTIONS)
            .map(|k| radius(DVec2::from_angle(TAU * k as f64 / DIRECTIONS as f64)))
            .map(|r| if r.is_finite() && r > 0.0 { r } else { 0.0 })
            .collect();
        Self { radius_px }
    }

    /// Radius of the edge in the direction of `offset`, px.
    pub fn radius_px(&self, offset: DVec2) -> f64 {
        let turns = offset.to_angle() / TAU;
        let place = (turns - turns.floor()) * DIRECTIONS as f64;
        let share = place - place.floor();
        let index = place as usize % DIRECTIONS;
        let next = (index + 1) % DIRECTIONS;
        let (a, b) = (self.radius_px[index], self.radius_px[next]);
        // `share` is zero at a direction that is held, and there the answer is exact.
        a + share * (b - a)
    }

    /// The largest radius, px.
    pub fn largest_px(&self) -> f64 {
        self.radius_px.iter().copied().fold(0.0, f64::max)
    }

    /// The smallest radius, px.
    pub fn smallest_px(&self) -> f64 {
        self.radius_px.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Whether the offset from the centre lies inside, the edge included, with a slack of rounding so that
    /// points of equal radius are treated alike.
    pub fn contains(&self, offset: DVec2) -> bool {
        const ROUNDING: f64 = 1e-9;
        offset.length() <= self.radius_px(offset) * (1.0 + ROUNDING)
    }

    /// The edge drawn in by `margin_px`, towards the centre; exact for a circle.
    #[must_use]
    pub fn inset(&self, margin_px: f64) -> Self {
        Self { radius_px: self.radius_px.iter().map(|r| (r - margin_px).max(0.0)).collect() }
    }

    /// The edge as a polygon of offsets from the centre, px.
    pub fn polygon(&self) -> Vec<DVec2> {
        let corner = |(k, r): (usize, &f64)| DVec2::from_angle(TAU * k as f64 / DIRECTIONS as f64) * *r;
        self.radius_px.iter().enumerate().map(corner).collect()
    }

    /// Area inside, px^2.
    pub fn area_px2(&self) -> f64 {
        let polygon = self.polygon();
        let next = polygon.iter().cycle().skip(1);
        0.5 * polygon.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f64>()
    }
}
