//! A closed mesh cut by a plane: the outlines of the cut.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::TriMesh;

/// A plane with axes of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CuttingPlane {
    /// A point of it, mm; the origin of its axes.
    pub origin_mm: DVec3,
    /// Its first axis, a unit vector.
    pub right: DVec3,
    /// Its second axis, a unit vector at right angles to the first.
    pub up: DVec3,
}

impl CuttingPlane {
    /// A point's coordinates along the two axes.
    pub fn flat_mm(&self, point_mm: DVec3) -> DVec2 {
        let from = point_mm - self.origin_mm;
        DVec2::new(from.dot(self.right), from.dot(self.up))
    }

    /// Height of a point over the plane, mm.
    pub fn height_mm(&self, point_mm: DVec3) -> f64 {
        (point_mm - self.origin_mm).dot(self.right.cross(self.up))
    }
}

impl TriMesh {
    /// The closed outlines in which a plane cuts the surface, in the plane's coordinates, mm. Material is where an
    /// odd number of them lies round a point. A corner that lies in the plane counts as above it, so that every
    /// outline of a closed mesh closes; one that does not, of an open mesh, is left out.
    ///
    /// ```
    /// use domecast_mesh::{Chord, CuttingPlane, Fit, Shape};
    /// use glam::DVec3;
    ///
    /// let peg = Shape::cylinder(2.0, 0.0, 5.0, Fit::Area).triangulate("peg", Chord::new(0.01)?)?;
    /// let upright = CuttingPlane { origin_mm: DVec3::ZERO, right: DVec3::X, up: DVec3::Z };
    /// let cut = peg.outlines(&upright);
    /// assert_eq!(cut.len(), 1);
    /// assert!(cut[0].iter().all(|p| p.x.abs() < 2.01 && (0.0..=5.0).contains(&p.y)));
    /// # Ok::<(), domecast_mesh::MeshError>(())
    /// ```
    pub fn outlines(&self, plane: &CuttingPlane) -> Vec<Vec<DVec2>> {
        let heights: Vec<f64> = self.vertices_mm.iter().map(|&v| plane.height_mm(v)).collect();
        let is_above = |i: u32| heights.get(i as usize).is_some_and(|h| *h >= 0.0);
        // From the edge where the cut enters a triangle to the one where it leaves it.
        let mut next: HashMap<(u32, u32), (u32, u32)> = HashMap::new();
        let mut order = Vec::new();
        let key = |a: u32, b: u32| (a.min(b), a.max(b));
        for &[a, b, c] in &self.triangles {
            let (mut enter, mut leave) = (None, None);
            for (p, q) in [(a, b), (b, c), (c, a)] {
                match (is_above(p), is_above(q)) {
                    (true, false) => enter = Some(key(p, q)),
                    (false, true) => leave = Some(key(p, q)),
                    _ => {}
                }
            }
            if let (Some(enter), Some(leave)) = (enter, leave) {
                next.insert(enter, leave);
                order.push(enter);
            }
        }
        let point = |(a, b): (u32, u32)| {
            let (p, q) = (self.vertices_mm.get(a as usize)?, self.vertices_mm.get(b as usize)?);
            let (low, high) = (*heights.get(a as usize)?, *heights.get(b as usize)?);
            Some(plane.flat_mm(p.lerp(*q, low / (low - high))))
        };
        let mut outlines = Vec::new();
        for start in order {
            let (mut at, mut outline) = (start, Vec::new());
            while let Some(to) = next.remove(&at) {
                outline.extend(point(at));
                at = to;
            }
            if at == start && outline.len() >= 3 {
                outlines.push(outline);
            }
        }
        outlines
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Chord, Fit, Piece, Shape, Solid};

    fn area(outline: &[DVec2]) -> f64 {
        let next = outline.iter().cycle().skip(1);
        0.5 * outline.iter().zip(next).map(|(p, q)| p.perp_dot(*q)).sum::<f64>()
    }

    const UPRIGHT: CuttingPlane = CuttingPlane { origin_mm: DVec3::ZERO, right: DVec3::X, up: DVec3::Z };

    #[test]
    fn a_bored_block_is_cut_in_two() {
        let chord = Chord::new(0.001).unwrap();
        let block = Piece::new("block", Shape::cuboid(DVec3::splat(-3.0), DVec3::splat(3.0)));
        let bore = Piece::new("bore", Shape::cylinder(1.0, -4.0, 4.0, Fit::Area));
        let solid = block.solid(chord).unwrap().difference(&bore.solid(chord).unwrap()).unwrap();
        let mesh = solid.to_mesh();
        let cut = mesh.outlines(&UPRIGHT);
        assert_eq!(cut.len(), 2);
        let sum: f64 = cut.iter().map(|o| area(o).abs()).sum();
        assert!((sum - 24.0).abs() < 0.02, "{sum}");
        // Through the corners of the polygons and through the block's own faces: every outline closes.
        for y in [-3.0, -1.0, 0.5, 1.0, 3.0] {
            let plane = CuttingPlane { origin_mm: DVec3::Y * y, ..UPRIGHT };
            let sum: f64 = mesh.outlines(&plane).iter().map(|o| area(o)).sum::<f64>().abs();
            let hole = 2.0 * (1.0 - y * y).max(0.0).sqrt() * 6.0;
            // A face that lies in the plane belongs to one side of it.
            let is_end = y.abs() == 3.0;
            assert!((sum - (36.0 - hole)).abs() < 0.3 || (is_end && sum == 0.0), "{y}: {sum}");
        }
    }

    #[test]
    fn beside_the_mesh_there_is_nothing() {
        let solid: Solid = Piece::new("block", Shape::cuboid(DVec3::ZERO, DVec3::ONE))
            .solid(Chord::new(0.1).unwrap())
            .unwrap();
        let plane = CuttingPlane { origin_mm: DVec3::Y * 2.0, ..UPRIGHT };
        assert!(solid.to_mesh().outlines(&plane).is_empty());
    }
}
