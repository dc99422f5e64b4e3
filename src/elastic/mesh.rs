//! Quadrilaterals over the meridian half of the dome: fine at the surface, coarser towards the middle.
//!
//! The section (r, z), a quarter disc for a hemisphere, is laid out in rings of nine-node quadrilaterals, each a smaller
//! copy of the surface about the base's centre. Two rings of nearly square elements
//! share a count of elements; then the count halves, down to [`CORE`] about a core of two by two. Where it halves,
//! the nodes of the finer side hang on the coarser edge and follow it exactly.

use domecast_optics::DomeShape;
use glam::DVec2;

/// Elements along the innermost ring.
pub(crate) const CORE: usize = 4;
/// Rings of one count.
const RINGS: usize = 2;

/// The mesh; nodes hang on others where their list of masters is not themselves alone.
#[derive(Debug, Clone)]
pub(crate) struct Meridian {
    /// (r, z), mm.
    pub nodes_mm: Vec<DVec2>,
    /// Nine nodes each: rows of three, along the surface first, from inside to outside.
    pub elements: Vec<[u32; 9]>,
    /// For each hanging node: itself, and what it is the weighted sum of.
    pub hanging: Vec<(u32, [(u32, f64); 3])>,
    /// Nodes on the surface, from the pole to the rim, two per element and one more.
    pub surface: Vec<u32>,
    /// Nodes on the axis r = 0.
    pub axis: Vec<u32>,
    /// Nodes on the bonded base z = 0.
    pub base: Vec<u32>,
}

/// A line of nodes at one depth: two per element and one more, from the axis to the base.
type Line = Vec<u32>;

struct Builder {
    mesh: Meridian,
}

impl Builder {
    fn node(&mut self, at: DVec2) -> u32 {
        self.mesh.nodes_mm.push(at);
        (self.mesh.nodes_mm.len() - 1) as u32
    }

    fn at(&self, node: u32) -> DVec2 {
        self.mesh.nodes_mm[node as usize]
    }

    fn line(&mut self, places: impl Iterator<Item = DVec2>) -> Line {
        places.map(|at| self.node(at)).collect()
    }

    /// A ring of elements between an inner and an outer line of equal counts.
    fn ring(&mut self, inner: &Line, middle: &Line, outer: &Line) {
        for k in 0..(outer.len() - 1) / 2 {
            let three = |line: &Line| [line[2 * k], line[2 * k + 1], line[2 * k + 2]];
            let ([a, b, c], [d, e, f], [g, h, i]) = (three(inner), three(middle), three(outer));
            self.mesh.elements.push([a, b, c, d, e, f, g, h, i]);
        }
    }
}

/// Places along the surface from the axis to the base, drawn in about the base's centre to a part of its size.
fn arc(dome: DomeShape, part: f64, elements: usize) -> impl Iterator<Item = DVec2> {
    let end_rad = dome.meridian_end_rad();
    (0..=2 * elements).map(move |p| {
        // The two ends lie on axis and base exactly.
        if p == 0 {
            DVec2::new(0.0, dome.height_mm()) * part
        } else if p == 2 * elements {
            DVec2::new(dome.rim_radius_mm(), 0.0) * part
        } else {
            let at_mm = dome.point_mm(end_rad * p as f64 / (2 * elements) as f64, 0.0);
            DVec2::new(at_mm.x, at_mm.z) * part
        }
    })
}

impl Meridian {
    /// The mesh with this many elements along the surface: [`CORE`] times a power of two.
    pub fn new(dome: DomeShape, elements: usize) -> Self {
        let mesh = Self {
            nodes_mm: Vec::new(),
            elements: Vec::new(),
            hanging: Vec::new(),
            surface: Vec::new(),
            axis: Vec::new(),
            base: Vec::new(),
        };
        let mut builder = Builder { mesh };
        let end_rad = dome.meridian_end_rad();
        let (mut count, mut part) = (elements, 1.0);
        let mut outer = builder.line(arc(dome, part, count));
        builder.mesh.surface.clone_from(&outer);
        loop {
            for _ in 0..RINGS {
                let next = part * (1.0 - end_rad / count as f64).max(0.55);
                let middle = builder.line(arc(dome, 0.5 * (part + next), count));
                let inner = builder.line(arc(dome, next, count));
                builder.ring(&inner, &middle, &outer);
                (part, outer) = (next, inner);
            }
            if count == CORE {
                break;
            }
            count /= 2;
            outer = builder.halve(&outer);
        }
        builder.core(DVec2::new(dome.rim_radius_mm(), dome.height_mm()) * part, &outer);
        let mut mesh = builder.mesh;
        let tiny = 1e-12 * dome.radius_mm();
        for (node, at) in mesh.nodes_mm.iter().enumerate() {
            if at.x.abs() <= tiny {
                mesh.axis.push(node as u32);
            }
            if at.y.abs() <= tiny {
                mesh.base.push(node as u32);
            }
        }
        mesh
    }
}

impl Builder {
    /// Every second node of a line becomes the coarser line's; the others hang between them.
    fn halve(&mut self, fine: &Line) -> Line {
        let coarse: Line = fine.iter().copied().step_by(2).collect();
        for (k, &node) in fine.iter().enumerate().filter(|(k, _)| k % 2 == 1) {
            // Quadratic through the coarse edge's three nodes, at a quarter or three quarters.
            let first = (k / 4) * 2;
            let masters = [coarse[first], coarse[first + 1], coarse[first + 2]];
            let weights = if k % 4 == 1 { [0.375, 0.75, -0.125] } else { [-0.125, 0.75, 0.375] };
            let list: [(u32, f64); 3] = std::array::from_fn(|i| (masters[i], weights[i]));
            let place = list.iter().map(|(m, w)| self.at(*m) * *w).sum();
            self.mesh.nodes_mm[node as usize] = place;
            self.mesh.hanging.push((node, list));
        }
        coarse
    }

    /// Two by two rectangles about the centre, and one ring between them and the last arc, of this width and height.
    fn core(&mut self, size_mm: DVec2, outer: &Line) {
        let side = 0.5 * size_mm;
        // The square's far corner is drawn in, which keeps the ring's elements even.
        let corner = 0.9;
        let square = |i: usize, j: usize| {
            let (u, v) = (i as f64 / CORE as f64, j as f64 / CORE as f64);
            DVec2::new(u, v) * side * (1.0 - (1.0 - corner) * u * v)
        };
        let grid: Vec<Vec<u32>> =
            (0..=CORE).map(|j| (0..=CORE).map(|i| self.node(square(i, j))).collect()).collect();
        for j in (0..CORE).step_by(2) {
            for i in (0..CORE).step_by(2) {
                // Rows from below, columns outwards: inside to outside runs along +z, the surface along +r.
                let row = |dj: usize| [grid[j + dj][i], grid[j + dj][i + 1], grid[j + dj][i + 2]];
                let ([a, b, c], [d, e, f], [g, h, k]) = (row(0), row(1), row(2));
                self.mesh.elements.push([a, b, c, d, e, f, g, h, k]);
            }
        }
        // From the top of the axis along the square's upper side, then down its outer side.
        let mut inner: Line = (0..=CORE).map(|i| grid[CORE][i]).collect();
        inner.extend((0..CORE).rev().map(|j| grid[j][CORE]));
        let middle: Vec<DVec2> =
            inner.iter().zip(outer).map(|(a, b)| 0.5 * (self.at(*a) + self.at(*b))).collect();
        let middle = self.line(middle.into_iter());
        self.ring(&inner, &middle, outer);
    }
}
