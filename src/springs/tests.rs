use super::*;
use glam::DVec3;
use nalgebra::{Matrix6, Vector6};

pub(super) fn music_wire(active_coils: f64) -> SpringSpec {
    SpringSpec {
        wire_diameter_mm: 0.3,
        outer_diameter_mm: 3.0,
        free_length_mm: 5.0,
        active_coils,
        ends: EndType::ClosedGround,
        shear_modulus_mpa: 81_500.0,
        elastic_modulus_mpa: 206_000.0,
        allowable_shear_mpa: 1180.0,
    }
}

pub(super) fn ring(count: u32, radius_mm: f64) -> Vec<DVec3> {
    let angle = |i: u32| f64::from(30 + 360 * i / count).to_radians();
    (0..count).map(|i| DVec3::new(radius_mm * angle(i).cos(), radius_mm * angle(i).sin(), -5.0)).collect()
}

pub(super) fn platform(active_coils: f64, magnets: bool) -> Suspension {
    let magnets = magnets.then(|| MagnetPair::new(3.0, 1.0, 1.2, true).unwrap());
    Suspension::new(SuspensionSpec {
        spring: Spring::new(music_wire(active_coils)).unwrap(),
        upper_ends_mm: ring(6, 9.7),
        magnets,
        weight_n: if magnets.is_some() { DVec3::new(0.01, 0.0, -0.06) } else { DVec3::ZERO },
        center_of_mass_mm: DVec3::new(0.1, -0.2, 0.5),
        at_mm: None,
    })
    .unwrap()
}

pub(super) fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b} to {tolerance}");
}

// Figures computed by hand from G d^4 / (8 D^3 n), (n + 2) d and Wahl's factor at C = 9.
#[test]
fn spring_figures() {
    let four = Spring::new(music_wire(4.0)).unwrap();
    close(four.axial_n_per_mm(), 1.0481, 1e-4);
    close(four.solid_height_mm(), 1.8, 1e-12);
    close(four.wahl_factor(), 35.0 / 32.0 + 0.615 / 9.0, 1e-12);
    close(four.shear_stress_mpa(17.0 / 6.0, 0.0, 0.0), 838.4, 0.5);
    close(6.0 * four.axial_n_per_mm() * four.solid_compression_mm(), 20.1, 0.05);
    let three = Spring::new(music_wire(3.0)).unwrap();
    close(6.0 * three.axial_n_per_mm() * three.solid_compression_mm(), 29.3, 0.05);
    close(17.0 / (6.0 * three.axial_n_per_mm()), 2.03, 0.005);
}

#[test]
fn bad_springs_are_refused_by_name() {
    let with = |change: fn(&mut SpringSpec)| {
        let mut spec = music_wire(3.0);
        change(&mut spec);
        Spring::new(spec).unwrap_err().field
    };
    assert_eq!(with(|s| s.wire_diameter_mm = f64::NAN), "wire_diameter_mm");
    assert_eq!(with(|s| s.outer_diameter_mm = 0.6), "outer_diameter_mm");
    assert_eq!(with(|s| s.active_coils = 20.0), "free_length_mm");
    assert_eq!(with(|s| s.elastic_modulus_mpa = -1.0), "elastic_modulus_mpa");
}

// At P = 0 the column is Timoshenko's: 12 B / (L^3 (1 + phi)) and its kin, phi = 12 B / (S L^2).
#[test]
fn column_without_load_is_timoshenko() {
    let spec = music_wire(3.0);
    let spring = Spring::new(spec).unwrap();
    let [shear, coupling, tilt] = spring.column().stiffness(0.0).unwrap().values();
    let (r, n, l) = (1.35, 3.0, 5.0);
    let ei = 206_000.0 * std::f64::consts::PI * 0.3_f64.powi(4) / 64.0;
    let b = l * ei / (n * std::f64::consts::PI * r * (1.0 + 206_000.0 / (2.0 * 81_500.0)));
    let s = l * ei / (n * std::f64::consts::PI * r * r * r);
    let phi = 12.0 * b / (s * l * l);
    close(shear, 12.0 * b / (l.powi(3) * (1.0 + phi)), 1e-12);
    close(coupling, -6.0 * b / (l * l * (1.0 + phi)), 1e-12);
    close(tilt, (4.0 + phi) * b / (l * (1.0 + phi)), 1e-11);
}

// The closed form against the two differential equations, integrated by Runge-Kutta.
#[test]
fn column_matches_the_integrated_equations() {
    let spring = Spring::new(music_wire(3.0)).unwrap();
    let column = spring.column();
    for c in [-1.5, 0.0, 0.8, 2.0, 3.4] {
        let [shear, coupling, tilt] = column.stiffness(c).unwrap().values();
        let l = 5.0 - c;
        let ei = 206_000.0 * std::f64::consts::PI * 0.3_f64.powi(4) / 64.0;
        let turns = 3.0 * std::f64::consts::PI;
        let b = l * ei / (turns * 1.35 * (1.0 + 206_000.0 / (2.0 * 81_500.0)));
        let s = l * ei / (turns * 1.35_f64.powi(3));
        let p = spring.axial_n_per_mm() * c;
        for (shift, lean) in [(0.3, 0.0), (0.0, 0.05), (0.2, -0.04)] {
            let h = shear * shift + coupling * lean;
            let [m0, ml] = column.end_moments(c, shift, lean).unwrap();
            let slope = |[_, psi, m]: [f64; 3]| {
                let q = h + p * psi;
                [psi + q / s, m / b, -(1.0 + p / s) * q]
            };
            let steps = 400;
            let dx = l / f64::from(steps);
            let mut z = [0.0, 0.0, m0];
            let add = |a: [f64; 3], k: [f64; 3], f: f64| std::array::from_fn(|i| a[i] + f * k[i]);
            for _ in 0..steps {
                let k1 = slope(z);
                let k2 = slope(add(z, k1, 0.5 * dx));
                let k3 = slope(add(z, k2, 0.5 * dx));
                let k4 = slope(add(z, k3, dx));
                z = std::array::from_fn(|i| z[i] + dx / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
            }
            close(z[0], shift, 1e-9);
            close(z[1], lean, 1e-9);
            close(z[2], ml, 1e-8);
            close(coupling * shift + tilt * lean, ml, 1e-11);
        }
    }
}

#[test]
fn lateral_stiffness_rises_as_haringx_says() {
    let spring = Spring::new(music_wire(4.0)).unwrap();
    let rise = spring.lateral_n_per_mm(2.7).unwrap() / spring.lateral_n_per_mm(0.0).unwrap();
    close(rise, 1.145, 2e-3);
}

#[test]
fn column_derivatives_are_those_of_its_values() {
    let column = Spring::new(music_wire(3.0)).unwrap().column();
    let h = 1e-4;
    for c in [-1.0, 0.0, 1.3, 3.0] {
        let mid = column.stiffness(c).unwrap();
        let (lo, hi) = (column.stiffness(c - h).unwrap(), column.stiffness(c + h).unwrap());
        for (m, l, u) in [
            (mid.shear, lo.shear, hi.shear),
            (mid.tilt, lo.tilt, hi.tilt),
            (mid.coupling, lo.coupling, hi.coupling),
        ] {
            close(m.d, (u.v - l.v) / (2.0 * h), 1e-6 * (1.0 + m.d.abs()));
            close(m.dd, (u.d - l.d) / (2.0 * h), 1e-6 * (1.0 + m.dd.abs()));
        }
    }
}

// Far apart, discs are point dipoles' extensions: pi Br^2 R^4 / (4 mu0) (1/x^2 - 2/(x+t)^2 + 1/(x+2t)^2).
#[test]
fn magnets_far_apart_follow_the_charge_model() {
    let pair = MagnetPair::new(3.0, 1.0, 1.2, true).unwrap();
    let x: f64 = 200.0;
    let scale = std::f64::consts::PI * 1.44 * 1.5_f64.powi(4) / (4.0 * 1.256_637_062_12);
    let far = scale * (x.powi(-2) - 2.0 * (x + 1.0).powi(-2) + (x + 2.0).powi(-2));
    let [force, _] = pair.attraction(x);
    assert!((force / far - 1.0).abs() < 1e-3, "{force} {far}");
    let repel = MagnetPair::new(3.0, 1.0, 1.2, false).unwrap();
    close(repel.attraction(2.0)[0], -pair.attraction(2.0)[0], 1e-15);
    for gap in [0.1, 0.7, 2.3, 5.0] {
        let h = 1e-5;
        let numeric = (pair.attraction(gap + h)[0] - pair.attraction(gap - h)[0]) / (2.0 * h);
        close(pair.attraction(gap)[1], numeric, 1e-7 * (1.0 + numeric.abs()));
    }
}

#[test]
fn axial_stiffness_is_the_sum_and_the_matrix_is_symmetric() {
    let suspension = platform(3.0, false);
    let k = suspension.stiffness().unwrap();
    let spring = suspension.spec().spring;
    close(k[(2, 2)], 6.0 * spring.axial_n_per_mm(), 1e-11);
    close(k[(0, 0)], 6.0 * spring.lateral_n_per_mm(0.0).unwrap(), 1e-11);
    close((k - k.transpose()).norm(), 0.0, 1e-10);
    // Twist: six lateral springs on a ring, and each one's own.
    close(k[(5, 5)], k[(0, 0)] * 9.7 * 9.7 + 6.0 * spring.torsion_nmm_per_rad(), 1e-9);
    // Tilt about the middle: axial springs on the ring, tilts at the ends, half a length of lever at the top.
    let [shear, coupling, tilt] = spring.column().stiffness(0.0).unwrap().values();
    let expected =
        3.0 * spring.axial_n_per_mm() * 9.7 * 9.7 + 6.0 * (tilt + 2.0 * 2.5 * coupling + 6.25 * shear);
    close(k[(3, 3)], expected, 1e-9);
    close(k[(3, 3)], k[(4, 4)], 1e-9);
    // At mid-height shift and tilt are apart.
    close(k[(0, 4)], 0.0, 1e-10);
}

#[test]
fn zero_at_rest_with_and_without_weight_and_magnets() {
    for magnets in [false, true] {
        let suspension = platform(3.0, magnets);
        let wrench = suspension.wrench_at(&Displacement::default()).unwrap();
        assert_eq!(wrench, Wrench::default());
    }
    let c = platform(3.0, true).rest_compression_mm();
    assert!(c > 0.015 && c < 0.04, "{c}");
}

#[test]
fn tangent_is_the_derivative_of_the_wrench() {
    let suspension = platform(3.0, true);
    for x in [[0.0; 6], [0.3, -0.2, -1.5, 0.05, -0.03, 0.1], [0.1, 0.4, 0.3, -0.1, 0.08, -0.4]] {
        let tangent = suspension.tangent_at(&Displacement::from_array(x)).unwrap();
        let h = 1e-5;
        let numeric = Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(|j| {
            let at = |sign: f64| {
                let mut y = x;
                y[j] += sign * h;
                suspension.wrench_at(&Displacement::from_array(y)).unwrap().to_vector()
            };
            (at(1.0) - at(-1.0)) / (2.0 * h)
        }));
        assert!((tangent - numeric).abs().max() < 2e-6 * tangent.abs().max(), "{}", tangent - numeric);
    }
}

// Work around a closed loop of poses is zero: the law comes from an energy.
#[test]
fn no_work_is_done_around_a_loop() {
    // Weight on the axis: what is subtracted for rest is then zero, not a fixed moment, which would do work.
    let mut spec = platform(3.0, true).spec().clone();
    (spec.weight_n, spec.center_of_mass_mm) = (DVec3::new(0.0, 0.0, -0.06), DVec3::new(0.0, 0.0, 0.5));
    let suspension = Suspension::new(spec).unwrap();
    let at = suspension.at_mm();
    let pose = |s: f64| {
        let a = std::f64::consts::TAU * s;
        Displacement {
            translation_mm: DVec3::new(0.3 * a.sin(), 0.2 * (1.0 - a.cos()), -1.2 + 0.6 * a.cos()),
            rotation_rad: DVec3::new(0.08 * (2.0 * a).sin(), 0.1 * a.cos(), 0.15 * a.sin()),
        }
    };
    let steps = 4000;
    let (mut work, mut size) = (0.0, 0.0);
    for i in 0..steps {
        let [s0, s1] = [i, i + 1].map(|j| f64::from(j) / f64::from(steps));
        let wrench = suspension.wrench_at(&pose(0.5 * (s0 + s1))).unwrap();
        let (a, b) = (pose(s0), pose(s1));
        let (pa, pb) = (a.to_pose(at), b.to_pose(at));
        // The wrench's moment is about the fixed point; the force acts where the platform's point is.
        let turn = domecast_optics::numeric::vector_from_rotation(&(pb.rotation * pa.rotation.transpose()));
        let mid = 0.5 * (a.translation_mm + b.translation_mm);
        let moment = wrench.moment_nmm - mid.cross(wrench.force_n);
        let dw = wrench.force_n.dot(b.translation_mm - a.translation_mm) + moment.dot(turn);
        work += dw;
        size += dw.abs();
    }
    assert!(work.abs() < 1e-6 * size, "{work} of {size}");
}

#[test]
fn equilibrium_inverts_the_law() {
    let suspension = platform(3.0, true);
    for x in [
        [0.2, -0.1, -2.0, 0.03, -0.05, 0.06],
        [0.0, 0.3, -0.5, -0.04, 0.0, 0.0],
        [1e-9, 0.0, 0.0, 0.0, 0.0, 0.0],
    ] {
        let wrench = suspension.wrench_at(&Displacement::from_array(x)).unwrap();
        let balance = suspension.equilibrium(&wrench).unwrap();
        let miss = Vector6::from(balance.displacement.to_array()) - Vector6::from(x);
        assert!(miss.norm() < 1e-11, "{miss}");
        assert!(balance.min_stiffness_n_per_mm > 0.0);
    }
}

#[test]
fn stiffness_at_is_exact_on_the_axis() {
    let suspension = platform(3.0, true);
    let k = suspension.stiffness_at(1.7).unwrap();
    let down = Displacement::from_array([0.0, 0.0, -1.7, 0.0, 0.0, 0.0]);
    let miss = k * Vector6::from(down.to_array()) - suspension.wrench_at(&down).unwrap().to_vector();
    assert!(miss.norm() < 1e-10);
    let beside = Displacement::from_array([1e-4, 0.0, -1.7, 0.0, 2e-5, 3e-5]);
    let miss = k * Vector6::from(beside.to_array()) - suspension.wrench_at(&beside).unwrap().to_vector();
    assert!(miss.norm() < 1e-6, "{miss}");
}
