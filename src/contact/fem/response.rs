//! The dome's response in one harmonic.

use faer::Mat;

use super::body::Body;
use super::grid::Grid;
use crate::error::ContactError;

/// Directions in a node's frame: r, z, phi.
pub(super) const AXES: usize = 3;

/// One harmonic's response.
#[derive(Debug)]
pub(crate) struct Spectrum {
    /// First ring that this harmonic reaches.
    pub first_ring: usize,
    /// Column by column, (ring - first_ring, direction): the surface nodes' three amplitudes, hats included, mm/N.
    pub columns: Vec<Vec<f64>>,
}

/// Parts of a unit force by surface node and direction.
pub(super) type Load = Vec<((usize, usize), f64)>;

/// A ring's unit force along an axis in one harmonic, as parts of the surface nodes' (node, direction).
///
/// The pole is one node: it pushes along z in the harmonic 0 alone, and sideways in the harmonic 1 alone, where
/// the same force is half in u_r and half in -u_phi at every azimuth.
fn ring_load(grid: &Grid, hat: &[(usize, f64)], ring: usize, axis: usize, m: usize) -> Load {
    if grid.harmonics(ring) <= m {
        return Vec::new();
    }
    let factor = grid.hat_harmonic(ring, m);
    let along =
        |direction: usize, factor: f64| hat.iter().map(move |(p, part)| ((*p, direction), part * factor));
    match (ring, axis, m) {
        (0, 1, 0) => along(1, 1.0).collect(),
        (0, 0 | 2, 1) => {
            let half = if axis == 0 { 0.5 } else { -0.5 };
            along(0, half).chain(along(2, -half)).collect()
        }
        (0, ..) => Vec::new(),
        _ => along(axis, factor).collect(),
    }
}

/// A harmonic with what its rings see of each other with their own hats, column by column.
pub(super) type Solved = (Spectrum, Vec<f64>);

/// Solves one harmonic: the surface's response to every ring that has a hat, and the rings' own, hats included.
pub(super) fn harmonic(
    grid: &Grid,
    body: &Body,
    hats: &[Vec<(usize, f64)>],
    m: usize,
) -> Result<Solved, ContactError> {
    let first_ring = (0..hats.len()).find(|ring| grid.harmonics(*ring) > m).unwrap_or(hats.len());
    // Rings between that do not reach this harmonic have zero columns, and are rare.
    let loads: Vec<Load> = (0..AXES * (hats.len() - first_ring))
        .map(|column| {
            let ring = first_ring + column / AXES;
            ring_load(grid, &hats[ring], ring, column % AXES, m)
        })
        .collect();
    let (columns, own) = respond(body, &loads, m as f64)?;
    Ok((Spectrum { first_ring, columns }, own))
}

/// Amplitudes of the surface nodes for some loads, and of each load's nodes by its own weights.
pub(super) fn respond(
    body: &Body,
    loads: &[Load],
    m: f64,
) -> Result<(Vec<Vec<f64>>, Vec<f64>), ContactError> {
    let mut rhs = Mat::<f64>::zeros(body.unknowns(), loads.len());
    for (column, load) in loads.iter().enumerate() {
        for &((p, direction), part) in load {
            let (unknown, sign) = body.surface_unknown(p, direction);
            rhs[(unknown, column)] += sign * part;
        }
    }
    body.mask(m, &mut rhs);
    body.factor(m)?.solve(&mut rhs);
    let amplitudes = |column: usize| -> Vec<f64> {
        let nodes = (0..body.surface_nodes()).flat_map(|p| (0..AXES).map(move |axis| (p, axis)));
        nodes
            .map(|(p, axis)| {
                let (unknown, sign) = body.surface_unknown(p, axis);
                sign * rhs[(unknown, column)]
            })
            .collect()
    };
    let columns: Vec<Vec<f64>> = (0..loads.len()).map(amplitudes).collect();
    let mut own = Vec::with_capacity(loads.len() * loads.len());
    for values in &columns {
        for load in loads {
            own.push(load.iter().map(|&((p, direction), part)| part * values[AXES * p + direction]).sum());
        }
    }
    Ok((columns, own))
}
