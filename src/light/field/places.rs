//! Places of a look-up: from a place of the dome to the equal-area plane, to a grid over it, to a cell and the weights of its nodes.

use glam::{DVec2, Vec2, Vec3A};

use crate::dome_map::DomeGrid;
use crate::tables::Ways;

/// What leads from the disc to a grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    /// Nodes along each side.
    pub nodes: usize,
    pub cells: f32,
    pub middle: f32,
    /// Beyond these a cubic, or a cell, lacks nodes.
    pub last_cubic: f32,
    pub last_cell: f32,
    has_wall: bool,
}

impl Scale {
    pub fn of(grid: &DomeGrid) -> Self {
        let nodes = grid.nodes as f32;
        Self {
            nodes: grid.nodes,
            cells: (0.5 * grid.cells() as f64 / grid.face.reach()) as f32,
            middle: 0.5 * (nodes - 1.0),
            last_cubic: nodes - 2.001,
            last_cell: nodes - 2.0,
            has_wall: grid.face.has_wall(),
        }
    }

    /// Where the equal-area plane has a place of the face; a sphere is continued some degrees below its rim.
    #[inline]
    pub fn flat(&self, place: Vec3A) -> Vec2 {
        let aside = Vec2::new(place.x, place.y);
        if self.has_wall && place.z < 0.0 {
            return aside * (1.0 - place.z).sqrt();
        }
        aside * (1.0 + place.z.max(-0.25)).sqrt().recip()
    }

    /// Grid coordinates of a place of the equal-area plane.
    #[inline]
    pub fn place(&self, disc: Vec2) -> Vec2 {
        disc * self.cells + Vec2::splat(self.middle)
    }
}

/// Where a point lies inside the dome.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inside {
    /// Distance from the sphere's centre, in the cylinder from the axis, part of the radius.
    pub part: f32,
    /// The place of the face over it, and the outward unit normal there.
    pub place: Vec3A,
    pub outward: Vec3A,
}

/// What a point's place inside the dome is measured from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Middle {
    center_mm: Vec3A,
    per_mm: f32,
    has_wall: bool,
}

impl Middle {
    pub fn of(ways: &Ways) -> Self {
        let dome = ways.optics[1].dome();
        Self {
            center_mm: dome.center_mm().as_vec3a(),
            per_mm: (1.0 / dome.radius_mm()) as f32,
            has_wall: dome.center_z_mm() > 0.0,
        }
    }

    #[inline]
    pub fn inside(&self, point_mm: Vec3A) -> Inside {
        let at = (point_mm - self.center_mm) * self.per_mm;
        let is_on_wall = self.has_wall && at.z < 0.0;
        let out = if is_on_wall { Vec3A::new(at.x, at.y, 0.0) } else { at };
        let part = out.length();
        let outward = if part > 0.0 { out / part } else { Vec3A::Z };
        let place = if is_on_wall { outward + Vec3A::new(0.0, 0.0, at.z) } else { outward };
        Inside { part, place, outward }
    }
}

/// The cell of a place of a grid, as column and row, and where in it, kept within some coordinates that no cell's number
/// passes. NaN, which no direction gives, is the first.
#[inline]
pub(super) fn split(at: Vec2, first: f32, last: f32) -> ((usize, usize), Vec2) {
    let within = |v: f32| if v > first { if v < last { v } else { last } } else { first };
    let (x, y) = (within(at.x), within(at.y));
    let (column, row) = (x as i32, y as i32);
    ((column as usize, row as usize), Vec2::new(x - column as f32, y - row as f32))
}

/// A function of the disc at a place, beyond its rim as the parabola through the rim and two places inside goes on, as
/// far apart as the place lies outside.
pub(super) fn continued<const K: usize>(place: DVec2, inside: impl Fn(DVec2) -> [f64; K]) -> [f64; K] {
    let radius = place.length();
    if radius <= 1.0 {
        return inside(place);
    }
    // The square's corners lie far out, where nothing is looked up.
    let beyond = (radius - 1.0).min(0.45);
    let [rim, near, deep] = [1.0, 1.0 - beyond, 1.0 - 2.0 * beyond].map(|r| inside(place * (r / radius)));
    std::array::from_fn(|k| 3.0 * (rim[k] - near[k]) + deep[k])
}
