//! Closed meshes as solids of truck with flat faces.

use std::collections::HashMap;

use truck_modeling::{Edge, Face, Plane, Shell, Wire, builder};

use crate::TriMesh;
use crate::exact::point;

impl TriMesh {
    /// The closed mesh as a solid with one flat face for each triangle: for what cannot be built with exact faces.
    /// Triangles without an area are left out.
    pub fn faceted_solid(&self) -> truck_modeling::Solid {
        let vertices: Vec<_> = self.vertices_mm.iter().map(|p| builder::vertex(point(*p))).collect();
        let mut edges: HashMap<(u32, u32), Edge> = HashMap::with_capacity(self.triangles.len() * 3 / 2);
        let mut shell = Shell::with_capacity(self.triangles.len());
        for (triangle, corners) in self.triangles.iter().zip(self.iter_mm()) {
            let [a, b, c] = corners;
            if (b - a).cross(c - a).try_normalize().is_none() {
                continue;
            }
            let sides = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| {
                let (from, to) = (triangle[i], triangle[j]);
                let (low, high) = (from.min(to), from.max(to));
                let edge = edges
                    .entry((low, high))
                    .or_insert_with(|| builder::line(&vertices[low as usize], &vertices[high as usize]));
                if from == low { edge.clone() } else { edge.inverse() }
            });
            let [a, b, c] = corners.map(point);
            shell.push(Face::new_unchecked(vec![Wire::from(sides.to_vec())], Plane::new(a, b, c).into()));
        }
        truck_modeling::Solid::new_unchecked(vec![shell])
    }
}
