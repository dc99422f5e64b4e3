//! The Rust side of `scripts/compare_opencv.py`: reads lenses and pixels,
//! writes what domecast makes of them and how long it took, one thread.
//!
//! `cargo bench --bench peer -- IN.json OUT.json`

use std::hint::black_box;
use std::time::Instant;

use domecast::camera::{Lens, LensModel, LensSpec};
use domecast::numeric::Rigid;
use domecast::optics::{DomeShape, FlatLayer, OpticsSpec, SensorOptics};
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

#[derive(Deserialize)]
struct Case {
    name: String,
    model: String,
    width: u32,
    height: u32,
    matrix: [[f64; 3]; 3],
    distortion: Vec<f64>,
    field_of_view_deg: f64,
    pixels: Vec<[f64; 2]>,
}

#[derive(Serialize)]
struct Answer {
    name: String,
    max_field_angle_deg: f64,
    fold_angle_deg: Option<f64>,
    lens_ns: f64,
    trace_ns: f64,
    project_ns: f64,
    traced: usize,
    rays: Vec<Option<[f64; 3]>>,
}

/// Rounds of which the median counts, for each piece by itself.
const ROUNDS: usize = 9;

/// Points timed at a time: shorter than a scheduler's slice, so that a busy
/// machine does not blur the comparison. The same in the script.
const PIECE: usize = 1000;

fn median_ns<I, O>(inputs: &[I], outputs: &mut [O], run: impl Fn(&[I], &mut [O])) -> f64 {
    let mut total = 0.0;
    for (inputs, outputs) in inputs.chunks(PIECE).zip(outputs.chunks_mut(PIECE)) {
        let mut seconds = [0.0; ROUNDS];
        for seconds in &mut seconds {
            let start = Instant::now();
            run(black_box(inputs), black_box(outputs));
            *seconds = start.elapsed().as_secs_f64();
        }
        seconds.sort_by(f64::total_cmp);
        total += seconds[ROUNDS / 2];
    }
    total * 1e9 / inputs.len().max(1) as f64
}

fn answer(case: Case) -> Answer {
    let spec = LensSpec {
        model: LensModel::parse(&case.model).expect("a known model"),
        width: case.width,
        height: case.height,
        matrix: case.matrix,
        distortion: case.distortion,
        field_of_view_rad: case.field_of_view_deg.to_radians(),
        pupil_shift_mm: Vec::new(),
    };
    let lens = Lens::new(spec.clone()).expect("a usable lens");
    let layer = |name: &str, index: f64, thickness_mm| FlatLayer {
        name: name.to_owned(),
        index: [index; 3],
        thickness_mm,
    };
    let optics = SensorOptics::new(&OpticsSpec {
        lens: spec,
        sensor_from_camera: Rigid::from_translation(DVec3::new(0.0, 0.0, -10.0)),
        layers: vec![layer("acrylic", 1.491, Some(1.0)), layer("silicone", 1.41, None)],
        // Large enough that every ray ends on the dome: the whole way is timed.
        dome: DomeShape::hemisphere(1000.0),
    })
    .expect("usable optics");
    let pixels: Vec<DVec2> = case.pixels.into_iter().map(DVec2::from_array).collect();
    let mut rays = vec![Ok(DVec3::Z); pixels.len()];
    let mut hits: Vec<_> = pixels.iter().map(|&p| optics.trace(p)).collect();
    let fits = "slices of one length";
    let lens_ns = median_ns(&pixels, &mut rays, |p, r| lens.unproject_all(p, r).expect(fits));
    let trace_ns = median_ns(&pixels, &mut hits, |p, h| optics.trace_all(p, h).expect(fits));
    let points: Vec<DVec3> = hits.iter().flatten().map(|hit| hit.surface_mm).collect();
    let mut back = vec![Ok(DVec2::ZERO); points.len()];
    let project_ns = median_ns(&points, &mut back, |p, b| optics.project_all(p, b).expect(fits));
    Answer {
        name: case.name,
        max_field_angle_deg: lens.max_field_angle_rad().to_degrees(),
        fold_angle_deg: lens.fold_angle_rad().map(f64::to_degrees),
        lens_ns,
        trace_ns,
        project_ns,
        traced: points.len(),
        rays: rays.iter().map(|r| r.ok().map(|r| r.to_array())).collect(),
    }
}

fn main() {
    let files: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let [input, output] = files.as_slice() else {
        // `cargo test --benches` runs this without arguments.
        println!("usage: cargo bench --bench peer -- IN.json OUT.json");
        return;
    };
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("one thread");
    let text = std::fs::read_to_string(input).expect("the input file");
    let cases: Vec<Case> = serde_json::from_str(&text).expect("a list of cases");
    let answers: Vec<Answer> = cases.into_iter().map(answer).collect();
    let text = serde_json::to_string(&answers).expect("finite numbers");
    std::fs::write(output, text).expect("the output file");
}
