//! The body's forces and its sparse tangent, factored.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::element::{Element, Material, NODES};
use super::mesh::Mesh;
use crate::error::ContactError;
use domecast_elastic::{Cholesky, Elimination, FactorError, Factors};

/// A meshed body with the pattern of its matrix.
#[derive(Debug)]
pub(crate) struct Body {
    pub mesh: Mesh,
    pub material: Material,
    elements: Vec<Element>,
    /// By node: the nodes from itself on that it shares an element with.
    neighbours: Vec<Vec<u32>>,
    cholesky: Cholesky,
}

/// The lower triangle of a symmetric matrix of the body's pattern.
#[derive(Debug, Clone)]
pub(crate) struct Tangent(Vec<f64>);

impl Body {
    /// Of a mesh.
    ///
    /// # Errors
    /// [`ContactError::Factorisation`] for a mesh with elements inside out, or a pattern too large for memory.
    pub fn new(mesh: Mesh, material: Material) -> Result<Self, ContactError> {
        let fault = |why: String| ContactError::from(FactorError(why));
        let elements: Option<Vec<Element>> = mesh
            .elements
            .iter()
            .map(|nodes| Element::new(&nodes.map(|n| mesh.nodes_mm[n as usize])))
            .collect();
        let elements = elements.ok_or_else(|| fault("an element is inside out".into()))?;
        let mut neighbours: Vec<Vec<u32>> = (0..mesh.nodes_mm.len() as u32).map(|n| vec![n]).collect();
        for nodes in &mesh.elements {
            for &node in nodes {
                neighbours[node as usize].extend(nodes.iter().filter(|other| **other > node));
            }
        }
        let (mut columns, mut rows) = (vec![0], Vec::new());
        for list in &mut neighbours {
            list.sort_unstable();
            list.dedup();
            for direction in 0..3 {
                let first = 3 * list[0] as usize + direction;
                rows.extend(
                    list.iter().flat_map(|n| 3 * *n as usize..3 * *n as usize + 3).filter(|r| *r >= first),
                );
                columns.push(rows.len());
            }
        }
        // The mesh has numbered its nodes already.
        let cholesky = Cholesky::new(columns, rows, Elimination::AsNumbered)?;
        Ok(Self { mesh, material, elements, neighbours, cholesky })
    }

    /// Unknowns, those on the base among them.
    pub fn unknowns(&self) -> usize {
        3 * self.mesh.nodes_mm.len()
    }

    /// Multiplications of one factorisation, about.
    pub fn factor_work(&self) -> f64 {
        let filled = self.cholesky.filled() as f64;
        filled * filled / self.unknowns() as f64
    }

    /// Inner forces by node, N; `None` if an element turns inside out.
    pub fn forces_n(&self, displaced_mm: &[DVec3]) -> Option<Vec<DVec3>> {
        self.add_up(displaced_mm, None)
    }

    /// Inner forces and their tangent.
    pub fn linearised(&self, displaced_mm: &[DVec3]) -> Option<(Vec<DVec3>, Tangent)> {
        let mut tangent = Tangent(vec![0.0; self.cholesky.rows().len()]);
        let forces = self.add_up(displaced_mm, Some(&mut tangent))?;
        Some((forces, tangent))
    }

    fn add_up(&self, displaced_mm: &[DVec3], mut tangent: Option<&mut Tangent>) -> Option<Vec<DVec3>> {
        /// Elements that are held at a time.
        const CHUNK: usize = 128;
        let mut forces = vec![DVec3::ZERO; self.mesh.nodes_mm.len()];
        let whole = tangent.is_some();
        for (elements, nodes) in self.elements.chunks(CHUNK).zip(self.mesh.elements.chunks(CHUNK)) {
            let answers: Vec<_> = elements
                .par_iter()
                .zip(nodes)
                .map(|(element, nodes)| {
                    element.answer(&nodes.map(|n| displaced_mm[n as usize]), self.material, whole)
                })
                .collect();
            // One after the other, so that sums do not depend on threads.
            for (answer, nodes) in answers.into_iter().zip(nodes) {
                let answer = answer?;
                for (node, force) in nodes.iter().zip(answer.forces_n) {
                    forces[*node as usize] += force;
                }
                let Some(tangent) = tangent.as_deref_mut() else { continue };
                for a in 0..NODES {
                    for b in 0..=a {
                        self.add(tangent, nodes[a], nodes[b], &answer.tangent[a * NODES + b]);
                    }
                }
            }
        }
        Some(forces)
    }

    /// Adds the block of two nodes, of which one half of the symmetric pair is given.
    pub fn add(&self, tangent: &mut Tangent, a: u32, b: u32, block: &DMat3) {
        let (row, column, block) = if a >= b { (a, b, *block) } else { (b, a, block.transpose()) };
        let Ok(rank) = self.neighbours[column as usize].binary_search(&row) else { return };
        for d in 0..3 {
            let start = self.cholesky.columns()[3 * column as usize + d];
            let values = block.col(d).to_array();
            if rank == 0 {
                tangent.0[start..start + 3 - d].iter_mut().zip(&values[d..]).for_each(|(to, v)| *to += v);
            } else {
                let at = start + 3 * rank - d;
                tangent.0[at..at + 3].iter_mut().zip(&values).for_each(|(to, v)| *to += v);
            }
        }
    }

    /// Takes the base's unknowns out.
    pub fn hold_base(&self, tangent: &mut Tangent) {
        for column in 0..self.unknowns() {
            let held = self.mesh.is_base[column / 3];
            for at in self.cholesky.columns()[column]..self.cholesky.columns()[column + 1] {
                let row = self.cholesky.rows()[at];
                if held || self.mesh.is_base[row / 3] {
                    tangent.0[at] = if row == column {
                        self.material.shear_mpa * self.mesh.grading.radius_mm
                    } else {
                        0.0
                    };
                }
            }
        }
    }

    /// Factors a tangent; `None` where it is not positive definite.
    pub fn factor(&self, tangent: &Tangent) -> Option<Factors> {
        self.cholesky.factor(&tangent.0).ok()
    }

    /// Solves in place; not a number where memory is short.
    pub fn solve(&self, factors: &Factors, rhs: &mut [f64]) {
        if self.cholesky.solve(factors, rhs).is_err() {
            rhs.fill(f64::NAN);
        }
    }

    /// The tangent times a vector.
    pub fn times(&self, tangent: &Tangent, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        for column in 0..x.len() {
            let range = self.cholesky.columns()[column]..self.cholesky.columns()[column + 1];
            let own = x[column];
            let mut sum = 0.0;
            for (row, value) in self.cholesky.rows()[range.clone()].iter().zip(&tangent.0[range]) {
                y[*row] += value * own;
                if *row != column {
                    sum += value * x[*row];
                }
            }
            y[column] += sum;
        }
        y
    }
}
