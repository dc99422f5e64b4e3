//! Places of a look-up: from a direction to the disc, to a grid over it, to a cell and the weights of its nodes.

use glam::{Vec2, Vec3A, Vec4};

use crate::sim::light::dome_map::DomeGrid;

/// 0 up to 0, 1 from 1 on, smooth between.
pub(super) fn smooth_step(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The disc's place of a unit direction, as [`super::dome_map::disc_continued`] tells it.
#[inline]
pub(super) fn disc_of(direction: Vec3A) -> Vec2 {
    Vec2::new(direction.x, direction.y) * (1.0 + direction.z.max(-0.25)).sqrt().recip()
}

/// What leads from the disc to a grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
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

/// Weights of the four nodes about a place between the middle two, along x and along y: the cubic spline's.
#[inline]
pub(super) fn cubics(part: Vec2) -> ([f32; 4], [f32; 4]) {
    // Both at once.
    let t = Vec4::new(part.x, part.y, 0.0, 0.0);
    let s = Vec4::ONE - t;
    let sixth = 1.0 / 6.0;
    let (t2, s2) = (t * t, s * s);
    let four = Vec4::splat(4.0);
    let weights = [
        s * s2 * sixth,
        (t2 * (t * 3.0 - 6.0) + four) * sixth,
        (s2 * (s * 3.0 - 6.0) + four) * sixth,
        t * t2 * sixth,
    ];
    (weights.map(|w| w.x), weights.map(|w| w.y))
}

/// Index of the lower corner of the cell of a place of the disc, and the place in it.
#[inline]
pub(super) fn cell_of(grid: &DomeGrid, scale: &Scale, disc: Vec2) -> (usize, f32, f32) {
    let ((column, row), part) = split(scale.place(disc), 0.0, scale.last_cell);
    (row * grid.nodes + column, part.x, part.y)
}
