//! Signed distance to a closed mesh.
//!
//! The nearest triangle is found in a tree of boxes; the sign is that of the angle-weighted pseudonormal of the
//! nearest face, edge or vertex (J. A. Baerentzen, H. Aanaes, Signed distance computation using the angle
//! weighted pseudonormal, IEEE TVCG 11(3), 2005), which is right for every closed manifold mesh.

use std::collections::BTreeMap;

use glam::DVec3;

use super::error::ContactError;
use super::solid::Distance;
use crate::mesh::{TriMesh, inspect};

/// A mesh prepared for distances.
#[derive(Debug)]
pub(super) struct MeshDistance {
    faces: Vec<Face>,
    nodes: Vec<Node>,
    vertices_mm: Vec<DVec3>,
    center_mm: DVec3,
    radius_mm: f64,
}

#[derive(Debug, Clone)]
struct Face {
    corners: [DVec3; 3],
    /// Pseudonormals: of the face, of the edges (0-1, 1-2, 2-0), of the corners.
    normal: DVec3,
    edges: [DVec3; 3],
    vertices: [DVec3; 3],
}

#[derive(Debug, Clone, Copy)]
struct Node {
    low: DVec3,
    high: DVec3,
    /// As in a tree laid out in order: a leaf holds faces `first..first + count`; a branch has `count` 0, its
    /// first child next to it and its second at `first`.
    first: u32,
    count: u32,
}

const LEAF: usize = 4;

impl MeshDistance {
    pub(super) fn new(mesh: &TriMesh) -> Result<Self, ContactError> {
        for vertex in &mesh.vertices_mm {
            if let Some(value) = vertex.to_array().into_iter().find(|v| v.is_nan() || v.abs() > 1e6) {
                let allowed = "finite, at most 1e6";
                return Err(ContactError::Dimension { field: "mesh.vertices_mm", value, allowed });
            }
        }
        let mesh = without_slivers(mesh);
        let found = inspect(&mesh);
        if found.triangles == 0 {
            return Err(ContactError::EmptyMesh);
        }
        let single = single_edges(&mesh);
        if single > 0 {
            return Err(ContactError::OpenMesh { edges: single });
        }
        if !found.is_closed() {
            let problem = found.problem().unwrap_or_else(|| "it is not closed".into());
            return Err(ContactError::NotManifold { problem });
        }
        if found.volume_mm3.is_nan() || found.volume_mm3 <= 0.0 {
            return Err(ContactError::InsideOut { volume_mm3: found.volume_mm3 });
        }
        let mut faces = faces_of(&mesh);
        let mut nodes = Vec::new();
        let count = faces.len();
        grow(&mut faces, 0, count, &mut nodes);
        let (center_mm, radius_mm) = nodes.first().map_or((DVec3::ZERO, 0.0), |root| {
            let center = 0.5 * (root.low + root.high);
            (center, mesh.vertices_mm.iter().map(|v| v.distance(center)).fold(0.0, f64::max))
        });
        Ok(Self { faces, nodes, vertices_mm: mesh.vertices_mm, center_mm, radius_mm })
    }

    pub(super) fn bounding_sphere(&self) -> (DVec3, f64) {
        (self.center_mm, self.radius_mm)
    }

    pub(super) fn support(&self, direction: DVec3) -> DVec3 {
        let farther = |a: &DVec3, b: &DVec3| a.dot(direction).total_cmp(&b.dot(direction));
        self.vertices_mm.iter().copied().max_by(farther).unwrap_or(self.center_mm)
    }

    pub(super) fn distance(&self, point: DVec3) -> Distance {
        let (mut best, mut nearest, mut normal) = (f64::INFINITY, point, DVec3::Z);
        let mut stack: Vec<(u32, f64)> = Vec::with_capacity(64);
        stack.push((0, 0.0));
        while let Some((index, reach)) = stack.pop() {
            let Some(node) = self.nodes.get(index as usize) else { continue };
            if reach >= best {
                continue;
            }
            if node.count == 0 {
                let (left, right) = (index + 1, node.first);
                let (a, b) = (self.box_distance2(left, point), self.box_distance2(right, point));
                // The nearer child is looked at first.
                if a < b {
                    stack.extend([(right, b), (left, a)]);
                } else {
                    stack.extend([(left, a), (right, b)]);
                }
                continue;
            }
            let range = node.first as usize..(node.first + node.count) as usize;
            for face in self.faces.get(range).unwrap_or_default() {
                let (at, pseudonormal) = face.nearest(point);
                let distance2 = at.distance_squared(point);
                if distance2 < best {
                    (best, nearest, normal) = (distance2, at, pseudonormal);
                }
            }
        }
        let away = point - nearest;
        let length = away.length();
        let sign = if away.dot(normal) < 0.0 { -1.0 } else { 1.0 };
        let outward = if length > 0.0 { away * (sign / length) } else { normal.normalize_or(DVec3::Z) };
        Distance { value_mm: sign * length, outward }
    }

    fn box_distance2(&self, index: u32, point: DVec3) -> f64 {
        self.nodes.get(index as usize).map_or(f64::INFINITY, |node| {
            (node.low - point).max(point - node.high).max(DVec3::ZERO).length_squared()
        })
    }
}

/// Welds equal vertices and drops triangles without area, which have no normal.
fn without_slivers(mesh: &TriMesh) -> TriMesh {
    let mut index: BTreeMap<[u64; 3], u32> = BTreeMap::new();
    let mut out = TriMesh::default();
    for corners in mesh.iter_mm() {
        let triangle = corners.map(|corner| {
            let key = (corner + DVec3::ZERO).to_array().map(f64::to_bits);
            *index.entry(key).or_insert_with(|| {
                out.vertices_mm.push(corner);
                (out.vertices_mm.len() - 1) as u32
            })
        });
        if triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0] {
            out.triangles.push(triangle);
        }
    }
    out
}

fn edges_of(triangle: [u32; 3]) -> [(u32, u32); 3] {
    let [a, b, c] = triangle;
    [(a, b), (b, c), (c, a)].map(|(a, b)| (a.min(b), a.max(b)))
}

fn single_edges(mesh: &TriMesh) -> usize {
    let mut uses: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for edge in mesh.triangles.iter().flat_map(|t| edges_of(*t)) {
        *uses.entry(edge).or_default() += 1;
    }
    uses.values().filter(|n| **n == 1).count()
}

fn faces_of(mesh: &TriMesh) -> Vec<Face> {
    let mut edges: BTreeMap<(u32, u32), DVec3> = BTreeMap::new();
    let mut vertices = vec![DVec3::ZERO; mesh.vertices_mm.len()];
    let corners = |t: [u32; 3]| t.map(|v| mesh.vertices_mm.get(v as usize).copied().unwrap_or_default());
    let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize_or_zero();
    for &triangle in &mesh.triangles {
        let points = corners(triangle);
        let n = normal(points);
        for edge in edges_of(triangle) {
            *edges.entry(edge).or_default() += n;
        }
        for k in 0..3 {
            let (u, v) = (points[(k + 1) % 3] - points[k], points[(k + 2) % 3] - points[k]);
            let angle = u.cross(v).length().atan2(u.dot(v));
            if let Some(sum) = vertices.get_mut(triangle[k] as usize) {
                *sum += n * angle;
            }
        }
    }
    mesh.triangles
        .iter()
        .map(|&triangle| {
            let points = corners(triangle);
            Face {
                corners: points,
                normal: normal(points),
                edges: edges_of(triangle).map(|edge| edges.get(&edge).copied().unwrap_or_default()),
                vertices: triangle.map(|v| vertices.get(v as usize).copied().unwrap_or_default()),
            }
        })
        .collect()
}

impl Face {
    /// Nearest point of the triangle and the pseudonormal of the feature it lies on (C. Ericson, Real-Time
    /// Collision Detection, 5.1.5).
    fn nearest(&self, p: DVec3) -> (DVec3, DVec3) {
        let [a, b, c] = self.corners;
        let (ab, ac, ap) = (b - a, c - a, p - a);
        let (d1, d2) = (ab.dot(ap), ac.dot(ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return (a, self.vertices[0]);
        }
        let bp = p - b;
        let (d3, d4) = (ab.dot(bp), ac.dot(bp));
        if d3 >= 0.0 && d4 <= d3 {
            return (b, self.vertices[1]);
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return (a + ab * (d1 / (d1 - d3)), self.edges[0]);
        }
        let cp = p - c;
        let (d5, d6) = (ab.dot(cp), ac.dot(cp));
        if d6 >= 0.0 && d5 <= d6 {
            return (c, self.vertices[2]);
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return (a + ac * (d2 / (d2 - d6)), self.edges[2]);
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 >= d3 && d5 >= d6 {
            return (b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), self.edges[1]);
        }
        let sum = va + vb + vc;
        if sum > 0.0 { (a + ab * (vb / sum) + ac * (vc / sum), self.normal) } else { (a, self.vertices[0]) }
    }
}

/// Splits at the median of the longest side, which depends on nothing but the triangles.
fn grow(faces: &mut [Face], start: usize, count: usize, nodes: &mut Vec<Node>) {
    let part = &mut faces[start..start + count];
    let corners = || part.iter().flat_map(|face| face.corners);
    let low = corners().fold(DVec3::splat(f64::INFINITY), DVec3::min);
    let high = corners().fold(DVec3::splat(f64::NEG_INFINITY), DVec3::max);
    let here = nodes.len();
    nodes.push(Node { low, high, first: start as u32, count: count as u32 });
    if count <= LEAF {
        return;
    }
    let size = high - low;
    let axis = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
    let middle = |face: &Face| face.corners.iter().map(|c| c[axis]).sum::<f64>();
    part.select_nth_unstable_by(count / 2, |a, b| middle(a).total_cmp(&middle(b)));
    grow(faces, start, count / 2, nodes);
    let second = nodes.len() as u32;
    grow(faces, start + count / 2, count - count / 2, nodes);
    nodes[here] = Node { low, high, first: second, count: 0 };
}
