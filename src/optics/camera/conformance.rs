//! The suite that every lens model passes: a new model adds a line to
//! [`lenses`] and nothing else.

use super::*;
use glam::{DVec2, DVec3};
use nalgebra::{Matrix2, Matrix2x3, Matrix3x2};
use proptest::prelude::*;

const CENTRE: DVec2 = DVec2::new(321.25, 238.5);

fn lenses() -> Vec<Lens> {
    use LensModel::{BrownConrady, KannalaBrandt, Pinhole};
    let sets: [(LensModel, &[f64], f64); 19] = [
        (Pinhole, &[], 160.0),
        (Pinhole, &[], 179.9),
        (BrownConrady, &[0.0; 5], 160.0),
        (BrownConrady, &[-0.2917, 0.0878, 0.0, 0.0, -0.01156], 160.0),
        (BrownConrady, &[-0.2917, 0.0878, 1e-3, -2e-3, -0.01156], 160.0),
        (BrownConrady, &[0.5, -40.0, 0.0005, -0.0003, 90.0], 160.0),
        (BrownConrady, &[0.1, 0.05, 0.01, -0.02, 0.002], 150.0),
        (BrownConrady, &[0.93, 0.166, -2.4e-5, -1.4e-5, 0.0029, 1.33, 0.436, 0.0276], 160.0),
        (BrownConrady, &[0.1, 0.0, 0.0, 0.0, 0.0, -0.3, 0.0, 0.0], 160.0),
        (BrownConrady, &[-0.2, 0.05, 1e-3, -2e-3, -0.005, 0.0, 0.0, 0.0, 1e-3, -2e-4, -2e-3, 1e-4], 150.0),
        (BrownConrady, &[0.93, 0.166, 0.0, 0.0, 0.0029, 1.33, 0.436, 0.0276, 2e-3, 0.0, -1e-3, 0.0], 140.0),
        (BrownConrady, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.02, 0.0, 0.03, 0.0], 150.0),
        (BrownConrady, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.02, -0.05], 120.0),
        (
            BrownConrady,
            &[-0.2, 0.05, 1e-3, 2e-3, -0.005, 0.0, 0.0, 0.0, 1e-3, 1e-4, -2e-3, 1e-4, 0.03, 0.01],
            150.0,
        ),
        (
            BrownConrady,
            &[0.93, 0.166, 1e-4, 1e-4, 0.0029, 1.33, 0.436, 0.0276, 1e-3, 0.0, 1e-3, 0.0, -0.1, 0.2],
            140.0,
        ),
        (KannalaBrandt, &[0.0; 4], 250.0),
        (KannalaBrandt, &[-0.0033, 0.0541, -0.0516, 0.0107], 163.0),
        (KannalaBrandt, &[-0.1, 0.0, 0.0, 0.0], 300.0),
        (KannalaBrandt, &[0.3, 0.2, 0.1, 0.05], 360.0),
    ];
    sets.into_iter()
        .map(|(model, distortion, view_deg)| {
            Lens::new(LensSpec {
                model,
                width: 640,
                height: 480,
                matrix: [[229.0, 0.0, CENTRE.x], [0.0, 231.0, CENTRE.y], [0.0, 0.0, 1.0]],
                distortion: distortion.to_vec(),
                field_of_view_rad: f64::to_radians(view_deg),
                pupil_shift_mm: Vec::new(),
            })
            .unwrap()
        })
        .collect()
}

fn direction(theta: f64, phi: f64) -> DVec3 {
    DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

#[test]
fn the_axis_is_the_principal_point() {
    for lens in lenses() {
        assert_eq!(lens.project(DVec3::Z), Ok(CENTRE));
        assert_eq!(lens.unproject(CENTRE), Ok(DVec3::Z));
        // A hair beside the axis keeps its direction.
        let ray = lens.unproject(CENTRE + DVec2::new(1e-12, -1e-12)).unwrap();
        assert!((ray.z - 1.0).abs() < 1e-15 && ray.x > 0.0 && ray.y < 0.0);
    }
}

#[test]
fn the_image_grows_with_the_field_angle() {
    for lens in lenses() {
        let end = lens.max_field_angle_rad();
        for azimuth in 0..16 {
            let phi = f64::from(azimuth) * 0.4;
            let mut before = 0.0;
            for i in 1..=400 {
                let theta = end * f64::from(i) / 400.0 * (1.0 - 1e-9);
                let radius = (lens.project(direction(theta, phi)).unwrap() - CENTRE).length();
                assert!(radius > before, "{:?} at {theta}", lens.spec());
                before = radius;
            }
            assert!(before <= lens.max_radius_px() * (1.0 + 1e-12));
        }
    }
}

#[test]
fn the_domain_has_an_end() {
    for lens in lenses() {
        let end = lens.max_field_angle_rad();
        assert!(lens.fold_angle_rad().is_none_or(|fold| end <= fold));
        for azimuth in 0..8 {
            let phi = f64::from(azimuth);
            assert!(lens.project(direction(end * (1.0 - 1e-12), phi)).is_ok());
            if end * (1.0 + 1e-9) < std::f64::consts::FRAC_PI_2 {
                assert_eq!(lens.project(direction(end * (1.0 + 1e-9), phi)), Err(lens.end_limit()));
            }
            // Straight back there is nothing to see, and no azimuth.
            assert_eq!(lens.project(direction(std::f64::consts::PI, phi)), Err(LensLimit::BehindCamera));
            let out = DVec2::new(phi.cos(), phi.sin());
            for far in [1.0 + 1e-6, 2.0, 1e9, 1e200, 1e300] {
                let pixel = CENTRE + out * (lens.max_radius_px() * far).min(1e307);
                assert_eq!(lens.unproject(pixel), Err(lens.end_limit()), "{:?} at {far}", lens.spec());
            }
        }
    }
}

#[test]
fn what_is_not_finite_is_named() {
    let bad = Err(LensLimit::NotFinite);
    for lens in lenses() {
        for v in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(lens.project(DVec3::new(v, 0.0, 1.0)), bad.map(|()| DVec2::ZERO));
            assert_eq!(lens.project(DVec3::new(0.0, 0.0, v)), bad.map(|()| DVec2::ZERO));
            assert_eq!(lens.unproject(DVec2::new(v, 0.0)), bad.map(|()| DVec3::ZERO));
            assert_eq!(lens.unproject(DVec2::new(0.0, v)), bad.map(|()| DVec3::ZERO));
        }
        assert_eq!(lens.project(DVec3::ZERO), bad.map(|()| DVec2::ZERO));
    }
}

#[test]
fn the_length_of_a_ray_does_not_matter() {
    for lens in lenses() {
        let ray = direction(0.5 * lens.max_field_angle_rad(), 1.0);
        let pixel = lens.project(ray).unwrap();
        for size in [1e-307, 1e-160, 1e-3, 1e80, 1e160, 1e307] {
            assert!((lens.project(ray * size).unwrap() - pixel).length() < 1e-11, "{size:e}");
        }
    }
}

/// Central differences of project by the ray, and the error of a matrix from them.
fn project_error(lens: &Lens, ray: DVec3, jacobian: &Matrix2x3<f64>) -> f64 {
    let h = 1e-6;
    let mut worst: f64 = 0.0;
    for (j, axis) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
        let (Ok(a), Ok(b)) = (lens.project(ray - axis * h), lens.project(ray + axis * h)) else {
            continue;
        };
        let slope = (b - a) / (2.0 * h);
        worst = worst.max((jacobian[(0, j)] - slope.x).abs()).max((jacobian[(1, j)] - slope.y).abs());
    }
    worst
}

fn product(a: &Matrix2x3<f64>, b: &Matrix3x2<f64>) -> Matrix2<f64> {
    a * b
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn rays_come_back(part in 0.0..1.0f64, phi in -3.2..3.2f64) {
        for lens in lenses() {
            let theta = lens.max_field_angle_rad() * part * (1.0 - 1e-6);
            let ray = direction(theta, phi);
            let pixel = lens.project(ray).unwrap();
            let back = lens.unproject(pixel).unwrap();
            let (_, slope) = lens.unproject_with_jacobian(pixel).unwrap();
            let allowed = (8.0 * f64::EPSILON * slope.norm() * pixel.length()).max(1e-10);
            prop_assert!(back.cross(ray).length() <= allowed, "{:?} at {theta}", lens.spec());
            prop_assert!((back.length() - 1.0).abs() < 1e-15);
            let solved = lens.unproject_solved(pixel).unwrap();
            let (_, forward) = lens.project_with_jacobian(back).unwrap();
            prop_assert_eq!(solved.ray, back);
            prop_assert!(solved.iterations <= Lens::MAX_UNPROJECT_ITERATIONS);
            prop_assert!(solved.residual_px <= (8.0 * f64::EPSILON * forward.norm()).max(1e-9));
        }
    }

    #[test]
    fn jacobians_are_the_derivatives(part in 0.0..0.95f64, phi in -3.2..3.2f64) {
        for lens in lenses() {
            let ray = direction(lens.max_field_angle_rad() * part, phi) * 1.5;
            let (pixel, forward) = lens.project_with_jacobian(ray).unwrap();
            prop_assert_eq!(pixel, lens.project(ray).unwrap());
            let scale = forward.norm();
            // Differences err by the third derivative, which grows like the
            // cube of the slope near 90 degrees.
            let allowed = 1e-6 * scale * (1.0 + scale / 200.0).powi(2);
            prop_assert!(project_error(&lens, ray, &forward) < allowed, "{:?} at {part}", lens.spec());
            let (back, inverse) = lens.unproject_with_jacobian(pixel).unwrap();
            prop_assert_eq!(back, lens.unproject(pixel).unwrap());
            // The unit ray moves across itself, and forth and back is nothing.
            let along = inverse.transpose() * nalgebra::Vector3::new(back.x, back.y, back.z);
            prop_assert!(along.norm() < 1e-14 * (1.0 + inverse.norm()));
            let round = product(&forward, &inverse) * 1.5 - Matrix2::identity();
            prop_assert!(round.norm() < 1e-8, "{:?} at {part}: {round}", lens.spec());
        }
    }
}
