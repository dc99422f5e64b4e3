//! What a force on one contact node does to every other, and to the whole surface.

use std::f64::consts::TAU;
use std::sync::{Arc, OnceLock};

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::between::NodePlaces;
use crate::body::BondedBody;
use crate::dome::{ElasticDome, FactorError};
use crate::grid::{Grid, GridNode};

/// Directions in a node's frame: r, z, phi.
const AXES: usize = 3;

/// Compliance of the bonded dome between contact nodes, and its spectrum for the field.
///
/// A ring's hat excites as many harmonics as it has nodes, so a touch near the pole needs few of them: each is solved when a
/// ring first asks for it.
#[derive(Debug, Clone)]
pub struct Compliance {
    /// The nodes that forces bear on.
    pub grid: Grid,
    /// Places between its nodes.
    pub places: NodePlaces,
    /// How many times the dome yields that the tables are of.
    yields: f64,
    tables: Arc<Tables>,
}

/// What is known of the dome so far.
#[derive(Debug)]
struct Tables {
    /// The dome and its elements, as text.
    of: String,
    elastic: ElasticDome,
    grid: Grid,
    body: BondedBody,
    hats: Vec<Vec<(usize, f64)>>,
    harmonics: Vec<OnceLock<Result<Harmonic, FactorError>>>,
    /// For ring pairs i >= j and azimuth steps 0..=azimuths/2: displacement at ring i for a force at ring j, the
    /// azimuth of i less that of j, row by row, mm/N.
    pairs: Vec<OnceLock<Vec<[f64; 9]>>>,
}

/// One harmonic's response.
#[derive(Debug)]
pub struct Harmonic {
    /// First ring that this harmonic reaches.
    pub first_ring: usize,
    /// Column by column, (ring - first_ring, direction): the surface nodes' three amplitudes, hats included, mm/N.
    pub columns: Vec<Vec<f64>>,
    /// What the rings see of each column with their own hats, column by column, mm/N.
    pub own: Vec<f64>,
}

impl Tables {
    fn harmonic(&self, m: usize) -> Option<&Result<Harmonic, FactorError>> {
        self.harmonics.get(m).map(|one| one.get_or_init(|| harmonic(&self.grid, &self.body, &self.hats, m)))
    }
}

impl Compliance {
    /// Assembles the dome's stiffness.
    ///
    /// # Errors
    /// A mesh too large for memory.
    pub fn new(elastomer: &ElasticDome, elements: usize) -> Result<Self, FactorError> {
        let grid = Grid::new(elastomer.dome, elements);
        let last = (0..grid.elements).map(|ring| grid.harmonics(ring)).max().unwrap_or(1);
        let tables = Tables {
            of: format!("{elastomer:?} {elements}"),
            elastic: *elastomer,
            body: BondedBody::new(elastomer, elements)?,
            hats: (0..grid.elements).map(|ring| grid.hat(ring)).collect(),
            harmonics: (0..last).map(|_| OnceLock::new()).collect(),
            pairs: (0..grid.elements * (grid.elements + 1) / 2).map(|_| OnceLock::new()).collect(),
            grid: grid.clone(),
        };
        Ok(Self { places: NodePlaces::new(&grid), grid, yields: 1.0, tables: Arc::new(tables) })
    }

    /// Factors the dome's stiffness for the harmonics of a ring, in parallel, as far as it was not done before. To be called
    /// before forces bear on a ring: a harmonic that has no factors answers with no displacement afterwards.
    ///
    /// # Errors
    /// A harmonic without factors.
    pub fn reach(&self, ring: usize) -> Result<(), FactorError> {
        let solved = |m: usize| match self.tables.harmonic(m) {
            Some(Err(error)) => Err(error.clone()),
            _ => Ok(()),
        };
        (0..self.grid.harmonics(ring)).into_par_iter().try_for_each(solved)
    }

    /// All that its numbers depend on, as text.
    pub fn key(&self) -> &str {
        &self.tables.of
    }

    /// The elastic body that it is of.
    pub fn elastic(&self) -> ElasticDome {
        let elastic = self.tables.elastic;
        ElasticDome { young_mpa: elastic.young_mpa / self.yields, ..elastic }
    }

    /// How many harmonics are solved.
    pub fn solved(&self) -> usize {
        self.tables.harmonics.iter().filter(|one| matches!(one.get(), Some(Ok(_)))).count()
    }

    /// The harmonics that are solved, as plain numbers: of each its own, then its columns one after the other, then what the rings see.
    pub fn numbers(&self) -> Vec<f64> {
        let mut numbers = Vec::new();
        for (m, one) in self.tables.harmonics.iter().enumerate() {
            if let Some(Ok(harmonic)) = one.get() {
                numbers.push(m as f64);
                numbers.extend(harmonic.columns.iter().flatten().chain(&harmonic.own));
            }
        }
        numbers
    }

    /// Takes harmonics as solved, from [`Compliance::numbers`] of the same dome; what does not fit is left out.
    pub fn take(&self, mut numbers: &[f64]) {
        let tables = &self.tables;
        while let Some((m, rest)) = numbers.split_first() {
            let m = *m as usize;
            let first_ring = first_ring(&self.grid, m);
            let columns = AXES * (self.grid.elements - first_ring);
            let height = AXES * surface_nodes(&self.grid);
            let (Some(cell), Some((values, rest))) =
                (tables.harmonics.get(m), rest.split_at_checked(columns * height))
            else {
                return;
            };
            let Some((own, rest)) = rest.split_at_checked(columns * columns) else { return };
            let columns = values.chunks_exact(height).map(<[f64]>::to_vec).collect();
            let _ = cell.set(Ok(Harmonic { first_ring, columns, own: own.to_vec() }));
            numbers = rest;
        }
    }

    /// The same of a dome that yields `factor` times as much.
    pub fn scaled(&self, factor: f64) -> Self {
        Self { yields: self.yields * factor, ..self.clone() }
    }

    /// The same dome, its nodes moved by forces on others (number; force in the node's frame, N) where `is_near` is true
    /// of their place at rest: there an object is looked at. The rest stays, for no node of it can be touched.
    pub fn displaced(&self, forces: &[(usize, DVec3)], is_near: impl Fn(DVec3) -> bool) -> Self {
        let mut grid = self.grid.clone();
        grid.offsets_mm.clear();
        let by: Vec<(GridNode, DVec3)> = forces.iter().map(|(number, f)| (grid.node(*number), *f)).collect();
        grid.offsets_mm = (0..grid.len())
            .map(|number| {
                let node = grid.node(number);
                if !is_near(grid.place(node)) {
                    return DVec3::ZERO;
                }
                let moved: DVec3 = by.iter().map(|(by, force)| self.between(node, *by) * *force).sum();
                grid.frame(node) * moved
            })
            .collect();
        Self { grid, ..self.clone() }
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
        let known =
            self.tables.pairs.get(pair).map(|known| known.get_or_init(|| self.tables.pair(at.ring, by.ring)));
        let e =
            known.and_then(|known| known.get(step)).map_or([0.0; 9], |e| e.map(|value| value * self.yields));
        // Mirrored azimuths turn the sign of what couples phi to the rest.
        DMat3::from_cols(
            DVec3::new(e[0], e[3], sign * e[6]),
            DVec3::new(e[1], e[4], sign * e[7]),
            DVec3::new(sign * e[2], sign * e[5], e[8]),
        )
    }

    /// A harmonic of the field, and by how much the dome yields to it: times its columns.
    pub(crate) fn harmonic(&self, m: usize) -> Option<(&Harmonic, f64)> {
        Some((self.tables.harmonic(m)?.as_ref().ok()?, self.yields))
    }
}

/// A ring's unit force along an axis in one harmonic, as parts of the surface nodes' (node, direction).
///
/// The pole is one node: it pushes along z in the harmonic 0 alone, and sideways in the harmonic 1 alone, where
/// the same force is half in u_r and half in -u_phi at every azimuth.
fn ring_load(
    grid: &Grid,
    hat: &[(usize, f64)],
    ring: usize,
    axis: usize,
    m: usize,
) -> Vec<((usize, usize), f64)> {
    if grid.harmonics(ring) <= m {
        return Vec::new();
    }
    let factor = grid.hat_harmonic(ring, m);
    let along =
        |direction: usize, factor: f64| hat.iter().map(move |(p, part)| ((*p, direction), part * factor));
    match (ring, axis, m) {
        (0, 1, 0) => along(1, 1.0).collect(),
        (0, 0 | 2, 1) => {
            let half = if axis == 0 { 0.5 } else { -0.5 };
            along(0, half).chain(along(2, -half)).collect()
        }
        (0, ..) => Vec::new(),
        _ => along(axis, factor).collect(),
    }
}

/// The first ring that a harmonic reaches; as many as there are where none does.
fn first_ring(grid: &Grid, m: usize) -> usize {
    (0..grid.elements).find(|ring| grid.harmonics(*ring) > m).unwrap_or(grid.elements)
}

/// Nodes of the mesh on the surface.
fn surface_nodes(grid: &Grid) -> usize {
    2 * grid.elements + 1
}

/// Solves one harmonic: the surface's response to every ring that has a hat, and the rings' own, hats included.
pub(crate) fn harmonic(
    grid: &Grid,
    body: &BondedBody,
    hats: &[Vec<(usize, f64)>],
    m: usize,
) -> Result<Harmonic, FactorError> {
    let first_ring = first_ring(grid, m);
    // Rings between that do not reach this harmonic have zero columns, and are rare.
    let rings = hats.len() - first_ring;
    let loads: Vec<Vec<((usize, usize), f64)>> = (0..AXES * rings)
        .map(|column| {
            let ring = first_ring + column / AXES;
            ring_load(grid, &hats[ring], ring, column % AXES, m)
        })
        .collect();
    let n = body.unknowns();
    let mut rhs = vec![0.0; n * AXES * rings];
    for (column, load) in loads.iter().enumerate() {
        for &((p, direction), part) in load {
            let (unknown, sign) = body.surface_unknown(p, direction);
            if body.lives(unknown, m) {
                rhs[column * n + unknown] += sign * part;
            }
        }
    }
    body.solve(m, &mut rhs)?;
    let surface = surface_nodes(grid);
    let mut columns = Vec::with_capacity(AXES * rings);
    for column in 0..AXES * rings {
        let mut values = Vec::with_capacity(AXES * surface);
        for p in 0..surface {
            for axis in 0..AXES {
                let (unknown, sign) = body.surface_unknown(p, axis);
                values.push(sign * rhs[column * n + unknown]);
            }
        }
        columns.push(values);
    }
    // What the rings see with their own hats.
    let mut own = Vec::with_capacity((AXES * rings).pow(2));
    for values in &columns {
        for load in &loads {
            own.push(load.iter().map(|&((p, direction), part)| part * values[AXES * p + direction]).sum());
        }
    }
    Ok(Harmonic { first_ring, columns, own })
}

impl Tables {
    /// Sums the harmonics of one pair of rings over the azimuth steps.
    fn pair(&self, i: usize, j: usize) -> Vec<[f64; 9]> {
        let grid = &self.grid;
        let waves: Vec<(f64, f64)> = (0..grid.azimuths)
            .map(|k| {
                let (sine, cosine) = (TAU * k as f64 / grid.azimuths as f64).sin_cos();
                (cosine, sine)
            })
            .collect();
        let mut entries = vec![[0.0; 9]; grid.azimuths / 2 + 1];
        // Beyond the coarser ring's harmonics nothing couples them.
        for m in 0..grid.harmonics(i).min(grid.harmonics(j)) {
            let Some(Ok(harmonic)) = self.harmonic(m) else { continue };
            let rings = AXES * (grid.elements - harmonic.first_ring);
            let (a, b) = (AXES * (i - harmonic.first_ring), AXES * (j - harmonic.first_ring));
            let g: [f64; 9] = std::array::from_fn(|e| harmonic.own[(b + e % 3) * rings + a + e / 3]);
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
        entries
    }
}
