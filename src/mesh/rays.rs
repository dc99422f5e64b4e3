//! Rays against a mesh.

use glam::DVec3;

use super::tree::{BoxTree, Node, STACK};
use super::{BoundingBox, TriMesh};

/// A mesh prepared for many rays: a tree of boxes over its triangles.
#[derive(Debug, Clone)]
pub struct RayTarget {
    pub(super) triangles: Vec<[DVec3; 3]>,
    pub(super) tree: BoxTree,
}

impl RayTarget {
    /// Prepares a mesh.
    pub fn new(mesh: &TriMesh) -> Self {
        let mut triangles: Vec<[DVec3; 3]> = mesh.iter_mm().collect();
        let tree = BoxTree::over(&mut triangles);
        Self { triangles, tree }
    }

    /// Where the segment from `from_mm` to `to_mm` first meets a triangle: the
    /// fraction along it, and the triangle's normal.
    pub fn first_hit(&self, from_mm: DVec3, to_mm: DVec3) -> Option<(f64, DVec3)> {
        let mut best: Option<(f64, usize)> = None;
        self.visit(from_mm, to_mm, |at, t| {
            if best.is_none_or(|(nearest, _)| t < nearest) {
                best = Some((t, at));
            }
            best.map(|(t, _)| t)
        });
        let (t, at) = best?;
        let [a, b, c] = self.triangles.get(at)?;
        Some((t, (b - a).cross(c - a).normalize_or_zero()))
    }

    /// Whether the segment meets any triangle: as [`Self::first_hit`], which
    /// has to look further.
    pub fn is_hit(&self, from_mm: DVec3, to_mm: DVec3) -> bool {
        let mut hit = false;
        self.visit(from_mm, to_mm, |_, _| {
            hit = true;
            // nothing nearer than the start is left to look for
            Some(f64::NEG_INFINITY)
        });
        hit
    }

    /// Tells `met` of triangles that the segment meets, the nearer boxes
    /// first; what it answers is how far along the segment is still of use.
    fn visit(&self, from: DVec3, to: DVec3, mut met: impl FnMut(usize, f64) -> Option<f64>) {
        let along = to - from;
        let inverse = along.recip();
        // Where the segment is in a box, if it is, up to `reach`.
        let enters = |node: &Node, reach: f64| {
            let (a, b) = ((node.low - from) * inverse, (node.high - from) * inverse);
            // `min` and `max` pass over the NaN of a ray within a box's face.
            let enter = a.min(b).max_element().max(0.0);
            let leave = a.max(b).min_element().min(reach);
            (enter <= leave * (1.0 + 1e-12) + 1e-12).then_some(enter)
        };
        let mut reach = 1.0_f64;
        let mut stack = [(0_u32, 0.0_f64); STACK];
        let nodes = self.tree.nodes();
        let Some(mut depth) = nodes.first().and_then(|root| enters(root, reach)).map(|_| 1) else {
            return;
        };
        while depth > 0 {
            depth -= 1;
            let (index, enter) = stack[depth];
            if enter > reach * (1.0 + 1e-12) + 1e-12 {
                continue;
            }
            let Some(node) = nodes.get(index as usize) else { continue };
            if node.count == 0 {
                let child = |i: u32| Some((i, enters(nodes.get(i as usize)?, reach)?));
                let (one, two) = (child(index + 1), child(node.first));
                let nearer_first = match (one, two) {
                    (Some(p), Some(q)) if p.1 <= q.1 => [two, one],
                    _ => [one, two],
                };
                for next in nearer_first.into_iter().flatten() {
                    stack[depth] = next;
                    depth += 1;
                }
                continue;
            }
            let first = node.first as usize;
            for at in first..first + node.count as usize {
                if let Some(t) = self.triangles.get(at).and_then(|triangle| meet(triangle, from, along))
                    && let Some(still) = met(at, t)
                {
                    reach = reach.min(still);
                }
            }
        }
    }

    /// Whether a triangle's own box shares a point with this one: if not, the
    /// mesh stays out of the box or holds all of it.
    pub fn comes_near(&self, bounds: &BoundingBox) -> bool {
        let apart =
            |low: DVec3, high: DVec3| (low - bounds.max_mm).max(bounds.min_mm - high).max_element() > 0.0;
        let mut stack = [0_u32; STACK];
        let nodes = self.tree.nodes();
        let mut depth = usize::from(!nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let index = stack[depth];
            let Some(node) = nodes.get(index as usize) else { continue };
            if apart(node.low, node.high) {
                continue;
            }
            if node.count == 0 {
                stack[depth] = node.first;
                stack[depth + 1] = index + 1;
                depth += 2;
                continue;
            }
            let range = node.first as usize..(node.first + node.count) as usize;
            let near = |[a, b, c]: &[DVec3; 3]| !apart(a.min(*b).min(*c), a.max(*b).max(*c));
            if self.triangles.get(range).unwrap_or_default().iter().any(near) {
                return true;
            }
        }
        false
    }
}

/// How far along the segment it meets the triangle. Moller and Trumbore 1997;
/// the triangle's edges belong to it.
fn meet(&[a, b, c]: &[DVec3; 3], from: DVec3, along: DVec3) -> Option<f64> {
    let (u, v) = (b - a, c - a);
    let p = along.cross(v);
    let det = u.dot(p);
    if det == 0.0 {
        return None;
    }
    let q = from - a;
    let x = q.dot(p) / det;
    // A ray through a shared edge must not slip between two triangles.
    let slack = -1e-12;
    if !(slack..=1.0 - slack).contains(&x) {
        return None;
    }
    let r = q.cross(u);
    let y = along.dot(r) / det;
    let t = v.dot(r) / det;
    (y >= slack && x + y <= 1.0 - slack && (0.0..=1.0).contains(&t)).then_some(t)
}
