//! What surfaces of the second order leave of smooth tables: shared by those of the membrane and of its light.

use std::ops::{Add, Mul, Range};

use glam::Vec4;

/// A parabola through three nodes leaves a third derivative times the cube of their distance over this: 9 times the root
/// of 3.
const REST: f32 = 15.59;
/// Two parabolas' rests, one across the other: the second sees the first one's through its weights, whose sizes add to at
/// most 1.25.
const BOTH: f32 = 2.25;
/// Where the second derivative jumps once in each cell, by as much as the third one would make of it over a cell, parabolas
/// through nodes some cells apart leave that jump times the square of their distance times the first of these, or the cube
/// over [`REST`] and the square times the second: the largest sums of Peano's kernel over the jumps.
const ONE_JUMP: f32 = 0.08;
const JUMPS: f32 = 0.01;

/// What the surface through nine nodes so far apart leaves of a table whose third derivatives are at most this.
pub(super) fn rest(third: f32, apart: f32) -> f32 {
    BOTH * third * apart * apart * apart / REST
}

/// The same of a quadratic spline, nodes so many of its cells apart, of which the second derivatives jump by at most this.
pub(super) fn rest_of_jumps(jump: f32, apart: f32) -> f32 {
    BOTH * jump * apart * apart * (apart / REST + JUMPS).max(ONE_JUMP)
}

/// The largest value of a square table in some columns and rows; none is NaN.
pub(super) fn largest(table: &[f32], nodes: usize, columns: &Range<usize>, rows: &Range<usize>) -> f32 {
    let row = |row: usize| {
        let row = table.get(row * nodes + columns.start..row * nodes + columns.end).unwrap_or_default();
        // Plain choices, of which machines make several at once.
        row.iter().fold(0.0_f32, |a, b| if *b > a { *b } else { a })
    };
    rows.clone().map(row).fold(0.0, f32::max)
}

/// Of each value of a table, what the one a way further has more; nothing where there is none.
pub(super) fn differences(table: &[Vec4], way: usize) -> Vec<Vec4> {
    let further = table.get(way..).unwrap_or_default();
    let mut out: Vec<Vec4> = table.iter().zip(further).map(|(here, further)| *further - *here).collect();
    out.resize(table.len(), Vec4::ZERO);
    out
}

/// Of each value of a table, the larger of those so many ways further, as some rule tells which that is.
pub(super) fn spread<T: Copy + Default>(
    table: &[T],
    way: usize,
    steps: Range<isize>,
    larger: impl Fn(T, T) -> T,
) -> Vec<T> {
    let mut out = vec![T::default(); table.len()];
    for step in steps {
        let shift = step.unsigned_abs() * way;
        let (to, from) = if step < 0 { (shift, 0) } else { (0, shift) };
        let from = table.get(from..).unwrap_or_default();
        out.iter_mut().skip(to).zip(from).for_each(|(out, value)| *out = larger(*out, *value));
    }
    out
}

/// Second differences of a square table, each at the node before it: along x, along y, and along both.
pub(super) struct Seconds {
    pub xx: Vec<Vec4>,
    pub yy: Vec<Vec4>,
    pub xy: Vec<Vec4>,
}

impl Seconds {
    /// From the first differences along x and y.
    pub fn new(along_x: &[Vec4], along_y: &[Vec4], nodes: usize) -> Self {
        Self { xx: differences(along_x, 1), yy: differences(along_y, nodes), xy: differences(along_y, 1) }
    }

    /// By cell, at the place of its lower node: the square of the largest third derivative in any three directions of the
    /// spline with these coefficients, by the width of a cell; nothing for cells at the table's edge, which lack nodes. Its
    /// derivatives are means of its coefficients' differences: of those about the cell, `most` tells the largest square over
    /// some steps along x and y. The largest value of a cubic form of unit directions is at most its Frobenius norm.
    pub fn thirds<T: Copy + Default + Add<Output = T> + Mul<f32, Output = T>>(
        &self,
        nodes: usize,
        most: impl Fn(&[Vec4], Range<isize>, Range<isize>) -> Vec<T>,
    ) -> Vec<T> {
        let xxx = most(&differences(&self.xx, 1), -1..0, -1..3);
        let yyy = most(&differences(&self.yy, nodes), -1..3, -1..0);
        let xxy = most(&differences(&self.xx, nodes), -1..1, -1..2);
        let xyy = most(&differences(&self.yy, 1), -1..2, -1..1);
        inside(nodes, |i| xxx[i] + yyy[i] + (xxy[i] + xyy[i]) * 3.0)
    }
}

/// A value for each cell of a square table, at the place of its lower node, that does not lie at the edge.
pub(super) fn inside<T: Copy + Default>(nodes: usize, value: impl Fn(usize) -> T) -> Vec<T> {
    let inner = 1..nodes.saturating_sub(2);
    let is_inside = |i: usize| inner.contains(&(i % nodes)) && inner.contains(&(i / nodes));
    (0..nodes * nodes).map(|i| if is_inside(i) { value(i) } else { T::default() }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parabolas through nodes of a function of which the second derivative jumps by one at knots one apart, with the
    /// worst signs: as the sum of what each jump leaves.
    #[test]
    fn jumps_leave_no_more_than_is_told() {
        for apart in [0.1_f32, 0.3, 0.5, 0.8, 1.0, 1.3, 1.7, 2.5, 4.0] {
            let mut worst = 0.0_f32;
            for phase in (0..16).map(|k| k as f32 / 16.0) {
                for x in (-40..=40).map(|k| k as f32 / 40.0 * apart) {
                    let mut left = 0.0;
                    for knot in (-6..=6).map(|k| k as f32 + phase) {
                        let f = |x: f32| 0.5 * (x - knot).max(0.0).powi(2);
                        let (a, b, c) = (f(-apart), f(0.0), f(apart));
                        let t = x / apart;
                        left += (f(x) - (b + 0.5 * (c - a) * t + 0.5 * (a - 2.0 * b + c) * t * t)).abs();
                    }
                    worst = worst.max(left);
                }
            }
            let told = rest_of_jumps(1.0, apart) / BOTH;
            assert!(worst <= told && told < 1.3 * worst, "{apart}: {worst} {told}");
        }
    }
}
