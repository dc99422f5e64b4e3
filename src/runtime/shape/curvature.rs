//! How the skin bends where it is touched: its principal curvatures, and the line of an edge.

use glam::{DVec2, DVec3, Vec3A};
use nalgebra::{SMatrix, SVector};

/// Fewest cells that curvatures are fitted to.
const MIN_FITTED: usize = 30;

/// How far an edge's direction is off beside what its middle and the whole of it differ by, rad: 1.8 degrees (25 edges on five designs), for the mask's ends are ragged.
const EDGE_SD_RAD: f64 = 0.0314;

/// Deviation from which on a direction is none, rad.
const MAX_EDGE_SD_RAD: f64 = 0.2;

/// The line of an edge at the deepest place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactEdge {
    /// Along it, tangent to the skin, of unit length; of its two ways the one whose x is not negative. Sensor frame.
    pub direction: DVec3,
    /// Standard deviation of its angle, rad.
    pub sd_rad: f64,
}

/// The cells of a touch; those whose pressure is over one. `at` is the deepest.
pub(super) struct Touch<'a> {
    pub points: &'a [Vec3A],
    pub normals: &'a [Vec3A],
    pub pressures: &'a [f32],
    pub at: usize,
}

/// Bending of the skin at a place.
pub(super) struct Bend {
    /// Principal curvatures, 1/mm, the larger first: positive where the skin is hollow.
    pub per_mm: [f64; 2],
    /// Along the smaller one.
    along: DVec3,
}

impl Touch<'_> {
    /// That of the paraboloid through the points within a reach of the deepest.
    pub fn bend(&self, reach_mm: f64) -> Option<Bend> {
        let (origin, up) =
            (self.points[self.at].as_dvec3(), self.normals[self.at].as_dvec3().try_normalize()?);
        let (x, y) = up.any_orthonormal_pair();
        let mut normal = SMatrix::<f64, 6, 6>::zeros();
        let mut right = SVector::<f64, 6>::zeros();
        let mut count = 0;
        for (cell, _) in self.pressures.iter().enumerate().filter(|(_, p)| **p > 1.0) {
            let away = self.points[cell].as_dvec3() - origin;
            let flat = DVec2::new(away.dot(x), away.dot(y)) / reach_mm;
            if flat.length_squared() > 1.0 {
                continue;
            }
            let row = SVector::<f64, 6>::from([
                1.0,
                flat.x,
                flat.y,
                0.5 * flat.x * flat.x,
                flat.x * flat.y,
                0.5 * flat.y * flat.y,
            ]);
            normal += row * row.transpose();
            right += row * away.dot(up);
            count += 1;
        }
        if count < MIN_FITTED {
            return None;
        }
        let fit = normal.cholesky()?.solve(&right) / (reach_mm * reach_mm);
        let (mean, half, shear) = (0.5 * (fit[3] + fit[5]), 0.5 * (fit[3] - fit[5]), fit[4]);
        let spread = half.hypot(shear);
        let (sin, cos) = (0.5 * shear.atan2(half)).sin_cos();
        let per_mm = [mean + spread, mean - spread];
        per_mm.iter().all(|v| v.is_finite()).then_some(Bend { per_mm, along: y * cos - x * sin })
    }

    /// The line of an edge: the less curved direction of the whole touch, where its middle is hollow across by more than half as much again
    /// as along, and deeper by `min_mm` than what is straight. A sharp edge's touch is so narrow that the middle alone says little of it.
    pub fn edge(&self, radius_mm: f64, min_mm: f64) -> Option<ContactEdge> {
        let [middle, whole] = [self.bend(radius_mm)?, self.bend(2.0 * radius_mm)?];
        let is_edge = [&middle, &whole].iter().all(|bend| {
            let [across, along] = bend.per_mm;
            across - along > 0.5 * across.max(-along) && 0.5 * across * radius_mm * radius_mm > min_mm
        });
        let turned_rad = middle.along.dot(whole.along).abs().min(1.0).acos();
        let sd_rad = turned_rad.hypot(EDGE_SD_RAD);
        let direction = if whole.along.x < 0.0 { -whole.along } else { whole.along };
        (is_edge && sd_rad < MAX_EDGE_SD_RAD).then_some(ContactEdge { direction, sd_rad })
    }
}
