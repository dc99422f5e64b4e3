//! A table over the dome, and how to look something up in it.
//!
//! Directions from the dome's centre are mapped to a disc of radius 1 by the equal-area map
//! `(x, y) / sqrt(1 + z)` (Lambert's azimuthal projection): smooth over the whole hemisphere, the rim included,
//! and one square root to compute. A cap ends at a smaller circle, which is drawn out to the disc; a cylinder under the
//! hemisphere goes on outside its circle, at `sqrt(1 - z)`, which keeps areas equal there too (Archimedes), and both are
//! drawn in to the disc. The disc lies in a square grid with some cells of padding all round.

use std::sync::atomic::{AtomicU64, Ordering};

use domecast_optics::DomeShape;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Cells beyond the disc on each side, so that a bicubic look-up at the rim stays inside.
const PADDING: usize = 3;

/// The dome's face as the map takes it: places of it less the sphere's centre, over the radius. On the sphere that is
/// the outward normal; on a cylinder `z` goes on below zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DomeFace {
    /// `z` of the rim: 0 for a hemisphere.
    pub rim: f64,
}

impl DomeFace {
    /// Half a sphere.
    pub const HEMISPHERE: Self = Self { rim: 0.0 };

    /// The face of a dome.
    pub fn of(dome: &DomeShape) -> Self {
        Self { rim: dome.rim_level() }
    }

    /// Whether the face goes on as a cylinder below the sphere.
    pub fn has_wall(&self) -> bool {
        self.rim < 0.0
    }

    /// Radius of the rim's circle in the equal-area plane, where the hemisphere's is 1.
    pub fn reach(&self) -> f64 {
        (1.0 - self.rim).sqrt()
    }

    /// `z` at a share of the area, counted from the rim.
    pub fn level(&self, share: f64) -> f64 {
        self.rim + (1.0 - self.rim) * share
    }

    /// The place at an azimuth and `z`.
    pub fn place(&self, azimuth_rad: f64, z: f64) -> DVec3 {
        let out = if z < 0.0 { 1.0 } else { (1.0 - z * z).sqrt() };
        (DVec2::from_angle(azimuth_rad) * out).extend(z)
    }

    /// Outward unit normal at a place.
    pub fn normal(&self, place: DVec3) -> DVec3 {
        if self.has_wall() && place.z < 0.0 { place.with_z(0.0) } else { place }
    }

    /// The disc's point for a place.
    pub fn disc(&self, place: DVec3) -> DVec2 {
        if self.has_wall() && place.z < 0.0 {
            place.truncate() * ((1.0 - place.z).sqrt() / self.reach())
        } else {
            place.truncate() / (1.0 + place.z.max(0.0)).sqrt() / self.reach()
        }
    }

    /// The place of a point of the disc, radius at most 1.
    pub fn place_of_disc(&self, disc: DVec2) -> DVec3 {
        let reach = self.reach();
        let flat = disc * reach;
        let square = flat.length_squared().min(reach * reach);
        let z = if reach == 1.0 { 1.0 - square } else { (1.0 - square).max(self.rim) };
        if z < 0.0 {
            return flat.normalize_or_zero().extend(z);
        }
        (flat * (2.0 - square).sqrt()).extend(z)
    }
}

/// The grid over the disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DomeGrid {
    /// Nodes along each side.
    pub nodes: usize,
    /// The face that the disc shows.
    pub face: DomeFace,
}

impl DomeGrid {
    /// A grid with so many cells from rim to rim, at least 8.
    pub fn with_cells(cells: usize) -> Self {
        Self { nodes: cells.max(8) + 2 * PADDING + 1, face: DomeFace::HEMISPHERE }
    }

    /// The same grid over another face.
    pub fn over(self, face: DomeFace) -> Self {
        Self { face, ..self }
    }

    /// Cells from rim to rim.
    pub fn cells(&self) -> usize {
        self.nodes - 2 * PADDING - 1
    }

    /// Width of a cell in the disc of radius 1.
    pub fn cell(&self) -> f64 {
        2.0 / self.cells() as f64
    }

    /// Place of a node in the disc's plane.
    pub fn place(&self, column: usize, row: usize) -> DVec2 {
        let at = |i: usize| (i as f64 - PADDING as f64) * self.cell() - 1.0;
        DVec2::new(at(column), at(row))
    }

    /// Grid coordinates (in nodes) of a place of the face.
    pub fn coordinates(&self, place: DVec3) -> DVec2 {
        self.coordinates_of_disc(self.face.disc(place))
    }

    /// Grid coordinates of a place in the disc's plane.
    pub fn coordinates_of_disc(&self, disc: DVec2) -> DVec2 {
        (disc + 1.0) * (0.5 * self.cells() as f64) + PADDING as f64
    }

    /// Values at all nodes, row by row, of a function of the place; rows are shared among threads.
    ///
    /// A node beyond the rim, which no direction has, gets the parabola over the radius through the rim and two places
    /// inside continued. These are asked for at even azimuths, a cell apart along the rim; a cubic leads from
    /// one to the next. Where no look-up comes it gets zeros.
    pub fn fill_in_parallel<const K: usize>(
        &self,
        value: impl Fn(DVec3) -> [f64; K] + Sync,
    ) -> Vec<[f64; K]> {
        let azimuths = self.azimuths();
        let step = RIM_STEP * self.cell();
        let rim: Vec<[[f64; K]; 3]> = (0..azimuths)
            .into_par_iter()
            .map(|k| {
                let aside = DVec2::from_angle(std::f64::consts::TAU * k as f64 / azimuths as f64);
                [1.0, 1.0 - step, 1.0 - 2.0 * step]
                    .map(|radius| value(self.face.place_of_disc(aside * radius)))
            })
            .collect();
        let node = |i: usize| {
            let place = self.place(i % self.nodes, i / self.nodes);
            if place.length() <= 1.0 {
                return value(self.face.place_of_disc(place));
            }
            if !self.is_beside(place.length()) { [0.0; K] } else { beyond(&rim, place, step) }
        };
        (0..self.nodes * self.nodes).into_par_iter().map(node).collect()
    }

    /// A table over the grid with half as wide cells. Where the cubic through this grid's nodes and the straight line between them
    /// differ too much, `value` is asked; elsewhere the cubic serves. Gives the number of times that it was asked besides.
    pub fn halved_in_parallel<const K: usize>(
        &self,
        table: &[[f64; K]],
        differ: impl Fn(&[f64; K], &[f64; K]) -> bool + Sync,
        value: impl Fn(DVec3) -> [f64; K] + Sync,
    ) -> (Self, Vec<[f64; K]>, u64) {
        let half = Self::with_cells(2 * self.cells()).over(self.face);
        let asked = AtomicU64::new(0);
        let found = half.fill_in_parallel(|place| {
            let at = self.coordinates(place);
            let cubic = bicubic(self, table, at);
            if !differ(&cubic, &bilinear(self, table, at)) {
                return cubic;
            }
            asked.fetch_add(1, Ordering::Relaxed);
            value(place)
        });
        (half, found, asked.into_inner())
    }

    /// Azimuths at which the rim is asked for.
    fn azimuths(&self) -> usize {
        (std::f64::consts::TAU / self.cell()).ceil() as usize
    }

    /// Whether a look-up inside the disc may ask for a node so far from the middle.
    fn is_beside(&self, radius: f64) -> bool {
        radius <= 1.0 + 2.0 * std::f64::consts::SQRT_2 * self.cell()
    }

    /// How often [`DomeGrid::fill_in_parallel`] calls its function.
    pub fn evaluations(&self) -> u64 {
        let nodes = (0..self.nodes).flat_map(|row| (0..self.nodes).map(move |column| (column, row)));
        let inside = nodes.filter(|(column, row)| self.place(*column, *row).length() <= 1.0).count();
        (inside + 3 * self.azimuths()) as u64
    }
}

/// Distance of the three places over the radius that continue a table beyond the rim, cells.
const RIM_STEP: f64 = 1.0;

/// The parabola over the radius from the rim's values, at a place beyond the rim.
fn beyond<const K: usize>(rim: &[[[f64; K]; 3]], place: DVec2, step: f64) -> [f64; K] {
    let count = rim.len();
    let turn = (place.y.atan2(place.x) / std::f64::consts::TAU).rem_euclid(1.0) * count as f64;
    let (first, wide) = (turn as usize, weights(turn.fract()));
    // Newton's form of the parabola, from the rim outwards.
    let t = (place.length() - 1.0) / step;
    let along = [1.0 + t * (1.5 + 0.5 * t), -t * (2.0 + t), 0.5 * t * (1.0 + t)];
    let mut out = [0.0; K];
    for (i, across) in wide.iter().enumerate() {
        let Some(three) = rim.get((first + count + i - 1) % count) else { continue };
        for (values, along) in three.iter().zip(along) {
            for (sum, value) in out.iter_mut().zip(values) {
                *sum += across * along * value;
            }
        }
    }
    out
}

/// Bicubic look-up (Catmull and Rom's cubic, third order) in a table over a grid.
pub fn bicubic<const K: usize>(grid: &DomeGrid, table: &[[f64; K]], at: DVec2) -> [f64; K] {
    weighted(grid, table, at, weights)
}

/// Straight between the nodes around a place.
fn bilinear<const K: usize>(grid: &DomeGrid, table: &[[f64; K]], at: DVec2) -> [f64; K] {
    weighted(grid, table, at, |t| [0.0, 1.0 - t, t, 0.0])
}

fn weighted<const K: usize>(
    grid: &DomeGrid,
    table: &[[f64; K]],
    at: DVec2,
    weights: impl Fn(f64) -> [f64; 4],
) -> [f64; K] {
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
