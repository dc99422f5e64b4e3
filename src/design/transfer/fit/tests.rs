use std::f64::consts::TAU;
use std::ops::Range;

use glam::{DVec2, DVec3};

use domecast_optics::numeric::SeededRandom;

use super::*;
use crate::transfer::{Correction, Nominal, TransferMap};

const RADIUS_MM: f64 = 10.0;

fn on_dome(polar_rad: f64, azimuth_rad: f64) -> DVec3 {
    let (sin, cos) = polar_rad.sin_cos();
    RADIUS_MM * (DVec2::from_angle(azimuth_rad) * sin).extend(cos)
}

fn scattered(at: DVec3, scatter_mm: f64, random: &mut SeededRandom) -> DVec3 {
    let out = at.truncate().normalize_or(DVec2::X);
    let cos = at.z / RADIUS_MM;
    let down = (out * cos).extend(-at.truncate().length() / RADIUS_MM);
    let off = random.normal_pair() * scatter_mm;
    (at + down * off.x + out.perp().extend(0.0) * off.y).normalize() * RADIUS_MM
}

/// A pad that prints like one: near a nominal map, somewhat stretched, turned and shifted.
fn pad(random: &mut SeededRandom) -> TransferMap {
    loop {
        let nominal = Nominal::ALL[((random.uniform() * 3.0) as usize).min(2)];
        let mut c = |limit: f64| random.between(-limit, limit);
        let correction = Correction {
            radial: vec![c(0.05), c(0.05), c(0.03)],
            two_fold: [c(0.015), c(0.015)],
            two_fold_sideways: [c(0.015), c(0.015)],
            rotation_rad: c(0.2),
            offset_mm: DVec2::new(c(0.4), c(0.4)),
            max_polar_rad: 1.25,
        };
        if let Ok(map) = TransferMap::new(RADIUS_MM, nominal, Some(correction)) {
            return map;
        }
    }
}

/// A table as a person measures it, with the indices of the marks that are mistaken by more than the scatter.
struct Table {
    samples: Vec<Sample>,
    mistaken: Vec<usize>,
    scatter_mm: f64,
    map: TransferMap,
    measured_in: MeasuredIn,
}

fn table(seed: u64, share_of_mistakes: f64) -> Table {
    let mut random = SeededRandom::new(seed);
    let map = pad(&mut random);
    let rings = 2 + ((random.uniform() * 7.0) as usize).min(6) as u32;
    let prints = 1 + ((random.uniform() * 3.0) as usize).min(2);
    let scatter_mm = if random.uniform() < 0.1 { 0.0 } else { random.between(0.002, 0.05) };
    let reach_rad = random.between(0.7, 1.15);
    let mut samples = Vec::new();
    for print in 0..prints {
        let shift = random.normal_pair() * 0.3 * scatter_mm;
        for ring in 0..=rings {
            for spoke in 0..(6 * ring).max(1) {
                let polar_rad = reach_rad * f64::from(ring) / f64::from(rings);
                let at = on_dome(polar_rad, TAU * f64::from(spoke) / f64::from((6 * ring).max(1)));
                let mark = if ring == 0 { 0 } else { 3 * ring * (ring - 1) + 1 + spoke };
                // The plate is where the map says; the mark lands there, but for the scatter.
                let plate_mm = map.plate_from_dome(at).unwrap();
                let landed = scattered(at + shift.extend(0.0), scatter_mm, &mut random);
                samples.push(Sample { plate_mm, landed, mark, print });
            }
        }
    }
    let count = samples.len();
    let measured_in = if random.uniform() < 0.5 { MeasuredIn::View } else { MeasuredIn::Dome };
    let mut mistaken = Vec::new();
    while mistaken.len() < (share_of_mistakes * count as f64) as usize {
        let index = ((random.uniform() * count as f64) as usize).min(count - 1);
        if mistaken.contains(&index) {
            continue;
        }
        let before = samples[index].landed;
        samples[index].landed = match ((random.uniform() * 3.0) as usize).min(2) {
            // Read as another mark, smeared, or anywhere.
            0 => samples[((random.uniform() * count as f64) as usize).min(count - 1)].landed,
            1 => scattered(before, random.between(0.3, 1.0), &mut random),
            _ => on_dome(random.between(0.0, reach_rad).acos(), TAU * random.uniform()),
        };
        let off = samples[index].landed - before;
        let off_mm = if measured_in == MeasuredIn::View { off.truncate().length() } else { off.length() };
        if off_mm > 0.25 + 8.0 * scatter_mm {
            mistaken.push(index);
        } else {
            samples[index].landed = before;
        }
    }
    mistaken.sort_unstable();
    Table { samples, mistaken, scatter_mm, map, measured_in }
}

#[test]
fn good_tables_are_never_refused() {
    good_tables(0..40);
}

#[test]
fn long_good_tables_are_never_refused() {
    good_tables(40..300);
}

/// Tables with up to a fifth of the marks mistaken. That every mistake is found asks for more than that the table is
/// taken: seed 458, beyond these, is taken with one mistaken mark kept.
fn good_tables(seeds: Range<u64>) {
    let mut worst: f64 = 0.0;
    for seed in seeds {
        let share = 0.2 * SeededRandom::new(seed ^ 0xabcd).uniform();
        let table = table(seed, share);
        let (n, mistakes) = (table.samples.len(), table.mistaken.len());
        let found = fit(RADIUS_MM, &table.samples, table.measured_in, 1.1).unwrap_or_else(|error| {
            panic!("{seed}: {error} ({mistakes} of {n} mistaken, {})", table.scatter_mm)
        });
        // Every mistake is found, and hardly anything else.
        assert!(table.mistaken.iter().all(|i| found.rejected.contains(i)), "{seed}: {found:?}");
        let others = found.rejected.len() - mistakes;
        assert!(others as f64 <= 2.0 + 0.03 * n as f64, "{seed}: {others} good ones of {n} left out");
        if table.scatter_mm > 0.0 && n > 60 {
            let ratio = found.residual_rms_mm / (table.scatter_mm * 1.04);
            assert!(
                (0.7..1.3).contains(&ratio),
                "{seed}: rms {} of {}",
                found.residual_rms_mm,
                table.scatter_mm
            );
        }
        // The map is right where it was measured, as well as the scatter allows.
        let map = TransferMap::new(RADIUS_MM, found.nominal, Some(found.correction.clone())).unwrap();
        let mut squares = 0.0;
        let mut count = 0.0;
        for (i, sample) in table.samples.iter().enumerate().filter(|(i, _)| !table.mistaken.contains(i)) {
            let truth = table.map.dome_from_plate(sample.plate_mm).unwrap();
            if truth.z < RADIUS_MM * found.correction.max_polar_rad.cos() {
                continue;
            }
            let back = map.dome_from_plate(sample.plate_mm);
            let back = back.unwrap_or_else(|limit| panic!("{seed}: {i}: {limit}"));
            squares += back.distance_squared(truth);
            count += 1.0;
        }
        let error_mm = (squares / count).sqrt();
        let fair_mm = table.scatter_mm * (found.parameters as f64 / n as f64).sqrt().min(1.0) + 0.003;
        worst = worst.max(error_mm / fair_mm);
        assert!(
            error_mm < 3.0 * fair_mm,
            "{seed}: map off by {error_mm}, scatter {}, {n} samples",
            table.scatter_mm
        );
    }
    println!("worst error of a map over the fair one: {worst:.2}");
}

#[test]
fn bad_tables_are_always_refused() {
    bad_tables(0..6);
}

#[test]
fn long_bad_tables_are_always_refused() {
    bad_tables(6..40);
}

/// Tables with more than two fifths of the marks mistaken, and tables in disorder.
fn bad_tables(seeds: Range<u64>) {
    for seed in seeds {
        let mut random = SeededRandom::new(seed ^ 0x5a5a);
        let share = random.between(0.42, 0.9);
        let mut bad = table(seed, share);
        let refused = fit(RADIUS_MM, &bad.samples, bad.measured_in, 1.1);
        assert!(refused.is_err(), "{seed}: {share} mistaken of {}: {refused:?}", bad.samples.len());
        // Marks in an order of their own: not one stands where it should.
        let count = bad.samples.len();
        for i in (1..count).rev() {
            let other = ((random.uniform() * (i + 1) as f64) as usize).min(i);
            let landed = bad.samples[i].landed;
            bad.samples[i].landed = bad.samples[other].landed;
            bad.samples[other].landed = landed;
        }
        let refused = fit(RADIUS_MM, &bad.samples, bad.measured_in, 1.1);
        assert!(refused.is_err(), "{seed}: {refused:?}");
    }
}

#[test]
fn a_mirrored_table_and_a_wrong_unit_are_named() {
    for seed in 0..20 {
        let good = table(seed, 0.0);
        let mut mirrored = good.samples.clone();
        for sample in &mut mirrored {
            sample.landed.y = -sample.landed.y;
        }
        let refused = fit(RADIUS_MM, &mirrored, good.measured_in, 1.1);
        assert_eq!(refused, Err(FitError::Mirrored), "{seed}");
        let mut inches = good.samples.clone();
        for sample in &mut inches {
            let flat = sample.landed.truncate() / 25.4;
            sample.landed = flat.extend((RADIUS_MM * RADIUS_MM - flat.length_squared()).sqrt());
        }
        let refused = fit(RADIUS_MM, &inches, MeasuredIn::View, 1.1);
        assert!(matches!(refused, Err(FitError::OtherScale { .. })), "{seed}: {refused:?}");
    }
}
