//! What a bonded body's surface moves less than a half-space's, about a contact.
//!
//! Near a force both move alike, as 1 / distance; what is left of the difference a little way off varies slowly, so one number along the
//! surface's normal and one across it stand for it. A dome's base holds back what is pressed in (positive); sideways a hemisphere sways, by
//! more than a half-space moves (negative).

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use crate::compliance::Compliance;
use crate::dome::FactorError;
use crate::grid::GridNode;

/// Distances from a ring's node at which the two are compared, as parts of the dome's radius or height, whichever is less; and in elements
/// at least, for a force is spread over one.
const AT: [f64; 2] = [0.16, 0.3];
const MIN_ELEMENTS: [f64; 2] = [1.5, 2.8];

/// What a ring's place moves less than a half-space of the same material, under a force there, mm/N.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HeldBack {
    /// Along the normal.
    pub along_mm_per_n: f64,
    /// Across it, the mean of both directions.
    pub across_mm_per_n: f64,
}

impl HeldBack {
    /// By force, for a normal of the surface.
    pub fn matrix(&self, normal: DVec3) -> DMat3 {
        let along = DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
        along * (self.along_mm_per_n - self.across_mm_per_n)
            + DMat3::from_diagonal(DVec3::splat(self.across_mm_per_n))
    }
}

impl Compliance {
    /// What is held back at a ring.
    ///
    /// # Errors
    /// A harmonic without factors.
    pub fn held(&self, ring: usize) -> Result<HeldBack, FactorError> {
        let (grid, spacing_mm) = (&self.grid, self.grid.spacing_mm());
        let ring = ring.min(grid.elements - 1);
        let scale_mm = grid.dome.radius_mm().min(grid.dome.height_mm());
        let [near_mm, far_mm] = [0, 1].map(|end| (AT[end] * scale_mm).max(MIN_ELEMENTS[end] * spacing_mm));
        let reach = (far_mm / spacing_mm).ceil() as usize;
        let rings = ring.saturating_sub(reach)..(ring + reach + 1).min(grid.elements);
        self.reach(rings.end - 1)?;
        let elastic = self.elastic();
        let (poisson, shear_mpa) = (elastic.poisson, elastic.shear_mpa());
        let own = GridNode { ring, step: 0 };
        let (at_mm, frame) = (grid.dome.point_mm(grid.meridian_rad(ring), 0.0), grid.frame(own));
        let normal = grid.dome.normal(at_mm);
        let (mut sum, mut count) = (HeldBack::default(), 0.0);
        for number in rings.clone().flat_map(|ring| grid.first[ring]..grid.first[ring] + grid.counts[ring]) {
            let node = grid.node(number);
            let there_mm = grid.dome.point_mm(grid.meridian_rad(node.ring), grid.azimuth(node));
            let distance_mm = there_mm.distance(at_mm);
            if !(near_mm..far_mm).contains(&distance_mm) {
                continue;
            }
            let moved = grid.frame(node) * self.between(node, own) * frame.transpose();
            let other = grid.dome.normal(there_mm);
            let (u, v) = (normal + other).normalize_or(normal).any_orthonormal_pair();
            // Boussinesq and Cerruti: K. L. Johnson, Contact Mechanics, 1985, eq. 3.19 and 3.75; across, the mean over directions.
            let half_space = 1.0 / (2.0 * PI * shear_mpa * distance_mm);
            sum.along_mm_per_n += (1.0 - poisson) * half_space - other.dot(moved * normal);
            sum.across_mm_per_n +=
                (1.0 - 0.5 * poisson) * half_space - 0.5 * (u.dot(moved * u) + v.dot(moved * v));
            count += 1.0;
        }
        Ok(HeldBack {
            along_mm_per_n: sum.along_mm_per_n / f64::max(count, 1.0),
            across_mm_per_n: sum.across_mm_per_n / f64::max(count, 1.0),
        })
    }
}
