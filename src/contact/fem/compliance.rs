//! What a force on one contact node does to every other, and to the whole surface.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::between::Places;
use super::body::Body;
use super::grid::{Grid, GridNode};
use super::harmonics::harmonics;
use super::response::{AXES, Solved, Spectrum};
use crate::elastomer::Elastomer;
use crate::error::ContactError;

/// Compliance of the bonded dome between contact nodes, and its spectrum for the field.
#[derive(Debug)]
pub(crate) struct Compliance {
    pub grid: Grid,
    /// Places between its nodes.
    pub places: Places,
    /// For ring pairs i >= j and azimuth steps 0..=azimuths/2: displacement at ring i for a force at ring j, the
    /// azimuth of i less that of j, row by row, mm/N.
    table: Vec<[f64; 9]>,
    /// For each harmonic, displacements of the surface nodes for forces on the rings.
    spectrum: Vec<Spectrum>,
}

impl Compliance {
    /// Factors the dome's stiffness for every harmonic and solves it for every ring.
    pub fn new(elastomer: &Elastomer, elements: usize) -> Result<Self, ContactError> {
        let grid = Grid::new(elastomer.dome_radius_mm, elements);
        let body = Body::new(elastomer, elements)?;
        let last = (0..grid.elements).map(|ring| grid.harmonics(ring)).max().unwrap_or(1);
        let hats: Vec<Vec<(usize, f64)>> = (0..grid.elements).map(|ring| grid.hat(ring)).collect();
        let solved = harmonics(&grid, &body, &hats, last)?;
        let mut table = vec![[0.0; 9]; grid.elements * (grid.elements + 1) / 2 * (grid.azimuths / 2 + 1)];
        let steps = grid.azimuths / 2 + 1;
        table.par_chunks_mut(steps).enumerate().for_each(|(pair, entries)| {
            let (i, j) = rings_of(pair);
            fill_pair(&grid, &solved, i, j, entries);
        });
        let spectrum = solved.into_iter().map(|(spectrum, _)| spectrum).collect();
        let places = Places::new(&grid);
        Ok(Self { grid, places, table, spectrum })
    }

    /// Displacement at node `at` for a unit force at node `by`, each in its own frame (r, z, phi), mm/N.
    pub fn between(&self, at: GridNode, by: GridNode) -> DMat3 {
        if at.ring < by.ring {
            return self.between(by, at).transpose();
        }
        let n = self.grid.azimuths;
        let ahead = (at.step + n - by.step) % n;
        let (step, sign) = if 2 * ahead <= n { (ahead, 1.0) } else { (n - ahead, -1.0) };
        let pair = at.ring * (at.ring + 1) / 2 + by.ring;
        let e = &self.table[pair * (n / 2 + 1) + step];
        // Mirrored azimuths turn the sign of what couples phi to the rest.
        DMat3::from_cols(
            DVec3::new(e[0], e[3], sign * e[6]),
            DVec3::new(e[1], e[4], sign * e[7]),
            DVec3::new(sign * e[2], sign * e[5], e[8]),
        )
    }

    /// Harmonics of the field.
    pub fn spectrum(&self) -> &[Spectrum] {
        &self.spectrum
    }
}

/// Pair number to rings i >= j.
fn rings_of(pair: usize) -> (usize, usize) {
    let mut i = ((((8 * pair + 1) as f64).sqrt() - 1.0) / 2.0) as usize;
    while i * (i + 1) / 2 > pair {
        i -= 1;
    }
    while (i + 1) * (i + 2) / 2 <= pair {
        i += 1;
    }
    (i, pair - i * (i + 1) / 2)
}

/// Sums the harmonics of one pair of rings over the azimuth steps.
fn fill_pair(grid: &Grid, solved: &[Solved], i: usize, j: usize, entries: &mut [[f64; 9]]) {
    let waves: Vec<(f64, f64)> = (0..grid.azimuths)
        .map(|k| {
            let (sine, cosine) = (TAU * k as f64 / grid.azimuths as f64).sin_cos();
            (cosine, sine)
        })
        .collect();
    for (m, (spectrum, own)) in solved.iter().enumerate() {
        if i < spectrum.first_ring || j < spectrum.first_ring {
            continue;
        }
        let rings = AXES * (grid.elements - spectrum.first_ring);
        let (a, b) = (AXES * (i - spectrum.first_ring), AXES * (j - spectrum.first_ring));
        let g: [f64; 9] = std::array::from_fn(|e| own[(b + e % 3) * rings + a + e / 3]);
        if g.iter().all(|v| *v == 0.0) {
            continue;
        }
        for (step, entry) in entries.iter_mut().enumerate() {
            let (cosine, sine) = waves[m * step % grid.azimuths];
            for row in 0..3 {
                for column in 0..3 {
                    let e = 3 * row + column;
                    // r, z even; phi odd. A force along phi is the other family, with u_phi = -U_phi cos.
                    let wave = match (row == 2, column == 2) {
                        (false, false) | (true, true) => cosine,
                        (true, false) => sine,
                        (false, true) => -sine,
                    };
                    entry[e] += g[e] * wave;
                }
            }
        }
    }
}
