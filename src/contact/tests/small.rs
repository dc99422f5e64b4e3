//! Objects smaller than the elements: what the nodes miss of them is said.

use super::*;
use domecast_optics::numeric::SeededRandom;

/// Hertz' force of a rigid ball that reaches `depth_mm` into the dome, N.
fn hertz_n(elastomer: &Elastomer, radius_mm: f64, depth_mm: f64) -> f64 {
    let relative_mm = 1.0 / (1.0 / radius_mm + 1.0 / elastomer.dome_radius_mm);
    4.0 / 3.0 * elastomer.plane_strain_mpa() * relative_mm.sqrt() * depth_mm.powf(1.5)
}

#[test]
fn small_balls_are_off_by_no_more_than_twice_what_is_said() {
    let cap = Elastomer { dome_radius_mm: 11.5, center_z_mm: -5.75, ..silicone() };
    let (mut free, mut random) = (0, SeededRandom::new(7));
    for elastomer in [silicone(), cap] {
        let dome = elastomer.dome();
        let contact = Contact::new(elastomer, Level::Linear { element_mm: 1.0 }).unwrap();
        for _ in 0..60 {
            let radius_mm = 0.15 * 20.0_f64.powf(random.uniform());
            let depth_mm = radius_mm * (0.02 + 0.38 * random.uniform());
            let (polar, azimuth) = (0.6 * random.uniform(), std::f64::consts::TAU * random.uniform());
            let normal = DVec3::new(azimuth.cos() * polar.sin(), azimuth.sin() * polar.sin(), polar.cos());
            let reach_mm = elastomer.dome_radius_mm + radius_mm - depth_mm;
            let pose = Rigid::from_translation(dome.center_mm() + normal * reach_mm);
            let state = contact.solve(&ball(radius_mm), &pose, None).unwrap();
            free += u32::from(state.status == Status::Free);
            let hertz_n = hertz_n(&elastomer, radius_mm, depth_mm);
            let (off_n, said) = ((state.wrench.force_n.length() - hertz_n).abs(), state.deviation);
            let what =
                format!("{radius_mm:.3} mm, {depth_mm:.3} mm deep: {hertz_n:.5} N, {off_n:.5} off, {said:?}");
            // what Hertz leaves out is a tenth here
            assert!(off_n <= 2.0 * said.force_n + 0.1 * hertz_n, "{what}");
            if state.status == Status::Free {
                assert!(said.displacement_mm >= depth_mm * (1.0 - 1e-9), "{what}");
                assert!(said.force_n < 1.5 * hertz_n, "{what}");
            }
        }
    }
    assert!(free > 20, "{free}");
}

#[test]
fn what_two_small_objects_miss_is_said_and_what_does_not_reach_the_dome_misses_nothing() {
    let elastomer = silicone();
    let contact = Contact::new(elastomer, Level::Linear { element_mm: 1.0 }).unwrap();
    let (object, large) = (ball(0.2), ball(5.0));
    // where a large ball has pushed the dome away, a small one in its place touches nothing
    let moved = contact.solve(&large, &ball_at(5.0, 0.0, 1.2), None).unwrap();
    let beside = Beside::default().with(std::iter::once(&moved));
    let pose = ball_at(0.2, 0.03, 0.05);
    let alone = contact.solve(&object, &pose, None).unwrap();
    assert!(alone.status == Status::Free && alone.deviation.force_n > 0.0, "{alone:?}");
    let in_its_place = contact.solve_beside(&object, &pose, None, &beside).unwrap();
    assert_eq!((in_its_place.status, in_its_place.deviation), (Status::Free, Deviation::default()));
    // outside of it
    let outside = contact.solve(&object, &ball_at(0.2, 0.03, -0.01), None).unwrap();
    assert_eq!((outside.status, outside.deviation), (Status::Free, Deviation::default()));
}
