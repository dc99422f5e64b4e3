//! The meshes of the parts.

use std::time::Instant;

use glam::DVec3;
use rayon::prelude::*;

use super::clock::{TimeLimit, time_again};
use super::sweep::{Law, Sweep, SweepSample};
use domecast_design::parts::Part;
use domecast_fab::numbers::significant;
use domecast_mesh::{Chord, Construction, MeshError, TriMesh, inspect};

/// Chord tolerances, mm.
const TOLERANCES_MM: [f64; 6] = [0.3, 0.1, 0.03, 0.01, 0.003, 0.001];
const QUICK_TOLERANCES_MM: [f64; 3] = [0.1, 0.03, 0.01];
/// Bytes of a binary STL: its head, and each triangle.
const STL_HEAD: f64 = 84.0;
const STL_TRIANGLE: f64 = 50.0;
/// Facets of a part that are held against the exact surface; an even choice where there are more.
const MAX_FACETS: usize = 4000;

/// The sweep of chord tolerances over all parts.
///
/// # Errors
/// A mesh that the kernel could not make.
pub fn sweep(
    parts: &[Part],
    in_use_mm: f64,
    asked_mm: Option<f64>,
    time_limit: TimeLimit,
    quick: bool,
) -> Result<Sweep, MeshError> {
    let plain: Vec<Construction> = parts.iter().map(|part| without_own_chords(&part.construction)).collect();
    let mut tolerances = if quick { QUICK_TOLERANCES_MM.to_vec() } else { TOLERANCES_MM.to_vec() };
    if !tolerances.contains(&in_use_mm) {
        tolerances.push(in_use_mm);
    }
    tolerances.sort_by(|a, b| b.total_cmp(a));
    let make = |chord: Chord| -> Result<Vec<TriMesh>, MeshError> {
        plain.iter().map(|part| Ok(part.solid(chord)?.to_mesh().welded_f32())).collect()
    };
    // the volume's error falls with the tolerance, so two samples give the limit
    let (finest, finer) = (tolerances[tolerances.len() - 1], 0.5 * tolerances[tolerances.len() - 1]);
    let volumes = |meshes: &[TriMesh]| meshes.iter().map(TriMesh::volume_mm3).collect::<Vec<f64>>();
    let (coarse, fine) = (volumes(&make(Chord::new(finest)?)?), volumes(&make(Chord::new(finer)?)?));
    let limit: Vec<f64> = coarse.iter().zip(&fine).map(|(a, b)| 2.0 * b - a).collect();
    let mut samples = Vec::new();
    for &tolerance_mm in &tolerances {
        let chord = Chord::new(tolerance_mm)?;
        let meshes = make(chord)?;
        let off_by_part: Vec<Vec<f64>> = meshes
            .par_iter()
            .zip(&plain)
            .map(|(mesh, part): (&TriMesh, _)| deviations(mesh, part).collect())
            .collect();
        let (mut max_error, mut squares, mut count) = (0.0_f64, 0.0, 0_usize);
        for off in off_by_part.into_iter().flatten() {
            max_error = max_error.max(off);
            squares += off * off;
            count += 1;
        }
        let triangles: usize = meshes.iter().map(|mesh| mesh.triangles.len()).sum();
        let by_volume =
            meshes.iter().zip(&limit).map(|(mesh, limit)| (mesh.volume_mm3() / limit - 1.0).abs());
        let check = once(|| meshes.iter().filter(|mesh| inspect(mesh).is_one_solid()).count());
        let time = time_again(time_limit, || make(chord).map(|meshes| meshes.len()).unwrap_or_default());
        samples.push(SweepSample {
            method: "",
            label: format!("chord tolerance {} mm", significant(tolerance_mm)),
            setting: tolerance_mm,
            max_error,
            rms_error: (squares / count.max(1) as f64).sqrt(),
            time,
            per_item_s: time.median_s / parts.len().max(1) as f64,
            notes: vec![
                ("triangles".into(), triangles as f64),
                ("STL bytes".into(), STL_HEAD * parts.len() as f64 + STL_TRIANGLE * triangles as f64),
                ("worst share of a volume".into(), by_volume.fold(0.0, f64::max)),
                ("seconds to check them".into(), check),
            ],
            dominated: false,
        });
    }
    Ok(sweep_of(samples, parts, in_use_mm, asked_mm))
}

/// The sweep of its samples.
fn sweep_of(samples: Vec<SweepSample>, parts: &[Part], in_use_mm: f64, asked_mm: Option<f64>) -> Sweep {
    let in_use = samples.iter().position(|sample| sample.setting == in_use_mm);
    let size_mm = parts.iter().map(|part| part.bounds.size_mm().max_element()).fold(0.0, f64::max);
    Sweep {
        name: "mesh",
        title: "The parts as meshes".into(),
        setting: "chord tolerance, mm",
        error: "distance of facets' corners, edges and middles from the exact surfaces",
        unit: "mm",
        item: "part",
        items: parts.len(),
        reference: "the exact shapes; volumes against Richardson's extrapolation from the finest two".into(),
        // an STL holds single precision
        floor: 0.01 * f64::from(f32::EPSILON) * size_mm,
        law: Law::Power { exponent: 1.0 },
        observed: None,
        samples,
        in_use,
        asked: asked_mm,
        meets: None,
        conclusion: "Ten times the exactness costs about three times the triangles.".into(),
    }
    .finish()
}

/// The construction with one chord tolerance for all of its pieces.
fn without_own_chords(construction: &Construction) -> Construction {
    let mut plain = construction.clone();
    for piece in plain.added.iter_mut().chain(&mut plain.cut) {
        piece.chord = None;
    }
    plain
}

/// How far points of the facets are from the nearest of the exact surfaces, mm.
pub(super) fn deviations<'a>(mesh: &'a TriMesh, part: &'a Construction) -> impl Iterator<Item = f64> + 'a {
    let step = mesh.triangles.len().div_ceil(MAX_FACETS).max(1);
    mesh.iter_mm()
        .step_by(step)
        .flat_map(|[a, b, c]| [a, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a), (a + b + c) / 3.0])
        .map(move |point: DVec3| {
            let pieces = part.added.iter().chain(&part.cut);
            pieces.map(|piece| piece.signed_distance_mm(point).abs()).fold(f64::INFINITY, f64::min)
        })
}

fn once<T>(work: impl FnOnce() -> T) -> f64 {
    let start = Instant::now();
    std::hint::black_box(work());
    start.elapsed().as_secs_f64()
}
