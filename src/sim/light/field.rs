//! The light on the membrane as tables: made once for a design, looked up in every frame.
//!
//! The lights ride on the platform, so in the sensor frame the light on the undeformed membrane never changes:
//! one table of it serves every frame. Where an object has moved the membrane, its place and its normal differ;
//! for those points there are tables of the *vector* irradiance on three shells inside the dome, whose product
//! with the normal is the irradiance.

use glam::{DVec2, DVec3, Vec3A, Vec4};
use rayon::prelude::*;

use super::direct::{DirectLight, Emitter, EmitterRule};
use super::dome_map::{DomeGrid, bicubic, direction_from_disc, disc_from_direction};
use super::radiosity::{DomeRoom, Rings, Underside};
use crate::optics::SensorOptics;

/// Radii of the shells for moved points, parts of the dome's.
const SHELLS: [f64; 3] = [1.0, 0.86, 0.72];

/// Fine cells in a coarse one: the look-up is linear in the fine table, which is cubic in the coarse one.
const FINE: usize = 4;
/// The same on the shells.
const FINE_SHELL: usize = 2;

/// Cells of the first coarse table, and of the finest that is tried.
const CELLS: [usize; 3] = [40, 80, 160];

/// Directions in which a table is compared with what it stands for.
const PROBES: usize = 96;

/// A light and how the camera's channels see it.
#[derive(Debug, Clone)]
pub struct Source {
    /// The emitter.
    pub emitter: Emitter,
    /// Layers and dome with the indices of its colour.
    pub optics: SensorOptics,
    /// Response of the red, green and blue channel to its light.
    pub seen: [f64; 3],
}

/// What the field is made of.
#[derive(Debug, Clone)]
pub struct FieldSpec<'a> {
    /// The lights.
    pub sources: Vec<Source>,
    /// Layers and dome for red, green and blue.
    pub optics: [&'a SensorOptics; 3],
    /// What the platform leaves open; `None` where its shadow does not count.
    pub cavities: Option<&'a super::Cavities>,
    /// Share of the light that gets through the platform.
    pub through_platform: f64,
    /// Half sides of the sheet, mm.
    pub sheet_half_mm: DVec2,
    /// Whether the sheet's faces take and send back their share.
    pub fresnel: bool,
    /// Whether light falls off with the way and the slant; else every point is lit like the pole.
    pub falloff: bool,
    /// The membrane's mean reflectance for each channel, if it lights itself.
    pub albedo: Option<[f64; 3]>,
    /// Largest error of the table, as a part of its largest value.
    pub tolerance: f64,
}

/// Light on the membrane, for the three channels of the camera, mW/mm^2 weighted by their responses.
#[derive(Debug, Clone)]
pub struct LightField {
    radius_mm: f64,
    still_grid: DomeGrid,
    still: Vec<Vec4>,
    shell_grid: DomeGrid,
    /// Empty until asked for; each node three vectors, one for each channel, and the indirect light.
    shells: Vec<Vec<ShellNode>>,
    brightest: [f64; 3],
    error: f64,
    evaluations: u64,
    exitance: Option<(Vec<DomeRoom>, Vec<Vec<f64>>)>,
}

#[derive(Debug, Clone, Copy, Default)]
struct ShellNode {
    flux: [Vec3A; 3],
    indirect: Vec3A,
}

impl FieldSpec<'_> {
    /// Vector irradiance of each channel at a point, mW/mm^2.
    pub fn direct(&self, point_mm: DVec3, rule: &EmitterRule) -> [DVec3; 3] {
        let mut sum = [DVec3::ZERO; 3];
        for source in &self.sources {
            let light = DirectLight {
                optics: &source.optics,
                cavities: self.cavities,
                through_platform: self.through_platform,
                sheet_half_mm: self.sheet_half_mm,
                fresnel: self.fresnel,
            };
            let vector = light.vector_irradiance(&source.emitter, point_mm, rule);
            for (total, seen) in sum.iter_mut().zip(source.seen) {
                *total += vector * seen;
            }
        }
        sum
    }

    /// Direct irradiance of each channel at a point of the undeformed membrane.
    pub fn still(&self, direction: DVec3, rule: &EmitterRule) -> [f64; 3] {
        let at = if self.falloff { direction } else { DVec3::Z };
        self.direct(self.point(at, 1.0), rule).map(|flux| flux.dot(at).max(0.0))
    }

    fn radius_mm(&self) -> f64 {
        self.optics[1].dome_radius_mm()
    }

    fn point(&self, direction: DVec3, part: f64) -> DVec3 {
        let point = direction * (self.radius_mm() * part);
        // The rim of the dome is silicone, not the sheet's top beside it.
        point.with_z(point.z.max(1e-9 * self.radius_mm()))
    }

    /// Light of the membrane on itself: for each channel the room and its exitances.
    fn room(&self, direct: impl Fn(DVec3) -> [f64; 3] + Sync) -> Option<Room> {
        let albedo = self.albedo?;
        let rings = Rings::USUAL;
        let underside = if self.fresnel { Underside::Fresnel } else { Underside::Dark };
        let directions: Vec<DVec3> = (0..rings.count())
            .map(|i| rings.direction(i / rings.patches, i % rings.patches))
            .collect();
        let light: Vec<[f64; 3]> = directions.par_iter().map(|d| direct(*d)).collect();
        let solved: Vec<_> = (0..3_usize)
            .into_par_iter()
            .map(|c| {
                let room = DomeRoom::new(self.optics[c], rings, underside);
                let own: Vec<f64> = light.iter().map(|e| e[c]).collect();
                let balance = room.solve(&own, albedo[c]);
                (room, balance)
            })
            .collect();
        let indirect = (0..rings.count())
            .map(|i| std::array::from_fn(|c| solved.get(c).map_or(0.0, |(_, b)| b.indirect[i])))
            .collect();
        let (rooms, balances): (Vec<_>, Vec<_>) = solved.into_iter().unzip();
        let exitance = balances.into_iter().map(|b| b.exitance).collect();
        Some(Room { rings, indirect, rooms, exitance })
    }
}

/// The membrane's own light.
struct Room {
    rings: Rings,
    indirect: Vec<[f64; 3]>,
    rooms: Vec<DomeRoom>,
    exitance: Vec<Vec<f64>>,
}

impl Room {
    /// Linear between rings and patches; level beyond the first and last ring.
    fn indirect(&self, direction: DVec3) -> [f64; 3] {
        let Rings { rings, patches } = self.rings;
        let ring = (direction.z * rings as f64 - 0.5).clamp(0.0, rings as f64 - 1.0);
        let turn = direction.y.atan2(direction.x) / std::f64::consts::TAU;
        let patch = (turn * patches as f64 - 0.5).rem_euclid(patches as f64);
        let low = (ring as usize).min(rings - 2);
        let (up, along) = (ring - low as f64, patch - patch.floor());
        let first = (patch as usize) % patches;
        let at = |ring: usize, patch: usize| self.indirect[ring * patches + patch % patches];
        let corners = [at(low, first), at(low, first + 1), at(low + 1, first), at(low + 1, first + 1)];
        std::array::from_fn(|c| {
            let mix = |a: f64, b: f64, part: f64| a + (b - a) * part;
            mix(mix(corners[0][c], corners[1][c], along), mix(corners[2][c], corners[3][c], along), up)
        })
    }
}

impl LightField {
    /// Makes the table of the undeformed membrane.
    ///
    /// It is refined until its largest error in [`PROBES`] directions is within the tolerance, or the finest is
    /// reached; [`LightField::error`] tells which.
    pub fn new(spec: &FieldSpec<'_>) -> Self {
        let rule = EmitterRule::default();
        let mut field = Self {
            radius_mm: spec.radius_mm(),
            still_grid: DomeGrid::with_cells(8),
            still: Vec::new(),
            shell_grid: DomeGrid::with_cells(8),
            shells: Vec::new(),
            brightest: [0.0; 3],
            error: 0.0,
            evaluations: 0,
            exitance: None,
        };
        if !spec.falloff {
            field.level(spec, &rule);
            return field;
        }
        let probes: Vec<(DVec3, [f64; 3])> = (0..PROBES)
            .into_par_iter()
            .map(|i| {
                let direction = probe(i);
                (direction, spec.still(direction, &rule))
            })
            .collect();
        field.evaluations += PROBES as u64;
        for cells in CELLS {
            let grid = DomeGrid::with_cells(cells);
            let table = grid.fill_in_parallel(|direction| spec.still(direction, &rule));
            field.evaluations += grid.evaluations();
            let largest = table.iter().flatten().copied().fold(0.0, f64::max).max(f64::MIN_POSITIVE);
            field.set_still(&grid, &table, None);
            field.error = probes
                .iter()
                .flat_map(|(direction, exact)| {
                    let found = field.still(*direction);
                    (0..3).map(move |c| (f64::from(found[c]) - exact[c]).abs() / largest)
                })
                .fold(0.0, f64::max);
            let last = cells == CELLS[CELLS.len() - 1];
            if field.error <= spec.tolerance || last {
                field.finish(spec, &grid, &table);
                break;
            }
        }
        field
    }

    /// Adds the membrane's own light to a table of direct light.
    fn finish(&mut self, spec: &FieldSpec<'_>, grid: &DomeGrid, table: &[[f64; 3]]) {
        let room = spec.room(|direction| bicubic(grid, table, grid.coordinates(direction)));
        self.set_still(grid, table, room.as_ref());
        self.exitance = room.map(|room| (room.rooms, room.exitance));
    }

    /// Every point lit like the pole.
    fn level(&mut self, spec: &FieldSpec<'_>, rule: &EmitterRule) {
        let pole = spec.still(DVec3::Z, rule);
        self.evaluations += 1;
        let grid = DomeGrid::with_cells(8);
        let table = vec![pole; grid.nodes * grid.nodes];
        self.finish(spec, &grid, &table);
    }

    fn set_still(&mut self, grid: &DomeGrid, table: &[[f64; 3]], room: Option<&Room>) {
        let fine = DomeGrid::with_cells(grid.cells() * FINE);
        self.brightest = [0.0; 3];
        let rows: Vec<Vec<Vec4>> = (0..fine.nodes)
            .into_par_iter()
            .map(|row| {
                (0..fine.nodes)
                    .map(|column| {
                        let place = fine.place(column, row);
                        let mut light = bicubic(grid, table, grid.coordinates_of_disc(place)).map(|v| v.max(0.0));
                        if let Some(room) = room {
                            let onto = place / place.length().max(1.0);
                            let own = room.indirect(direction_from_disc(onto));
                            light = std::array::from_fn(|c| light[c] + own[c]);
                        }
                        let [r, g, b] = light.map(|v| v as f32);
                        Vec4::new(r, g, b, 0.0)
                    })
                    .collect()
            })
            .collect();
        self.still = rows.into_iter().flatten().collect();
        self.still_grid = fine;
        for (i, node) in self.still.iter().enumerate() {
            if fine.place(i % fine.nodes, i / fine.nodes).length() <= 1.0 {
                for c in 0..3 {
                    self.brightest[c] = self.brightest[c].max(f64::from(node[c]));
                }
            }
        }
    }

    /// Makes the tables for moved points; without them [`LightField::moved`] answers as for still ones.
    pub fn with_shells(mut self, spec: &FieldSpec<'_>) -> Self {
        if !spec.falloff {
            return self;
        }
        let rule = EmitterRule::default();
        let grid = DomeGrid::with_cells(CELLS[0]);
        let fine = DomeGrid::with_cells(grid.cells() * FINE_SHELL);
        let direct = |direction: DVec3| spec.still(direction, &rule);
        let room = self.exitance.is_some().then(|| spec.room(direct)).flatten();
        self.shells = SHELLS
            .iter()
            .map(|&part| {
                let table = grid.fill_in_parallel(|direction| {
                    let flux = spec.direct(spec.point(direction, part), &rule);
                    let mut out = [0.0; 9];
                    for (c, vector) in flux.iter().enumerate() {
                        out[3 * c..3 * c + 3].copy_from_slice(&vector.to_array());
                    }
                    out
                });
                let nodes = (0..fine.nodes * fine.nodes).into_par_iter().map(|i| {
                    let place = fine.place(i % fine.nodes, i / fine.nodes);
                    let v = bicubic(&grid, &table, grid.coordinates_of_disc(place)).map(|v| v as f32);
                    let onto = direction_from_disc(place / place.length().max(1.0));
                    let own = room.as_ref().map_or([0.0; 3], |room| room.indirect(onto)).map(|v| v as f32);
                    ShellNode {
                        flux: std::array::from_fn(|c| Vec3A::new(v[3 * c], v[3 * c + 1], v[3 * c + 2])),
                        indirect: Vec3A::from_array(own),
                    }
                });
                nodes.collect()
            })
            .collect();
        self.evaluations += SHELLS.len() as u64 * grid.evaluations();
        self.shell_grid = fine;
        self
    }

    /// Irradiance of an undeformed point in this direction, for the channels red, green, blue.
    #[inline]
    pub fn still(&self, direction: DVec3) -> [f32; 3] {
        let (at, x, y) = self.still_grid.cell_of(direction);
        let nodes = self.still_grid.nodes;
        let Some(corner) = self.still.get(at..at + nodes + 2) else { return [0.0; 3] };
        let low = corner[0] + (corner[1] - corner[0]) * x;
        let high = corner[nodes] + (corner[nodes + 1] - corner[nodes]) * x;
        let value = low + (high - low) * y;
        [value.x, value.y, value.z]
    }

    /// Irradiance of a point that was moved to `point_mm` (sensor frame), with the unit normal out of the
    /// elastomer that it has there.
    pub fn moved(&self, point_mm: DVec3, normal: DVec3) -> [f32; 3] {
        let distance = point_mm.length();
        if self.shells.is_empty() || distance.is_nan() || distance <= 0.0 {
            return self.still(if distance > 0.0 { point_mm / distance } else { DVec3::Z });
        }
        let (at, x, y) = self.shell_grid.cell_of(point_mm / distance);
        let nodes = self.shell_grid.nodes;
        let weights = shell_weights(distance / self.radius_mm);
        let normal = normal.as_vec3a();
        let mut light = Vec3A::ZERO;
        for (shell, weight) in self.shells.iter().zip(weights) {
            let Some(corner) = shell.get(at..at + nodes + 2) else { return [0.0; 3] };
            let mix = |a: &ShellNode| {
                Vec3A::new(a.flux[0].dot(normal), a.flux[1].dot(normal), a.flux[2].dot(normal)) + a.indirect
            };
            let low = mix(&corner[0]) * (1.0 - x) + mix(&corner[1]) * x;
            let high = mix(&corner[nodes]) * (1.0 - x) + mix(&corner[nodes + 1]) * x;
            light += (low * (1.0 - y) + high * y) * weight;
        }
        light.max(Vec3A::ZERO).to_array()
    }

    /// Irradiance of the sheet's top beside the dome, from below: a white marker's.
    pub fn beside(&self, spec: &FieldSpec<'_>, position_mm: DVec3) -> [f64; 3] {
        let direct = spec.direct(position_mm, &EmitterRule::default()).map(|flux| flux.z.max(0.0));
        let Some((rooms, exitance)) = &self.exitance else { return direct };
        std::array::from_fn(|c| {
            let own = if spec.fresnel {
                rooms
                    .get(c)
                    .zip(exitance.get(c))
                    .map_or(0.0, |(room, light)| room.beside(spec.optics[c], light, position_mm))
            } else {
                0.0
            };
            direct[c] + own
        })
    }

    /// Largest irradiance of each channel on the undeformed membrane.
    pub fn brightest(&self) -> [f64; 3] {
        self.brightest
    }

    /// Largest error of the direct light seen in the probes, as a part of its largest value.
    pub fn error(&self) -> f64 {
        self.error
    }

    /// Points at which the light was worked out exactly to make the tables.
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// Largest difference between neighbouring nodes over their distance on the dome, 1/mm.
    pub fn steepest_per_mm(&self) -> f64 {
        let nodes = self.still_grid.nodes;
        // The map's scale is at most sqrt(2) (at the rim, along it), so a cell is at least this long.
        let cell_mm = self.still_grid.cell() * self.radius_mm / std::f64::consts::SQRT_2;
        let mut steepest = 0.0_f32;
        for row in self.still.chunks(nodes) {
            for pair in row.windows(2) {
                steepest = steepest.max((pair[1] - pair[0]).abs().max_element());
            }
        }
        for (low, high) in self.still.iter().zip(self.still.iter().skip(nodes)) {
            steepest = steepest.max((*high - *low).abs().max_element());
        }
        std::f64::consts::SQRT_2 * f64::from(steepest) / cell_mm
    }
}

/// Lagrange's weights of the three shells for a radius, part of the dome's.
#[inline]
fn shell_weights(part: f64) -> [f32; 3] {
    let [a, b, c] = SHELLS;
    let p = part.clamp(0.5, 1.1);
    [
        ((p - b) * (p - c) / ((a - b) * (a - c))) as f32,
        ((p - a) * (p - c) / ((b - a) * (b - c))) as f32,
        ((p - a) * (p - b) / ((c - a) * (c - b))) as f32,
    ]
}

/// Directions spread evenly over the hemisphere (a golden spiral), none of them a node of a table.
fn probe(i: usize) -> DVec3 {
    let z = (i as f64 + 0.5) / PROBES as f64;
    let azimuth = i as f64 * 2.399_963_229_728_653;
    (DVec2::from_angle(azimuth) * (1.0 - z * z).sqrt()).extend(z)
}

impl DomeGrid {
    /// Index of the lower corner of the cell of a direction, and the place in it.
    #[inline]
    fn cell_of(&self, direction: DVec3) -> (usize, f32, f32) {
        let at = self.coordinates_of_disc(disc_from_direction(direction));
        let last = (self.nodes - 2) as f64;
        let (x, y) = (at.x.clamp(0.0, last), at.y.clamp(0.0, last));
        let (column, row) = (x as usize, y as usize);
        (row * self.nodes + column, (x - column as f64) as f32, (y - row as f64) as f32)
    }
}
