//! Forces on the skin: what the constants must say, and that nothing is allocated once it runs.

use domecast::shape::ShapeMap;
use domecast::track::{TrackOptions, Tracked};
use domecast::traction::{DotTraction, ForceDistribution, PressureMap, TractionStatus};
use glam::DVec3;

use super::render::{Picture, still};
use super::{SENSOR, drawn, frame, pose, tracker};

/// A dent about a place of the dome, as far as this test needs one.
fn dent(p: DVec3) -> DVec3 {
    let off = p - DVec3::new(3.0, 0.0, 9.5);
    let q = (-off.length_squared() / 8.0).exp();
    p + (off * 0.12 - p * 0.03) * q
}

/// Where a place of the dome came out in print: a tenth of a millimetre along it, some millimetres to a wave.
fn misprinted(p: DVec3) -> DVec3 {
    let along = p.normalize_or_zero().cross(DVec3::new((1.1 * p.y).sin(), (1.3 * p.x + 0.4).cos(), 0.5));
    // on the dome: beside it the projection sees nothing
    (p + 0.1 * along).normalize_or_zero() * (p.length() - 1e-9)
}

#[test]
fn a_print_that_is_off_is_no_force() {
    let (rest, press) = (pose([0.0; 3], [0.0; 3]), pose([0.0, 0.0, -0.2], [0.0; 3]));
    let off_and_pressed = |p| dent(misprinted(p));
    let pictures = [
        [still(rest), Picture { displace: &dent, ..still(press) }],
        [
            Picture { displace: &misprinted, ..still(rest) },
            Picture { displace: &off_and_pressed, ..still(press) },
        ],
    ];
    let felt = |[untouched, pressed]: &[Picture<'_>; 2], has_rest: bool| {
        let mut forces = ForceDistribution::new(&SENSOR.constants, None).expect("forces");
        let [untouched, pressed] = [untouched, pressed].map(|picture| {
            let mut tracker = tracker(TrackOptions::default());
            tracker.track(0, &frame(&drawn(picture).bytes)).clone()
        });
        assert!(!has_rest || forces.set_rest(&untouched), "{}: {:?}", untouched.status(), untouched.pose);
        let at_rest = forces.update(&untouched, None).clone();
        let beyond = |dot: &&DotTraction| dot.traction_n_mm2.length() > 3.0 * dot.sd_n_mm2;
        let beyond = at_rest.dots.iter().filter(beyond).count();
        assert!(at_rest.contact.is_none(), "{has_rest}: {:?}", at_rest.contact);
        assert!(100 * beyond <= 3 * at_rest.dots.len(), "{has_rest}: {beyond} dots");
        forces.update(&pressed, None).clone()
    };
    let [exact, misprinted] = pictures.each_ref().map(|both| felt(both, true));
    let largest = exact.dots.iter().map(|dot| dot.traction_n_mm2.length()).fold(0.0, f64::max);
    for (one, other) in exact.dots.iter().zip(&misprinted.dots) {
        let apart = one.traction_n_mm2.distance(other.traction_n_mm2);
        assert!(apart < 0.15 * largest, "dot {}: {apart} of {largest}", one.id);
    }
    felt(&pictures[1], false);
    // what is no frame of this sensor is not taken for its rest
    let mut forces = ForceDistribution::new(&SENSOR.constants, None).expect("forces");
    assert!(!forces.set_rest(&Tracked::default()));
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
