//! Each light's own tables over the dome, for a flux of one: computed once for a design, whatever its lights are
//! driven with, and kept for the next scene of the same design.

use std::sync::{Arc, OnceLock};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::cavity::Cavities;
use super::direct::{DirectLight, Emitter, EmitterRule};
use super::dome_map::{DomeFace, DomeGrid, bicubic};
use super::radiosity::{DomeRoom, Rings, Underside};
use super::shelf::Shelf;
use domecast_optics::SensorOptics;

/// Cells across the table on the dome; those on the shells inside it, where light is smoother, have fewer.
const DOME_CELLS: usize = 60;
/// How often the cells on a shadow's edge are halved, and the part of a light's largest irradiance by which a cubic and a straight
/// line differ there: a quarter of a level of 8 bits.
const HALVINGS: usize = 2;
const BENT: f64 = 1e-3;
/// Cells across the tables on the shells.
pub const SHELL_CELLS: usize = 36;

/// Places across an emitter, each way, of coarser tables.
const COARSE_PLACES: usize = 2;

/// Radii of the shells for moved points, parts of the dome's; in a flat cap nearer to it ([`Ways::shell`]).
pub const SHELLS: [f64; 3] = [1.0, 0.86, 0.72];

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

    /// All that the tables depend on, as text.
    pub fn key(&self) -> String {
        let mut of_one = self.clone();
        // Tables are for a flux of one.
        of_one.sources.iter_mut().for_each(|source| source.seen_mw = [0.0; 3]);
        format!("{of_one:?}")
    }

    /// Radius of the dome, mm.
    pub fn radius_mm(&self) -> f64 {
        self.optics[1].dome_radius_mm()
    }

    /// The face of the dome.
    pub fn face(&self) -> DomeFace {
        DomeFace::of(self.optics[1].dome())
    }

    /// How far the shells lie apart, over what they do in a hemisphere: a cap has less room.
    pub fn room(&self) -> f64 {
        (self.optics[1].dome().height_mm() / self.radius_mm()).min(1.0)
    }

    /// Radius of a shell, part of the dome's.
    pub fn shell(&self, part: f64) -> f64 {
        1.0 - (1.0 - part) * self.room()
    }

    /// The point of a place of the dome, or of a shell inside it.
    pub fn point(&self, place: DVec3, part: f64) -> DVec3 {
        // A shell of the cylinder is narrower, not lower.
        let up = if place.z < 0.0 { place.z } else { place.z * part };
        let point = self.optics[1].dome().center_mm() + (place * part).with_z(up) * self.radius_mm();
        // The rim of the dome is silicone, not the sheet's top beside it.
        point.with_z(point.z.max(1e-9 * self.radius_mm()))
    }

    /// Irradiance of the undeformed membrane by one source, for a flux of one.
    pub fn still(&self, source: &Source, place: DVec3, rule: &EmitterRule) -> f64 {
        self.flux(source, self.point(place, 1.0), rule).dot(self.face().normal(place)).max(0.0)
    }
}

/// A source's vector irradiance along x, y and z, then the irradiance of a surface whose normal is the direction: looked up
/// for itself, it is smoother than its parts.
pub type Node = [f64; 4];

/// A table over the dome for each source.
#[derive(Debug)]
pub struct Tables {
    /// Their grid.
    pub grid: DomeGrid,
    /// For each source, its values at the nodes.
    pub sources: Vec<Vec<Node>>,
    /// Largest error seen in the probes, as a part of the source's largest value.
    pub error: f64,
    /// Points at which one source was computed exactly.
    pub evaluations: u64,
}

/// Which parts of the light a field has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldParts {
    /// Whether light falls off with the way and the slant; else every point is lit like the pole.
    pub falloff: bool,
    /// The membrane's mean reflectance for each channel, if it lights itself.
    pub albedo: Option<[f64; 3]>,
    /// Whether moved points are asked for.
    pub moved: bool,
}

/// Gives the numbers of a table by its key, which says all that they depend on, how many it has, and what makes them.
pub type Numbers<'a> = dyn Fn(&str, usize, &dyn Fn() -> Vec<f64>) -> Vec<f64> + 'a;

/// All that is computed once for a design and a choice of effects.
#[derive(Debug, Default)]
pub struct Prepared {
    dome: OnceLock<Tables>,
    shells: OnceLock<Vec<Tables>>,
    rooms: OnceLock<Vec<DomeRoom>>,
}

impl Prepared {
    /// Vector irradiance of each source on the undeformed dome.
    pub fn dome(&self, ways: &Ways) -> &Tables {
        kept(&self.dome, || dome_tables(ways))
    }

    /// The same on the shells inside it.
    pub fn shells(&self, ways: &Ways) -> &[Tables] {
        kept::<Vec<_>>(&self.shells, || shell_tables(ways))
    }

    /// The dome as a room, for each channel.
    pub fn rooms(&self, ways: &Ways) -> &[DomeRoom] {
        kept::<Vec<_>>(&self.rooms, || rooms(ways))
    }

    /// With what a field of some parts needs, from elsewhere.
    pub fn filled(ways: &Ways, parts: &FieldParts, numbers: &Numbers<'_>) -> Self {
        let prepared = Self::default();
        prepared.fill(ways, parts, numbers);
        prepared
    }

    /// Takes what a field of some parts needs as plain numbers from elsewhere.
    pub fn fill(&self, ways: &Ways, parts: &FieldParts, numbers: &Numbers<'_>) {
        let key = ways.key();
        let numbers = |name: &str, count: usize, make: &dyn Fn() -> Vec<f64>| {
            numbers(&format!("light's {name} {key}"), count, make)
        };
        let grid = |cells| DomeGrid::with_cells(cells).over(ways.face());
        let count = |grid: &DomeGrid| 2 + ways.sources.len() * grid.nodes.pow(2) * 4;
        if parts.falloff && self.dome.get().is_none() {
            let grid = grid(DOME_CELLS << HALVINGS);
            let all = numbers("dome", count(&grid), &|| dome_tables(ways).numbers());
            let _ = self.dome.set(Tables::of_numbers(grid, &all));
        }
        if parts.falloff && parts.moved && self.shells.get().is_none() {
            let (grid, inside) = (grid(SHELL_CELLS), SHELLS.len() - 1);
            let made = || shell_tables(ways).iter().flat_map(Tables::numbers).collect();
            let all = numbers("shells", inside * count(&grid), &made);
            let each = all.chunks_exact(count(&grid)).map(|one| Tables::of_numbers(grid, one));
            let _ = self.shells.set(each.collect());
        }
        if parts.albedo.is_some() && self.rooms.get().is_none() {
            let rings = Rings::usual(ways.face());
            let made = || rooms(ways).iter().flat_map(DomeRoom::numbers).collect();
            let all = numbers("rooms' vectors", ways.optics.len() * rings.numbers_len(), &made);
            let each = all.chunks_exact(rings.numbers_len()).zip(&ways.optics);
            let _ = self.rooms.set(each.map(|(one, optics)| DomeRoom::of(optics, rings, one)).collect());
        }
    }
}

impl Tables {
    fn numbers(&self) -> Vec<f64> {
        let values = self.sources.iter().flatten().flatten().copied();
        [self.error, self.evaluations as f64].into_iter().chain(values).collect()
    }

    fn of_numbers(grid: DomeGrid, numbers: &[f64]) -> Self {
        let (about, values) = numbers.split_at(numbers.len().min(2));
        let nodes: Vec<Node> = values.as_chunks::<4>().0.to_vec();
        Self {
            grid,
            sources: nodes.chunks_exact(grid.nodes.pow(2)).map(<[Node]>::to_vec).collect(),
            error: about.first().copied().unwrap_or(0.0),
            evaluations: about.get(1).map_or(0, |count| *count as u64),
        }
    }
}

/// What a cell holds, computed when it is first asked for. Not by `get_or_init`: what computes in parallel takes up other tasks of the
/// pool while it waits for its parts, and one that asks for the same cell would wait for itself. Here two compute the same.
fn kept<T>(cell: &OnceLock<T>, compute: impl FnOnce() -> T) -> &T {
    if let Some(found) = cell.get() {
        return found;
    }
    let computed = compute();
    cell.get_or_init(|| computed)
}

/// The tables for a key: text of the design and flags of the effects.
pub fn prepared(key: &str) -> Arc<Prepared> {
    static SHELF: Shelf<Prepared> = Shelf::new();
    SHELF.get(key)
}

fn shell_tables(ways: &Ways) -> Vec<Tables> {
    let grid = DomeGrid::with_cells(SHELL_CELLS).over(ways.face());
    SHELLS.iter().skip(1).map(|&part| tables(ways, ways.shell(part), grid)).collect()
}

fn rooms(ways: &Ways) -> Vec<DomeRoom> {
    let underside = if ways.fresnel { Underside::Fresnel } else { Underside::Dark };
    let room = |optics| DomeRoom::new(optics, Rings::usual(ways.face()), underside);
    ways.optics.par_iter().map(room).collect()
}

fn dome_tables(ways: &Ways) -> Tables {
    let rule = EmitterRule::default();
    let made: Vec<_> =
        ways.sources.iter().map(|source| dome_table(ways, source, DOME_CELLS, HALVINGS, &rule)).collect();
    let grid = made
        .first()
        .map_or(DomeGrid::with_cells(DOME_CELLS << HALVINGS).over(ways.face()), |(grid, ..)| *grid);
    let evaluations = made.iter().map(|(.., asked)| *asked).max().unwrap_or(0) + PROBES as u64;
    let sources = made.into_iter().map(|(_, table, _)| table).collect();
    let made = Tables { grid, sources, error: 0.0, evaluations };
    let off = |(source, table): (&Source, &Vec<Node>)| {
        let probes = (0..PROBES).into_par_iter().map(|i| {
            let direction = probe(ways.face(), i);
            let [.., found] = bicubic(&made.grid, table, made.grid.coordinates(direction));
            let exact = ways.still(source, direction, &rule);
            (exact, (found - exact).abs())
        });
        let larger = |a: (f64, f64), b: (f64, f64)| (a.0.max(b.0), a.1.max(b.1));
        let (largest, off) = probes.reduce(|| (f64::MIN_POSITIVE, 0.0), larger);
        off / largest
    };
    let error = ways.sources.iter().zip(&made.sources).map(off).fold(0.0, f64::max);
    Tables { error, ..made }
}

/// Vector irradiance of each source on the sphere of a part of the dome's radius.
fn tables(ways: &Ways, part: f64, grid: DomeGrid) -> Tables {
    let rule = EmitterRule::default();
    let sources = ways.sources.iter().map(|source| table(ways, source, part, &grid, &rule)).collect();
    Tables { grid, sources, error: 0.0, evaluations: grid.evaluations() }
}

fn table(ways: &Ways, source: &Source, part: f64, grid: &DomeGrid, rule: &EmitterRule) -> Vec<Node> {
    grid.fill_in_parallel(|place| node(ways, source, part, place, rule))
}

fn node(ways: &Ways, source: &Source, part: f64, place: DVec3, rule: &EmitterRule) -> Node {
    let flux = ways.flux(source, ways.point(place, part), rule);
    flux.extend(flux.dot(ways.face().normal(place)).max(0.0)).to_array()
}

/// The table of one light on the dome, and how often it was computed; cells on the edges of shadows are halved.
fn dome_table(
    ways: &Ways,
    source: &Source,
    cells: usize,
    halvings: usize,
    rule: &EmitterRule,
) -> (DomeGrid, Vec<Node>, u64) {
    let mut grid = DomeGrid::with_cells(cells).over(ways.face());
    let mut found = table(ways, source, 1.0, &grid, rule);
    let mut evaluations = grid.evaluations();
    let largest = found.iter().map(|node| node[3]).fold(0.0, f64::max);
    for _ in 0..halvings {
        let differ = |cubic: &Node, line: &Node| (cubic[3] - line[3]).abs() > BENT * largest;
        let (half, values, asked) =
            grid.halved_in_parallel(&found, differ, |place| node(ways, source, 1.0, place, rule));
        (grid, found) = (half, values);
        evaluations += asked;
    }
    (grid, found, evaluations)
}

/// The tables of one light: on the dome, then on the shells inside it.
#[derive(Debug, Clone, PartialEq)]
pub struct SourceTables(Vec<(DomeGrid, Vec<Node>)>);

impl SourceTables {
    /// Computes them for one of the ways' sources, on grids with so many times fewer cells across than those that frames are drawn
    /// with; on coarser ones with fewer places of the emitter as well.
    pub fn new(ways: &Ways, source: &Source, coarser: usize) -> Self {
        let rule = if coarser > 1 { EmitterRule::with_places(COARSE_PLACES) } else { EmitterRule::default() };
        let of = |(shell, part): (usize, &f64)| {
            let coarser = coarser.max(1);
            if shell == 0 {
                let halvings = if coarser == 1 { HALVINGS } else { 0 };
                let (grid, table, _) = dome_table(ways, source, DOME_CELLS / coarser, halvings, &rule);
                return (grid, table);
            }
            let grid = DomeGrid::with_cells(SHELL_CELLS / coarser).over(ways.face());
            (grid, table(ways, source, ways.shell(*part), &grid, &rule))
        };
        Self(SHELLS.iter().enumerate().map(of).collect())
    }
}

impl Prepared {
    /// Puts together what was computed light by light on the same grids, and the dome as a room.
    pub fn of(sources: &[&SourceTables], rooms: &[DomeRoom]) -> Self {
        let gathered = |shell: usize| {
            let own = || sources.iter().filter_map(|own| own.0.get(shell));
            let sources = own().map(|(_, values)| values.clone()).collect();
            own().next().map(|(grid, _)| Tables { grid: *grid, sources, error: 0.0, evaluations: 0 })
        };
        let prepared = Self { rooms: OnceLock::from(rooms.to_vec()), ..Self::default() };
        if let Some(dome) = gathered(0) {
            let _ = prepared.dome.set(dome);
            let _ = prepared.shells.set((1..SHELLS.len()).filter_map(gathered).collect());
        }
        prepared
    }
}

/// Exact evaluations of each source, with or without shells.
pub fn predicted_evaluations(shells: bool) -> u64 {
    let of = |cells| DomeGrid::with_cells(cells).evaluations();
    let inside = if shells { (SHELLS.len() as u64 - 1) * of(SHELL_CELLS) } else { 0 };
    PROBES as u64 + of(DOME_CELLS) + inside
}

/// Places spread evenly over the dome (a golden spiral), none of them a node of a table.
fn probe(face: DomeFace, i: usize) -> DVec3 {
    let z = face.level((i as f64 + 0.5) / PROBES as f64);
    face.place(i as f64 * 2.399_963_229_728_653, z)
}
