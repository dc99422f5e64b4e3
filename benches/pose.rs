//! One pose from four white markers, refraction and discs included. `scripts/bench_pose.py` runs it beside OpenCV.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use domecast::constants::markers_of;
use domecast::numeric::{Rigid, rotation_from_vector};
use domecast::pose::{PoseOptions, PoseSolver, Sighting};
use glam::DVec3;

fn poses(c: &mut Criterion) {
    for name in ["thumb24", "thumb24-fisheye"] {
        let path = format!("{}/designs/{name}.json", env!("CARGO_MANIFEST_DIR"));
        let Ok(design) = domecast::design::Design::load(path.as_ref()) else { continue };
        let markers = markers_of(&design);
        let Ok(solver) = PoseSolver::new(design.optics(), &markers, PoseOptions::new(0.1, 5.0)) else {
            continue;
        };
        let turn = rotation_from_vector(DVec3::new(0.03, -0.02, 0.02));
        let pose = Rigid::new(turn, DVec3::new(0.2, 0.1, -1.5));
        let Ok(optics) = design.optics().at_pose(&pose) else { continue };
        let seen: Vec<Sighting> = markers
            .iter()
            .filter_map(|m| Some(Sighting { id: m.id, centroid_px: m.image(&optics).ok()?.centroid_px }))
            .collect();
        c.bench_function(&format!("pose {name}"), |b| b.iter(|| solver.solve(black_box(&seen))));
    }
}

criterion_group!(benches, poses);
criterion_main!(benches);
