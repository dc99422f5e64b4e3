//! The dome as a room that lights itself.

use super::*;

#[test]
fn a_dome_on_a_perfect_mirror_is_half_a_sphere() {
    // Without a sheet between, the mirrored dome closes the sphere: evenly lit, E_indirect = a / (1 - a) E.
    let optics = sensor(&[], 1.41);
    let rings = Rings { rings: 20, patches: 48, ..Rings::USUAL };
    let room = DomeRoom::new(&optics, rings, Underside::Perfect);
    for albedo in [0.2, 0.6, 0.9] {
        let balance = room.solve(&vec![1.0; rings.count()], albedo);
        let expected = albedo / (1.0 - albedo);
        let mean = balance.indirect.iter().sum::<f64>() / rings.count() as f64;
        assert!((mean / expected - 1.0).abs() < 5e-3 / (1.0 - albedo), "{albedo}: {mean} {expected}");
        assert!(balance.residual < 1e-6 * expected);
    }
}

#[test]
fn the_dome_alone_keeps_half_of_its_light() {
    // Form factor of a hemisphere to itself: 1/2. So E_indirect = (a/2) / (1 - a/2) E, exactly.
    let optics = sensor(&[1.49], 1.41);
    let room = DomeRoom::new(&optics, Rings::USUAL, Underside::Dark);
    for albedo in [0.1, 0.5, 0.95] {
        let balance = room.solve(&vec![2.0; Rings::USUAL.count()], albedo);
        let expected = 2.0 * (0.5 * albedo) / (1.0 - 0.5 * albedo);
        for e in &balance.indirect {
            assert!((e / expected - 1.0).abs() < 1e-8);
        }
    }
}

#[test]
fn skin_that_tilts_sees_as_much_more_of_the_dome_as_the_vectors_of_its_light_say() {
    // Brighter on one side, as beside a light; straight ways alone, summed finely for a normal that is tilted.
    let optics = sensor(&[1.494], 1.412);
    let bright = |place: DVec3| 1.0 + 0.8 * place.x + 0.3 * place.y * place.z;
    let exitance = |rings: Rings| -> Vec<f64> {
        (0..rings.count()).map(|i| bright(rings.place(i / rings.patches, i % rings.patches))).collect()
    };
    let room = DomeRoom::new(&optics, Rings::USUAL, Underside::Dark);
    let (found, still) =
        (room.vector_irradiance(&exitance(Rings::USUAL)), room.irradiance(&exitance(Rings::USUAL)));
    let fine = Rings { rings: 300, patches: 600, ..Rings::USUAL };
    let (light, radius) = (exitance(fine), optics.dome_radius_mm());
    for (ring, patch) in [(3, 0), (8, 13), (12, 31)] {
        let at = ring * Rings::USUAL.patches + patch;
        let place = Rings::USUAL.place(ring, patch);
        assert!(
            (found[at].dot(place) / still[at] - 1.0).abs() < 0.01,
            "{} {}",
            found[at].dot(place),
            still[at]
        );
        for tilt in [DVec3::X, DVec3::Y, DVec3::NEG_X] {
            let normal = (place + 0.1 * tilt.reject_from(place)).normalize();
            let mut sum = 0.0;
            for (i, light) in light.iter().enumerate() {
                let source = fine.place(i / fine.patches, i % fine.patches);
                let way = (place - source) * radius;
                let square = way.length_squared().max(1e-9);
                let cosines = normal.dot(way).max(0.0) * (-source.dot(way)).max(0.0);
                sum += light * cosines / (std::f64::consts::PI * square * square);
            }
            let change = sum * std::f64::consts::TAU * radius * radius / fine.count() as f64 - still[at];
            let expected = found[at].dot(normal) - still[at];
            assert!(
                (change - expected).abs() < 0.008 * still[at],
                "{ring} {patch} {tilt}: {change} {expected} of {}",
                still[at]
            );
        }
    }
}

#[test]
fn interreflection_makes_no_light() {
    // What the membrane absorbs is what the lights put in, less what leaves through the underside; of a membrane's
    // own light less than all comes back, and more comes back with total reflection than without a mirror.
    let optics = sensor(&[1.494], 1.412);
    let room = DomeRoom::new(&optics, Rings::USUAL, Underside::Fresnel);
    let ones = vec![1.0; Rings::USUAL.count()];
    let back = room.irradiance(&ones);
    let share = back.iter().sum::<f64>() / ones.len() as f64;
    // Half straight; of the other half, 1 - 1/n^2 = 0.498 lies beyond the critical angle and returns, less what
    // escapes beside the dome's foot; of the rest a few percent.
    assert!(share > 0.65 && share < 0.5 + 0.5 * (0.499 + 0.05), "{share}");
    let finer = Rings { rings: 32, patches: 80, ..Rings::USUAL };
    let fine = DomeRoom::new(&optics, finer, Underside::Fresnel).irradiance(&vec![1.0; finer.count()]);
    let fine_share = fine.iter().sum::<f64>() / fine.len() as f64;
    assert!((share / fine_share - 1.0).abs() < 3e-3, "{share} {fine_share}");
    let direct: Vec<f64> = (0..ones.len()).map(|i| 1.0 + (i % 7) as f64).collect();
    let balance = room.solve(&direct, 0.8);
    let (input, exitance): (f64, f64) = (direct.iter().sum(), balance.exitance.iter().sum());
    let absorbed = (input + balance.indirect.iter().sum::<f64>()) * 0.2;
    let returned: f64 = balance.indirect.iter().sum();
    let left = exitance - returned;
    assert!(left > 0.0);
    assert!((absorbed + left - input).abs() < 1e-6 * input, "{absorbed} {left} {input}");
}
