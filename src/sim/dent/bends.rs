//! How sharply the displaced membrane bends, cell by cell: what tells a picture where it may fill in between rays.

use std::ops::Range;

use glam::Vec4;

use crate::sim::rests::{largest, rest};
use crate::sim::shading::Turned;

/// Bounds of a spline by cell, at the place of the cell's lower node.
#[derive(Debug, Clone, Default)]
pub(super) struct Bends {
    /// Third derivative of the displacement in any three directions, by the width of a cell: as the spline's derivatives
    /// are means of its coefficients' differences, the largest of those about the cell.
    third: Vec<f32>,
    /// Second derivative of the displacement in any two directions, 1/mm.
    pub second: Vec<f32>,
    /// Slope of the displacement.
    slope: Vec<f32>,
    /// Displacement, mm.
    moved: Vec<f32>,
    /// The largest slope of all.
    pub steepest: f32,
}

impl Bends {
    /// Of a square table of coefficients.
    pub fn new(moved: &[Vec4], nodes: usize, per_step: f32) -> Self {
        let (x, y) = (1, nodes);
        let (along_x, along_y) = (differences(moved, x), differences(moved, y));
        // Second differences at a node stand at the node before it.
        let (xx, yy, xy) = (differences(&along_x, x), differences(&along_y, y), differences(&along_y, x));
        let most = |table: &[Vec4], columns: Range<isize>, rows: Range<isize>| {
            let squares: Vec<f32> = table.iter().map(|v| v.length_squared()).collect();
            spread(&spread(&squares, x, columns), y, rows)
        };
        let xxx = most(&differences(&xx, x), -1..0, -1..3);
        let yyy = most(&differences(&yy, y), -1..3, -1..0);
        let xxy = most(&differences(&xx, y), -1..1, -1..2);
        let xyy = most(&differences(&yy, x), -1..2, -1..1);
        let (xx, yy, xy) = (most(&xx, -1..1, -1..3), most(&yy, -1..3, -1..1), most(&xy, -1..2, -1..2));
        let (along_x, along_y) = (most(&along_x, -1..2, -1..3), most(&along_y, -1..3, -1..2));
        let lengths = most(moved, -1..3, -1..3);
        // Cells at the table's edge lack nodes, and none in use asks.
        let is_inside = |i: usize| {
            let inner = 1..nodes.saturating_sub(2);
            inner.contains(&(i % nodes)) && inner.contains(&(i / nodes))
        };
        let table = |value: &dyn Fn(usize) -> f32| -> Vec<f32> {
            (0..moved.len()).map(|i| if is_inside(i) { value(i) } else { 0.0 }).collect()
        };
        // The largest value of a form of unit directions is at most its Frobenius norm.
        let slope = table(&|i| (along_x[i] + along_y[i]).sqrt() * per_step);
        Self {
            third: table(&|i| (xxx[i] + yyy[i] + 3.0 * (xxy[i] + xyy[i])).sqrt() * per_step),
            second: table(&|i| (xx[i] + yy[i] + 2.0 * xy[i]).sqrt() * per_step * per_step),
            moved: table(&|i| lengths[i].sqrt()),
            steepest: slope.iter().copied().fold(0.0, f32::max),
            slope,
        }
    }

    /// Those of a spline a part of the way to another.
    pub fn towards(&self, to: &Self, part: f32) -> Self {
        let mix = |a: f32, b: f32| a + (b - a) * part;
        let all = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| mix(*a, *b)).collect();
        Self {
            third: all(&self.third, &to.third),
            second: all(&self.second, &to.second),
            slope: all(&self.slope, &to.slope),
            moved: all(&self.moved, &to.moved),
            steepest: mix(self.steepest, to.steepest),
        }
    }

    /// The most that anything moves in some cells, mm.
    pub fn farthest(&self, nodes: usize, [columns, rows]: &[Range<usize>; 2]) -> f32 {
        largest(&self.moved, nodes, columns, rows)
    }

    /// Over some cells, with nodes so many cells apart.
    pub fn over(&self, nodes: usize, [columns, rows]: &[Range<usize>; 2], apart: f32) -> Turned {
        let most = |table: &[f32]| largest(table, nodes, columns, rows);
        Turned {
            tilt_rad: rest(most(&self.third), apart),
            slope: most(&self.slope),
            moved_mm: most(&self.moved),
        }
    }
}

/// Of each value of a table, what the one a way further has more; nothing where there is none.
fn differences(table: &[Vec4], way: usize) -> Vec<Vec4> {
    let further = table.get(way..).unwrap_or_default();
    let mut out: Vec<Vec4> = table.iter().zip(further).map(|(here, further)| *further - *here).collect();
    out.resize(table.len(), Vec4::ZERO);
    out
}

/// Of each value of a table, none of them negative or NaN, the largest of those so many ways further.
fn spread(table: &[f32], way: usize, steps: Range<isize>) -> Vec<f32> {
    let mut out = vec![0.0_f32; table.len()];
    for step in steps {
        let shift = step.unsigned_abs() * way;
        let (to, from) = if step < 0 { (shift, 0) } else { (0, shift) };
        let from = table.get(from..).unwrap_or_default();
        // Plain choices, of which machines make several at once.
        out.iter_mut()
            .skip(to)
            .zip(from)
            .for_each(|(out, value)| *out = if *value > *out { *value } else { *out });
    }
    out
}
