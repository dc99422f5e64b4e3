//! The dome as eight-node bricks: a half cube blown up to a hemisphere, finer towards the surface.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_4;

use glam::DVec3;

/// Half side of the core over the radius.
const CORE: f64 = 0.45;
/// Each shell is this much thicker than the one outside it.
const GROWTH: f64 = 1.35;

/// A lattice point of the half cube: |i|, |j| <= n, 0 <= k <= n.
type Lattice = (i32, i32, i32);

/// Bricks over the dome.
#[derive(Debug, Clone)]
pub(super) struct Bricks {
    pub nodes_mm: Vec<DVec3>,
    pub bricks: Vec<[u32; 8]>,
    /// Nodes on the curved surface: lattice point of the cube's surface, node, area in mm2.
    pub surface: Vec<(Lattice, u32, f64)>,
    /// Place in `surface` by lattice point.
    index: BTreeMap<Lattice, u32>,
    /// Cells along half an edge of the cube.
    half: i32,
}

/// The direction of a point of the cube: equal angles for equal steps.
fn direction(v: DVec3) -> DVec3 {
    let tan = |t: f64| (FRAC_PI_4 * t).tan();
    // A coordinate that is zero stays exactly zero: the base must stay flat.
    DVec3::new(tan(v.x), tan(v.y), tan(v.z)).normalize_or_zero()
}

impl Bricks {
    /// A mesh with `half` cells along half an edge of the cube: a quarter circle has twice as many.
    pub fn new(radius_mm: f64, half: usize) -> Self {
        let n = half as i32;
        let unit = |(i, j, k): Lattice| DVec3::new(f64::from(i), f64::from(j), f64::from(k)) / f64::from(n);
        // Half way between a cube and a ball.
        let core = |p: Lattice| {
            let v = unit(p);
            let size = v.abs().max_element();
            let round = direction(if size > 0.0 { v / size } else { v }) * size;
            0.5 * (v + round) * (CORE * radius_mm)
        };
        let mut made = Self {
            nodes_mm: Vec::new(),
            bricks: Vec::new(),
            surface: Vec::new(),
            index: BTreeMap::new(),
            half: n,
        };
        let mut core_nodes = BTreeMap::new();
        let mut skin = Vec::new();
        for k in 0..=n {
            for j in -n..=n {
                for i in -n..=n {
                    core_nodes.insert((i, j, k), made.nodes_mm.len() as u32);
                    made.nodes_mm.push(core((i, j, k)));
                    if i.abs().max(j.abs()).max(k) == n {
                        skin.push((i, j, k));
                    }
                }
            }
        }
        for k in 0..n {
            for j in -n..n {
                for i in -n..n {
                    let at = |di: i32, dj: i32, dk: i32| core_nodes[&(i + di, j + dj, k + dk)];
                    made.bricks.push([
                        at(0, 0, 0),
                        at(1, 0, 0),
                        at(1, 1, 0),
                        at(0, 1, 0),
                        at(0, 0, 1),
                        at(1, 0, 1),
                        at(1, 1, 1),
                        at(0, 1, 1),
                    ]);
                }
            }
        }
        // Shells, from the core outwards.
        let fractions = shells(half);
        let mut below: BTreeMap<Lattice, u32> = skin.iter().map(|p| (*p, core_nodes[p])).collect();
        for fraction in fractions {
            let mut above = BTreeMap::new();
            for p in &skin {
                let (inner, outer) = (core(*p), direction(unit(*p)) * radius_mm);
                above.insert(*p, made.nodes_mm.len() as u32);
                made.nodes_mm.push(inner + (outer - inner) * fraction);
            }
            for face in made.faces() {
                let (low, high) = (face.map(|p| below[&p]), face.map(|p| above[&p]));
                made.bricks.push([low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]]);
            }
            below = above;
        }
        let mut areas: BTreeMap<Lattice, f64> = BTreeMap::new();
        for face in made.faces() {
            let at = face.map(|p| made.nodes_mm[below[&p] as usize]);
            let area = 0.5 * (at[2] - at[0]).cross(at[3] - at[1]).length();
            for p in face {
                *areas.entry(p).or_default() += 0.25 * area;
            }
        }
        for (number, p) in skin.iter().enumerate() {
            made.surface.push((*p, below[p], areas[p]));
            made.index.insert(*p, number as u32);
        }
        made
    }

    /// Cells of the half cube's surface, corners counter-clockwise seen from outside.
    fn faces(&self) -> Vec<[Lattice; 4]> {
        let n = self.half;
        let mut faces = Vec::new();
        for j in -n..n {
            for i in -n..n {
                faces.push([(i, j, n), (i + 1, j, n), (i + 1, j + 1, n), (i, j + 1, n)]);
            }
        }
        for k in 0..n {
            for i in -n..n {
                faces.push([(n, i, k), (n, i + 1, k), (n, i + 1, k + 1), (n, i, k + 1)]);
                faces.push([(-n, i + 1, k), (-n, i, k), (-n, i, k + 1), (-n, i + 1, k + 1)]);
                faces.push([(i + 1, n, k), (i, n, k), (i, n, k + 1), (i + 1, n, k + 1)]);
                faces.push([(i, -n, k), (i + 1, -n, k), (i + 1, -n, k + 1), (i, -n, k + 1)]);
            }
        }
        faces
    }

    /// Four surface nodes (places in `surface`) round a point of the dome, and their bilinear weights.
    pub fn surround(&self, at_mm: DVec3) -> [(usize, f64); 4] {
        let n = self.half;
        let size = at_mm.abs().max_element();
        if size.is_nan() || size <= 0.0 {
            return [(0, 0.0); 4];
        }
        let cell = |v: f64, lowest: i32| {
            let s = v.atan() / FRAC_PI_4 * f64::from(n);
            let base = (s.floor() as i32).clamp(lowest, n - 1);
            (base, (s - f64::from(base)).clamp(0.0, 1.0))
        };
        let v = at_mm / size;
        let a = v.abs();
        // The face whose coordinate is largest; its point as a lattice triple.
        let (s, t, positive);
        let lattice: fn(i32, i32, i32, bool) -> Lattice;
        if a.z >= a.x.max(a.y) {
            (s, t, positive) = (cell(v.x, -n), cell(v.y, -n), true);
            lattice = |s, t, n, _| (s, t, n);
        } else if a.x >= a.y {
            (s, t, positive) = (cell(v.y, -n), cell(v.z.max(0.0), 0), v.x > 0.0);
            lattice = |s, t, n, positive| (if positive { n } else { -n }, s, t);
        } else {
            (s, t, positive) = (cell(v.x, -n), cell(v.z.max(0.0), 0), v.y > 0.0);
            lattice = |s, t, n, positive| (s, if positive { n } else { -n }, t);
        }
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(ds, dt)| {
            let weight = if ds == 1 { s.1 } else { 1.0 - s.1 } * if dt == 1 { t.1 } else { 1.0 - t.1 };
            let number = self.index.get(&lattice(s.0 + ds, t.0 + dt, n, positive)).copied().unwrap_or(0);
            (number as usize, weight)
        })
    }
}

/// Where the shells end, as parts of the way from core to surface: the outermost nearly cubes, thicker inwards.
fn shells(half: usize) -> Vec<f64> {
    let edge = FRAC_PI_4 / half as f64 / (1.0 - CORE);
    let (mut depths, mut depth, mut thick) = (Vec::new(), 0.0, 0.7 * edge);
    while depth + 0.6 * thick < 1.0 {
        depths.push(depth);
        depth += thick;
        thick *= GROWTH;
    }
    // Stretched so that the innermost ends on the core.
    depths.iter().rev().map(|d| 1.0 - d / depth).collect()
}
