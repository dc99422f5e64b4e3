//! Signed distance to a closed mesh.
//!
//! The nearest triangle is found in a tree of boxes; the sign is that of the angle-weighted pseudonormal of the
//! nearest face, edge or vertex (J. A. Baerentzen, H. Aanaes, Signed distance computation using the angle
//! weighted pseudonormal, IEEE TVCG 11(3), 2005), which is right for every closed manifold mesh.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU32, Ordering};

use glam::DVec3;

use super::distance::Distance;
use crate::error::ContactError;
use domecast_mesh::{BoxTree, Cornered, TriMesh, inspect};

/// A mesh prepared for distances.
#[derive(Debug)]
pub(super) struct MeshDistance {
    corners: Vec<[DVec3; 3]>,
    normals: Vec<Pseudonormals>,
    tree: BoxTree,
    vertices_mm: Vec<DVec3>,
    center_mm: DVec3,
    radius_mm: f64,
    /// The face that was nearest last: where points are asked for one beside the other it is near again, and the search
    /// starts with its distance. Only the time of an answer depends on it.
    last: AtomicU32,
}

/// Pseudonormals of a face, of its edges (0-1, 1-2, 2-0), of its corners.
#[derive(Debug, Clone)]
struct Pseudonormals {
    face: DVec3,
    edges: [DVec3; 3],
    corners: [DVec3; 3],
}

/// A face, on its way into the tree.
struct Face {
    corners: [DVec3; 3],
    normals: Pseudonormals,
}

impl Cornered for Face {
    fn corners(&self) -> [DVec3; 3] {
        self.corners
    }
}

/// Ways shorter than these parts of the mesh's size take the direction of the pseudonormal.
const SHORT_OVER_FACE: f64 = 1e-6;
const SHORT: f64 = 1e-10;

/// What of a triangle is nearest to a point.
#[derive(Clone, Copy)]
enum Feature {
    Face,
    Edge(usize),
    Corner(usize),
}

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
        let tree = BoxTree::over(&mut faces);
        let (center_mm, radius_mm) = tree.bounds().map_or((DVec3::ZERO, 0.0), |(low, high)| {
            let center = 0.5 * (low + high);
            (center, mesh.vertices_mm.iter().map(|v| v.distance(center)).fold(0.0, f64::max))
        });
        let (corners, normals) = faces.into_iter().map(|face| (face.corners, face.normals)).unzip();
        let last = AtomicU32::new(0);
        Ok(Self { corners, normals, tree, vertices_mm: mesh.vertices_mm, center_mm, radius_mm, last })
    }

    pub(super) fn bounding_sphere(&self) -> (DVec3, f64) {
        (self.center_mm, self.radius_mm)
    }

    pub(super) fn support(&self, direction: DVec3) -> DVec3 {
        let farther = |a: &DVec3, b: &DVec3| a.dot(direction).total_cmp(&b.dot(direction));
        self.vertices_mm.iter().copied().max_by(farther).unwrap_or(self.center_mm)
    }

    pub(super) fn distance(&self, point: DVec3) -> Distance {
        // Of faces at one distance the first is taken, whatever the search began with.
        let mut best = (f64::INFINITY, u32::MAX, point, Feature::Face);
        let mut look = |index: u32| {
            if let Some(corners) = self.corners.get(index as usize) {
                let (at, feature) = nearest(corners, point);
                let distance2 = at.distance_squared(point);
                if distance2 < best.0 || (distance2 == best.0 && index < best.1) {
                    best = (distance2, index, at, feature);
                }
            }
            best.0
        };
        let within = look(self.last.load(Ordering::Relaxed));
        self.tree.nearest(point, within, |index| look(index as u32));
        let (_, index, nearest, feature) = best;
        self.last.store(index, Ordering::Relaxed);
        let normal = self.normals.get(index as usize).map_or(DVec3::Z, |normals| match feature {
            Feature::Face => normals.face,
            Feature::Edge(k) => normals.edges[k],
            Feature::Corner(k) => normals.corners[k],
        });
        let away = point - nearest;
        let length = away.length();
        let sign = if away.dot(normal) < 0.0 { -1.0 } else { 1.0 };
        // A short way is what rounding left of it, and has no direction; over a face that is the normal anyway.
        let short = if matches!(feature, Feature::Face) { SHORT_OVER_FACE } else { SHORT };
        let known = length > short * (self.radius_mm + self.center_mm.length());
        let outward = if known { away * (sign / length) } else { normal.normalize_or(DVec3::Z) };
        Distance { value_mm: sign * length, outward }
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
            let normals = Pseudonormals {
                face: normal(points),
                edges: edges_of(triangle).map(|edge| edges.get(&edge).copied().unwrap_or_default()),
                corners: triangle.map(|v| vertices.get(v as usize).copied().unwrap_or_default()),
            };
            Face { corners: points, normals }
        })
        .collect()
}

/// Nearest point of a triangle and what of it that is (C. Ericson, Real-Time Collision Detection, 5.1.5).
fn nearest(&[a, b, c]: &[DVec3; 3], p: DVec3) -> (DVec3, Feature) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (a, Feature::Corner(0));
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (b, Feature::Corner(1));
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * (d1 / (d1 - d3)), Feature::Edge(0));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (c, Feature::Corner(2));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * (d2 / (d2 - d6)), Feature::Edge(2));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return (b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), Feature::Edge(1));
    }
    let sum = va + vb + vc;
    if sum > 0.0 { (a + ab * (vb / sum) + ac * (vc / sum), Feature::Face) } else { (a, Feature::Corner(0)) }
}
