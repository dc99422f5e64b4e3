//! Stiffness as the constants carry it: rows, and a table over the compression.

use nalgebra::Matrix6;

use super::model::{SpringConstants, StiffnessAt};
use domecast_springs::Displacement;

/// Rows of a matrix, as the constants carry it.
pub fn rows(matrix: &Matrix6<f64>) -> [[f64; 6]; 6] {
    std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)]))
}

/// A matrix from its rows.
pub fn matrix_of(rows: &[[f64; 6]; 6]) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| rows[i][j])
}

/// The wrench of a displacement by the constants: the 6x6 interpolated at the compression (linearly between the
/// tabulated ones, the nearest beyond them), or the one at rest where there is no table.
pub fn wrench_by_table(springs: &SpringConstants, displacement: &Displacement) -> [f64; 6] {
    let d = nalgebra::Vector6::from(displacement.to_array());
    let at_rest = matrix_of(&springs.stiffness);
    (stiffness_between(&springs.stiffness_at, &at_rest, -displacement.translation_mm.z) * d).into()
}

/// The 6x6 of a table at a compression (mm): linear between two entries, the nearest beyond them, `at_rest` where
/// there is no table.
pub fn stiffness_between(table: &[StiffnessAt], at_rest: &Matrix6<f64>, compression_mm: f64) -> Matrix6<f64> {
    let above = table.partition_point(|entry| entry.compression_mm <= compression_mm);
    match (above.checked_sub(1).and_then(|i| table.get(i)), table.get(above)) {
        (Some(low), Some(high)) => {
            let part = (compression_mm - low.compression_mm) / (high.compression_mm - low.compression_mm);
            matrix_of(&low.stiffness) * (1.0 - part) + matrix_of(&high.stiffness) * part
        }
        (Some(end), None) | (None, Some(end)) => matrix_of(&end.stiffness),
        (None, None) => *at_rest,
    }
}
