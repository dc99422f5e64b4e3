use super::*;
use glam::{DVec2, DVec3};

fn lens(model: LensModel, distortion: &[f64], field_of_view_deg: f64) -> Lens {
    Lens::new(LensSpec {
        model,
        width: 640,
        height: 480,
        matrix: [[229.18, 0.0, 319.5], [0.0, 230.5, 239.5], [0.0, 0.0, 1.0]],
        distortion: distortion.to_vec(),
        field_of_view_rad: field_of_view_deg.to_radians(),
        pupil_shift_mm: Vec::new(),
    })
    .unwrap()
}

#[test]
fn folds_are_where_the_derivative_says() {
    // k1 alone: 1 + 3 k1 u = 0.
    let barrel = lens(LensModel::BrownConrady, &[-0.1, 0.0, 0.0, 0.0, 0.0], 170.0);
    let fold = (1.0_f64 / 0.3).sqrt().atan();
    assert!((barrel.fold_angle_rad().unwrap() - fold).abs() < 1e-15);
    assert_eq!(barrel.max_field_angle_rad(), barrel.fold_angle_rad().unwrap());
    assert_eq!(barrel.end_limit(), LensLimit::BeyondFold);
    let fish = lens(LensModel::KannalaBrandt, &[-0.1, 0.0, 0.0, 0.0], 300.0);
    assert!((fish.fold_angle_rad().unwrap() - (1.0_f64 / 0.3).sqrt()).abs() < 1e-15);
    // Within the field of view nothing folds, the field of view ends it.
    let narrow = lens(LensModel::BrownConrady, &[-0.1, 0.0, 0.0, 0.0, 0.0], 90.0);
    assert_eq!(narrow.end_limit(), LensLimit::BeyondFieldOfView);
    assert!((narrow.max_field_angle_rad() - 45_f64.to_radians()).abs() < 1e-15);
    assert!((narrow.fold_angle_rad().unwrap() - fold).abs() < 1e-15);
    // Tangential terms alone: the determinant is first zero at 6 q r = 1.
    let skew = lens(LensModel::BrownConrady, &[0.0, 0.0, 0.03, 0.04, 0.0], 178.0);
    let fold = (1.0_f64 / (6.0 * 0.05)).atan();
    assert!((skew.fold_angle_rad().unwrap() - fold).abs() < 1e-14);
}

#[test]
fn rays_and_pixels_come_back() {
    let lenses = [
        lens(LensModel::Pinhole, &[], 160.0),
        lens(LensModel::BrownConrady, &[-0.2917, 0.0878, 0.0, 0.0, -0.01156], 160.0),
        lens(LensModel::BrownConrady, &[-0.2917, 0.0878, 1e-3, -2e-3, -0.01156], 160.0),
        lens(LensModel::BrownConrady, &[0.8, 0.1, 1e-4, 2e-4, 0.003, 1.1, 0.25, 0.01], 160.0),
        lens(LensModel::KannalaBrandt, &[0.0; 4], 250.0),
        lens(LensModel::KannalaBrandt, &[-0.01, 0.002, -0.001, 0.0001], 200.0),
    ];
    for lens in &lenses {
        let end = lens.max_field_angle_rad();
        for i in 0..=100 {
            for j in 0..24 {
                let theta = end * (1.0 - 1e-6) * f64::from(i) / 100.0;
                let phi = 0.1 + f64::from(j) * std::f64::consts::PI / 12.0;
                let ray = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
                let pixel = lens.project(ray).unwrap();
                let back = lens.unproject(pixel).unwrap();
                let error = back.cross(ray).length();
                // Half a pixel ulp, times the condition near a fold.
                let (_, slope) = lens.unproject_with_jacobian(pixel).unwrap();
                let allowed = 1e-10_f64.max(8.0 * 1.2e-13 * slope.norm());
                assert!(error < allowed, "{:?} at {theta}: {error:e}", lens.spec());
            }
        }
        let past = (end + 1e-6).sin_cos();
        assert!(lens.project(DVec3::new(past.0, 0.0, past.1)).is_err());
        let far = lens.max_radius_px() * (1.0 + 1e-6);
        assert_eq!(lens.unproject(DVec2::new(319.5 + far, 239.5 + far)), Err(lens.end_limit()));
    }
}

#[test]
fn bad_lenses_are_named() {
    let good = lens(LensModel::BrownConrady, &[0.0; 5], 90.0).spec().clone();
    let fails = |change: &dyn Fn(&mut LensSpec)| {
        let mut spec = good.clone();
        change(&mut spec);
        Lens::new(spec).unwrap_err().field
    };
    assert_eq!(fails(&|s| s.width = 0), "width");
    assert_eq!(fails(&|s| s.matrix[0][0] = -1.0), "matrix[0][0]");
    assert_eq!(fails(&|s| s.matrix[0][1] = 0.1), "matrix[0][1]");
    assert_eq!(fails(&|s| s.matrix[1][2] = f64::NAN), "matrix[1][2]");
    assert_eq!(fails(&|s| s.distortion = vec![0.0; 6]), "distortion");
    assert_eq!(fails(&|s| s.distortion[3] = f64::INFINITY), "distortion[3]");
    assert_eq!(fails(&|s| s.field_of_view_rad = 0.0), "field_of_view_rad");
    assert_eq!(fails(&|s| s.pupil_shift_mm = vec![f64::NAN]), "pupil_shift_mm[0]");
}

/// A lens with prism terms and tilt, from like published ones to absurd ones.
fn prism_lens(r: &mut crate::numeric::SeededRandom) -> Option<Lens> {
    let wild = if r.next_u64().is_multiple_of(3) { 10.0 } else { 1.0 };
    let mut k = vec![r.between(-0.35, 0.1), r.between(-0.05, 0.12)];
    k.extend((0..2).map(|_| wild * r.between(-0.003, 0.003)));
    k.extend((0..4).map(|_| wild * r.between(-0.02, 0.02)));
    k.extend((0..4).map(|_| wild * r.between(-0.005, 0.005)));
    k.extend((0..2).map(|_| wild * r.between(-0.03, 0.03)));
    Lens::new(LensSpec {
        distortion: k,
        field_of_view_rad: r.between(40.0, 175.0).to_radians(),
        ..lens(LensModel::BrownConrady, &[0.0; 5], 90.0).spec().clone()
    })
    .ok()
}

#[test]
fn random_prisms_are_inverted_in_all_of_their_domain() {
    let mut r = crate::numeric::SeededRandom::new(21);
    let (mut lenses, mut rays) = (0, 0);
    while lenses < 500 {
        let Some(lens) = prism_lens(&mut r) else { continue };
        lenses += 1;
        let end = lens.max_field_angle_rad();
        for _ in 0..40 {
            let (theta, phi) = (end * (1.0 - 1e-7) * r.uniform().sqrt(), r.between(-3.2, 3.2));
            let ray = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            let pixel = lens.project(ray).unwrap();
            let solved =
                lens.unproject_solved(pixel).unwrap_or_else(|e| panic!("{e}: {:?} {theta}", lens.spec()));
            let (_, slope) = lens.unproject_with_jacobian(pixel).unwrap();
            let allowed = 1e-10_f64.max(8.0 * f64::EPSILON * slope.norm() * pixel.length());
            assert!(solved.ray.cross(ray).length() <= allowed, "{:?} at {theta}", lens.spec());
            assert!(solved.iterations <= Lens::MAX_UNPROJECT_ITERATIONS);
            rays += 1;
            // Any pixel has an answer by name.
            let spread = 1.2 * lens.max_radius_px().min(5000.0);
            let any = pixel + DVec2::new(r.between(-spread, spread), r.between(-spread, spread));
            if let Err(limit) = lens.unproject(any) {
                assert_eq!(limit, lens.end_limit(), "{:?} at {any}", lens.spec());
            }
        }
    }
    assert_eq!(rays, 20_000);
}

#[test]
fn a_tilted_sensor_keeps_the_principal_point_and_squashes_one_side() {
    let k = |tau_x: f64| {
        let mut k = vec![0.0; 14];
        k[12] = tau_x;
        k
    };
    let tilted = lens(LensModel::BrownConrady, &k(0.1), 90.0);
    let [up, down] = [-0.5, 0.5].map(|y| tilted.project(DVec3::new(0.0, y, 1.0)).unwrap().y - 239.5);
    // By hand: y''' = y R33 / (R33 - sin(tau_x) y / cos(tau_x)) with R33 = cos(tau_x), tau_y = 0.
    for (y, seen) in [(-0.5, up), (0.5, down)] {
        let (sin, cos) = 0.1_f64.sin_cos();
        let by_hand = (cos * cos * y + sin * sin * y) / (-sin * y + cos);
        assert!((seen - 230.5 * by_hand).abs() < 1e-10, "{seen} {by_hand}");
    }
    assert_eq!(tilted.project(DVec3::Z), Ok(DVec2::new(319.5, 239.5)));
}
