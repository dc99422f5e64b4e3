//! Lens inverse, refraction, full back-projection, full projection.

use std::hint::black_box;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use domecast::camera::{Lens, LensModel, LensSpec};
use domecast::numeric::Rigid;
use domecast::optics::{DomeShape, FlatLayer, OpticsSpec, SensorOptics};
use glam::{DVec2, DVec3};

const BROWN: [f64; 5] = [-0.2917, 0.0878, 0.0, 0.0, -0.01156];
const BROWN_TANGENTIAL: [f64; 5] = [-0.2917, 0.0878, 6e-4, -7e-4, -0.01156];
const RATIONAL: [f64; 8] = [0.93, 0.166, -2.4e-5, -1.4e-5, 0.0029, 1.33, 0.436, 0.0276];
const FISHEYE: [f64; 4] = [-0.0033, 0.0541, -0.0516, 0.0107];

fn lens_spec(model: LensModel, distortion: &[f64]) -> LensSpec {
    LensSpec {
        model,
        width: 640,
        height: 480,
        matrix: [[229.18, 0.0, 319.5], [0.0, 229.18, 239.5], [0.0, 0.0, 1.0]],
        distortion: distortion.to_vec(),
        field_of_view_rad: 160_f64.to_radians(),
        pupil_shift_mm: Vec::new(),
    }
}

fn optics(model: LensModel, distortion: &[f64]) -> SensorOptics {
    let layer = |name: &str, index, thickness_mm| FlatLayer {
        name: name.to_owned(),
        index: [index; 3],
        thickness_mm,
    };
    SensorOptics::new(&OpticsSpec {
        lens: lens_spec(model, distortion),
        sensor_from_camera: Rigid::from_translation(DVec3::new(0.0, 0.0, -10.0)),
        layers: vec![layer("acrylic", 1.491, Some(1.0)), layer("silicone", 1.41, None)],
        dome: DomeShape::hemisphere(10.0),
    })
    .expect("usable optics")
}

/// Pixels that meet the dome, spread over the image.
fn pixels(optics: &SensorOptics) -> Vec<DVec2> {
    (0..20_000)
        .map(|i| {
            let i = f64::from(i);
            DVec2::new((i * 0.754_877_666).fract() * 640.0, (i * 0.569_840_29).fract() * 480.0)
        })
        .filter(|&pixel| optics.trace(pixel).is_ok())
        .take(4000)
        .collect()
}

fn bench(c: &mut Criterion) {
    let cases = [
        ("pinhole", LensModel::Pinhole, &[][..]),
        ("brown_conrady", LensModel::BrownConrady, &BROWN[..]),
        ("brown_conrady_tangential", LensModel::BrownConrady, &BROWN_TANGENTIAL[..]),
        ("rational", LensModel::BrownConrady, &RATIONAL[..]),
        ("kannala_brandt", LensModel::KannalaBrandt, &FISHEYE[..]),
    ];
    for (name, model, distortion) in cases {
        let optics = optics(model, distortion);
        let lens = Lens::new(lens_spec(model, distortion)).expect("a usable lens");
        let pixels = pixels(&optics);
        let points: Vec<DVec3> =
            pixels.iter().filter_map(|&p| optics.trace(p).ok()).map(|hit| hit.surface_mm).collect();
        let mut group = c.benchmark_group(name);
        group.throughput(Throughput::Elements(pixels.len() as u64));
        group.bench_function("lens_inverse", |b| {
            b.iter(|| {
                for &pixel in &pixels {
                    let _ = black_box(lens.unproject(black_box(pixel)));
                }
            });
        });
        group.bench_function("back_projection", |b| {
            b.iter(|| {
                for &pixel in &pixels {
                    let _ = black_box(optics.trace(black_box(pixel)));
                }
            });
        });
        group.bench_function("projection", |b| {
            b.iter(|| {
                for &point in &points {
                    let _ = black_box(optics.project(black_box(point)));
                }
            });
        });
        group.bench_function("trace_batch_all_threads", |b| {
            b.iter_batched_ref(
                || vec![optics.trace(DVec2::ZERO); pixels.len()],
                |hits| optics.trace_all(&pixels, hits).is_ok(),
                BatchSize::LargeInput,
            );
        });
        group.finish();
        if name == "pinhole" {
            // With a pinhole the lens costs next to nothing: what is left of
            // the back-projection is refraction and dome.
            let mut group = c.benchmark_group("refraction");
            group.throughput(Throughput::Elements(pixels.len() as u64));
            group.bench_function("layers_and_dome", |b| {
                b.iter(|| {
                    for &pixel in &pixels {
                        let _ = black_box(optics.trace(black_box(pixel)));
                    }
                });
            });
            group.finish();
        }
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);
