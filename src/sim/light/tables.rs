//! Each light's own tables over the dome, for a flux of one: worked out once for a design, whatever its lights are
//! driven with, and kept for the next scene of the same design.

use std::sync::{Arc, Mutex, OnceLock};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::bounds::Samples;
use super::cavity::Cavities;
use super::direct::{DirectLight, Emitter, EmitterRule};
use super::dome_map::{DomeGrid, bicubic};
use super::radiosity::{DomeRoom, Rings, Underside};
use domecast_optics::SensorOptics;

/// Cells of the coarsest table, and of those that are tried after it.
const CELLS: [usize; 2] = [36, 60];

/// Radii of the shells for moved points, parts of the dome's.
pub(super) const SHELLS: [f64; 3] = [1.0, 0.86, 0.72];

/// Directions in which a table is compared with what it stands for.
const PROBES: usize = 64;

/// A light and how the camera's channels see it.
#[derive(Debug, Clone)]
pub struct Source {
    /// The emitter, at a flux of one.
    pub emitter: Emitter,
    /// Layers and dome with the indices of its colour.
    pub optics: SensorOptics,
    /// Flux that the red, green and blue channel see of it, mW.
    pub seen_mw: [f64; 3],
}

/// What stands between the lights and the membrane.
#[derive(Debug, Clone)]
pub struct Ways {
    /// The lights.
    pub sources: Vec<Source>,
    /// Layers and dome for red, green and blue.
    pub optics: [SensorOptics; 3],
    /// What the platform leaves open; `None` where its shadow does not count.
    pub cavities: Option<Cavities>,
    /// Share of the light that gets through the platform.
    pub through_platform: f64,
    /// Half sides of the sheet, mm.
    pub sheet_half_mm: DVec2,
    /// Whether the sheet's faces take and send back their share.
    pub fresnel: bool,
}

impl Ways {
    /// Vector irradiance of one source at a point, for a flux of one, 1/mm^2.
    pub fn flux(&self, source: &Source, point_mm: DVec3, rule: &EmitterRule) -> DVec3 {
        let light = DirectLight {
            optics: &source.optics,
            cavities: self.cavities.as_ref(),
            through_platform: self.through_platform,
            sheet_half_mm: self.sheet_half_mm,
            fresnel: self.fresnel,
        };
        light.vector_irradiance(&source.emitter, point_mm, rule)
    }

    /// Radius of the dome, mm.
    pub fn radius_mm(&self) -> f64 {
        self.optics[1].dome_radius_mm()
    }

    /// A point of the dome or of a shell inside it.
    pub fn point(&self, direction: DVec3, part: f64) -> DVec3 {
        let point = direction * (self.radius_mm() * part);
        // The rim of the dome is silicone, not the sheet's top beside it.
        point.with_z(point.z.max(1e-9 * self.radius_mm()))
    }

    /// Irradiance of the undeformed membrane by one source, for a flux of one.
    pub fn still(&self, source: &Source, direction: DVec3, rule: &EmitterRule) -> f64 {
        self.flux(source, self.point(direction, 1.0), rule).dot(direction).max(0.0)
    }
}

/// A table over the dome for each source.
#[derive(Debug)]
pub struct Tables<const K: usize> {
    /// Their grid.
    pub grid: DomeGrid,
    /// For each source, its values at the nodes.
    pub sources: Vec<Vec<[f64; K]>>,
    /// Largest error seen in the probes, as a part of the source's largest value.
    pub error: f64,
    /// Points at which one source was worked out exactly.
    pub evaluations: u64,
}

/// All that is worked out once for a design and a choice of effects.
#[derive(Debug, Default)]
pub struct Prepared {
    still: OnceLock<Tables<1>>,
    shells: OnceLock<Vec<Tables<3>>>,
    rooms: OnceLock<Vec<DomeRoom>>,
    pub(super) samples: OnceLock<Samples>,
}

impl Prepared {
    /// Irradiance of the undeformed membrane by each source; refined until its error is within the tolerance or the
    /// finest is reached.
    pub fn still(&self, ways: &Ways, tolerance: f64) -> &Tables<1> {
        self.still.get_or_init(|| still_tables(ways, tolerance))
    }

    /// Vector irradiance of each source on the shells.
    pub fn shells(&self, ways: &Ways) -> &[Tables<3>] {
        self.shells.get_or_init(|| SHELLS.iter().map(|&part| shell_tables(ways, part)).collect())
    }

    /// The dome as a room, for each channel.
    pub fn rooms(&self, ways: &Ways) -> &[DomeRoom] {
        let underside = if ways.fresnel { Underside::Fresnel } else { Underside::Dark };
        let room = |optics| DomeRoom::new(optics, Rings::USUAL, underside);
        self.rooms.get_or_init(|| ways.optics.par_iter().map(room).collect())
    }
}

/// Designs and choices whose tables are kept; the oldest goes first.
const KEPT: usize = 24;

/// The tables for a key: text of the design and flags of the effects. What is kept never changes what comes out,
/// only when it is worked out.
pub fn prepared(key: &str) -> Arc<Prepared> {
    static SHELF: Mutex<Vec<(String, Arc<Prepared>)>> = Mutex::new(Vec::new());
    // A thread that died while it held the shelf left it whole: entries are pushed and removed in one step.
    let mut shelf = SHELF.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some((_, found)) = shelf.iter().find(|(kept, _)| kept == key) {
        return Arc::clone(found);
    }
    if shelf.len() >= KEPT {
        shelf.remove(0);
    }
    let new = Arc::new(Prepared::default());
    shelf.push((key.to_owned(), Arc::clone(&new)));
    new
}

fn still_tables(ways: &Ways, tolerance: f64) -> Tables<1> {
    let rule = EmitterRule::default();
    let probes: Vec<DVec3> = (0..PROBES).map(probe).collect();
    let exact: Vec<Vec<f64>> = ways
        .sources
        .iter()
        .map(|source| probes.par_iter().map(|d| ways.still(source, *d, &rule)).collect())
        .collect();
    let mut evaluations = PROBES as u64;
    let mut made = None;
    for cells in CELLS {
        let grid = DomeGrid::with_cells(cells);
        let fill = |source| grid.fill_in_parallel(|direction| [ways.still(source, direction, &rule)]);
        let sources: Vec<Vec<[f64; 1]>> = ways.sources.iter().map(fill).collect();
        evaluations += grid.evaluations();
        let mut error = 0.0_f64;
        for (table, exact) in sources.iter().zip(&exact) {
            let largest = table.iter().map(|v| v[0]).fold(f64::MIN_POSITIVE, f64::max);
            for (direction, value) in probes.iter().zip(exact) {
                let [found] = bicubic(&grid, table, grid.coordinates(*direction));
                error = error.max((found - value).abs() / largest);
            }
        }
        let good = error <= tolerance;
        made = Some(Tables { grid, sources, error, evaluations });
        if good {
            break;
        }
    }
    made.unwrap_or(Tables { grid: DomeGrid::with_cells(8), sources: Vec::new(), error: 0.0, evaluations })
}

fn shell_tables(ways: &Ways, part: f64) -> Tables<3> {
    let rule = EmitterRule::default();
    let grid = DomeGrid::with_cells(CELLS[0]);
    let fill = |source| {
        grid.fill_in_parallel(|direction| ways.flux(source, ways.point(direction, part), &rule).to_array())
    };
    let sources = ways.sources.iter().map(fill).collect();
    Tables { grid, sources, error: 0.0, evaluations: grid.evaluations() }
}

/// Exact evaluations of each source, if the coarsest table is enough, with or without shells.
pub fn predicted_evaluations(shells: bool) -> u64 {
    let grid = DomeGrid::with_cells(CELLS[0]).evaluations();
    PROBES as u64 + grid * if shells { 1 + SHELLS.len() as u64 } else { 1 }
}

/// Directions spread evenly over the hemisphere (a golden spiral), none of them a node of a table.
fn probe(i: usize) -> DVec3 {
    let z = (i as f64 + 0.5) / PROBES as f64;
    let azimuth = i as f64 * 2.399_963_229_728_653;
    (DVec2::from_angle(azimuth) * (1.0 - z * z).sqrt()).extend(z)
}
