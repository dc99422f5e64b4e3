mod domes;

use super::*;
use crate::camera::{LensModel, LensSpec};
use crate::numeric::Rigid;
use glam::{DMat3, DVec2, DVec3};

fn spec(model: LensModel, distortion: &[f64]) -> OpticsSpec {
    let layer =
        |name: &str, index: [f64; 3], thickness_mm| FlatLayer { name: name.to_owned(), index, thickness_mm };
    OpticsSpec {
        lens: LensSpec {
            model,
            width: 640,
            height: 480,
            matrix: [[229.18, 0.0, 319.5], [0.0, 229.18, 239.5], [0.0, 0.0, 1.0]],
            distortion: distortion.to_vec(),
            field_of_view_rad: 160_f64.to_radians(),
            pupil_shift_mm: Vec::new(),
        },
        sensor_from_camera: Rigid::from_translation(DVec3::new(0.0, 0.0, -10.0)),
        layers: vec![
            layer("acrylic", [1.489, 1.491, 1.497], Some(1.0)),
            layer("silicone", [1.408, 1.41, 1.415], None),
        ],
        dome: DomeShape::hemisphere(10.0),
    }
}

const BROWN: [f64; 5] = [-0.2917, 0.0878, 0.0, 0.0, -0.01156];

fn lenses() -> Vec<OpticsSpec> {
    vec![
        spec(LensModel::Pinhole, &[]),
        spec(LensModel::BrownConrady, &BROWN),
        spec(LensModel::BrownConrady, &[-0.2917, 0.0878, 1e-3, -5e-4, -0.01156]),
        spec(LensModel::BrownConrady, &[0.8, 0.1, 1e-4, 2e-4, 0.003, 1.1, 0.25, 0.01]),
        spec(LensModel::KannalaBrandt, &[0.0; 4]),
        spec(LensModel::KannalaBrandt, &[-0.01, 0.002, -0.001, 0.0001]),
    ]
}

fn round_trips(optics: &SensorOptics) -> usize {
    let mut seen = 0;
    for v in (-40..=520).step_by(20) {
        for u in (-40..=680).step_by(20) {
            let pixel = DVec2::new(f64::from(u) + 0.25, f64::from(v) - 0.125);
            let Ok(hit) = optics.trace(pixel) else {
                continue;
            };
            seen += 1;
            let radius = optics.dome_radius_mm();
            assert!((hit.surface_mm.length() - radius).abs() < 1e-14 * radius);
            assert!(hit.surface_mm.z >= 0.0);
            assert!(hit.field_angle_rad <= optics.lens().max_field_angle_rad() * (1.0 + 1e-12));
            let back = optics.project(hit.surface_mm).unwrap();
            assert!((back - pixel).length() < 1e-9, "{pixel} came back as {back}");
        }
    }
    seen
}

#[test]
fn pixel_to_dome_and_back() {
    for spec in lenses() {
        let optics = SensorOptics::new(&spec).unwrap();
        assert!(round_trips(&optics) > 200, "{:?}", spec.lens);
        for channel in ColorChannel::ALL {
            round_trips(&optics.for_channel(channel));
        }
    }
}

#[test]
fn tilted_shifted_and_noncentral() {
    for mut spec in lenses() {
        spec.sensor_from_camera = Rigid::new(
            DMat3::from_rotation_z(0.3) * DMat3::from_rotation_y(0.2) * DMat3::from_rotation_x(-0.1),
            DVec3::new(0.5, -0.7, -9.0),
        );
        spec.lens.pupil_shift_mm = vec![0.3, 0.02];
        let optics = SensorOptics::new(&spec).unwrap();
        assert!(round_trips(&optics) > 300);
        let pose = Rigid::new(DMat3::from_rotation_y(0.05), DVec3::new(0.1, -0.2, -1.5));
        assert!(round_trips(&optics.at_pose(&pose).unwrap()) > 300);
    }
}

#[test]
fn no_refraction_is_a_straight_line() {
    for mut spec in lenses() {
        for layer in &mut spec.layers {
            layer.index = [1.0; 3];
        }
        let optics = SensorOptics::new(&spec).unwrap();
        let camera_from_sensor = spec.sensor_from_camera.inverse();
        for point in [
            DVec3::new(3.0, 4.0, 75f64.sqrt()),
            DVec3::new(-6.0, 8.0, 0.0),
            DVec3::new(0.0, 0.0, 10.0),
            DVec3::new(1.0, 2.0, 3.0),
        ] {
            let straight = optics.lens().project(camera_from_sensor.point(point)).unwrap();
            let pixel = optics.project(point).unwrap();
            assert!((straight - pixel).length() < 1e-11);
        }
    }
}

#[test]
fn snell_holds_by_hand() {
    // 30 degrees in air, 9 mm of air and 1 mm of acrylic.
    let optics = SensorOptics::new(&spec(LensModel::Pinhole, &[])).unwrap();
    let half = 0.5_f64;
    let x = 9.0 * half.asin().tan() + (half / 1.491).asin().tan();
    let pixel = optics.project(DVec3::new(x, 0.0, 0.0)).unwrap();
    let expected = 319.5 + 229.18 * half.asin().tan();
    assert!((pixel.x - expected).abs() < 1e-10);
    // In silicone at 0.5 mm above the top, inside the dome.
    let x = x + 0.5 * (half / 1.41).asin().tan();
    let pixel = optics.project(DVec3::new(x, 0.0, 0.5)).unwrap();
    assert!((pixel.x - expected).abs() < 1e-10);
}

#[test]
fn white_markers_beside_the_dome_are_seen() {
    let optics = SensorOptics::new(&spec(LensModel::BrownConrady, &BROWN)).unwrap();
    let pixel = optics.project(DVec3::new(7.5, 7.5, 0.0)).unwrap();
    assert!(pixel.is_finite());
    // The same pixel's ray leaves the sheet outside the dome.
    assert_eq!(optics.trace(pixel), Err(RayLimit::MissesDome));
    assert_eq!(optics.project(DVec3::new(7.5, 7.5, 0.1)), Err(RayLimit::OutsideDome));
}

#[test]
fn the_rim_is_reached_from_both_sides() {
    let optics = SensorOptics::new(&spec(LensModel::BrownConrady, &BROWN)).unwrap();
    for k in 0..360 {
        let (sin, cos) = f64::from(k).to_radians().sin_cos();
        let rim = DVec3::new(10.0 * cos, 10.0 * sin, 0.0);
        let pixel = optics.project(rim).unwrap();
        let hit = optics.trace(pixel).unwrap();
        assert!((hit.surface_mm - rim).length() < 1e-10);
    }
}

#[test]
fn the_axis_is_exact() {
    let optics = SensorOptics::new(&spec(LensModel::KannalaBrandt, &[0.1, 0.0, 0.0, 0.0])).unwrap();
    let hit = optics.trace(DVec2::new(319.5, 239.5)).unwrap();
    assert_eq!(hit.surface_mm, DVec3::new(0.0, 0.0, 10.0));
    assert_eq!(hit.field_angle_rad, 0.0);
    assert_eq!(optics.project(DVec3::new(0.0, 0.0, 10.0)).unwrap(), DVec2::new(319.5, 239.5));
}

#[test]
fn limits_have_their_names() {
    let optics = SensorOptics::new(&spec(LensModel::BrownConrady, &BROWN)).unwrap();
    let of = |u: f64, v: f64| optics.trace(DVec2::new(u, v)).unwrap_err().as_str();
    assert_eq!(of(-400.0, 0.0), "beyond_fold");
    assert_eq!(of(f64::NAN, 0.0), "not_finite");
    assert_eq!(of(f64::INFINITY, 0.0), "not_finite");
    assert_eq!(of(1e300, -1e300), "beyond_fold");
    let of = |x: f64, y: f64, z: f64| optics.project(DVec3::new(x, y, z)).unwrap_err().as_str();
    assert_eq!(of(0.0, 0.0, -11.0), "behind_camera");
    assert_eq!(of(0.0, 0.0, 10.1), "outside_dome");
    assert_eq!(of(40.0, 0.0, 0.0), "beyond_fold");
    assert_eq!(of(f64::NAN, 0.0, 0.0), "not_finite");
    let touching = OpticsSpec {
        sensor_from_camera: Rigid::from_translation(DVec3::new(0.0, 0.0, -1.0)),
        ..spec(LensModel::Pinhole, &[])
    };
    let touching = SensorOptics::new(&touching).unwrap();
    assert_eq!(touching.air_gap_mm(), 0.0);
    assert_eq!(touching.project(DVec3::new(5.0, 0.0, 0.0)), Err(RayLimit::TotalInternalReflection));
    assert!(touching.project(DVec3::new(0.5, 0.0, 0.0)).is_ok());
}

#[test]
fn a_pupil_in_the_sheet_is_refused() {
    let mut bad = spec(LensModel::Pinhole, &[]);
    bad.sensor_from_camera.translation_mm.z = -0.5;
    let error = SensorOptics::new(&bad).unwrap_err();
    assert_eq!(error.field, "camera.position_mm[2]");
    let optics = SensorOptics::new(&spec(LensModel::Pinhole, &[])).unwrap();
    assert!((optics.air_gap_mm() - 9.0).abs() < 1e-15);
    let down = |z: f64| Rigid::from_translation(DVec3::new(0.0, 0.0, z));
    assert!((optics.at_pose(&down(-2.0)).unwrap().air_gap_mm() - 7.0).abs() < 1e-14);
    assert!(optics.at_pose(&down(-9.5)).is_err());
    assert_eq!(optics.layers()[0].name, "air");
}

/// Central differences of a function of a vector.
fn differences<const N: usize>(f: impl Fn(&[f64; N]) -> Vec<f64>, at: [f64; N], step: f64) -> Vec<Vec<f64>> {
    (0..N)
        .map(|j| {
            let (mut low, mut high) = (at, at);
            low[j] -= step;
            high[j] += step;
            let (low, high) = (f(&low), f(&high));
            high.iter().zip(&low).map(|(h, l)| (h - l) / (2.0 * step)).collect()
        })
        .collect()
}

fn tilted() -> Vec<OpticsSpec> {
    let mut specs = lenses();
    for (i, spec) in specs.iter_mut().enumerate() {
        spec.sensor_from_camera = Rigid::new(
            DMat3::from_rotation_z(0.3) * DMat3::from_rotation_y(0.2) * DMat3::from_rotation_x(-0.1),
            DVec3::new(0.5, -0.7, -9.0),
        );
        if i % 2 == 0 {
            spec.lens.pupil_shift_mm = vec![0.4, -0.05];
        }
    }
    specs
}

#[test]
fn trace_jacobian_is_the_derivative() {
    for spec in lenses().into_iter().chain(tilted()) {
        let optics = SensorOptics::new(&spec).unwrap();
        for pixel in [[319.5, 239.5], [300.0, 350.0], [200.25, 180.0]] {
            let (hit, jacobian) = optics.trace_with_jacobian(DVec2::from_array(pixel)).unwrap();
            assert_eq!(hit, optics.trace(DVec2::from_array(pixel)).unwrap());
            let numeric = differences(
                |p| {
                    let at = optics.trace(DVec2::from_array(*p)).unwrap().surface_mm;
                    at.to_array().to_vec()
                },
                pixel,
                1e-3,
            );
            for (j, column) in numeric.iter().enumerate() {
                for (i, value) in column.iter().enumerate() {
                    assert!((jacobian[(i, j)] - value).abs() < 1e-8);
                }
            }
        }
    }
}

#[test]
fn project_jacobians_are_the_derivatives() {
    let touching = |mut spec: OpticsSpec| {
        spec.sensor_from_camera.translation_mm.z = -1.0;
        spec
    };
    let specs = lenses()
        .into_iter()
        .chain(tilted())
        .chain([touching(lenses()[0].clone()), touching(lenses()[4].clone())]);
    for spec in specs {
        let rest = SensorOptics::new(&spec).unwrap();
        let pose = Rigid::new(
            DMat3::from_rotation_y(0.03) * DMat3::from_rotation_z(-0.02),
            DVec3::new(0.1, -0.2, if rest.air_gap_mm() > 1.0 { -1.5 } else { 0.5 }),
        );
        for (base, optics) in [(Rigid::identity(), rest.clone()), (pose, rest.at_pose(&pose).unwrap())] {
            for point in
                [[0.0, 0.0, 5.0], [0.3, -0.2, 0.05], [1.0, 2.0, 5.0], [-0.2, 0.4, 8.0], [0.1, 0.2, -0.5]]
            {
                let motion = optics.project_with_motion(DVec3::from_array(point)).unwrap();
                let plain = optics.project(DVec3::from_array(point)).unwrap();
                assert!((motion.pixel - plain).length() < 1e-11);
                let numeric = differences(
                    |p| {
                        let pixel = optics.project(DVec3::from_array(*p)).unwrap();
                        pixel.to_array().to_vec()
                    },
                    point,
                    1e-5,
                );
                for (j, column) in numeric.iter().enumerate() {
                    for (i, value) in column.iter().enumerate() {
                        let error = (motion.by_point[(i, j)] - value).abs();
                        assert!(error < 2e-6 * (1.0 + value.abs()), "{point:?}: {error:e}");
                    }
                }
                if base == Rigid::identity() && optics.air_gap_mm() == 0.0 {
                    // Half of the differences would push the pupil into the sheet.
                    continue;
                }
                let numeric = differences(
                    |x: &[f64; 6]| {
                        let turn =
                            DMat3::from_quat(glam::DQuat::from_scaled_axis(DVec3::new(x[3], x[4], x[5])));
                        let moved = Rigid::new(turn, DVec3::new(x[0], x[1], x[2])).compose(&base);
                        let pixel = rest.at_pose(&moved).unwrap();
                        let pixel = pixel.project(DVec3::from_array(point)).unwrap();
                        pixel.to_array().to_vec()
                    },
                    [0.0; 6],
                    1e-5,
                );
                for (j, column) in numeric.iter().enumerate() {
                    for (i, value) in column.iter().enumerate() {
                        let error = (motion.by_pose[(i, j)] - value).abs();
                        assert!(
                            error < 2e-6 * (1.0 + value.abs()),
                            "{point:?} {j}: {value} but {}",
                            motion.by_pose[(i, j)]
                        );
                    }
                }
            }
        }
    }
}

proptest::proptest! {
    /// Snell's law with angles, as a textbook has it: every layer adds its
    /// thickness times the tangent of its own angle.
    #[test]
    fn points_are_seen_by_snells_law(
        indices in proptest::collection::vec(1.0..2.4f64, 1..6),
        thickness in 0.0..2.0f64,
        gap in 1e-3..20.0f64,
        across in 0.0..9.9f64,
        azimuth in -3.2..3.2f64,
        height in 0.0..1.0f64,
    ) {
        let mut spec = spec(LensModel::KannalaBrandt, &[0.0; 4]);
        spec.lens.field_of_view_rad = 179_f64.to_radians();
        spec.layers = indices
            .iter()
            .enumerate()
            .map(|(i, &n)| FlatLayer {
                name: i.to_string(),
                index: [n; 3],
                thickness_mm: (i + 1 < indices.len()).then_some(thickness),
            })
            .collect();
        let sheet = thickness * (indices.len() - 1) as f64;
        spec.sensor_from_camera = Rigid::from_translation(DVec3::new(0.0, 0.0, -sheet - gap));
        let optics = SensorOptics::new(&spec).unwrap();
        let z = height * (100.0 - across * across).sqrt();
        let point = DVec3::new(across * azimuth.cos(), across * azimuth.sin(), z);
        if let Ok(pixel) = optics.project(point) {
            let ray = optics.lens().unproject(pixel).unwrap();
            let sine = ray.x.hypot(ray.y);
            let tangent = |n: f64| (sine / n).asin().tan();
            let fill = indices[indices.len() - 1];
            let within: f64 = indices[..indices.len() - 1].iter().map(|&n| thickness * tangent(n)).sum();
            let reach = gap * sine / ray.z + within + z * tangent(fill);
            let allowed = 1e-9 * (1.0 + gap / (ray.z * ray.z));
            proptest::prop_assert!((reach - across).abs() < allowed, "{reach} is not {across}");
            if across > 0.0 {
                let turned = (ray.x * azimuth.sin() - ray.y * azimuth.cos()).abs();
                proptest::prop_assert!(turned < 1e-12);
            }
        } else {
            // Only a ray past the field of view is not seen.
            let steepest = 89.4_f64.to_radians().tan() * gap;
            proptest::prop_assert!(across > steepest, "{across} is within {steepest}");
        }
    }
}
