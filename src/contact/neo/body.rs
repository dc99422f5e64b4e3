//! The bonded dome of bricks: residual, tangent and its factors.

use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Mat, Side};
use glam::DVec3;

use super::super::sparse::lower_triangle;
use super::brick::{DOFS, Point, points, respond};
use super::mesh::Bricks;
use crate::{ContactError, Elastomer};

/// The dome of bricks.
#[derive(Debug)]
pub(crate) struct Body {
    pub(super) mesh: Bricks,
    points: Vec<[Point; 8]>,
    /// Nodes on the bonded base.
    fixed: Vec<bool>,
    columns: Vec<usize>,
    rows: Vec<usize>,
    symbolic: SymbolicLlt<usize>,
    shear_mpa: f64,
    bulk_mpa: f64,
}

impl Body {
    pub fn new(elastomer: &Elastomer, half: usize) -> Result<Self, ContactError> {
        let mesh = Bricks::new(elastomer.dome_radius_mm, half);
        let bad = || ContactError::Factorisation("a brick is inside out at rest".into());
        let points = mesh
            .bricks
            .iter()
            .map(|brick| points(&brick.map(|n| mesh.nodes_mm[n as usize])).ok_or_else(bad))
            .collect::<Result<Vec<_>, _>>()?;
        let fixed: Vec<bool> = mesh.nodes_mm.iter().map(|p| p.z <= 1e-9 * elastomer.dome_radius_mm).collect();
        let (columns, rows) = pattern(&mesh);
        let n = 3 * mesh.nodes_mm.len();
        let view = SymbolicSparseColMatRef::new_checked(n, n, &columns, None, &rows);
        let symbolic = SymbolicLlt::try_new(view, Side::Lower)
            .map_err(|error| ContactError::Factorisation(format!("{error:?}")))?;
        Ok(Self {
            mesh,
            points,
            fixed,
            columns,
            rows,
            symbolic,
            shear_mpa: elastomer.shear_mpa(),
            bulk_mpa: elastomer.young_mpa / (3.0 * (1.0 - 2.0 * elastomer.poisson)),
        })
    }

    pub fn nodes(&self) -> usize {
        self.mesh.nodes_mm.len()
    }

    pub fn is_fixed(&self, node: usize) -> bool {
        self.fixed[node]
    }

    /// Entries of the tangent, for the count of work.
    pub fn entries(&self) -> usize {
        self.rows.len()
    }

    /// Forces of the elements on the nodes at a displacement, N; `None` where a brick has turned inside out.
    pub(super) fn inner(&self, u_mm: &[DVec3]) -> Option<Vec<DVec3>> {
        let mut force_n = vec![DVec3::ZERO; self.nodes()];
        for (brick, points) in self.mesh.bricks.iter().zip(&self.points) {
            let u = brick.map(|n| u_mm[n as usize]);
            let response = respond(points, &u, self.shear_mpa, self.bulk_mpa, false)?;
            for (node, force) in brick.iter().zip(response.force) {
                force_n[*node as usize] += force;
            }
        }
        Some(force_n)
    }

    /// Factors of the tangent at a displacement; `None` where it is not positive definite.
    pub fn factor(&self, u_mm: &[DVec3]) -> Option<Llt<usize, f64>> {
        let mut values = vec![0.0; self.rows.len()];
        for (brick, points) in self.mesh.bricks.iter().zip(&self.points) {
            let u = brick.map(|n| u_mm[n as usize]);
            let k = respond(points, &u, self.shear_mpa, self.bulk_mpa, true)?.stiffness?;
            for a in 0..DOFS {
                for b in 0..DOFS {
                    let (na, nb) = (brick[a / 3] as usize, brick[b / 3] as usize);
                    let (row, column) = (3 * na + a % 3, 3 * nb + b % 3);
                    if row < column || self.fixed[na] || self.fixed[nb] {
                        continue;
                    }
                    let range = self.columns[column]..self.columns[column + 1];
                    if let Ok(at) = self.rows[range].binary_search(&row) {
                        values[self.columns[column] + at] += k[(a, b)];
                    }
                }
            }
        }
        for (node, _) in self.fixed.iter().enumerate().filter(|(_, fixed)| **fixed) {
            for column in 3 * node..3 * node + 3 {
                values[self.columns[column]] = 1.0;
            }
        }
        let n = 3 * self.nodes();
        let view = SymbolicSparseColMatRef::new_checked(n, n, &self.columns, None, &self.rows);
        Llt::try_new_with_symbolic(self.symbolic.clone(), SparseColMatRef::new(view, &values), Side::Lower)
            .ok()
    }

    /// K^-1 times nodal columns.
    pub fn solve(factors: &Llt<usize, f64>, rhs: &mut Mat<f64>) {
        use faer::linalg::solvers::Solve;
        factors.solve_in_place(rhs.as_mut());
    }
}

/// Lower triangle's pattern, columns in order; the diagonal is each column's first entry.
fn pattern(mesh: &Bricks) -> (Vec<usize>, Vec<usize>) {
    let mut neighbours: Vec<Vec<usize>> = vec![Vec::new(); mesh.nodes_mm.len()];
    for brick in &mesh.bricks {
        for a in brick {
            neighbours[*a as usize].extend(brick.iter().map(|b| *b as usize));
        }
    }
    lower_triangle(neighbours)
}
