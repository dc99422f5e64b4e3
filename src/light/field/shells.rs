//! What an object changes of the light on a point that it moves.
//!
//! On three shells inside the dome there are tables of the *vector* irradiance, whose product with the normal is the
//! irradiance; between them, Lagrange's parabola over the radius. What the undeformed membrane's own table shows beyond the
//! outer shell's coarser one, the edges of shadows and the nearest lights, stays with the direction from the dome's centre:
//! so only the difference that depth and tilt make is looked up here, as quadratic splines, which have no creases. The
//! membrane's own light has its vectors on the outer shell: tilt changes it as it does the lights', depth much less.

use glam::{DVec2, Vec2, Vec3A, Vec4};

use super::own::OwnLight;
use super::places::{Inside, Scale, continued, split};
use crate::dome_map::{DomeGrid, bicubic};
use crate::splines::{Degree, quadratics, to_coefficients};
use crate::tables::{SHELL_CELLS, SHELLS, Tables, Ways};

/// Fluxes of the three channels along x, y and z.
type Flux = [Vec3A; 3];

/// A flux along a way, by channel.
#[inline]
pub(super) fn along(flux: &Flux, way: Vec3A) -> Vec3A {
    (flux[0] * way.x + flux[1] * way.y) + flux[2] * way.z
}

/// The outer shell's flux with what the membrane throws there, how much more the others have, and what the membrane throws,
/// side by side: a look-up asks all of them.
#[derive(Debug, Clone, Copy, Default)]
struct Node {
    outer: Flux,
    second: Flux,
    third: Flux,
    own: Flux,
}

/// The tables.
#[derive(Debug, Clone)]
pub(super) struct Shells {
    per_room: f32,
    scale: Scale,
    /// Coefficients.
    nodes: Vec<Node>,
}

impl Shells {
    /// Sums up the lights' tables; `None` where there are none.
    pub fn new(ways: &Ways, outer: &Tables, inside: &[Tables], own: Option<&OwnLight>) -> Option<Self> {
        let grid = DomeGrid::with_cells(SHELL_CELLS).over(ways.face());
        let flux = |tables: &Tables| flux(ways, tables, &grid);
        let [second, third] = inside else { return None };
        let [outer, second, third] = [outer, second, third].map(flux);
        let more = |shell: &[Vec<Vec4>; 3]| -> [Vec<Vec4>; 3] {
            std::array::from_fn(|k| shell[k].iter().zip(&outer[k]).map(|(a, b)| *a - *b).collect())
        };
        let mut parts = [more(&second), more(&third)];
        let [second, third] = &mut parts;
        let (mut outer, mut thrown) = (outer, nothing(&grid));
        if let Some(own) = own {
            let vectors = |place: DVec2| own.vectors_at(grid.face.place_of_disc(place));
            for i in 0..grid.nodes * grid.nodes {
                let here = continued(grid.place(i % grid.nodes, i / grid.nodes), vectors);
                for (axis, (outer, thrown)) in outer.iter_mut().zip(&mut thrown).enumerate() {
                    thrown[i] = wide(&here, axis);
                    outer[i] += thrown[i];
                }
            }
        }
        for table in [&mut outer, second, third, &mut thrown].into_iter().flatten() {
            to_coefficients(table, grid.nodes, Degree::Quadratic);
        }
        let at = |table: &[Vec<Vec4>; 3], i: usize| -> Flux {
            std::array::from_fn(|k| table[k].get(i).map_or(Vec3A::ZERO, |v| Vec3A::from_vec4(*v)))
        };
        let node = |i: usize| Node {
            outer: at(&outer, i),
            second: at(second, i),
            third: at(third, i),
            own: at(&thrown, i),
        };
        Some(Self {
            per_room: (1.0 / ways.room()) as f32,
            scale: Scale::of(&grid),
            nodes: (0..grid.nodes * grid.nodes).map(node).collect(),
        })
    }

    /// What is added to the light on an undeformed point over or under it, where the membrane has a unit normal of its own.
    #[inline]
    pub fn change(&self, at: &Inside, normal: Vec3A) -> Vec3A {
        let nodes = self.scale.nodes;
        let place = self.scale.place(self.scale.flat(at.place)) + Vec2::splat(0.5);
        let ((column, row), part) = split(place, 1.0, self.scale.last_cell);
        let (wx, wy) = quadratics(part);
        let start = (row - 1) * nodes + column - 1;
        let Some(corner) = self.nodes.get(start..start + 2 * nodes + 3) else { return Vec3A::ZERO };
        let [second, third] =
            shell_weights(1.0 - (1.0 - at.part) * self.per_room).map(|weight| normal * weight);
        let off = normal - at.outward;
        let mut light = Vec3A::ZERO;
        for (row, wy) in wy.into_iter().enumerate() {
            let row = &corner[row * nodes..row * nodes + 3];
            let of = |node: &Node| {
                (along(&node.outer, off) + along(&node.second, second)) + along(&node.third, third)
            };
            light += ((of(&row[0]) * wx[0] + of(&row[1]) * wx[1]) + of(&row[2]) * wx[2]) * wy;
        }
        light
    }
}

impl Shells {
    /// Vector irradiance of the channels at a place over or under the undeformed membrane, on the outer shell over it, and
    /// of that what the membrane throws: `[k]` has component k of the three.
    #[inline]
    pub fn vectors(&self, at: &Inside) -> [Flux; 3] {
        let nodes = self.scale.nodes;
        let place = self.scale.place(self.scale.flat(at.place)) + Vec2::splat(0.5);
        let ((column, row), part) = split(place, 1.0, self.scale.last_cell);
        let (wx, wy) = quadratics(part);
        let start = (row - 1) * nodes + column - 1;
        let mut sum = Node::default();
        let Some(corner) = self.nodes.get(start..start + 2 * nodes + 3) else { return [sum.outer; 3] };
        for (row, wy) in wy.into_iter().enumerate() {
            let row = &corner[row * nodes..row * nodes + 3];
            for (node, wx) in row.iter().zip(wx) {
                let weight = wx * wy;
                for k in 0..3 {
                    sum.outer[k] += node.outer[k] * weight;
                    sum.second[k] += node.second[k] * weight;
                    sum.third[k] += node.third[k] * weight;
                    sum.own[k] += node.own[k] * weight;
                }
            }
        }
        let [second, third] = shell_weights(1.0 - (1.0 - at.part) * self.per_room);
        let there = std::array::from_fn(|k| sum.outer[k] + sum.second[k] * second + sum.third[k] * third);
        [there, sum.outer, sum.own]
    }
}

/// The flux of all lights on a shell as the channels see it: tables of x, y and z, continued beyond the rim.
fn flux(ways: &Ways, tables: &Tables, grid: &DomeGrid) -> [Vec<Vec4>; 3] {
    let own = &tables.grid;
    let mut flux = vec![[0.0; 9]; own.nodes * own.nodes];
    for (source, table) in ways.sources.iter().zip(&tables.sources) {
        for (sum, vector) in flux.iter_mut().zip(table) {
            for (k, total) in sum.iter_mut().enumerate() {
                *total += vector[k % 3] * source.seen_mw[k / 3];
            }
        }
    }
    let inside = |place: DVec2| bicubic(own, &flux, own.coordinates_of_disc(place));
    let node = |i: usize| continued(grid.place(i % grid.nodes, i / grid.nodes), inside);
    let nodes: Vec<[f64; 9]> = (0..grid.nodes * grid.nodes).map(node).collect();
    std::array::from_fn(|axis| nodes.iter().map(|v| wide(v, axis)).collect())
}

/// Tables of nothing.
fn nothing(grid: &DomeGrid) -> [Vec<Vec4>; 3] {
    std::array::from_fn(|_| vec![Vec4::ZERO; grid.nodes * grid.nodes])
}

/// A component of the channels' vectors.
fn wide(vectors: &[f64; 9], axis: usize) -> Vec4 {
    Vec4::new(vectors[axis] as f32, vectors[3 + axis] as f32, vectors[6 + axis] as f32, 0.0)
}

/// Lagrange's weights of the second and third shell for a radius, part of the dome's; all three sum to one.
#[inline]
fn shell_weights(part: f32) -> [f32; 2] {
    let [a, b, c] = PARTS;
    let p = part.clamp(0.5, 1.1);
    [(p - a) * (p - c) * (1.0 / ((b - a) * (b - c))), (p - a) * (p - b) * (1.0 / ((c - a) * (c - b)))]
}

const PARTS: [f32; 3] = [SHELLS[0] as f32, SHELLS[1] as f32, SHELLS[2] as f32];
