//! Laying out and drawing: time against the number of dots.
//!
//! `cargo bench --bench layout`. The time for each number is the whole way from a resolved design to the bytes
//! of every film; it grows in proportion to the number of dots.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use domecast::artwork::{FilmLabel, film, to_dxf, to_pdf, to_svg, to_tiff};
use domecast::design;
use domecast::layout::{Layout, LayoutSpec};
use serde_json::{Value, json};

/// The paper's sensor with a camera of `scale` times the resolution and about `count` dots.
fn design_with(count: u32, scale: f64, kind: &str) -> design::Design {
    let mut value: Value =
        serde_json::from_str(include_str!("../designs/thumb24-fisheye.json")).expect("JSON");
    let camera = &mut value["camera"];
    for row in 0..2 {
        for column in 0..3 {
            let entry = camera["matrix"][row][column].as_f64().expect("a number");
            camera["matrix"][row][column] = json!(entry * scale);
        }
    }
    for side in ["width", "height"] {
        camera[side] = json!((camera[side].as_f64().expect("a number") * scale) as u32);
    }
    value["runtime"]["mask_radius_px"] = json!(240.0 * scale);
    let pattern = &mut value["pattern"];
    pattern["kind"] = json!(kind);
    pattern.as_object_mut().expect("an object").remove("pitch_px");
    pattern["count"] = json!(count);
    // A third of the pitch.
    let pitch_px = (std::f64::consts::PI * (133.0 * scale).powi(2) / f64::from(count)).sqrt();
    pattern["dot_diameter_px"] = json!(pitch_px / 3.0);
    value["print"]["min_dot_mm"] = json!(0.001);
    value["print"]["min_gap_mm"] = json!(0.001);
    design::from_text(&value.to_string()).expect("a design")
}

fn lay_out_and_write(criterion: &mut Criterion) {
    let label = FilmLabel { design: "bench".into(), hash: "0".repeat(64) };
    for kind in ["hexagonal", "fill"] {
        let mut group = criterion.benchmark_group(kind);
        group.sample_size(10);
        for (count, scale) in [(300, 1.0), (3_000, 2.0), (30_000, 6.0), (100_000, 12.0)] {
            let design = design_with(count, scale, kind);
            let spec = LayoutSpec::of_design(&design).expect("a spec");
            group.throughput(Throughput::Elements(u64::from(count)));
            group.bench_with_input(BenchmarkId::new("lay out", count), &spec, |bench, spec| {
                bench.iter(|| black_box(Layout::new(spec).expect("a layout")));
            });
            let layout = Layout::new(&spec).expect("a layout");
            group.bench_with_input(BenchmarkId::new("write", count), &layout, |bench, layout| {
                bench.iter(|| {
                    let drawing = film(layout, 0, 1.3, &label).expect("a drawing");
                    black_box((
                        to_svg(&drawing),
                        to_pdf(&drawing).expect("PDF"),
                        to_dxf(&drawing, 0.0005).expect("DXF"),
                        to_tiff(&drawing, 2400).expect("TIFF"),
                    ))
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, lay_out_and_write);
criterion_main!(benches);
