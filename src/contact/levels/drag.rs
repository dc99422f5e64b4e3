//! Friction of the whole contact, shared out among its nodes.

use crate::half_space::{Disc, Drag};
use crate::outcome::{Status, sum};
use crate::state::ContactState;

/// Sums the nodes and the drag into a wrench, shares the drag among the nodes by their pressure.
pub(super) fn share_out(state: &mut ContactState, disc: &Disc, drag: &Drag) {
    let pressed: f64 = state.nodes.iter().map(|n| n.pressure_mpa * n.area_mm2).sum();
    let twist: f64 = state
        .nodes
        .iter()
        .map(|n| n.pressure_mpa * n.area_mm2 * (n.at_mm - disc.at_mm).cross(disc.normal).length_squared())
        .sum();
    for node in &mut state.nodes {
        let load = node.pressure_mpa * node.area_mm2;
        if pressed > 0.0 {
            node.force_n += drag.force_n * (load / pressed);
        }
        if twist > 0.0 {
            let arm = node.at_mm - disc.at_mm;
            node.force_n += disc.normal.cross(arm) * (drag.torsion_nmm * load / twist);
        }
        node.sticks = drag.sticks;
    }
    state.wrench = sum(&state.nodes);
    state.status = Status::Solved;
    state.iterations = 1;
    state.history.tangential_n = drag.force_n;
    state.history.torsion_nmm = drag.torsion_nmm;
}
