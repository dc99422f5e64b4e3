//! Places of the surface halfway between neighbouring nodes: there an object finer than the nodes is met.
//!
//! On a ring they lie between its nodes, between two rings at the azimuths of the nodes. What lies in the middle of four
//! nodes is the mean of such places, and would only say again what they say.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::grid::Grid;

/// Rows of places to a ring of nodes.
const FINER: usize = 2;

/// The places of a grid, numbered after its nodes.
#[derive(Debug, Clone)]
pub struct NodePlaces {
    /// Places of each row, and the number of its first; an even row lies on a ring of nodes and has the places between
    /// them.
    counts: Vec<usize>,
    first: Vec<usize>,
}

/// Nodes with their shares of a node or place: at most four.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodeParts {
    list: [(usize, f64); 4],
    len: usize,
}

impl NodeParts {
    /// A node itself.
    pub fn whole(number: usize) -> Self {
        Self { list: [(number, 1.0), (0, 0.0), (0, 0.0), (0, 0.0)], len: 1 }
    }

    fn none() -> Self {
        Self { list: [(0, 0.0); 4], len: 0 }
    }

    fn add(&mut self, number: usize, share: f64) {
        if let Some((_, sum)) = self.list[..self.len].iter_mut().find(|(known, _)| *known == number) {
            *sum += share;
        } else if share > 0.0
            && let Some(free) = self.list.get_mut(self.len)
        {
            *free = (number, share);
            self.len += 1;
        }
    }

    /// With other numbers.
    pub fn map(self, other: impl Fn((usize, f64)) -> (usize, f64)) -> Self {
        Self { list: self.list.map(other), len: self.len }
    }

    /// Numbers of nodes with their shares.
    pub fn as_slice(&self) -> &[(usize, f64)] {
        &self.list[..self.len]
    }
}

/// One row of places.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Number of its first place, and how many there are.
    pub first: usize,
    /// Its places.
    pub count: usize,
    /// Their distance, mm.
    pub step_mm: f64,
    /// The surface that each stands for among the places, mm2.
    pub area_mm2: f64,
}

impl NodePlaces {
    /// Of a grid.
    pub fn new(grid: &Grid) -> Self {
        let (mut counts, mut first, mut next) = (Vec::new(), Vec::new(), grid.len());
        for row in 0..FINER * grid.elements {
            let ring = row / FINER;
            let count = match (row % FINER, ring) {
                (0, 0) => 0,
                (0, _) => grid.counts[ring],
                _ => grid.counts[ring].max(grid.counts.get(ring + 1).copied().unwrap_or(0)),
            };
            counts.push(count);
            first.push(next);
            next += count;
        }
        Self { counts, first }
    }

    /// The rows with their places.
    pub fn rows<'g>(&'g self, grid: &'g Grid) -> impl Iterator<Item = Row> + 'g {
        let band_mm = grid.spacing_mm() / FINER as f64;
        self.counts.iter().zip(&self.first).enumerate().map(move |(row, (&count, &first))| {
            let around_mm = grid.dome.ring_radius_mm(meridian_rad(grid, row)) * TAU;
            let step_mm = if count > 0 { around_mm / count as f64 } else { 0.0 };
            Row { first, count, step_mm, area_mm2: step_mm * band_mm }
        })
    }

    /// Row, length of the meridian over the radius and azimuth of a number beyond the nodes'.
    fn angles(&self, grid: &Grid, number: usize) -> (usize, f64, f64) {
        let row = self.first.partition_point(|first| *first <= number).saturating_sub(1);
        let count = self.counts.get(row).copied().unwrap_or(1).max(1) as f64;
        let along = (number - self.first.get(row).copied().unwrap_or(number)) as f64;
        // On a ring the nodes lie at the whole steps.
        let along = if row % FINER == 0 { along + 0.5 } else { along };
        (row, meridian_rad(grid, row), TAU * along / count)
    }

    /// Where a node or a place lies on the dome, mm.
    pub fn place(&self, grid: &Grid, number: usize) -> DVec3 {
        if number < grid.len() {
            return grid.place(grid.node(number));
        }
        let (_, meridian_rad, azimuth) = self.angles(grid, number);
        let at_rest = grid.dome.point_mm(meridian_rad, azimuth);
        if grid.offsets_mm.is_empty() {
            return at_rest;
        }
        let parts = self.parts(grid, number);
        at_rest + parts.as_slice().iter().map(|(node, share)| grid.offset(*node) * *share).sum::<DVec3>()
    }

    /// The nodes that tell what a place moves by, with their shares: bilinear, towards zero at the bonded rim. A force
    /// on the place is shared out alike.
    pub fn parts(&self, grid: &Grid, number: usize) -> NodeParts {
        if number < grid.len() {
            return NodeParts::whole(number);
        }
        let (row, _, azimuth) = self.angles(grid, number);
        let (ring, over) = (row / FINER, (row % FINER) as f64 / FINER as f64);
        let mut parts = NodeParts::none();
        for (ring, weight) in [(ring, 1.0 - over), (ring + 1, over)] {
            let Some(&count) = grid.counts.get(ring).filter(|_| weight > 0.0) else { continue };
            let along = azimuth / TAU * count as f64;
            let (at, part) = (along.floor(), along - along.floor());
            for (step, share) in [(at as usize, 1.0 - part), (at as usize + 1, part)] {
                parts.add(grid.first[ring] + step % count, weight * share);
            }
        }
        parts
    }
}

fn meridian_rad(grid: &Grid, row: usize) -> f64 {
    grid.dome.meridian_end_rad() * row as f64 / (FINER * grid.elements) as f64
}
