//! What the geometry says of the springs: the yardstick of a measured table.

use nalgebra::{Matrix6, Vector6};

use super::statistics::{quantile, sorted};
use super::types::Pair;
use crate::constants::{
    POSE_AXES, SpringConstants, StiffnessAt, WRENCH_AXES, matrix_of, rows, stiffness_between,
};

/// Travel where the constants do not say what the springs are made of, mm, and the turn that goes with it, rad.
const TRAVEL_MM: f64 = 5.0;
const TURN_RAD: f64 = 0.5;
/// A single value so many times beyond what the springs can do is none of theirs.
const MAX_BEYOND: f64 = 10.0;
/// What nine tenths of the values must keep to, in parts of what the springs can do.
const MAX_USE: f64 = 1.5;
/// Compressions at which the law is tabulated.
const STEPS: u32 = 5;

/// The springs by their geometry.
#[derive(Debug, Clone)]
pub(super) struct SpringReference {
    pub stiffness: Matrix6<f64>,
    table: Vec<StiffnessAt>,
    /// How far each axis of the displacement can go (mm, rad), and what load that takes (N, N*mm).
    pub travel: [f64; 6],
    pub capacity: [f64; 6],
}

impl SpringReference {
    /// By the law where the constants have it: their own 6x6 may be measured already.
    pub fn new(springs: &SpringConstants) -> Self {
        let (mut stiffness, mut table) = (matrix_of(&springs.stiffness), springs.stiffness_at.clone());
        let deepest = table.last().map_or(TRAVEL_MM, |entry| entry.compression_mm);
        let mut travel = [deepest, deepest, deepest, TURN_RAD, TURN_RAD, TURN_RAD];
        let law = springs.law.as_ref().and_then(|law| law.suspension(springs.at_mm).ok());
        if let Some((law, own)) = law.and_then(|law| Some((law.stiffness().ok()?, law))).map(|(k, l)| (l, k))
        {
            stiffness = own;
            let left = law.spec().spring.solid_compression_mm() - law.rest_compression_mm();
            let turn = (left / law.reach_mm()).max(0.1);
            travel = [left, left, left, turn, turn, turn].map(|v: f64| v.abs().max(1e-3));
            let at = |step: u32| {
                let compression_mm = 0.9 * left * f64::from(step) / f64::from(STEPS);
                let stiffness = rows(&law.stiffness_at(compression_mm).ok()?);
                Some(StiffnessAt { compression_mm, stiffness })
            };
            table = (0..=STEPS).map_while(at).collect();
        }
        // Springs grow stiffer sideways and softer in tilt as they shorten, by less than this.
        let capacity = std::array::from_fn(|i| {
            1.5 * (0..6).map(|j| stiffness[(i, j)].abs() * travel[j]).fold(0.0, f64::max)
        });
        Self { stiffness, table, travel, capacity }
    }

    /// The wrench of a displacement by the geometry.
    pub fn wrench(&self, displacement: &[f64; 6]) -> [f64; 6] {
        let stiffness = stiffness_between(&self.table, &self.stiffness, -displacement[2]);
        (stiffness * Vector6::from(*displacement)).into()
    }

    /// Least range of the predicted readings of an axis that says anything of it: what displacements of these sizes do.
    pub fn min_range(&self, axis: usize, sizes: &[f64; 6]) -> f64 {
        2.0 * (0..6).map(|j| self.stiffness[(axis, j)].abs() * sizes[j]).sum::<f64>()
    }

    /// Whether nine of ten rows keep to what the springs can do.
    pub fn holds_nearly_all(&self, pairs: &[Pair]) -> bool {
        (0..6).all(|axis| {
            let ninth = |values: Vec<f64>| quantile(&sorted(&values), 0.9);
            let moves = ninth(pairs.iter().map(|pair| pair.displacement[axis].abs()).collect());
            let loads = ninth(pairs.iter().filter_map(|pair| Some(pair.wrench[axis]?.abs())).collect());
            moves <= MAX_USE * self.travel[axis] && loads <= MAX_USE * self.capacity[axis]
        })
    }

    /// The largest part of the travel, or of the capacity, that the rows use.
    pub fn largest_use(&self, pairs: &[Pair]) -> f64 {
        let part = |pair: &Pair| {
            (0..6).map(|axis| pair.displacement[axis].abs() / self.travel[axis]).fold(0.0, f64::max)
        };
        quantile(&sorted(&pairs.iter().map(part).collect::<Vec<_>>()), 0.9)
    }

    /// The first value that no springs of this kind can show, in words; `lines`: the rows' lines in their table.
    pub fn beyond(&self, pairs: &[Pair], lines: &[usize]) -> Option<String> {
        let found_beyond = |axis: usize, values: &dyn Fn(&Pair) -> Option<f64>, limit: f64| {
            let beyond = |pair: &Pair| values(pair).is_some_and(|v| v.abs() > MAX_USE * limit);
            let count = pairs.iter().filter(|pair| beyond(pair)).count();
            let worst =
                pairs.iter().position(|pair| values(pair).is_some_and(|v| v.abs() > MAX_BEYOND * limit));
            let row = worst
                .or_else(|| (10 * count > pairs.len()).then(|| pairs.iter().position(beyond)).flatten())?;
            Some((axis, row, values(&pairs[row])?, count))
        };
        (0..6).find_map(|axis| {
            let (moves, loads) =
                (|pair: &Pair| Some(pair.displacement[axis]), |pair: &Pair| pair.wrench[axis]);
            let at_travel =
                found_beyond(axis, &moves, self.travel[axis]).map(|found| (POSE_AXES, found, self.travel));
            let at_load = || {
                found_beyond(axis, &loads, self.capacity[axis])
                    .map(|found| (WRENCH_AXES, found, self.capacity))
            };
            let (names, (axis, row, value, count), limits) = at_travel.or_else(at_load)?;
            let line =
                lines.get(row).map_or_else(|| format!("row {}", row + 1), |line| format!("line {line}"));
            let others = if count > 1 { format!(" ({count} rows are beyond)") } else { String::new() };
            Some(format!(
                "{line}: {} {value:.4e} is beyond the sensor, whose springs end at {:.3}{others}",
                names[axis], limits[axis]
            ))
        })
    }
}
