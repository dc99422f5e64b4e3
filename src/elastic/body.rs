//! The dome's stiffness, harmonic by harmonic, and its factors.

use std::f64::consts::PI;

use crate::cholesky::{Cholesky, Elimination};
use crate::dome::{ElasticDome, FactorError};
use crate::element::{DOFS, stiffness};
use crate::mesh::Meridian;

/// The swept dome: a mesh, and the pattern and values of K0, K1, K2.
#[derive(Debug)]
pub struct BondedBody {
    pub(crate) mesh: Meridian,
    cholesky: Cholesky,
    values: [Vec<f64>; 3],
    /// What each unknown is at each harmonic.
    kinds: Vec<Kind>,
}

/// Where an unknown lives.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Free,
    /// On the bonded base, or a hanging node that has no unknown of its own.
    Never,
    /// On the axis: alive in this harmonic only.
    Only(usize),
}

impl BondedBody {
    /// Assembles the dome.
    pub fn new(elastomer: &ElasticDome, elements: usize) -> Result<Self, FactorError> {
        let mesh = Meridian::new(elastomer.dome, elements);
        let nodes = mesh.nodes_mm.len();
        let mut kinds = vec![Kind::Free; 3 * nodes];
        for &node in &mesh.axis {
            // On the axis the unknowns are z, and half sum s and half difference d of r and -phi: a sideways
            // motion is u_r = s cos, u_phi = -s sin, the only one besides z that a smooth field has there.
            let node = 3 * node as usize;
            kinds[node] = Kind::Only(1);
            kinds[node + 1] = Kind::Only(0);
            kinds[node + 2] = Kind::Never;
        }
        for node in mesh.base.iter().chain(mesh.hanging.iter().map(|(node, _)| node)) {
            kinds[3 * *node as usize..][..3].fill(Kind::Never);
        }
        let masters = masters_of(&mesh);
        let (columns, rows) = pattern(&mesh, &masters);
        let mut values = [vec![0.0; rows.len()], vec![0.0; rows.len()], vec![0.0; rows.len()]];
        let bulk_mpa = elastomer.young_mpa / (3.0 * (1.0 - 2.0 * elastomer.poisson));
        let on_axis: Vec<bool> = (0..nodes).map(|n| mesh.nodes_mm[n].x.abs() <= f64::EPSILON).collect();
        for element in &mesh.elements {
            let places = element.map(|node| mesh.nodes_mm[node as usize]);
            let parts = stiffness(places, elastomer.shear_mpa(), bulk_mpa);
            let expansion = expand(element, &masters, &on_axis);
            for (part, values) in parts.iter().zip(&mut values) {
                for (a, list_a) in expansion.iter().enumerate() {
                    for (b, list_b) in expansion.iter().enumerate() {
                        let k = part[(a, b)];
                        if k == 0.0 {
                            continue;
                        }
                        for &(i, wi) in list_a {
                            for &(j, wj) in list_b {
                                // The lower triangle is enough.
                                if i >= j
                                    && let Ok(at) = rows[columns[j]..columns[j + 1]].binary_search(&i)
                                {
                                    values[columns[j] + at] += wi * wj * k;
                                }
                            }
                        }
                    }
                }
            }
        }
        let cholesky = Cholesky::new(columns, rows, Elimination::MinimumDegree)?;
        Ok(Self { mesh, cholesky, values, kinds })
    }

    /// Unknowns of one harmonic.
    pub fn unknowns(&self) -> usize {
        self.kinds.len()
    }

    /// Whether a harmonic has an unknown.
    pub(crate) fn lives(&self, unknown: usize, m: usize) -> bool {
        match self.kinds[unknown] {
            Kind::Free => true,
            Kind::Never => false,
            Kind::Only(harmonic) => harmonic == m,
        }
    }

    /// K0 + m K1 + m^2 K2 over the sweep, dead unknowns replaced by ones on the diagonal.
    fn matrix(&self, m: usize) -> Vec<f64> {
        let sweep = if m == 0 { 2.0 * PI } else { PI };
        let h = m as f64;
        let (columns, rows) = (self.cholesky.columns(), self.cholesky.rows());
        let mut values = Vec::with_capacity(rows.len());
        for column in 0..self.unknowns() {
            let alive = self.lives(column, m);
            let range = columns[column]..columns[column + 1];
            for (at, &row) in range.clone().zip(&rows[range]) {
                values.push(if alive && self.lives(row, m) {
                    sweep * (self.values[0][at] + h * (self.values[1][at] + h * self.values[2][at]))
                } else {
                    f64::from(u8::from(row == column))
                });
            }
        }
        values
    }

    /// Solves one harmonic in place, for right sides one after the other.
    pub(crate) fn solve(&self, m: usize, rhs: &mut [f64]) -> Result<(), FactorError> {
        let solved = self.cholesky.factor(&self.matrix(m));
        let solved = solved.and_then(|factors| self.cholesky.solve(&factors, rhs));
        solved.map_err(|FactorError(why)| FactorError(format!("harmonic {m}: {why}")))
    }

    /// The unknowns of surface node `p` in the direction r, z or phi (0, 1, 2), with weights.
    pub(crate) fn surface_unknown(&self, p: usize, direction: usize) -> (usize, f64) {
        let node = self.mesh.surface[p] as usize;
        // At the pole u_phi = -s.
        if p == 0 && direction == 2 { (3 * node, -1.0) } else { (3 * node + direction, 1.0) }
    }
}

/// For each node, the nodes with unknowns that it follows.
fn masters_of(mesh: &Meridian) -> Vec<Vec<(usize, f64)>> {
    let mut masters: Vec<Vec<(usize, f64)>> = (0..mesh.nodes_mm.len()).map(|n| vec![(n, 1.0)]).collect();
    for (node, list) in &mesh.hanging {
        masters[*node as usize] = list.iter().map(|(m, w)| (*m as usize, *w)).collect();
    }
    masters
}

/// For each of an element's displacements, the unknowns that it is the sum of.
fn expand(element: &[u32; 9], masters: &[Vec<(usize, f64)>], on_axis: &[bool]) -> Vec<Vec<(usize, f64)>> {
    let mut lists = Vec::with_capacity(DOFS);
    for node in element {
        for direction in 0..3 {
            let mut list = Vec::with_capacity(3);
            for &(master, weight) in &masters[*node as usize] {
                match (on_axis[master], direction) {
                    // u_r = s + d, u_phi = d - s.
                    (true, 0) => list.extend([(3 * master, weight), (3 * master + 2, weight)]),
                    (true, 2) => list.extend([(3 * master, -weight), (3 * master + 2, weight)]),
                    _ => list.push((3 * master + direction, weight)),
                }
            }
            lists.push(list);
        }
    }
    lists
}

/// Lower triangle's pattern, columns in order.
fn pattern(mesh: &Meridian, masters: &[Vec<(usize, f64)>]) -> (Vec<usize>, Vec<usize>) {
    let nodes = mesh.nodes_mm.len();
    let mut neighbours: Vec<Vec<usize>> = (0..nodes).map(|n| vec![n]).collect();
    for element in &mesh.elements {
        let all: Vec<usize> =
            element.iter().flat_map(|n| masters[*n as usize].iter().map(|(m, _)| *m)).collect();
        for &a in &all {
            neighbours[a].extend(&all);
        }
    }
    lower_triangle(neighbours)
}

/// Column starts and rows of the lower triangle, three unknowns a node, columns in order; `neighbours` are the nodes
/// that each node shares an element with, itself among them. The diagonal is each column's first entry.
fn lower_triangle(neighbours: Vec<Vec<usize>>) -> (Vec<usize>, Vec<usize>) {
    let (mut columns, mut rows) = (vec![0], Vec::new());
    for (node, mut list) in neighbours.into_iter().enumerate() {
        list.sort_unstable();
        list.dedup();
        for direction in 0..3 {
            let column = 3 * node + direction;
            rows.extend(list.iter().flat_map(|n| 3 * n..3 * n + 3).filter(|row| *row >= column));
            columns.push(rows.len());
        }
    }
    (columns, rows)
}
