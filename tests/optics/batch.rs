//! Batches: the same bytes as one by one, for any number of threads.

use domecast::camera::LensLimit;
use domecast::optics::{RayLimit, SensorOptics, SurfacePoint};
use glam::{DVec2, DVec3};

use super::cases::golden;

fn bytes(hits: &[Result<SurfacePoint, RayLimit>]) -> Vec<u64> {
    hits.iter()
        .flat_map(|hit| match hit {
            Ok(h) => {
                let s = h.surface_mm;
                [s.x, s.y, s.z, h.field_angle_rad].map(f64::to_bits)
            }
            Err(limit) => [*limit as u64, 0, 0, 0],
        })
        .collect()
}

#[test]
fn batches_have_the_same_bytes_on_any_number_of_threads() {
    for case in golden().iter().filter(|c| c.name.starts_with("published")) {
        let optics = SensorOptics::new(&case.spec).unwrap();
        let pixels: Vec<DVec2> = (0..30_011)
            .map(|i| {
                let i = f64::from(i);
                DVec2::new(
                    (i * 0.754_877_666).fract() * 900.0 - 100.0,
                    (i * 0.569_840_29).fract() * 900.0 - 100.0,
                )
            })
            .collect();
        // What has no answer stands among the rest.
        let lost = [DVec2::NAN, DVec2::new(f64::INFINITY, 0.0), DVec2::splat(1e200)];
        let pixels: Vec<DVec2> = lost.into_iter().chain(pixels).collect();
        let one_by_one: Vec<_> = pixels.iter().map(|&p| optics.trace(p)).collect();
        let points: Vec<DVec3> = one_by_one.iter().flatten().map(|h| h.surface_mm).collect();
        assert!(points.len() > 5000, "{}: {}", case.name, points.len());
        for threads in [1, 2, 3, 7] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut hits = vec![Err(RayLimit::NotFinite); pixels.len()];
            pool.install(|| optics.trace_all(&pixels, &mut hits)).unwrap();
            assert_eq!(bytes(&hits), bytes(&one_by_one), "{} on {threads} threads", case.name);
            let mut back = vec![Err(RayLimit::NotFinite); points.len()];
            pool.install(|| optics.project_all(&points, &mut back)).unwrap();
            for (pixel, &point) in back.iter().zip(&points) {
                assert_eq!(*pixel, optics.project(point));
            }
            let lens = optics.lens();
            let mut rays = vec![Err(LensLimit::NotFinite); pixels.len()];
            pool.install(|| lens.unproject_all(&pixels, &mut rays)).unwrap();
            let bits = |ray: DVec3| ray.to_array().map(f64::to_bits);
            for (ray, &pixel) in rays.iter().zip(&pixels) {
                assert_eq!(ray.map(bits), lens.unproject(pixel).map(bits), "{} at {pixel}", case.name);
            }
            let seen: Vec<DVec3> = rays.into_iter().flatten().collect();
            let mut back = vec![Err(LensLimit::NotFinite); seen.len()];
            pool.install(|| lens.project_all(&seen, &mut back)).unwrap();
            for (pixel, &ray) in back.iter().zip(&seen) {
                assert_eq!(*pixel, lens.project(ray));
            }
        }
    }
}

#[test]
fn slices_of_different_length_are_refused() {
    let optics = SensorOptics::new(&golden()[0].spec).unwrap();
    let mut hits = vec![Err(RayLimit::NotFinite); 2];
    let error = optics.trace_all(&[DVec2::ZERO], &mut hits).unwrap_err();
    assert_eq!((error.inputs, error.outputs), (1, 2));
    assert_eq!(hits, vec![Err(RayLimit::NotFinite); 2]);
}
