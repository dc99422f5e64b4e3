//! How sharply the displaced membrane bends, cell by cell: what tells a picture where it may fill in between rays.

use std::ops::Range;

use glam::Vec4;

use crate::rests::{Seconds, differences, inside, largest, rest, spread};
use crate::shading::Turned;

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
        let (along_x, along_y) = (differences(moved, 1), differences(moved, nodes));
        let seconds = Seconds::new(&along_x, &along_y, nodes);
        // Plain choices, of which machines make several at once.
        let larger = |a: f32, b: f32| if b > a { b } else { a };
        let most = |table: &[Vec4], columns: Range<isize>, rows: Range<isize>| {
            let squares: Vec<f32> = table.iter().map(|v| v.length_squared()).collect();
            spread(&spread(&squares, 1, columns, larger), nodes, rows, larger)
        };
        let thirds = seconds.thirds(nodes, most);
        let Seconds { xx, yy, xy } = seconds;
        let (xx, yy, xy) = (most(&xx, -1..1, -1..3), most(&yy, -1..3, -1..1), most(&xy, -1..2, -1..2));
        let (along_x, along_y) = (most(&along_x, -1..2, -1..3), most(&along_y, -1..3, -1..2));
        let lengths = most(moved, -1..3, -1..3);
        // The largest value of a form of unit directions is at most its Frobenius norm.
        let slope = inside(nodes, |i| (along_x[i] + along_y[i]).sqrt() * per_step);
        Self {
            third: thirds.into_iter().map(|third| third.sqrt() * per_step).collect(),
            second: inside(nodes, |i| (xx[i] + yy[i] + 2.0 * xy[i]).sqrt() * per_step * per_step),
            moved: inside(nodes, |i| lengths[i].sqrt()),
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
