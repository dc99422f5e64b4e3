//! A table over the dome, and how to look something up in it.
//!
//! Directions from the dome's centre are mapped to a disc of radius 1 by the equal-area map
//! `(x, y) / sqrt(1 + z)` (Lambert's azimuthal projection): smooth over the whole hemisphere, the rim included,
//! and one square root to compute. The disc lies in a square grid with some cells to spare all round.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Cells beyond the disc on each side, so that a bicubic look-up at the rim stays inside.
const SPARE: usize = 3;

/// The grid over the disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DomeGrid {
    /// Nodes along each side.
    pub nodes: usize,
}

impl DomeGrid {
    /// A grid with so many cells from rim to rim, at least 8.
    pub fn with_cells(cells: usize) -> Self {
        Self { nodes: cells.max(8) + 2 * SPARE + 1 }
    }

    /// Cells from rim to rim.
    pub fn cells(&self) -> usize {
        self.nodes - 2 * SPARE - 1
    }

    /// Width of a cell in the disc of radius 1.
    pub fn cell(&self) -> f64 {
        2.0 / self.cells() as f64
    }

    /// Place of a node in the disc's plane.
    pub fn place(&self, column: usize, row: usize) -> DVec2 {
        let at = |i: usize| (i as f64 - SPARE as f64) * self.cell() - 1.0;
        DVec2::new(at(column), at(row))
    }

    /// Grid coordinates (in nodes) of a unit direction with z of at least 0.
    pub fn coordinates(&self, direction: DVec3) -> DVec2 {
        self.coordinates_of_disc(disc_from_direction(direction))
    }

    /// Grid coordinates of a place in the disc's plane.
    pub fn coordinates_of_disc(&self, disc: DVec2) -> DVec2 {
        (disc + 1.0) * (0.5 * self.cells() as f64) + SPARE as f64
    }

    /// Values at all nodes, row by row, of a function of the direction; rows are shared among threads.
    ///
    /// A node beyond the rim, which no direction has, gets the parabola through the rim and two places inside
    /// continued, as far apart as it lies outside. Where no look-up comes it gets zeros.
    pub fn fill_in_parallel<const K: usize>(
        &self,
        value: impl Fn(DVec3) -> [f64; K] + Sync,
    ) -> Vec<[f64; K]> {
        let rows: Vec<Vec<[f64; K]>> = (0..self.nodes)
            .into_par_iter()
            .map(|row| (0..self.nodes).map(|column| self.node(column, row, &value)).collect())
            .collect();
        rows.into_iter().flatten().collect()
    }

    fn node<const K: usize>(
        &self,
        column: usize,
        row: usize,
        value: &impl Fn(DVec3) -> [f64; K],
    ) -> [f64; K] {
        let place = self.place(column, row);
        let radius = place.length();
        match self.evaluations_at(radius) {
            0 => [0.0; K],
            1 => value(direction_from_disc(place)),
            _ => {
                let rim = value(direction_from_disc(place / radius));
                let inside = value(direction_from_disc(place * ((2.0 - radius) / radius)));
                let deeper = value(direction_from_disc(place * ((3.0 - 2.0 * radius) / radius)));
                std::array::from_fn(|k| 3.0 * (rim[k] - inside[k]) + deeper[k])
            }
        }
    }

    fn evaluations_at(&self, radius: f64) -> u64 {
        if radius <= 1.0 {
            1
        } else if radius <= 1.0 + 2.0 * std::f64::consts::SQRT_2 * self.cell() {
            3
        } else {
            0
        }
    }

    /// How often [`DomeGrid::fill_in_parallel`] calls its function.
    pub fn evaluations(&self) -> u64 {
        let nodes = (0..self.nodes).flat_map(|row| (0..self.nodes).map(move |column| (column, row)));
        nodes.map(|(column, row)| self.evaluations_at(self.place(column, row).length())).sum()
    }
}

/// The disc's point for a unit direction.
pub fn disc_from_direction(direction: DVec3) -> DVec2 {
    direction.truncate() / (1.0 + direction.z.max(0.0)).sqrt()
}

/// [`disc_from_direction`], continued some degrees below the rim.
#[inline]
pub fn disc_continued(direction: DVec3) -> DVec2 {
    direction.truncate() / (1.0 + direction.z.max(-0.25)).sqrt()
}

/// The unit direction of a point of the disc, radius at most 1.
pub fn direction_from_disc(disc: DVec2) -> DVec3 {
    let square = disc.length_squared().min(1.0);
    (disc * (2.0 - square).sqrt()).extend(1.0 - square)
}

/// Bicubic look-up (Catmull and Rom's cubic, third order) in a table over a grid.
pub fn bicubic<const K: usize>(grid: &DomeGrid, table: &[[f64; K]], at: DVec2) -> [f64; K] {
    let last = grid.nodes as f64 - 1.0;
    let clamped = at.clamp(DVec2::ONE, DVec2::splat(last - 1.0 - 1e-9));
    let (column, row) = (clamped.x as usize, clamped.y as usize);
    let (wx, wy) = (weights(clamped.x - column as f64), weights(clamped.y - row as f64));
    let mut out = [0.0; K];
    for (j, wy) in wy.iter().enumerate() {
        for (i, wx) in wx.iter().enumerate() {
            let node = &table[(row + j - 1) * grid.nodes + column + i - 1];
            for (sum, v) in out.iter_mut().zip(node) {
                *sum += wx * wy * v;
            }
        }
    }
    out
}

fn weights(t: f64) -> [f64; 4] {
    [
        0.5 * t * ((2.0 - t) * t - 1.0),
        0.5 * (t * t * (3.0 * t - 5.0) + 2.0),
        0.5 * t * ((4.0 - 3.0 * t) * t + 1.0),
        0.5 * t * t * (t - 1.0),
    ]
}
