//! What surfaces of the second order leave of smooth tables: shared by those of the membrane and of its light.

use std::ops::Range;

/// A parabola through three nodes leaves a third derivative times the cube of their distance over this: 9 times the root
/// of 3.
const REST: f32 = 15.59;
/// Two parabolas' rests, one across the other: the second sees the first one's through its weights, whose sizes add to at
/// most 1.25.
pub(super) const BOTH: f32 = 2.25;

/// What the surface through nine nodes so far apart leaves of a table whose third derivatives are at most this.
pub(super) fn rest(third: f32, apart: f32) -> f32 {
    BOTH * third * apart * apart * apart / REST
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
