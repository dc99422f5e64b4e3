//! Mistakes that turn a good table into another one: each with its name and what takes it back.

use super::types::Pair;
use crate::constants::{POSE_AXES, WRENCH_AXES};

/// A mistake that was made with a table.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mistake {
    /// What the table looks like, in words.
    pub name: String,
    /// What takes the mistake back.
    cure: Cure,
    /// Whether the mistake is of units alone, so that some of the rows may have it.
    pub is_unit: bool,
}

#[derive(Debug, Clone, PartialEq)]
enum Cure {
    /// Factors of the displacement and of the wrench.
    Scale([f64; 6], [f64; 6]),
    /// Two axes of the displacement (true) or of the wrench change places.
    Swap(bool, usize, usize),
    /// The reference's axes turn about z, rad.
    Turn(f64),
    /// Forces and moments change places.
    Blocks,
    /// Moments are about a point so far off in z, mm.
    Lever(f64),
    /// The wrench of the row so many further down belongs to the displacement.
    Shift(isize),
    /// The wrenches stand in the opposite order.
    Reverse,
}

const ONE: [f64; 6] = [1.0; 6];

/// Factors of the first and the last three axes.
fn halves(first: f64, last: f64) -> [f64; 6] {
    [first, first, first, last, last, last]
}

fn scale(name: &str, moves: [f64; 6], loads: [f64; 6]) -> Mistake {
    Mistake { name: name.into(), cure: Cure::Scale(moves, loads), is_unit: true }
}

fn units() -> Vec<Mistake> {
    vec![
        scale("degrees instead of rad (rx, ry, rz; factor 57.3)", halves(1.0, 1.0 / 57.295_779_513), ONE),
        scale("N m instead of N mm (Mx, My, Mz; factor 1000)", ONE, halves(1.0, 1000.0)),
        scale("N cm instead of N mm (Mx, My, Mz; factor 10)", ONE, halves(1.0, 10.0)),
        scale(
            "gram-force instead of N (Fx to Mz; factor 102)",
            ONE,
            halves(1.0 / 101.971_62, 1.0 / 101.971_62),
        ),
        scale("gram-force instead of N (Fx, Fy, Fz alone; factor 102)", ONE, halves(1.0 / 101.971_62, 1.0)),
        scale("kilogram-force instead of N (Fx to Mz; factor 9.81)", ONE, halves(9.806_65, 9.806_65)),
        scale("kilogram-force instead of N (Fx, Fy, Fz alone; factor 9.81)", ONE, halves(9.806_65, 1.0)),
        scale("kgf m instead of N mm (Mx, My, Mz) beside kgf (Fx, Fy, Fz)", ONE, halves(9.806_65, 9806.65)),
        scale("mN instead of N (Fx, Fy, Fz; factor 1000)", ONE, halves(1e-3, 1.0)),
        scale("mN and mN mm instead of N and N mm (factor 1000)", ONE, halves(1e-3, 1e-3)),
        scale("pound-force instead of N (Fx, Fy, Fz; factor 4.45)", ONE, halves(4.448_222, 1.0)),
        scale("lbf and lbf in instead of N and N mm (factors 4.45, 113)", ONE, halves(4.448_222, 112.984_83)),
        scale("m instead of mm (tx, ty, tz; factor 1000)", halves(1000.0, 1.0), ONE),
        scale("cm instead of mm (tx, ty, tz; factor 10)", halves(10.0, 1.0), ONE),
        scale("inches instead of mm (tx, ty, tz; factor 25.4)", halves(25.4, 1.0), ONE),
        scale("micrometres instead of mm (tx, ty, tz; factor 1000)", halves(1e-3, 1.0), ONE),
        scale("mrad instead of rad (rx, ry, rz; factor 1000)", halves(1.0, 1e-3), ONE),
        scale(
            "SI units instead of mm and N mm (m, N m; factor 1000)",
            halves(1000.0, 1.0),
            halves(1.0, 1000.0),
        ),
    ]
}

fn signs() -> Vec<Mistake> {
    let flip = |name: &str, loads: [f64; 6]| Mistake {
        name: name.into(),
        cure: Cure::Scale(ONE, loads),
        is_unit: false,
    };
    let mut all = vec![
        flip(
            "the opposite sign: the load that the sensor puts on the world, or poses inverted \
             (sensor_from_camera for camera_from_sensor)",
            [-1.0; 6],
        ),
        flip("the opposite sign of the forces (or of tx, ty, tz)", halves(-1.0, 1.0)),
        flip("the opposite sign of the moments (or of rx, ry, rz)", halves(1.0, -1.0)),
    ];
    for axis in 0..6 {
        let mut loads = ONE;
        loads[axis] = -1.0;
        let push = if axis == 2 { "; a push on the pole has Fz < 0 and tz < 0" } else { "" };
        let name = format!("the opposite sign of {} or of {}{push}", WRENCH_AXES[axis], POSE_AXES[axis]);
        all.push(flip(&name, loads));
    }
    let mirror = |axis: &str, loads: [f64; 6]| {
        flip(
            &format!("mirrored axes (the reference's {axis} points the other way: a left-handed frame)"),
            loads,
        )
    };
    all.push(mirror("x", [-1.0, 1.0, 1.0, 1.0, -1.0, -1.0]));
    all.push(mirror("y", [1.0, -1.0, 1.0, -1.0, 1.0, -1.0]));
    all.push(mirror("z", [1.0, 1.0, -1.0, -1.0, -1.0, 1.0]));
    all
}

fn axes() -> Vec<Mistake> {
    let plain = |name: String, cure: Cure| Mistake { name, cure, is_unit: false };
    let mut all = Vec::new();
    for a in 0..6 {
        for b in a + 1..6 {
            // Beside the axis a swap of the displacements looks the same.
            let beside = if a / 3 == b / 3 {
                format!(" (or {} and {})", POSE_AXES[a], POSE_AXES[b])
            } else {
                String::new()
            };
            let name = format!("{} and {} swapped{beside}", WRENCH_AXES[a], WRENCH_AXES[b]);
            all.push(plain(name, Cure::Swap(false, a, b)));
        }
    }
    for (a, b) in [(0, 1), (0, 2), (1, 2), (3, 4), (3, 5), (4, 5)] {
        let name = format!(
            "{} and {} swapped (or {} and {})",
            POSE_AXES[a], POSE_AXES[b], WRENCH_AXES[a], WRENCH_AXES[b]
        );
        all.push(plain(name, Cure::Swap(true, a, b)));
    }
    all.push(plain("forces and moments swapped".into(), Cure::Blocks));
    for step in 1..12 {
        let degrees = 30.0 * f64::from(step);
        let name = format!("axes of the reference turned about z by {degrees} degrees");
        all.push(plain(name, Cure::Turn(degrees.to_radians())));
    }
    all
}

/// Mistakes in how the rows of the two halves of a table go together.
pub(super) fn orders() -> Vec<Mistake> {
    let plain = |name: String, cure: Cure| Mistake { name, cure, is_unit: false };
    let mut all =
        vec![plain("unpaired rows: the wrenches stand in the opposite order".into(), Cure::Reverse)];
    for by in (-20..=20_isize).filter(|by| *by != 0) {
        let way = if by > 0 { "later" } else { "earlier" };
        let rows = if by.abs() == 1 { "row" } else { "rows" };
        let name =
            format!("unpaired rows: each wrench stands {} {rows} {way} than its displacement", by.abs());
        all.push(plain(name, Cure::Shift(by)));
    }
    all
}

/// Moments about a point so far off in z.
pub(super) fn lever(height_mm: f64) -> Mistake {
    let name = format!(
        "moments about another point than springs.at_mm, {:.1} mm off in z, by how Mx and My follow Fy and Fx",
        height_mm.abs()
    );
    Mistake { name, cure: Cure::Lever(height_mm), is_unit: false }
}

/// All mistakes that keep the rows together, the likeliest first.
pub(super) fn mistakes() -> Vec<Mistake> {
    let mut all = units();
    all.extend(signs());
    all.extend(axes());
    all
}

impl Mistake {
    /// Whether two mistakes are of units that differ: no column has two units.
    pub fn goes_with(&self, other: &Self) -> bool {
        let changed = |mistake: &Self| match &mistake.cure {
            Cure::Scale(moves, loads) => moves.iter().chain(loads).map(|v| *v != 1.0).collect(),
            _ => Vec::new(),
        };
        self.name != other.name && !changed(self).iter().zip(changed(other)).any(|(a, b)| *a && b)
    }

    /// Axes of the wrench whose readings or predictions it changes.
    pub fn axes(&self) -> Vec<usize> {
        match &self.cure {
            Cure::Scale(moves, loads) if moves.iter().all(|v| *v == 1.0) => {
                (0..6).filter(|axis| loads[*axis] != 1.0).collect()
            }
            _ => (0..6).collect(),
        }
    }

    /// The table without the mistake.
    pub fn taken_back(&self, pairs: &[Pair]) -> Vec<Pair> {
        let with = |change: &dyn Fn(&mut Pair)| {
            let changed = |pair: &Pair| {
                let mut pair = *pair;
                change(&mut pair);
                pair
            };
            pairs.iter().map(changed).collect::<Vec<Pair>>()
        };
        match &self.cure {
            Cure::Scale(moves, loads) => with(&|pair| {
                for axis in 0..6 {
                    pair.displacement[axis] *= moves[axis];
                    pair.wrench[axis] = pair.wrench[axis].map(|w| w * loads[axis]);
                }
            }),
            Cure::Swap(true, a, b) => with(&|pair| pair.displacement.swap(*a, *b)),
            Cure::Swap(false, a, b) => with(&|pair| pair.wrench.swap(*a, *b)),
            Cure::Blocks => with(&|pair| pair.wrench.rotate_left(3)),
            Cure::Turn(angle) => with(&|pair| {
                let (sin, cos) = angle.sin_cos();
                for first in [0, 3] {
                    if let (Some(x), Some(y)) = (pair.wrench[first], pair.wrench[first + 1]) {
                        pair.wrench[first] = Some(cos * x - sin * y);
                        pair.wrench[first + 1] = Some(sin * x + cos * y);
                    }
                }
            }),
            Cure::Lever(height_mm) => with(&|pair| {
                let [fx, fy, ..] = pair.wrench;
                pair.wrench[3] = pair.wrench[3].zip(fy).map(|(m, f)| m + height_mm * f);
                pair.wrench[4] = pair.wrench[4].zip(fx).map(|(m, f)| m - height_mm * f);
            }),
            Cure::Reverse => {
                let wrenches: Vec<_> = pairs.iter().rev().map(|pair| pair.wrench).collect();
                pairs.iter().zip(wrenches).map(|(pair, wrench)| Pair { wrench, ..*pair }).collect()
            }
            Cure::Shift(by) => {
                let at = |row: usize| pairs.get(row.checked_add_signed(*by)?);
                let both = pairs
                    .iter()
                    .enumerate()
                    .map(|(row, pair)| Some(Pair { wrench: at(row)?.wrench, ..*pair }));
                both.flatten().collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mistake_is_taken_back_to_a_table_of_its_own() {
        let pair = |k: f64| Pair {
            displacement: [0.1, 0.2, -0.7, 0.01, 0.02, 0.03].map(|v| v * k),
            displacement_covariance: nalgebra::Matrix6::zeros(),
            wrench: [1.0, 2.0, -7.0, 3.0, 4.0, 5.0].map(|v| Some(v * k)),
        };
        let table: Vec<Pair> = (1..30).map(|k| pair(f64::from(k))).collect();
        let all: Vec<Mistake> = mistakes().into_iter().chain(orders()).collect();
        let cured: Vec<Vec<Pair>> = all.iter().map(|mistake| mistake.taken_back(&table)).collect();
        for (index, one) in cured.iter().enumerate() {
            assert!(*one != table && !one.is_empty(), "{}", all[index].name);
            assert!(!cured[..index].contains(one), "{}", all[index].name);
        }
    }
}
