//! Places of a look-up: from a direction to the disc, to a grid over it, to a cell and the weights of its nodes.

use glam::{DVec2, Vec2, Vec3A};

use crate::light::dome_map::DomeGrid;

/// The disc's place of a unit direction, as [`super::dome_map::disc_continued`] tells it.
#[inline]
pub(super) fn disc_of(direction: Vec3A) -> Vec2 {
    Vec2::new(direction.x, direction.y) * (1.0 + direction.z.max(-0.25)).sqrt().recip()
}

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
}

impl Scale {
    pub fn of(grid: &DomeGrid) -> Self {
        let nodes = grid.nodes as f32;
        Self {
            nodes: grid.nodes,
            cells: 0.5 * grid.cells() as f32,
            middle: 0.5 * (nodes - 1.0),
            last_cubic: nodes - 2.001,
            last_cell: nodes - 2.0,
        }
    }

    /// Grid coordinates of a place in the disc's plane.
    #[inline]
    pub fn place(&self, disc: Vec2) -> Vec2 {
        disc * self.cells + Vec2::splat(self.middle)
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
