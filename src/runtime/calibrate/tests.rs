use nalgebra::{Matrix6, Vector6};

use super::force::{ForceModel, MotionNoise, Pair, fit};
use super::*;
use domecast_optics::numeric::SeededRandom;

fn truth() -> Matrix6<f64> {
    let mut k = Matrix6::from_diagonal(&Vector6::new(5.9, 6.1, 8.3, 420.0, 431.0, 560.0));
    for (i, j, v) in [(0, 4, 3.0), (4, 0, 3.0), (1, 3, -2.5), (3, 1, -2.5), (2, 5, 0.4), (5, 2, 0.4)] {
        k[(i, j)] = v;
    }
    k
}

const SIZES: [f64; 6] = [1e-3, 1e-3, 1e-3, 1e-4, 1e-4, 1e-4];

fn pairs(count: usize, noise: f64, wild: f64, seed: u64) -> Vec<Pair> {
    let mut random = SeededRandom::new(seed);
    let k = truth();
    (0..count)
        .map(|_| {
            let d: [f64; 6] = std::array::from_fn(|i| {
                let u = 2.0 * random.uniform() - 1.0;
                match i {
                    2 => -2.0 * random.uniform(),
                    0 | 1 => 0.3 * u,
                    _ => 0.04 * u,
                }
            });
            let w = k * Vector6::from(d);
            let range = [1.8, 1.8, 16.0, 17.0, 17.0, 22.0];
            let wrench = std::array::from_fn(|i| {
                let off = if random.uniform() < wild { 3.0 * range[i] * random.uniform() } else { 0.0 };
                Some(w[i] + noise * range[i] * random.normal() + off)
            });
            Pair { displacement: d, displacement_covariance: Matrix6::zeros(), wrench }
        })
        .collect()
}

#[test]
fn clean_data_give_the_matrix_back() {
    let found = fit(&pairs(60, 0.0, 0.0, 1), &Matrix6::identity(), &SIZES, MotionNoise::Stated).unwrap();
    assert_eq!(found.model, ForceModel::Linear);
    assert!(found.refused.is_empty(), "{:?}", found.refused);
    for i in 0..6 {
        for j in 0..6 {
            assert!(
                (found.stiffness[i][j] - truth()[(i, j)]).abs() < 1e-8,
                "{i} {j} {}",
                found.stiffness[i][j]
            );
        }
    }
}

// One per cent noise, five per cent outliers, all missing on one axis: nineteen of twenty entries inside their
// intervals, the missing axis by name, and its nominal row kept.
#[test]
fn noisy_data_with_outliers_and_a_missing_axis() {
    let (mut inside, mut all) = (0, 0);
    for seed in 0..8 {
        let mut data = pairs(300, 0.01, 0.05, 100 + seed);
        for pair in &mut data {
            pair.wrench[5] = None;
        }
        let nominal = Matrix6::identity() * 7.0;
        let found = fit(&data, &nominal, &SIZES, MotionNoise::Stated).unwrap();
        assert_eq!(found.model, ForceModel::Linear);
        assert_eq!(found.refused, ["Mz: no reading"]);
        assert_eq!(found.stiffness[5], [0.0, 0.0, 0.0, 0.0, 0.0, 7.0]);
        for (i, axis) in found.axes.iter().enumerate() {
            assert!(axis.outliers.len() > 3, "{}", axis.outliers.len());
            for j in 0..6 {
                let (miss, half) = (axis.coefficients[j] - truth()[(i, j)], axis.half_widths[j].unwrap());
                all += 1;
                inside += u32::from(miss.abs() <= half);
                assert!(miss.abs() < 3.0 * half, "{i} {j}: {miss} of {half}");
            }
            assert!(axis.hysteresis.unwrap().abs() < 0.02);
        }
    }
    let part = f64::from(inside) / f64::from(all);
    assert!(part > 0.9 && part < 0.99, "{part}");
}

#[test]
fn a_motion_that_is_not_there_is_refused() {
    let mut data = pairs(100, 0.01, 0.0, 5);
    for pair in &mut data {
        let w = truth() * Vector6::from(pair.displacement);
        pair.displacement[5] = 0.0;
        let still = truth() * Vector6::from(pair.displacement);
        for i in 0..6 {
            pair.wrench[i] = pair.wrench[i].map(|v| v - w[i] + still[i]);
        }
    }
    let found = fit(&data, &Matrix6::identity(), &SIZES, MotionNoise::Stated).unwrap();
    assert_eq!(found.refused, ["rz: does not vary in the data"]);
    assert_eq!(found.stiffness[5][5], 1.0);
    assert!((found.stiffness[2][2] - 8.3).abs() < 0.1);
}

#[test]
fn motions_that_go_together_are_not_separated() {
    let mut data = pairs(100, 0.01, 0.0, 6);
    for pair in &mut data {
        pair.displacement[4] = 0.1 * pair.displacement[0];
        let w = truth() * Vector6::from(pair.displacement);
        pair.wrench = std::array::from_fn(|i| Some(w[i]));
    }
    let found = fit(&data, &Matrix6::identity(), &SIZES, MotionNoise::Stated).unwrap();
    assert!(
        found.refused.iter().any(|r| r == "Fx by tx: the data do not separate it"),
        "{:?}",
        found.refused
    );
    assert!(
        found.refused.iter().any(|r| r == "My by ry: the data do not separate it"),
        "{:?}",
        found.refused
    );
    assert!((found.stiffness[2][2] - 8.3).abs() < 1e-6);
}

#[test]
fn offset_and_stiffening_are_found() {
    let mut data = pairs(300, 0.001, 0.02, 9);
    for pair in &mut data {
        pair.wrench[2] = pair.wrench[2].map(|w| w + 0.5);
    }
    let found = fit(&data, &Matrix6::identity(), &SIZES, MotionNoise::Stated).unwrap();
    assert_eq!(found.model, ForceModel::Affine);
    assert!((found.offset.unwrap()[2] - 0.5).abs() < 0.01);
    for pair in &mut data {
        let d = pair.displacement;
        pair.wrench[0] = pair.wrench[0].map(|w| w - 0.6 * d[2] * d[0]);
    }
    let found = fit(&data, &Matrix6::identity(), &SIZES, MotionNoise::Stated).unwrap();
    assert_eq!(found.model, ForceModel::Compressing);
    assert!((found.by_compression.unwrap()[0][0] - 0.6).abs() < 0.1, "{:?}", found.by_compression);
}

#[test]
fn too_little_is_said() {
    let data = pairs(5, 0.0, 0.0, 1);
    assert!(matches!(
        fit(&data, &Matrix6::identity(), &SIZES, MotionNoise::Stated),
        Err(force::ForceError::TooFew { .. })
    ));
    assert!(matches!(
        fit(&[], &Matrix6::identity(), &SIZES, MotionNoise::Stated),
        Err(force::ForceError::NoMotion)
    ));
}

#[test]
fn tables_name_their_faults() {
    let table = Table::parse("a, b\n1,\n# note\n\n2,x\n").unwrap();
    assert_eq!(table.number(0, 0), Ok(Some(1.0)));
    assert_eq!(table.number(0, 1), Ok(None));
    assert_eq!(table.required(0, 1).unwrap_err().line, 2);
    assert_eq!(table.number(1, 1).unwrap_err().line, 5);
    assert!(Table::parse("").is_err());
    assert!(Table::parse("a,a\n").is_err());
    assert!(Table::parse("a,b\n1,2,3\n").is_err());
}

// Noise of 0.03 mm and 0.003 rad in the displacements: plain least squares shrinks the diagonal by 3 to 10 per cent.
#[test]
fn noise_of_the_motions_does_not_shrink_the_stiffness() {
    let (mut squares, mut count) = (0.0, 0.0);
    let (mut plain_part, mut parts) = (0.0, [0.0; 2]);
    for seed in 0..24 {
        let mut random = SeededRandom::new(900 + seed);
        let sd = [0.03, 0.03, 0.03, 0.003, 0.003, 0.003];
        let exact = pairs(200, 0.005, 0.0, 300 + seed);
        let noisy: Vec<Pair> = exact
            .iter()
            .map(|pair| Pair {
                displacement: std::array::from_fn(|i| pair.displacement[i] + sd[i] * random.normal()),
                ..*pair
            })
            .collect();
        let stated: Vec<Pair> = noisy
            .iter()
            .map(|pair| Pair {
                displacement_covariance: Matrix6::from_diagonal(&Vector6::from(sd.map(|v| v * v))),
                ..*pair
            })
            .collect();
        let nominal = truth();
        let plain = fit(&noisy, &nominal, &SIZES, MotionNoise::Stated).unwrap();
        let known = fit(&stated, &nominal, &SIZES, MotionNoise::Stated).unwrap();
        let guessed = fit(&noisy, &nominal, &SIZES, MotionNoise::FromScatter).unwrap();
        plain_part += (plain.stiffness[0][0] / truth()[(0, 0)] - 1.0) / 24.0;
        for (part, found) in parts.iter_mut().zip([&known, &guessed]) {
            *part += (found.stiffness[0][0] / truth()[(0, 0)] - 1.0) / 24.0;
        }
        for (i, axis) in known.axes.iter().enumerate() {
            let sd = axis.half_widths[i].unwrap() / 1.96;
            squares += ((axis.coefficients[i] - truth()[(i, i)]) / sd).powi(2);
            count += 1.0;
        }
    }
    assert!(plain_part < -0.02, "{plain_part}");
    assert!(parts.iter().all(|part| part.abs() < 0.008), "{parts:?}");
    let rms = f64::sqrt(squares / count);
    assert!((0.85..1.15).contains(&rms), "{rms}");
}

// One axis after the other: no two motions ever go together, and five of six rows hold an axis still, where noise of the
// motions speaks against any stiffness.
#[test]
fn axes_that_move_one_after_the_other_are_all_found() {
    let sd = [0.03, 0.03, 0.03, 0.003, 0.003, 0.003];
    let size = [0.3, 0.3, 1.0, 0.04, 0.04, 0.04];
    for (seed, is_read_with_noise) in (0..12).flat_map(|seed| [(seed, true), (seed, false)]) {
        let mut random = SeededRandom::new(40 + seed);
        let mut row = |k: usize| {
            let wave = (f64::from(k as u32 % 25) / 24.0 * std::f64::consts::TAU).sin();
            let moved: [f64; 6] = std::array::from_fn(|i| if i == k / 25 { size[i] * wave } else { 0.0 });
            let load = truth() * Vector6::from(moved);
            let mut noise = || if is_read_with_noise { random.normal() } else { 0.0 };
            let displacement = std::array::from_fn(|i| moved[i] + sd[i] * noise());
            let wrench = std::array::from_fn(|i| Some(load[i] + 0.02 * truth()[(i, i)] * size[i] * noise()));
            let displacement_covariance = if is_read_with_noise {
                Matrix6::zeros()
            } else {
                Matrix6::from_diagonal(&Vector6::from(sd.map(|v| 1e-4 * v * v)))
            };
            Pair { displacement, wrench, displacement_covariance }
        };
        let rows: Vec<Pair> = (0..150).map(&mut row).collect();
        let found = fit(&rows, &truth(), &SIZES, MotionNoise::Stated).unwrap();
        for i in 0..6 {
            let part = found.stiffness[i][i] / truth()[(i, i)];
            assert!((0.7..1.2).contains(&part), "{seed} {is_read_with_noise}: axis {i}: {part}");
        }
    }
}
