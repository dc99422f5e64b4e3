use super::*;
use glam::{DMat3, DVec3};
use proptest::prelude::*;

#[test]
fn rigid_motions_compose_and_invert() {
    let a_from_b = Rigid::new(DMat3::from_rotation_x(0.3), DVec3::new(1.0, 2.0, 3.0));
    let b_from_c = Rigid::new(DMat3::from_rotation_z(-1.1), DVec3::new(-4.0, 0.5, 2.0));
    let p = DVec3::new(0.2, -7.0, 1.0);
    let direct = a_from_b.point(b_from_c.point(p));
    assert!((a_from_b.compose(&b_from_c).point(p) - direct).length() < 1e-14);
    let back = a_from_b.inverse().point(a_from_b.point(p));
    assert!((back - p).length() < 1e-14);
    let v = a_from_b.vector(p);
    assert!((v - (a_from_b.point(p) - a_from_b.translation_mm)).length() < 1e-14);
}

#[test]
fn rows_are_row_major() {
    let quarter = Rigid::new(DMat3::from_rotation_z(std::f64::consts::FRAC_PI_2), DVec3::new(5.0, 6.0, 7.0));
    let rows = quarter.to_rows_4x4();
    // A quarter turn about z sends x to y: first column (0, 1, 0).
    assert!((rows[1][0] - 1.0).abs() < 1e-15 && (rows[0][1] + 1.0).abs() < 1e-15);
    assert_eq!([rows[0][3], rows[1][3], rows[2][3]], [5.0, 6.0, 7.0]);
    assert_eq!(Rigid::from_rows_4x4(&rows), Ok(quarter));
}

#[test]
fn what_is_not_rigid_is_named() {
    let mut rows = Rigid::identity().to_rows_4x4();
    rows[0][0] = f64::NAN;
    assert_eq!(Rigid::from_rows_4x4(&rows), Err(RigidError::NotFinite));
    rows[0][0] = -1.0;
    assert_eq!(Rigid::from_rows_4x4(&rows), Err(RigidError::Mirrored));
    rows[0][0] = 1.1;
    assert!(matches!(Rigid::from_rows_4x4(&rows), Err(RigidError::NotOrthonormal(_))));
    rows[0][0] = 1e300;
    assert!(matches!(Rigid::from_rows_4x4(&rows), Err(RigidError::NotOrthonormal(_))));
    rows[0][0] = 1.0;
    rows[3][0] = 0.5;
    assert!(matches!(Rigid::from_rows_4x4(&rows), Err(RigidError::LastRow(_))));
}

#[test]
fn seven_digit_rotations_become_exact() {
    let exact = DMat3::from_rotation_y(0.4) * DMat3::from_rotation_z(1.2);
    let rounded = DMat3::from_cols_array(&exact.to_cols_array().map(|v| (v * 1e7).round() / 1e7));
    let fixed = Rigid::new(rounded, DVec3::ZERO).orthonormalized().rotation;
    let gram = fixed.transpose() * fixed - DMat3::IDENTITY;
    assert!(gram.to_cols_array().iter().all(|e| e.abs() < 1e-15));
    assert!((fixed - exact).to_cols_array().iter().all(|e| e.abs() < 1e-7));
}

#[test]
fn newton_keeps_to_its_bracket() {
    // Newton alone diverges on atan from 2.
    let root = bracketed_newton(|x| (x.atan(), 1.0 / (1.0 + x * x)), -1.0, 50.0, 2.0).unwrap();
    assert!(root.value.abs() < 1e-15 && root.iterations < 30);
    // A slope of zero at the start.
    let root = bracketed_newton(|x| (x * x * x - 8.0, 3.0 * x * x), -5.0, 9.0, 0.0).unwrap();
    assert!((root.value - 2.0).abs() < 1e-15);
}

#[test]
fn what_is_no_bracket_is_named() {
    let f = |x: f64| (x * x + 1.0, 2.0 * x);
    assert!(matches!(bracketed_newton(f, -1.0, 1.0, 0.0), Err(RootError::NoSignChange { .. })));
    assert!(matches!(bracketed_newton(f, 1.0, -1.0, 0.0), Err(RootError::BadBracket { .. })));
    assert!(matches!(bracketed_newton(f, f64::NAN, 1.0, 0.0), Err(RootError::BadBracket { .. })));
    let g = |x: f64| (if x > 0.4 && x < 0.6 { f64::NAN } else { x - 0.5 }, 1.0);
    assert!(matches!(bracketed_newton(g, 0.0, 1.0, 0.5), Err(RootError::NotFinite { .. })));
}

#[test]
fn wilkinson_roots_are_all_found() {
    let mut p = Polynomial::new(&[1.0]);
    for k in 1..=10 {
        p = p.times(&Polynomial::new(&[-f64::from(k), 1.0]));
    }
    let roots = p.roots_in(0.0, 20.0);
    assert_eq!(roots.len(), 10);
    for (k, root) in roots.iter().enumerate() {
        assert!((root - (k + 1) as f64).abs() < 1e-7, "{root}");
    }
    assert_eq!(p.roots_in(2.5, 4.5).len(), 2);
}

#[test]
fn a_touching_root_counts() {
    // (x - 0.5)^2 (x + 3): no change of sign at 0.5.
    let p = Polynomial::new(&[0.25, -1.0, 1.0]).times(&Polynomial::new(&[3.0, 1.0]));
    let first = p.first_root_after(0.0, 2.0).unwrap();
    assert!((first - 0.5).abs() < 1e-7);
    assert!(Polynomial::new(&[1.0, 0.0, 1.0]).roots_in(-5.0, 5.0).is_empty());
    assert!(Polynomial::new(&[f64::INFINITY, 1.0]).roots_in(-5.0, 5.0).is_empty());
}

proptest! {
    #[test]
    fn roots_of_products_are_found(
        mut wanted in proptest::collection::vec(-10.0..10.0f64, 1..7),
        scale in 1e-3..1e3f64,
    ) {
        wanted.sort_by(f64::total_cmp);
        prop_assume!(wanted.windows(2).all(|w| w[1] - w[0] > 0.05));
        let p = wanted.iter().fold(Polynomial::new(&[scale]), |p, r| {
            p.times(&Polynomial::new(&[-r, 1.0]))
        });
        let found = p.roots_in(-11.0, 11.0);
        for w in &wanted {
            prop_assert!(found.iter().any(|f| (f - w).abs() < 1e-6), "{w} not in {found:?}");
        }
    }
}
