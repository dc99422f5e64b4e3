//! Rays against a mesh.

use glam::DVec3;

use super::TriMesh;

/// A mesh prepared for many rays: a tree of boxes over its triangles.
#[derive(Debug, Clone)]
pub struct RayTarget {
    triangles: Vec<[DVec3; 3]>,
    nodes: Vec<Node>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    low: DVec3,
    high: DVec3,
    /// Triangles `first..first + count` of a leaf; for a branch `count` is 0,
    /// its first child is the next node, and `first` is its second child.
    first: u32,
    count: u32,
}

const LEAF: usize = 4;

impl RayTarget {
    /// Prepares a mesh.
    pub fn new(mesh: &TriMesh) -> Self {
        let mut triangles: Vec<[DVec3; 3]> = mesh.iter_mm().collect();
        let mut nodes = Vec::with_capacity(triangles.len());
        let n = triangles.len();
        if n > 0 {
            grow(&mut triangles, 0, n, &mut nodes);
        }
        Self { triangles, nodes }
    }

    /// Where the segment from `from_mm` to `to_mm` first meets a triangle: the
    /// fraction along it, and the triangle's normal.
    pub fn first_hit(&self, from_mm: DVec3, to_mm: DVec3) -> Option<(f64, DVec3)> {
        let along = to_mm - from_mm;
        let inverse = along.recip();
        let mut best: Option<(f64, DVec3)> = None;
        let mut stack = Vec::with_capacity(64);
        stack.push(0_u32);
        while let Some(index) = stack.pop() {
            let Some(node) = self.nodes.get(index as usize) else { continue };
            let reach = best.map_or(1.0, |(t, _)| t);
            let (a, b) = ((node.low - from_mm) * inverse, (node.high - from_mm) * inverse);
            // `min` and `max` pass over the NaN of a ray within a box's face.
            let enter = a.min(b).max_element().max(0.0);
            let leave = a.max(b).min_element().min(reach);
            if enter > leave * (1.0 + 1e-12) + 1e-12 {
                continue;
            }
            if node.count == 0 {
                stack.push(node.first);
                stack.push(index + 1);
                continue;
            }
            let range = node.first as usize..(node.first + node.count) as usize;
            for triangle in self.triangles.get(range).unwrap_or_default() {
                if let Some((t, normal)) = meet(triangle, from_mm, along)
                    && best.is_none_or(|(least, _)| t < least)
                {
                    best = Some((t, normal));
                }
            }
        }
        best
    }
}

/// Builds the subtree of a range of triangles; splits at the median of the
/// longest side, which depends on nothing but the triangles.
fn grow(triangles: &mut [[DVec3; 3]], start: usize, count: usize, nodes: &mut Vec<Node>) {
    let part = &mut triangles[start..start + count];
    let corners = || part.iter().flatten().copied();
    let low = corners().fold(DVec3::splat(f64::INFINITY), DVec3::min);
    let high = corners().fold(DVec3::splat(f64::NEG_INFINITY), DVec3::max);
    let here = nodes.len();
    nodes.push(Node { low, high, first: start as u32, count: count as u32 });
    if count <= LEAF {
        return;
    }
    let size = high - low;
    let axis = if size.x >= size.y.max(size.z) {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let middle = |t: &[DVec3; 3]| t[0][axis] + t[1][axis] + t[2][axis];
    let half = count / 2;
    part.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
    grow(triangles, start, half, nodes);
    let second = nodes.len() as u32;
    grow(triangles, start + half, count - half, nodes);
    if let Some(node) = nodes.get_mut(here) {
        *node = Node { low, high, first: second, count: 0 };
    }
}

/// Moller and Trumbore 1997; the triangle's edges belong to it.
fn meet(&[a, b, c]: &[DVec3; 3], from: DVec3, along: DVec3) -> Option<(f64, DVec3)> {
    let (u, v) = (b - a, c - a);
    let p = along.cross(v);
    let det = u.dot(p);
    if det == 0.0 {
        return None;
    }
    let q = from - a;
    let x = q.dot(p) / det;
    let r = q.cross(u);
    let y = along.dot(r) / det;
    let t = v.dot(r) / det;
    // A ray through a shared edge must not slip between two triangles.
    let slack = -1e-12;
    (x >= slack && y >= slack && x + y <= 1.0 - slack && (0.0..=1.0).contains(&t))
        .then(|| (t, u.cross(v).normalize_or_zero()))
}
