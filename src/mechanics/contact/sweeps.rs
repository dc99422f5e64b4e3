//! Pressures and friction on planes, by sweeps.
//!
//! Every node in turn takes the force that its own gap and slip ask for, the others held: the pressure so that the
//! gap closes, or none; the friction so that the slip ends, or as large as Coulomb's disc lets it be. This is a
//! projected Gauss-Seidel method (M. Jean, The non-smooth contact dynamics method, Comput. Methods Appl. Mech. Eng.
//! 177, 1999). A compliance makes it quick: its smooth modes, which sweeps are slow on where a matrix is
//! a stiffness, are its stiffest here, and the shortest ones are held by the hats that forces are spread over.

use glam::{DMat3, DVec3};

use super::geometric::frame_of;

/// How much of its own best step a node takes: between 0 and 2 the sweeps converge, most quickly a little below 1,
/// where a node leaves room for the neighbours that its hat overlaps (measured).
const RELAXATION: f64 = 0.9;

/// What a node must not pass, and where it would be carried; all without forces on any node.
pub(super) struct Node {
    /// The plane's outward normal, and the distance from it.
    pub normal: DVec3,
    pub rest_gap_mm: f64,
    /// Displacement at which it sticks.
    pub carried_mm: DVec3,
}

/// How the sweeps ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct Settled {
    pub sweeps: u32,
    /// The most that the last sweep moved a node by its own force, mm.
    pub change_mm: f64,
}

/// A sum of products in eight lanes, in a fixed order.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a8.zip(b8) {
        for k in 0..8 {
            lanes[k] += x[k] * y[k];
        }
    }
    lanes.iter().sum::<f64>() + rest
}

/// A node's displacement: its three rows of the compliance times all forces.
pub(super) fn displacement(rows: &[f64], forces: &[f64]) -> DVec3 {
    let width = forces.len();
    DVec3::new(
        dot(&rows[..width], forces),
        dot(&rows[width..2 * width], forces),
        dot(&rows[2 * width..], forces),
    )
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
    let (u, v) = frame_of(normal);
    let (uu, vv, uv) = (u.dot(block * u), v.dot(block * v), u.dot(block * v));
    let along = 0.5 * (uu + vv) + (0.25 * (uu - vv) * (uu - vv) + uv * uv).sqrt();
    Own { block, normal: normal.dot(block * normal), along }
}

/// Sweeps over the nodes until one moves none by more than `wanted_mm`. `blocks` is the symmetric compliance, three
/// rows and columns a node, row by row; `forces` starts and ends it, three numbers a node.
pub(super) fn sweeps(
    blocks: &[f64],
    nodes: &[Node],
    friction: f64,
    forces: &mut [f64],
    wanted_mm: f64,
    most: u32,
) -> Settled {
    let width = forces.len();
    let rows = |i: usize| &blocks[3 * i * width..3 * (i + 1) * width];
    let owns: Vec<Own> =
        nodes.iter().enumerate().map(|(i, n)| own(rows(i), width, 3 * i, n.normal)).collect();
    let mut ended = Settled { sweeps: 0, change_mm: f64::INFINITY };
    while ended.change_mm > wanted_mm && ended.sweeps < most {
        ended.sweeps += 1;
        ended.change_mm = 0.0;
        for (i, (node, own)) in nodes.iter().zip(&owns).enumerate() {
            let old = DVec3::from_slice(&forces[3 * i..3 * i + 3]);
            let mut u = displacement(rows(i), forces);
            let pressed = old.dot(node.normal);
            let gap = node.rest_gap_mm + node.normal.dot(u);
            let press = (pressed - RELAXATION * gap / own.normal).max(0.0);
            let mut rub = DVec3::ZERO;
            if friction > 0.0 && press > 0.0 {
                u += own.block * node.normal * (press - pressed);
                let slip = u - node.carried_mm;
                let along = |v: DVec3| v - node.normal * v.dot(node.normal);
                rub = along(old - slip * (RELAXATION / own.along)).clamp_length_max(friction * press);
            }
            let new = node.normal * press + rub;
            if new != old {
                let step = new - old;
                ended.change_mm = ended.change_mm.max((own.block * step).length());
                forces[3 * i..3 * i + 3].copy_from_slice(&new.to_array());
            }
        }
    }
    ended
}
