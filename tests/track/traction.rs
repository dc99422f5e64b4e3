//! Forces on the skin: what the constants must say, and that nothing is allocated once it runs.

use domecast::shape::ShapeMap;
use domecast::track::TrackOptions;
use domecast::traction::{ForceDistribution, PressureMap, TractionStatus};
use glam::DVec3;

use super::render::{Picture, still};
use super::{SENSOR, drawn, frame, pose, tracker};

/// A dent about a place of the dome, as far as this test needs one.
fn dent(p: DVec3) -> DVec3 {
    let off = p - DVec3::new(3.0, 0.0, 9.5);
    let q = (-off.length_squared() / 8.0).exp();
    p + (off * 0.12 - p * 0.03) * q
}

#[test]
fn constants_without_an_elastomer_are_refused_by_name() {
    let mut constants = SENSOR.constants.clone();
    constants.elastomer = None;
    let fault = ForceDistribution::new(&constants, None).unwrap_err();
    assert_eq!(fault.field, "elastomer");
    let mut elastomer = SENSOR.constants.elastomer.unwrap();
    elastomer.young_modulus_mpa = f64::NAN;
    constants.elastomer = Some(elastomer);
    let fault = ForceDistribution::new(&constants, None).unwrap_err();
    assert_eq!(fault.field, "elastomer.young_modulus_mpa");
}

#[test]
fn forces_are_finite_whatever_is_seen_and_allocate_nothing_once_they_run() {
    let press = pose([0.0, 0.0, -0.2], [0.0; 3]);
    let frames = [
        drawn(&still(pose([0.0; 3], [0.0; 3]))),
        drawn(&Picture { displace: &dent, ..still(press) }),
        drawn(&Picture { displace: &dent, missing: &[5, 6, 7, 60, 61], ..still(press) }),
    ];
    let mut tracker = tracker(TrackOptions::default());
    let mut forces = ForceDistribution::new(&SENSOR.constants, None).expect("forces");
    let mut run = |numbers: std::ops::Range<u64>| {
        for number in numbers {
            let tracked = tracker.track(number, &frame(&frames[number as usize % 3].bytes));
            let found = forces.update(tracked, None);
            if found.status == TractionStatus::NoMotion {
                assert!(found.dots.is_empty() && found.contact.is_none());
            }
            for dot in &found.dots {
                assert!(dot.traction_n_mm2.is_finite() && dot.surface_mm.is_finite());
                assert!(dot.noise_sd_n_mm2 > 0.0 && dot.noise_sd_n_mm2.is_finite());
            }
        }
    };
    run(0..6);
    let counted = allocation_counter::measure(|| run(6..15));
    assert_eq!(counted.count_total, 0);
    // a map of no frame has no pixels to draw
    let mut pressure = PressureMap::default();
    forces.draw_pressure(&ShapeMap::default(), &mut pressure);
    assert!(pressure.pressure_n_mm2.is_empty());
}
