use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DVec2, DVec3};
use proptest::prelude::*;

use super::fit::{FitError, MeasuredIn, Sample, fit};
use super::{Correction, Nominal, TransferLimit, TransferMap};

const RADIUS_MM: f64 = 10.0;

fn on_dome(polar_rad: f64, azimuth_rad: f64) -> DVec3 {
    let (s, c) = polar_rad.sin_cos();
    RADIUS_MM * DVec3::new(s * azimuth_rad.cos(), s * azimuth_rad.sin(), c)
}

fn nominal_map(nominal: Nominal) -> TransferMap {
    TransferMap::new(RADIUS_MM, nominal, None).unwrap()
}

fn correction() -> Correction {
    Correction {
        radial: vec![0.03, -0.05, 0.02],
        two_fold: [0.01, -0.006],
        two_fold_sideways: [-0.006, -0.012],
        rotation_rad: 0.02,
        offset_mm: DVec2::new(0.11, -0.07),
        max_polar_rad: 1.2,
    }
}

#[test]
fn nominal_radii_are_the_textbook_ones() {
    for (nominal, radius_mm) in [
        (Nominal::Orthographic, RADIUS_MM * 60f64.to_radians().sin()),
        (Nominal::Equidistant, RADIUS_MM * 60f64.to_radians()),
        (Nominal::EqualArea, RADIUS_MM * 2.0 * 30f64.to_radians().sin()),
    ] {
        let plate = nominal_map(nominal).plate_from_dome(on_dome(60f64.to_radians(), 0.7)).unwrap();
        assert!((plate.length() - radius_mm).abs() < 1e-13, "{nominal:?}");
        assert!((plate.to_angle() - 0.7).abs() < 1e-14);
    }
}

#[test]
fn equal_area_keeps_area_and_equidistant_keeps_meridians() {
    for polar_rad in [0.0, 1e-6, 0.3, 1.0, 1.5] {
        let at = on_dome(polar_rad, 2.1);
        let slope = nominal_map(Nominal::EqualArea).plate_from_dome_with_slope(at).unwrap().plate_from_dome;
        let area = slope[0].cross(slope[1]).dot(at / RADIUS_MM);
        assert!((area - 1.0).abs() < 1e-12, "area ratio {area} at {polar_rad}");
        let slope = nominal_map(Nominal::Equidistant).plate_from_dome_with_slope(at).unwrap().plate_from_dome;
        let down = on_dome(polar_rad + FRAC_PI_2, 2.1) / RADIUS_MM;
        let step = DVec2::new(slope[0].dot(down), slope[1].dot(down));
        assert!((step.length() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn slope_agrees_with_differences() {
    let measured = Nominal::ALL.map(|n| TransferMap::new(RADIUS_MM, n, Some(correction())).unwrap());
    let plain = Nominal::ALL.map(nominal_map);
    for map in measured.iter().chain(&plain) {
        for (polar_rad, azimuth_rad) in [(0.02, 0.3), (0.4, -2.0), (1.1, 1.0)] {
            let point = map.plate_from_dome_with_slope(on_dome(polar_rad, azimuth_rad)).unwrap();
            let h = 1e-5;
            for (d_polar, d_azimuth) in [(h, 0.0), (0.0, h)] {
                let (a, b) = (
                    on_dome(polar_rad - d_polar, azimuth_rad - d_azimuth),
                    on_dome(polar_rad + d_polar, azimuth_rad + d_azimuth),
                );
                let difference = map.plate_from_dome(b).unwrap() - map.plate_from_dome(a).unwrap();
                let predicted =
                    DVec2::new(point.plate_from_dome[0].dot(b - a), point.plate_from_dome[1].dot(b - a));
                let scale = difference.length();
                assert!((difference - predicted).length() < 1e-8 * scale, "{map:?} at {polar_rad}");
            }
        }
    }
}

#[test]
fn rim_and_beyond() {
    for nominal in Nominal::ALL {
        let map = nominal_map(nominal);
        let rim = map.plate_from_dome(on_dome(FRAC_PI_2, 0.4)).unwrap();
        let back = map.dome_from_plate(rim).unwrap();
        assert!((back - on_dome(FRAC_PI_2, 0.4)).length() < 1e-6);
        assert_eq!(map.dome_from_plate(rim * 1.0001), Err(TransferLimit::BeyondDome));
        assert_eq!(map.plate_from_dome(on_dome(1.6, 0.0)), Err(TransferLimit::BeyondDome));
        assert_eq!(map.plate_from_dome(DVec3::new(f64::NAN, 0.0, 1.0)), Err(TransferLimit::NotFinite));
        assert_eq!(map.dome_from_plate(DVec2::new(0.0, f64::INFINITY)), Err(TransferLimit::NotFinite));
        assert!(matches!(
            map.plate_from_dome(DVec3::new(0.0, 0.0, 9.99)),
            Err(TransferLimit::NotOnDome { off_mm }) if off_mm < 0.0
        ));
        assert_eq!(map.dome_from_plate(DVec2::ZERO).unwrap(), DVec3::new(0.0, 0.0, RADIUS_MM));
    }
}

#[test]
fn measured_map_ends_where_the_measurement_ends() {
    let map = TransferMap::new(RADIUS_MM, Nominal::Orthographic, Some(correction())).unwrap();
    let inside = map.plate_from_dome(on_dome(1.2, 2.0)).unwrap();
    assert!((map.dome_from_plate(inside).unwrap() - on_dome(1.2, 2.0)).length() < 1e-9);
    assert!(matches!(map.plate_from_dome(on_dome(1.21, 2.0)), Err(TransferLimit::BeyondMeasured { .. })));
    let outside = inside + (inside - correction().offset_mm) * 0.01;
    assert!(matches!(map.dome_from_plate(outside), Err(TransferLimit::BeyondMeasured { .. })));
}

#[test]
fn folding_maps_are_refused_by_name() {
    let mut folded = correction();
    folded.radial = vec![0.0, -0.5, 0.0];
    let error = TransferMap::new(RADIUS_MM, Nominal::Orthographic, Some(folded)).unwrap_err();
    assert_eq!(error.field, "measured");
    assert!(error.problem.contains("folds"), "{error}");
    // The orthographic map has no slope left at the rim: a measurement cannot reach it.
    let rim = Correction { max_polar_rad: FRAC_PI_2, ..correction() };
    assert!(TransferMap::new(RADIUS_MM, Nominal::Orthographic, Some(rim.clone())).is_err());
    assert!(TransferMap::new(RADIUS_MM, Nominal::Equidistant, Some(rim)).is_ok());
    let broken = Correction { radial: vec![f64::NAN], ..correction() };
    assert_eq!(
        TransferMap::new(RADIUS_MM, Nominal::Equidistant, Some(broken)).unwrap_err().field,
        "measured.radial"
    );
    assert_eq!(TransferMap::new(-1.0, Nominal::Equidistant, None).unwrap_err().field, "dome_radius_mm");
}

#[test]
fn a_pure_stretch_is_linear_at_the_pole() {
    let stretch = Correction {
        radial: vec![0.0],
        two_fold: [0.02, 0.01],
        two_fold_sideways: [0.01, -0.02],
        rotation_rad: 0.0,
        offset_mm: DVec2::ZERO,
        max_polar_rad: 1.0,
    };
    let map = TransferMap::new(RADIUS_MM, Nominal::Orthographic, Some(stretch)).unwrap();
    for k in 0..12 {
        let at = on_dome(0.5, TAU * f64::from(k) / 12.0);
        let expected = DVec2::new(at.x * 1.02 + at.y * 0.01, at.x * 0.01 + at.y * 0.98);
        assert!((map.plate_from_dome(at).unwrap() - expected).length() < 1e-12);
    }
}

/// Marks on rings and spokes, landed where they are listed, printed from where `plate` says.
fn printed(rings: u32, plate: impl Fn(DVec3) -> DVec2) -> Vec<Sample> {
    let mut samples = Vec::new();
    for ring in 1..=rings {
        for spoke in 0..6 * ring {
            let landed = on_dome(
                f64::from(ring) * 1.1 / f64::from(rings),
                TAU * f64::from(spoke) / f64::from(6 * ring),
            );
            let mark = samples.len() as u32;
            samples.push(Sample { plate_mm: plate(landed), landed, mark, print: 0 });
        }
    }
    samples
}

#[test]
fn fit_finds_the_map_that_printed() {
    for nominal in Nominal::ALL {
        let truth = TransferMap::new(RADIUS_MM, nominal, Some(correction())).unwrap();
        let samples = printed(6, |at| truth.plate_from_dome(at).unwrap());
        for measured_in in [MeasuredIn::View, MeasuredIn::Dome] {
            let found = fit(RADIUS_MM, &samples, measured_in, 1.1).unwrap();
            assert_eq!(found.nominal, nominal);
            assert!(found.residual_max_mm < 1e-8, "{found:?}");
            assert!(found.rejected.is_empty() && found.scatter_mm.is_none());
            assert!((found.correction.rotation_rad - 0.02).abs() < 1e-8);
            assert!((found.correction.offset_mm - correction().offset_mm).length() < 1e-7);
            for (a, b) in found.correction.radial.iter().zip(&correction().radial) {
                assert!((a - b).abs() < 1e-5, "{found:?}");
            }
            assert!((found.measured_to_rad - 1.1).abs() < 1e-12);
        }
    }
}

#[test]
fn fit_rejects_what_does_not_fit() {
    let truth = TransferMap::new(RADIUS_MM, Nominal::EqualArea, None).unwrap();
    let mut samples = printed(6, |at| truth.plate_from_dome(at).unwrap());
    for index in [3, 40, 77, 101] {
        samples[index].plate_mm += DVec2::new(0.4, -0.2);
    }
    let found = fit(RADIUS_MM, &samples, MeasuredIn::Dome, 1.1).unwrap();
    assert_eq!(found.rejected, [3, 40, 77, 101]);
    assert!(found.residual_max_mm < 1e-8);
}

#[test]
fn measurements_without_a_map_are_refused_by_name() {
    let round = TransferMap::new(RADIUS_MM, Nominal::Orthographic, None).unwrap();
    let plate = |at: DVec3| round.plate_from_dome(at).unwrap();
    let few = &printed(2, plate)[..9];
    assert!(matches!(fit(RADIUS_MM, few, MeasuredIn::View, 1.0), Err(FitError::TooFew { have: 9, .. })));
    let mut broken = printed(4, plate);
    broken[5].plate_mm.x = f64::NAN;
    assert_eq!(fit(RADIUS_MM, &broken, MeasuredIn::View, 1.0), Err(FitError::NotFinite { sample: 5 }));
    let same: Vec<Sample> = (0..20).map(|_| few[3].clone()).collect();
    assert_eq!(fit(RADIUS_MM, &same, MeasuredIn::View, 1.0), Err(FitError::Degenerate));
    // A pad that slides back: beyond 45 degrees its ink comes from nearer to the centre again.
    let folding = printed(6, |at| {
        let out = at.truncate();
        let polar_rad = out.length().atan2(at.z);
        out.normalize_or(DVec2::X) * RADIUS_MM * (2.0 * polar_rad).sin()
    });
    let refused = fit(RADIUS_MM, &folding, MeasuredIn::Dome, 1.1);
    assert!(matches!(refused, Err(FitError::Folds(_))), "{refused:?}");
    // Two marks of five mistaken.
    let mut mistaken = printed(4, plate);
    for (index, sample) in mistaken.iter_mut().enumerate().filter(|(index, _)| index % 5 < 2) {
        sample.plate_mm += DVec2::from_angle(index as f64) * (0.5 + 0.1 * index as f64);
    }
    let refused = fit(RADIUS_MM, &mistaken, MeasuredIn::Dome, 1.1);
    assert!(matches!(refused, Err(FitError::TooManyOutliers { .. })), "{refused:?}");
}

proptest! {
    #[test]
    fn round_trip_nominal(polar_rad in 0.0..1.55f64, azimuth_rad in 0.0..TAU, which in 0usize..3) {
        let map = nominal_map(Nominal::ALL[which]);
        let point = on_dome(polar_rad, azimuth_rad);
        let back = map.dome_from_plate(map.plate_from_dome(point).unwrap()).unwrap();
        // Near the rim the orthographic map's slope, cos(phi), stretches the plate's rounding.
        prop_assert!((back - point).length() < 1e-13 * RADIUS_MM / polar_rad.cos());
    }

    #[test]
    fn round_trip_measured(
        polar_rad in 0.0..1.2f64, azimuth_rad in 0.0..TAU, which in 0usize..3,
        c in prop::array::uniform3(-0.06..0.06f64), two in prop::array::uniform4(-0.03..0.03f64),
    ) {
        let correction = Correction {
            radial: c.to_vec(), two_fold: [two[0], two[1]], two_fold_sideways: [two[2], two[3]],
            ..correction()
        };
        let Ok(map) = TransferMap::new(RADIUS_MM, Nominal::ALL[which], Some(correction)) else {
            return Ok(());
        };
        let point = on_dome(polar_rad, azimuth_rad);
        let back = map.dome_from_plate(map.plate_from_dome(point).unwrap()).unwrap();
        prop_assert!((back - point).length() < 1e-11 * RADIUS_MM, "{:e}", (back - point).length());
    }

    #[test]
    fn any_place_gives_a_point_or_a_limit(x in -40.0..40.0f64, y in -40.0..40.0f64) {
        let map = TransferMap::new(RADIUS_MM, Nominal::EqualArea, Some(correction())).unwrap();
        match map.dome_from_plate(DVec2::new(x, y)) {
            Ok(point) => {
                prop_assert!((point.length() - RADIUS_MM).abs() < 1e-12);
                prop_assert!((map.plate_from_dome(point).unwrap() - DVec2::new(x, y)).length() < 1e-11);
            }
            Err(limit) => prop_assert!(matches!(limit, TransferLimit::BeyondMeasured { .. }), "{limit}"),
        }
    }
}
