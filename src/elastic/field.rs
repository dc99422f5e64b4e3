//! The surface's displacement under given forces on the grid, exactly as the elements have it.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::{Arc, OnceLock};

use glam::{DMat3, DVec3};

use crate::compliance::Compliance;
use crate::dome::Extent;
use crate::element::quadratic;

/// The displacement under given forces; computed when it is first asked for.
#[derive(Debug, Clone)]
pub struct SurfaceField {
    compliance: Arc<Compliance>,
    /// Forces on grid nodes, in their frames (r, z, phi), N.
    forces: Vec<(usize, DVec3)>,
    lazy: Arc<Lazy>,
}

#[derive(Debug, Default)]
struct Lazy {
    /// By harmonic, then surface node: r, z, phi of the even family, then of the odd one.
    amplitudes: OnceLock<Vec<Vec<[f64; 6]>>>,
    /// The same summed on a raster of surface nodes and azimuths, once many points are asked for.
    raster: OnceLock<Vec<DVec3>>,
}

/// Forces below this one move nothing that a number of ours could show, N.
const MIN_FORCE_N: f64 = 1e-14;

/// From this many points on, the raster pays.
const RASTER_FROM: usize = 400;

impl PartialEq for SurfaceField {
    fn eq(&self, other: &Self) -> bool {
        self.compliance.grid.dome == other.compliance.grid.dome && self.forces == other.forces
    }
}

impl SurfaceField {
    /// From forces on grid nodes in order, in their frames (r, z, phi), N.
    pub fn new(compliance: Arc<Compliance>, forces: Vec<(usize, DVec3)>) -> Self {
        Self { compliance, forces, lazy: Arc::default() }
    }

    /// The forces that it comes of: nodes in order, forces in their frames, N.
    pub fn forces(&self) -> &[(usize, DVec3)] {
        &self.forces
    }

    /// The field of some fields' forces together, each by its weight; `None` for none.
    pub fn sum(parts: &[(f64, &Self)]) -> Option<Self> {
        let (_, first) = parts.first()?;
        let mut forces: BTreeMap<usize, DVec3> = BTreeMap::new();
        for (weight, part) in parts {
            for (number, force) in &part.forces {
                *forces.entry(*number).or_insert(DVec3::ZERO) += *force * *weight;
            }
        }
        let forces = forces.into_iter().filter(|(_, force)| force.length() > MIN_FORCE_N).collect();
        Some(Self::new(Arc::clone(&first.compliance), forces))
    }

    fn surface(&self) -> usize {
        2 * self.compliance.grid.elements + 1
    }

    /// Azimuths of the raster.
    fn azimuths(&self) -> usize {
        2 * self.compliance.grid.azimuths
    }

    /// Multiplications of the amplitudes.
    pub fn work(&self) -> f64 {
        let grid = &self.compliance.grid;
        let mut rings: Vec<usize> = self.forces.iter().map(|(number, _)| grid.node(*number).ring).collect();
        rings.dedup();
        let sums: usize = rings.iter().map(|ring| grid.harmonics(*ring)).sum();
        (18 * self.surface() * sums) as f64
    }

    fn amplitudes(&self) -> &[Vec<[f64; 6]>] {
        self.lazy.amplitudes.get_or_init(|| self.sum_forces())
    }

    fn sum_forces(&self) -> Vec<Vec<[f64; 6]>> {
        let grid = &self.compliance.grid;
        // Forces of each ring by harmonic: cos and sin sums.
        let mut rings: Vec<(usize, Vec<[f64; 6]>)> = Vec::new();
        for &(number, force) in &self.forces {
            let node = grid.node(number);
            if rings.last().is_none_or(|(ring, _)| *ring != node.ring) {
                rings.push((node.ring, vec![[0.0; 6]; grid.harmonics(node.ring)]));
            }
            let Some((_, sums)) = rings.last_mut() else { continue };
            let (step_sine, step_cosine) = grid.azimuth(node).sin_cos();
            let (mut cosine, mut sine) = (1.0, 0.0);
            for sum in sums.iter_mut() {
                // Even family: r and z with cos, phi with sin; odd family: r and z with sin, phi with -cos.
                let parts = [
                    force.x * cosine,
                    force.y * cosine,
                    force.z * sine,
                    force.x * sine,
                    force.y * sine,
                    -force.z * cosine,
                ];
                for (sum, part) in sum.iter_mut().zip(parts) {
                    *sum += part;
                }
                (cosine, sine) =
                    (cosine * step_cosine - sine * step_sine, sine * step_cosine + cosine * step_sine);
            }
        }
        let harmonics = rings.iter().map(|(_, sums)| sums.len()).max().unwrap_or(0);
        let mut amplitudes = Vec::with_capacity(harmonics);
        for m in 0..harmonics {
            let mut nodes = vec![[0.0; 6]; self.surface()];
            let known = self.compliance.harmonic(m);
            for (ring, sums) in &rings {
                let (Some(sums), Some((harmonic, yields))) = (sums.get(m), known) else { continue };
                let first = ring - harmonic.first_ring;
                for axis in 0..3 {
                    let (even, odd) = (yields * sums[axis], yields * sums[3 + axis]);
                    let column = &harmonic.columns[3 * first + axis];
                    for (node, values) in nodes.iter_mut().zip(column.chunks_exact(3)) {
                        for k in 0..3 {
                            node[k] += values[k] * even;
                            node[3 + k] += values[k] * odd;
                        }
                    }
                }
            }
            amplitudes.push(nodes);
        }
        amplitudes
    }

    /// The whole dome moves: the bound is the sum of all amplitudes, which no point can pass, over the whole dome.
    pub fn extent(&self) -> Extent {
        let amplitudes = self.amplitudes();
        let largest_beyond = |p: usize| {
            let size = |a: &[f64; 6]| a.iter().map(|v| v * v).sum::<f64>().sqrt();
            amplitudes.iter().map(|nodes| size(&nodes[p])).sum::<f64>()
        };
        let beyond_mm = (0..self.surface()).map(largest_beyond).fold(0.0, f64::max);
        let angle_rad = self.compliance.grid.dome.meridian_end_rad();
        Extent { direction: DVec3::Z, angle_rad, beyond_mm }
    }

    /// Makes the raster where many points will be asked for.
    pub fn prepare(&self, points: usize) {
        if points >= RASTER_FROM {
            self.lazy.raster.get_or_init(|| self.sum_raster());
        }
    }

    /// Displacement of a point of the dome, sensor frame, mm.
    pub fn at(&self, at_mm: DVec3) -> DVec3 {
        let flat = at_mm.truncate().length();
        let azimuth = if flat > 0.0 { at_mm.y.atan2(at_mm.x) } else { 0.0 };
        let (element, along) = self.compliance.grid.element_at(at_mm);
        let (n, _) = quadratic(along);
        if let Some(raster) = self.lazy.raster.get() {
            return self.interpolate(raster, element, n, azimuth);
        }
        let (step_sine, step_cosine) = azimuth.sin_cos();
        let (mut cosine, mut sine) = (1.0, 0.0);
        let mut u = DVec3::ZERO;
        for nodes in self.amplitudes() {
            for (k, n) in n.into_iter().enumerate() {
                let a = &nodes[2 * element + k];
                u += DVec3::new(
                    a[0] * cosine + a[3] * sine,
                    a[1] * cosine + a[4] * sine,
                    a[2] * sine - a[5] * cosine,
                ) * n;
            }
            (cosine, sine) =
                (cosine * step_cosine - sine * step_sine, sine * step_cosine + cosine * step_sine);
        }
        DMat3::from_cols(
            DVec3::new(step_cosine, step_sine, 0.0),
            DVec3::Z,
            DVec3::new(-step_sine, step_cosine, 0.0),
        ) * u
    }

    /// What bears on a point of the undeformed dome, force over its undeformed area, sensor frame, MPa: each node's force is
    /// spread as its hat.
    pub fn traction_mpa(&self, at_mm: DVec3) -> DVec3 {
        let grid = &self.compliance.grid;
        let mut sum = DVec3::ZERO;
        for (number, share) in grid.hats_at(at_mm) {
            let Ok(at) = self.forces.binary_search_by_key(&number, |(number, _)| *number) else { continue };
            let force_n = self.forces.get(at).map_or(DVec3::ZERO, |(_, force)| *force);
            let node = grid.node(number);
            sum += grid.frame(node) * force_n * (share / grid.areas_mm2[node.ring]);
        }
        sum
    }

    /// Sensor-frame displacements, surface node by surface node, azimuth by azimuth.
    fn sum_raster(&self) -> Vec<DVec3> {
        let surface = self.surface();
        let n = self.azimuths();
        let amplitudes = self.amplitudes();
        let waves: Vec<(f64, f64)> = (0..n).map(|k| (TAU * k as f64 / n as f64).sin_cos()).collect();
        let mut out = Vec::with_capacity(surface * n);
        let mut ring = vec![DVec3::ZERO; n];
        for p in 0..surface {
            ring.fill(DVec3::ZERO);
            for (m, nodes) in amplitudes.iter().enumerate() {
                let a = &nodes[p];
                if a.iter().all(|v| *v == 0.0) {
                    continue;
                }
                let mut at = 0;
                for u in &mut ring {
                    let (sine, cosine) = waves[at];
                    u.x += a[0] * cosine + a[3] * sine;
                    u.y += a[1] * cosine + a[4] * sine;
                    u.z += a[2] * sine - a[5] * cosine;
                    at += m;
                    if at >= n {
                        at -= n;
                    }
                }
            }
            out.extend(ring.iter().zip(&waves).map(|(u, (sine, cosine))| {
                DVec3::new(u.x * cosine - u.z * sine, u.x * sine + u.z * cosine, u.y)
            }));
        }
        out
    }

    /// The elements' own quadratic along the meridian, a cubic (Catmull-Rom) along the ring.
    fn interpolate(&self, raster: &[DVec3], element: usize, n: [f64; 3], azimuth: f64) -> DVec3 {
        let count = self.azimuths();
        let s = azimuth.rem_euclid(TAU) / TAU * count as f64;
        let (base, t) = (s.floor() as usize % count, s - s.floor());
        let (t2, t3) = (t * t, t * t * t);
        let weights = [
            0.5 * (2.0 * t2 - t - t3),
            0.5 * (2.0 - 5.0 * t2 + 3.0 * t3),
            0.5 * (t + 4.0 * t2 - 3.0 * t3),
            0.5 * (t3 - t2),
        ];
        let mut u = DVec3::ZERO;
        for (k, n) in n.into_iter().enumerate() {
            let row = (2 * element + k) * count;
            for (i, w) in weights.into_iter().enumerate() {
                u += raster[row + (base + count + i - 1) % count] * (n * w);
            }
        }
        u
    }
}
