//! How sharply the light bends over the membrane: what tells a picture where it may fill in between rays.

use std::ops::Range;

use glam::{Vec3A, Vec4};

use super::LightField;
use super::places::cells;
use super::shells::over;
use crate::rests::{Seconds, differences, rest, spread};
use crate::shading::{MovedBend, Turned};

/// By cell of the undeformed membrane's light, of which these are the spline's coefficients: bound on its third derivative
/// in any three directions, by the width of a cell.
pub(super) fn thirds(still: &[Vec4], nodes: usize) -> Vec<f32> {
    squared_thirds(still, nodes).into_iter().map(|third| third.max_element().sqrt()).collect()
}

/// The squares of such bounds, by channel.
pub(super) fn squared_thirds(table: &[Vec4], nodes: usize) -> Vec<Vec4> {
    let (along_x, along_y) = (differences(table, 1), differences(table, nodes));
    let most = |table: &[Vec4], columns, rows| squares(table, nodes, columns, rows);
    Seconds::new(&along_x, &along_y, nodes).thirds(nodes, most)
}

/// The largest squares, by channel, over some steps along x and y from each node.
pub(super) fn squares(table: &[Vec4], nodes: usize, columns: Range<isize>, rows: Range<isize>) -> Vec<Vec4> {
    let squares: Vec<Vec4> = table.iter().map(|v| *v * *v).collect();
    spread(&spread(&squares, 1, columns, Vec4::max), nodes, rows, Vec4::max)
}

impl LightField {
    /// How far the undeformed membrane's light may be from the surface of the second order through nine nodes, in rows
    /// of three, over a part of the dome that holds these directions from its centre: two parabolas' rests, from the
    /// largest third differences of the table's cells about.
    pub fn bend(&self, directions: &[Vec3A]) -> f32 {
        let (low, high) = cells(&self.scale, directions);
        let apart = 0.5 * (high - low).max_element();
        rest(over(&self.third, self.scale.nodes, low, high), apart)
    }

    /// The same for what the shells add where the membrane has moved, and for what they give a normal that is not quite
    /// known.
    pub fn moved_bend(&self, directions: &[Vec3A], turned: Turned) -> MovedBend {
        self.shells.as_ref().map_or(MovedBend::default(), |shells| shells.bend(directions, turned))
    }
}
