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
        let count = nodes * nodes;
        let at = |i: usize| moved.get(i).copied().unwrap_or(Vec4::ZERO);
        let table = |value: &dyn Fn(usize) -> f32| -> Vec<f32> { (0..count).map(value).collect() };
        // Squares of the differences' lengths. Beyond the table's end they mean nothing, and no cell in use asks.
        let (x, y) = (1, nodes);
        let second = |i: usize, way: usize| at(i.wrapping_sub(way)) - at(i) * 2.0 + at(i + way);
        let third = |way: usize| {
            table(&|i| {
                (at(i + 2 * way) - at(i.wrapping_sub(way)) + (at(i) - at(i + way)) * 3.0).length_squared()
            })
        };
        let pure = |way: usize| table(&|i| second(i, way).length_squared());
        let [xx, yy] = [x, y].map(pure);
        let xy = table(&|i| (at(i + x + y) - at(i + x) - at(i + y) + at(i)).length_squared());
        let mixed = |twice: usize, once: usize| {
            table(&|i| (second(i + once, twice) - second(i, twice)).length_squared())
        };
        let [xxx, yyy, xxy, xyy] = [third(x), third(y), mixed(x, y), mixed(y, x)];
        let [along_x, along_y] = [x, y].map(|way| table(&|i| (at(i + way) - at(i)).length_squared()));
        let lengths = table(&|i| at(i).length_squared());
        let mut bends = Self {
            third: vec![0.0; count],
            second: vec![0.0; count],
            slope: vec![0.0; count],
            moved: vec![0.0; count],
            steepest: 0.0,
        };
        let most = |table: &[f32], columns: Range<usize>, rows: Range<usize>| {
            let mut most = 0.0_f32;
            for row in rows {
                let row = table.get(row * nodes + columns.start..row * nodes + columns.end);
                most = row.unwrap_or_default().iter().copied().fold(most, f32::max);
            }
            most
        };
        for j in 1..nodes.saturating_sub(2) {
            for i in 1..nodes.saturating_sub(2) {
                let cell = j * nodes + i;
                // The largest value of a cubic form of unit directions is at most its Frobenius norm.
                let third = most(&xxx, i..i + 1, j - 1..j + 3)
                    + most(&yyy, i - 1..i + 3, j..j + 1)
                    + 3.0 * (most(&xxy, i..i + 2, j - 1..j + 2) + most(&xyy, i - 1..i + 2, j..j + 2));
                let twice = most(&xx, i..i + 2, j - 1..j + 3)
                    + most(&yy, i - 1..i + 3, j..j + 2)
                    + 2.0 * most(&xy, i - 1..i + 2, j - 1..j + 2);
                let slope =
                    most(&along_x, i - 1..i + 2, j - 1..j + 3) + most(&along_y, i - 1..i + 3, j - 1..j + 2);
                bends.third[cell] = third.sqrt() * per_step;
                bends.second[cell] = twice.sqrt() * per_step * per_step;
                bends.slope[cell] = slope.sqrt() * per_step;
                bends.moved[cell] = most(&lengths, i - 1..i + 3, j - 1..j + 3).sqrt();
                bends.steepest = bends.steepest.max(bends.slope[cell]);
            }
        }
        bends
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
