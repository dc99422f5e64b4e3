//! Pressures and friction on planes, by sweeps.
//!
//! Every node in turn takes the force that its own gap and slip ask for, the others held: the pressure so that the
//! gap closes, or none; the friction so that the slip ends, or as large as Coulomb's disc lets it be. This is a
//! projected Gauss-Seidel method (M. Jean, The non-smooth contact dynamics method, Comput. Methods Appl. Mech. Eng.
//! 177, 1999). A compliance makes it quick: its smooth modes, which sweeps are slow on where a matrix is
//! a stiffness, are its stiffest here, and the shortest ones are held by the hats that forces are spread over. Forces that
//! are turned back ([`Node::back`]) make the task unsymmetric where planes turn differently; then no theorem says that sweeps
//! converge, and their bound holds.

use glam::{DMat3, DVec3};

/// How much of its own best step a node takes: between 0 and 2 the sweeps converge, most quickly a little below 1,
/// where a node leaves room for the neighbours that its hat overlaps (measured).
const RELAXATION: f64 = 0.9;

/// What a node must not pass, and where it would be carried; all without forces on any node.
pub(crate) struct Node {
    /// The plane's outward normal, and the distance from it.
    pub normal: DVec3,
    /// Turns a force on the node back to how the dome lay there at rest.
    pub back: DMat3,
    pub rest_gap_mm: f64,
    /// Displacement at which it sticks.
    pub carried_mm: DVec3,
}

/// How the sweeps ended.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SweepOutcome {
    pub sweeps: u32,
    /// The most that the last sweep over all nodes moved one by its own force, mm.
    pub change_mm: f64,
    /// Multiplications.
    pub work: f64,
}

/// Lanes that sums of products are taken in, in a fixed order: what the compiler makes vectors of.
const LANES: usize = 8;

/// Adds eight products to a row's sums.
#[inline(always)]
fn add_products(sums: &mut [f64; LANES], row: &[f64], forces: &[f64; LANES]) {
    if let Some(row) = row.first_chunk::<LANES>() {
        for k in 0..LANES {
            sums[k] += row[k] * forces[k];
        }
    }
}

/// Three rows times the forces, by the chunks of [`LANES`] columns that are named; the columns after the last whole chunk
/// are always taken.
#[inline(always)]
fn three_rows(rows: &[f64], forces: &[f64], chunks: impl Iterator<Item = usize>) -> DVec3 {
    let width = forces.len();
    let (x, rest) = rows.split_at(width);
    let (y, z) = rest.split_at(width);
    let mut sums = [[0.0; LANES]; 3];
    for chunk in chunks {
        let at = LANES * chunk;
        let Some(part) = forces.get(at..).and_then(|part| part.first_chunk::<LANES>()) else { continue };
        add_products(&mut sums[0], &x[at..], part);
        add_products(&mut sums[1], &y[at..], part);
        add_products(&mut sums[2], &z[at..], part);
    }
    let last = width - width % LANES;
    let [x, y, z] = [x, y, z].map(|row| {
        let tail = row[last..width].iter().zip(&forces[last..]);
        tail.map(|(c, f)| c * f).sum::<f64>()
    });
    DVec3::new(
        sums[0].iter().sum::<f64>() + x,
        sums[1].iter().sum::<f64>() + y,
        sums[2].iter().sum::<f64>() + z,
    )
}

/// A node's displacement: its three rows of the compliance times all forces.
pub(crate) fn displacement(rows: &[f64], forces: &[f64]) -> DVec3 {
    three_rows(rows, forces, 0..forces.len() / LANES)
}

/// The chunks of columns with a force: the others add nothing to any sum.
#[derive(Default)]
struct Loaded {
    /// Numbers of the chunks, in order.
    chunks: Vec<usize>,
}

impl Loaded {
    fn of(forces: &[f64]) -> Self {
        let chunks = forces.chunks_exact(LANES).enumerate();
        let loaded = chunks.filter(|(_, part)| part.iter().any(|f| *f != 0.0));
        Self { chunks: loaded.map(|(chunk, _)| chunk).collect() }
    }

    /// A node's force at a place may no longer be zero.
    fn add(&mut self, at: usize) {
        for chunk in [at / LANES, (at + 2) / LANES] {
            if let Err(place) = self.chunks.binary_search(&chunk) {
                self.chunks.insert(place, chunk);
            }
        }
    }
}

/// A node's own compliance: the block, along the plane's normal, and the larger one along the plane.
struct Own {
    block: DMat3,
    normal: f64,
    along: f64,
}

fn own(rows: &[f64], width: usize, at: usize, normal: DVec3) -> Own {
    let column = |k: usize| DVec3::new(rows[at + k], rows[width + at + k], rows[2 * width + at + k]);
    let block = DMat3::from_cols(column(0), column(1), column(2));
    let (u, v) = normal.any_orthonormal_pair();
    let (uu, vv, uv) = (u.dot(block * u), v.dot(block * v), u.dot(block * v));
    let along = 0.5 * (uu + vv) + (0.25 * (uu - vv) * (uu - vv) + uv * uv).sqrt();
    Own { block, normal: normal.dot(block * normal), along }
}

/// Sweeps over the nodes that bear a force between two over all of them.
const SWEEPS_OF_FEW: u32 = 12;

/// Sweeps over the nodes until one over all of them moves none by more than `wanted_mm`. `blocks` is the symmetric
/// compliance, three rows and columns a node, row by row; `forces` starts and ends it, three numbers a node, turned back.
///
/// Most nodes bear no force for long: between two sweeps over all, only those that do are looked at, with the part of
/// the compliance that couples them.
pub(crate) fn sweeps(
    blocks: &[f64],
    nodes: &[Node],
    friction: f64,
    forces: &mut [f64],
    wanted_mm: f64,
    max_sweeps: u32,
) -> SweepOutcome {
    let width = forces.len();
    let rows = |i: usize| &blocks[3 * i * width..3 * (i + 1) * width];
    let owns: Vec<Own> =
        nodes.iter().enumerate().map(|(i, n)| own(rows(i), width, 3 * i, n.normal)).collect();
    let mut ended = SweepOutcome { sweeps: 0, change_mm: f64::INFINITY, work: 0.0 };
    let (mut bearing, mut few_blocks, mut few_forces): (Vec<usize>, Vec<f64>, Vec<f64>) = Default::default();
    while ended.change_mm > wanted_mm && ended.sweeps < max_sweeps {
        ended.sweeps += 1;
        ended.work += (width * width) as f64;
        ended.change_mm = 0.0;
        let mut loaded = Loaded::of(forces);
        for (i, node) in nodes.iter().zip(&owns).enumerate() {
            let u = three_rows(rows(i), forces, loaded.chunks.iter().copied());
            if let Some(change_mm) = turn(u, node, friction, &mut forces[3 * i..3 * i + 3]) {
                ended.change_mm = ended.change_mm.max(change_mm);
                loaded.add(3 * i);
            }
        }
        let bears = |i: &usize| forces[3 * i..3 * i + 3].iter().any(|f| *f != 0.0);
        bearing.clear();
        bearing.extend((0..nodes.len()).filter(bears));
        if ended.change_mm <= wanted_mm || bearing.is_empty() || 4 * bearing.len() > 3 * nodes.len() {
            continue;
        }
        let few = 3 * bearing.len();
        few_blocks.clear();
        few_forces.clear();
        for &i in &bearing {
            few_forces.extend_from_slice(&forces[3 * i..3 * i + 3]);
            for row in rows(i).chunks_exact(width) {
                for &j in &bearing {
                    few_blocks.extend_from_slice(&row[3 * j..3 * j + 3]);
                }
            }
        }
        let (mut change_mm, mut count) = (f64::INFINITY, 0);
        while change_mm > wanted_mm && count < SWEEPS_OF_FEW && ended.sweeps < max_sweeps {
            change_mm = 0.0;
            count += 1;
            ended.sweeps += 1;
            for ((k, &i), rows) in bearing.iter().enumerate().zip(few_blocks.chunks_exact(3 * few)) {
                let u = displacement(rows, &few_forces);
                let node = (&nodes[i], &owns[i]);
                if let Some(moved_mm) = turn(u, node, friction, &mut few_forces[3 * k..3 * k + 3]) {
                    change_mm = change_mm.max(moved_mm);
                }
            }
        }
        ended.work += f64::from(count + 1) * (few * few) as f64;
        for (&i, force) in bearing.iter().zip(few_forces.chunks_exact(3)) {
            forces[3 * i..3 * i + 3].copy_from_slice(force);
        }
    }
    ended
}

/// A node takes the force that its gap and slip ask for, the others held; how far that moves it, mm, if the force changes.
/// `u` is its displacement by all forces; `force` is its own, turned back.
fn turn(mut u: DVec3, (node, own): (&Node, &Own), friction: f64, force: &mut [f64]) -> Option<f64> {
    let (was, forth) = (DVec3::from_slice(force), node.back.transpose());
    let old = forth * was;
    let pressed = old.dot(node.normal);
    let gap = node.rest_gap_mm + node.normal.dot(u);
    let press = (pressed - RELAXATION * gap / own.normal).max(0.0);
    let mut rub = DVec3::ZERO;
    if friction > 0.0 && press > 0.0 {
        u += own.block * (node.back * node.normal) * (press - pressed);
        let slip = u - node.carried_mm;
        let along = |v: DVec3| v - node.normal * v.dot(node.normal);
        rub = along(old - slip * (RELAXATION / own.along)).clamp_length_max(friction * press);
    }
    let new = node.back * (node.normal * press + rub);
    if new == was {
        return None;
    }
    force.copy_from_slice(&new.to_array());
    Some((own.block * (new - was)).length())
}
