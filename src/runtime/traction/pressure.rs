//! The pressure at every pixel of a height map.

use glam::DVec3;

use super::forces::ForceDistribution;
use super::pressure_room::Borne;
use crate::shape::ShapeMap;

/// Pressure on the skin over the raw image, row by row; NaN where a height map has nothing, or nothing is known of the forces.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PressureMap {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Normal force on the skin over its area as it is now, N/mm2; not negative.
    pub pressure_n_mm2: Vec<f32>,
    /// Its standard deviation, N/mm2: what dots, wrench and heights leave open. What nodes are too coarse to tell is not in it.
    pub pressure_sd_n_mm2: Vec<f32>,
}

/// What the skin's own shape may be off between nodes, as a part of the pressure.
const SHAPE_PART: f64 = 0.2;

impl ForceDistribution {
    /// Draws the last frame's pressures onto the grid of its height map. Where the skin is seen to be touched, the forces of the
    /// nodes are shared out as its own shape says (`|k|` times its depth in the Fourier plane, as for a half-space), which is
    /// finer than the nodes; elsewhere as the nodes have them.
    pub fn draw_pressure(&mut self, map: &ShapeMap, out: &mut PressureMap) {
        (out.width, out.height) = (map.width, map.height);
        for list in [&mut out.pressure_n_mm2, &mut out.pressure_sd_n_mm2] {
            list.clear();
            list.resize(map.width * map.height, f32::NAN);
        }
        if self.result().dots.is_empty() {
            return;
        }
        let count = self.model.nodes.len();
        for node in 0..count {
            let alone = self.model.pressure_sd_n_mm2;
            let sd = self.posterior.sd_of(std::iter::once((node, 1.0))).unwrap_or(alone);
            self.node_sd_n_mm2[node] = if self.set.allowed[node] { sd } else { 0.0 };
        }
        let mut room = std::mem::take(&mut self.room);
        self.find_borne(map, &mut room.borne);
        room.touched.clear();
        room.touched.resize(count, 0.0);
        let (borne, touched, mut own_sum) = (&room.borne, &mut room.touched, 0.0);
        for one in borne {
            own_sum += one.own * one.area_mm2;
            one.nodes.iter().for_each(|(node, hat)| touched[*node] += hat * one.own);
        }
        let pooled = (0..count).filter(|node| touched[*node] > 0.0);
        let pooled_n: f64 =
            pooled.map(|node| self.set.tractions[node] * self.model.nodes[node].area_mm2).sum();
        let scale = if own_sum > 0.0 { pooled_n / own_sum } else { 0.0 };
        for list in &mut room.values {
            list.clear();
            list.resize(map.cell_count(), f32::NAN);
        }
        for one in borne {
            let (mut pressure, mut sd) = (one.own * scale, 0.0);
            for (node, hat) in one.nodes {
                let hat = hat / self.stretch[node];
                pressure += if touched[node] > 0.0 { 0.0 } else { hat * self.set.tractions[node] };
                sd += hat * self.node_sd_n_mm2[node];
            }
            room.values[0][one.cell] = pressure as f32;
            room.values[1][one.cell] = sd.hypot(SHAPE_PART * pressure) as f32;
        }
        map.draw_cells(&room.values[0], &mut out.pressure_n_mm2);
        map.draw_cells(&room.values[1], &mut out.pressure_sd_n_mm2);
        self.room = room;
    }

    /// Finds the cells that show the skin, with the nodes that bear on them.
    fn find_borne(&self, map: &ShapeMap, found: &mut Vec<Borne>) {
        let dome = *self.optics.dome();
        let points = (0..map.cell_count()).map(|cell| (cell, map.cell_point(cell)));
        let shown = points.filter(|(_, point)| point.is_finite());
        let borne = shown.map(|(cell, point)| {
            let at_mm = dome.nearest_mm(point.as_dvec3());
            let about = |at_mm: DVec3| {
                let mut nodes = [(0, 0.0); 4];
                nodes.iter_mut().zip(self.model.about(at_mm)).for_each(|(to, from)| *to = from);
                nodes
            };
            let mut nodes = about(at_mm);
            if nodes.iter().any(|(node, hat)| *hat > 0.0 && self.set.tractions[*node] > 0.0) {
                // What is there now came from beside.
                let moved = nodes.iter().map(|(node, hat)| self.nodes_moved_mm[*node] * *hat);
                nodes = about(at_mm - moved.sum::<DVec3>());
            }
            let area_mm2 = map.cell_area_mm2(cell);
            Borne { cell, area_mm2, nodes, own: f64::from(map.own_pressure(cell)) }
        });
        found.clear();
        found.extend(borne);
    }
}
