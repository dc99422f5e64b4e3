//! Laying out and drawing: time and memory against the number of dots.
//!
//! `cargo bench --bench layout`. First a table of one run for each number of dots, from a resolved design to the bytes
//! of every film and the figures of the report, with the largest memory of the process on Linux; both must grow in
//! proportion to the dots. Then criterion's medians of laying out and of writing.

use std::hint::black_box;
use std::str::FromStr;
use std::time::Instant;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use domecast::Films;
use domecast::design;
use domecast::layout::report::LayoutReport;
use domecast::layout::{Layout, LayoutSpec};
use serde_json::{Value, json};

/// Numbers of dots, with the resolution of the camera that tells them apart over that of the paper's.
const SIZES: [(u32, f64); 4] = [(300, 1.0), (3_000, 2.0), (30_000, 6.0), (100_000, 12.0)];

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
    domecast::design::Design::from_str(&value.to_string()).expect("a design")
}

/// The largest memory that the process has held since it was last asked, MB; nothing where Linux does not tell.
fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kb: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    // The mark is set back to what is held now.
    std::fs::write("/proc/self/clear_refs", "5").ok()?;
    Some(kb / 1024.0)
}

fn write_films(layout: &Layout) -> usize {
    let film = layout.film(0);
    let films = (
        film.to_svg().expect("SVG"),
        film.to_pdf().expect("PDF"),
        film.to_dxf().expect("DXF"),
        film.to_tiff().expect("TIFF"),
    );
    let films = black_box(films);
    films.0.len() + films.1.len() + films.2.len() + films.3.len()
}

/// One run of each size, with its memory.
fn once() {
    println!("pattern    dots    lay out s  write s  report s  us a dot  peak MB  films MB");
    for kind in ["hexagonal", "fill"] {
        for (count, scale) in SIZES {
            let design = design_with(count, scale, kind);
            let spec = LayoutSpec::of_design(&design).expect("a spec");
            peak_mb();
            let began = Instant::now();
            let layout = Layout::new(&spec).expect("a layout");
            let laid_out = began.elapsed().as_secs_f64();
            let bytes = write_films(&layout);
            let written = began.elapsed().as_secs_f64();
            black_box(LayoutReport::new(&design, &spec, &layout));
            let judged = began.elapsed().as_secs_f64();
            println!(
                "{kind:<9} {:>6}  {laid_out:>9.3}  {:>7.3}  {:>8.3}  {:>8.1}  {:>7.0}  {:>8.1}",
                layout.dots.len(),
                written - laid_out,
                judged - written,
                written / layout.dots.len() as f64 * 1e6,
                peak_mb().unwrap_or(f64::NAN),
                bytes as f64 / 1e6
            );
        }
    }
}

fn lay_out_and_write(criterion: &mut Criterion) {
    once();
    for kind in ["hexagonal", "fill"] {
        let mut group = criterion.benchmark_group(kind);
        group.sample_size(10);
        for (count, scale) in SIZES {
            let design = design_with(count, scale, kind);
            let spec = LayoutSpec::of_design(&design).expect("a spec");
            group.throughput(Throughput::Elements(u64::from(count)));
            group.bench_with_input(BenchmarkId::new("lay out", count), &spec, |bench, spec| {
                bench.iter(|| black_box(Layout::new(spec).expect("a layout")));
            });
            let layout = Layout::new(&spec).expect("a layout");
            group.bench_with_input(BenchmarkId::new("write", count), &layout, |bench, layout| {
                bench.iter(|| write_films(layout));
            });
        }
        group.finish();
    }
}

criterion_group!(benches, lay_out_and_write);
criterion_main!(benches);
