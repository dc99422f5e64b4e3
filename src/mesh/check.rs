//! Is a mesh the surface of one solid?

use std::collections::HashMap;

use super::{BoundingBox, TriMesh};

/// What [`inspect`] found.
#[derive(Debug, Clone, PartialEq)]
pub struct Inspection {
    /// Triangles looked at.
    pub triangles: usize,
    /// Edges that do not belong to exactly two triangles.
    pub open_edges: usize,
    /// Edges whose two triangles run along them in the same direction.
    pub flipped_edges: usize,
    /// Vertices where the triangles around do not form one closed fan: parts
    /// of the surface that touch in a point.
    pub pinched_vertices: usize,
    /// Pieces that hang together by edges.
    pub shells: usize,
    /// Vertices - edges + triangles.
    pub euler: i64,
    /// Volume, mm^3 (negative if inside out).
    pub volume_mm3: f64,
    /// Box; `None` for an empty mesh.
    pub bounds: Option<BoundingBox>,
}

impl Inspection {
    /// Number of holes through a single closed shell: `1 - euler/2`; `None` if
    /// the mesh is not one closed shell, where the formula has no meaning.
    pub fn genus(&self) -> Option<i64> {
        (self.is_closed() && self.shells == 1).then_some(1 - self.euler / 2)
    }

    /// Every edge has two triangles, running along it in opposite directions,
    /// and no two parts of the surface touch in a point.
    pub fn is_closed(&self) -> bool {
        self.triangles > 0 && self.open_edges == 0 && self.flipped_edges == 0 && self.pinched_vertices == 0
    }

    /// The surface of exactly one solid of positive volume.
    pub fn is_one_solid(&self) -> bool {
        self.is_closed() && self.shells == 1 && self.volume_mm3 > 0.0
    }

    /// One phrase for what is wrong, `None` if nothing is.
    pub fn problem(&self) -> Option<String> {
        if self.triangles == 0 {
            Some("the mesh is empty".into())
        } else if self.open_edges > 0 {
            Some(format!("{} edges do not join exactly two triangles", self.open_edges))
        } else if self.flipped_edges > 0 {
            Some(format!("{} edges join triangles of opposite winding", self.flipped_edges))
        } else if self.pinched_vertices > 0 {
            Some(format!("the surface touches itself in {} points", self.pinched_vertices))
        } else if self.shells != 1 {
            Some(format!("{} separate shells instead of one", self.shells))
        } else if self.volume_mm3 <= 0.0 {
            Some(format!("the volume is {} mm3: inside out", self.volume_mm3))
        } else {
            None
        }
    }
}

/// Looks at a mesh as it is; weld it first ([`TriMesh::welded_f32`]) to learn
/// what a reader of the STL will see.
pub fn inspect(mesh: &TriMesh) -> Inspection {
    // For each undirected edge: how often it is run along upwards and downwards.
    let mut edges: HashMap<(u32, u32), (u32, u32)> = HashMap::with_capacity(mesh.triangles.len() * 3 / 2);
    for t in &mesh.triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            let entry = edges.entry((a.min(b), a.max(b))).or_default();
            if a < b { entry.0 += 1 } else { entry.1 += 1 }
        }
    }
    // Counting does not depend on the map's order.
    let open_edges = edges.values().filter(|(up, down)| up + down != 2).count();
    let flipped_edges = edges.values().filter(|&&(up, down)| up + down == 2 && up != 1).count();

    let mut used = vec![false; mesh.vertices_mm.len()];
    let mut vertices = DisjointSets::new(mesh.vertices_mm.len());
    for t in &mesh.triangles {
        for &v in t {
            if let Some(flag) = used.get_mut(v as usize) {
                *flag = true;
            }
        }
        vertices.join(t[0], t[1]);
        vertices.join(t[1], t[2]);
    }
    let shells = (0..used.len() as u32).filter(|&v| used[v as usize] && vertices.root(v) == v).count();
    let used_count = used.iter().filter(|&&u| u).count();

    Inspection {
        triangles: mesh.triangles.len(),
        open_edges,
        flipped_edges,
        pinched_vertices: if open_edges == 0 { pinched_vertices(mesh) } else { 0 },
        shells,
        euler: used_count as i64 - edges.len() as i64 + mesh.triangles.len() as i64,
        volume_mm3: mesh.volume_mm3(),
        bounds: mesh.bounds(),
    }
}

/// Counts vertices whose triangles fall apart into several fans: the corners
/// of neighbouring triangles at one vertex are joined across shared edges, and
/// every vertex must be left with one group.
fn pinched_vertices(mesh: &TriMesh) -> usize {
    let mut corner_at: HashMap<(u32, u32), u32> = HashMap::with_capacity(mesh.triangles.len() * 3);
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            // Corner k and the edge that leaves it.
            corner_at.insert((triangle[k], triangle[(k + 1) % 3]), (3 * t + k) as u32);
        }
    }
    let mut corners = DisjointSets::new(3 * mesh.triangles.len());
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            // The edge that arrives at corner k is, in the neighbour, the one
            // that leaves it.
            let before = triangle[(k + 2) % 3];
            if let Some(&other) = corner_at.get(&(triangle[k], before)) {
                corners.join((3 * t + k) as u32, other);
            }
        }
    }
    let mut fans = vec![0_u32; mesh.vertices_mm.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        for (k, &v) in triangle.iter().enumerate() {
            let corner = (3 * t + k) as u32;
            if corners.root(corner) == corner
                && let Some(count) = fans.get_mut(v as usize)
            {
                *count += 1;
            }
        }
    }
    fans.iter().filter(|&&n| n > 1).count()
}

/// Union-find with path halving.
struct DisjointSets(Vec<u32>);

impl DisjointSets {
    fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }

    fn root(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            let parent = self.0[i as usize];
            self.0[i as usize] = self.0[parent as usize];
            i = self.0[i as usize];
        }
        i
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        // The smaller index becomes the root: independent of the order of calls.
        let (low, high) = (a.min(b), a.max(b));
        self.0[high as usize] = low;
    }
}
