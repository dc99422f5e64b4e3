//! The light on the membrane as tables: looked up in every frame.
//!
//! The lights ride on the platform, so in the sensor frame the light on the undeformed membrane never changes:
//! one table of it serves every frame. Where an object has moved the membrane, its place and its normal differ;
//! for those points there are tables of the *vector* irradiance on three shells inside the dome, whose product
//! with the normal is the irradiance.

mod bend;
mod own;
mod places;

use glam::{DVec2, DVec3, Vec2, Vec3A, Vec4};
use rayon::prelude::*;

use self::bend::Bends;
use self::own::OwnLight;
use self::places::{Scale, cell_of, cubics, disc_of, smooth_step, split};
use super::direct::EmitterRule;
use super::dome_map::{DomeGrid, bicubic, direction_from_disc};
use super::tables::{Prepared, SHELLS, Tables, Ways};

/// Fine cells in a coarse one: the shells' look-up is linear in the fine table, which is cubic in the coarse one.
const FINE_SHELL: usize = 2;
/// Places in a cell, each way, at which the undeformed membrane's brightest and steepest light is looked for.
const LOOKS: usize = 6;

/// Which parts of the light a field has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldParts {
    /// Whether light falls off with the way and the slant; else every point is lit like the pole.
    pub falloff: bool,
    /// The membrane's mean reflectance for each channel, if it lights itself.
    pub albedo: Option<[f64; 3]>,
    /// Whether moved points are asked for.
    pub moved: bool,
    /// Largest error of the tables, as a part of each light's largest value.
    pub tolerance: f64,
}

/// Light on the membrane for the three channels of the camera, mW/mm^2 weighted by their responses.
#[derive(Debug, Clone)]
pub struct LightField {
    radius_mm: f64,
    grid: DomeGrid,
    /// Coefficients of a cubic spline.
    still: Vec<Vec4>,
    bends: Bends,
    shell_grid: DomeGrid,
    scale: Scale,
    shell_scale: Scale,
    shells: Vec<ShellNodes>,
    brightest: [f64; 3],
    steepest_per_mm: f64,
    error: f64,
    evaluations: u64,
    own: Option<OwnLight>,
}

/// The flux of the three channels along x, y and z, and the membrane's own light.
#[derive(Debug, Clone, Copy, Default)]
struct ShellNode {
    along: [Vec3A; 3],
    own: Vec3A,
}

/// A node on each of the shells, side by side: a look-up asks all of them.
type ShellNodes = [ShellNode; SHELLS.len()];

impl LightField {
    /// Puts the tables of all lights together.
    pub fn new(ways: &Ways, prepared: &Prepared, parts: &FieldParts) -> Self {
        let mut field = Self {
            radius_mm: ways.radius_mm(),
            grid: DomeGrid::with_cells(8),
            still: Vec::new(),
            bends: Bends::default(),
            shell_grid: DomeGrid::with_cells(8),
            scale: Scale::of(&DomeGrid::with_cells(8)),
            shell_scale: Scale::of(&DomeGrid::with_cells(8)),
            shells: Vec::new(),
            brightest: [0.0; 3],
            steepest_per_mm: 0.0,
            error: 0.0,
            evaluations: 0,
            own: None,
        };
        let rule = EmitterRule::default();
        let (grid, table) = if parts.falloff {
            let tables = prepared.still(ways, parts.tolerance);
            field.error = tables.error;
            field.evaluations += tables.evaluations;
            (tables.grid, channels(ways, tables))
        } else {
            let mut pole = [0.0; 3];
            for source in &ways.sources {
                let light = ways.still(source, DVec3::Z, &rule);
                pole = std::array::from_fn(|c| pole[c] + light * source.seen_mw[c]);
            }
            field.evaluations += 1;
            let grid = DomeGrid::with_cells(8);
            (grid, vec![pole; grid.nodes * grid.nodes])
        };
        let own = parts.albedo.map(|albedo| OwnLight::new(ways, prepared, albedo, &grid, &table));
        field.set_still(&grid, &table, own.as_ref());
        if parts.moved && parts.falloff {
            field.set_shells(ways, prepared.shells(ways), own.as_ref());
        }
        field.own = own;
        field
    }

    /// The table is small, so that it stays in the nearest caches, and looked up as a cubic spline: a picture of it has no
    /// creases of the table's making.
    fn set_still(&mut self, grid: &DomeGrid, table: &[[f64; 3]], own: Option<&OwnLight>) {
        let more = |place: DVec2| own.map_or([0.0; 3], |own| own.at(direction_from_disc(place)));
        let inside = |place: DVec2| -> [f64; 3] {
            let direct = bicubic(grid, table, grid.coordinates_of_disc(place));
            let more = more(place);
            std::array::from_fn(|c| direct[c].max(0.0) + more[c])
        };
        let node = |i: usize| {
            let place = grid.place(i % grid.nodes, i / grid.nodes);
            let [r, g, b] = if place.length() <= 1.0 {
                let more = more(place);
                std::array::from_fn(|c| table[i][c].max(0.0) + more[c])
            } else if table[i] != [0.0; 3] {
                // Next to the rim the table goes on by itself.
                let more = continued(place, more);
                std::array::from_fn(|c| table[i][c] + more[c])
            } else {
                continued(place, inside)
            };
            Vec4::new(r as f32, g as f32, b as f32, 0.0)
        };
        self.still = (0..grid.nodes * grid.nodes).into_par_iter().map(node).collect();
        bend::to_coefficients(&mut self.still, grid.nodes);
        (self.grid, self.scale) = (*grid, Scale::of(grid));
        self.bends.find_third(&self.still, grid.nodes);
        self.look_over();
    }

    /// The brightest and the steepest light of the undeformed membrane.
    fn look_over(&mut self) {
        let fine = DomeGrid::with_cells(self.grid.cells() * LOOKS);
        let row = |row: usize| -> Vec<Option<Vec4>> {
            let light = |column: usize| {
                let place = fine.place(column, row);
                (place.length() <= 1.0).then(|| self.still_at(place.as_vec2()))
            };
            (0..fine.nodes).map(light).collect()
        };
        let rows: Vec<Vec<Option<Vec4>>> = (0..fine.nodes).into_par_iter().map(row).collect();
        let (mut brightest, mut steepest) = (Vec4::ZERO, 0.0_f32);
        for (j, row) in rows.iter().enumerate() {
            for (i, here) in row.iter().enumerate() {
                let Some(here) = here else { continue };
                brightest = brightest.max(*here);
                let below = rows.get(j + 1).and_then(|row| row.get(i));
                for there in [row.get(i + 1), below].into_iter().flatten().flatten() {
                    steepest = steepest.max((*there - *here).abs().max_element());
                }
            }
        }
        self.brightest = [brightest.x, brightest.y, brightest.z].map(f64::from);
        // The map's scale is at most sqrt(2) (at the rim, along it), so a cell is at least this long.
        let cell_mm = fine.cell() * self.radius_mm / std::f64::consts::SQRT_2;
        self.steepest_per_mm = std::f64::consts::SQRT_2 * f64::from(steepest) / cell_mm;
    }

    fn set_shells(&mut self, ways: &Ways, tables: &[Tables<3>], own: Option<&OwnLight>) {
        let Some(first) = tables.first() else { return };
        let grid = first.grid;
        let fine = DomeGrid::with_cells(grid.cells() * FINE_SHELL);
        let shells = tables
            .iter()
            .map(|tables| {
                self.evaluations += tables.evaluations;
                let mut flux = vec![[0.0; 9]; grid.nodes * grid.nodes];
                for (source, table) in ways.sources.iter().zip(&tables.sources) {
                    for (sum, vector) in flux.iter_mut().zip(table) {
                        for (k, total) in sum.iter_mut().enumerate() {
                            *total += vector[k % 3] * source.seen_mw[k / 3];
                        }
                    }
                }
                let inside = |place: DVec2| -> [f64; 12] {
                    let v = bicubic(&grid, &flux, grid.coordinates_of_disc(place));
                    let more = own.map_or([0.0; 3], |own| own.at(direction_from_disc(place)));
                    std::array::from_fn(|k| if k < 9 { v[k] } else { more[k - 9] })
                };
                let node = |i: usize| {
                    let v = continued(fine.place(i % fine.nodes, i / fine.nodes), inside).map(|v| v as f32);
                    let along = |axis: usize| Vec3A::new(v[axis], v[3 + axis], v[6 + axis]);
                    ShellNode { along: std::array::from_fn(along), own: Vec3A::new(v[9], v[10], v[11]) }
                };
                (0..fine.nodes * fine.nodes).into_par_iter().map(node).collect()
            })
            .collect::<Vec<Vec<ShellNode>>>();
        let of = |shell: usize, i: usize| shells.get(shell).and_then(|nodes| nodes.get(i)).copied();
        let nodes = |i: usize| std::array::from_fn(|shell| of(shell, i).unwrap_or_default());
        self.shells = (0..fine.nodes * fine.nodes).map(nodes).collect();
        (self.shell_grid, self.shell_scale) = (fine, Scale::of(&fine));
        self.bends.find_kinks(&self.shells, fine.nodes);
    }

    /// Irradiance of an undeformed point in this unit direction, for the channels red, green, blue; the fourth number means
    /// nothing.
    #[inline]
    pub fn still(&self, direction: Vec3A) -> Vec4 {
        self.still_at(disc_of(direction)).max(Vec4::ZERO)
    }

    /// The undeformed membrane's light at a place of the disc.
    #[inline]
    fn still_at(&self, disc: Vec2) -> Vec4 {
        self.cubic_at(&self.still, disc).max(Vec4::ZERO)
    }

    /// A table on the undeformed membrane's grid at a place of the disc.
    #[inline]
    fn cubic_at(&self, table: &[Vec4], disc: Vec2) -> Vec4 {
        let nodes = self.grid.nodes;
        // The cubics take a node more on each side.
        let ((column, row), part) = split(self.scale.place(disc), 1.0, self.scale.last_cubic);
        let (wx, wy) = cubics(part);
        let start = (row - 1) * nodes + column - 1;
        let Some(corner) = table.get(start..start + 3 * nodes + 4) else { return Vec4::ZERO };
        let across = |row: usize| {
            let row = &corner[row * nodes..row * nodes + 4];
            (row[0] * wx[0] + row[1] * wx[1]) + (row[2] * wx[2] + row[3] * wx[3])
        };
        (across(0) * wy[0] + across(1) * wy[1]) + (across(2) * wy[2] + across(3) * wy[3])
    }

    /// Irradiance of a point that was moved to `point_mm` (sensor frame), with the unit normal out of the
    /// elastomer that it has there. Without shells it answers as for a point that was not moved.
    pub fn moved(&self, point_mm: Vec3A, normal: Vec3A) -> Vec4 {
        let distance = point_mm.length();
        if self.shells.is_empty() || distance.is_nan() || distance <= 0.0 {
            return self.still(if distance > 0.0 { point_mm / distance } else { Vec3A::Z });
        }
        let (part, direction) = (distance / self.radius_mm as f32, point_mm / distance);
        let disc = disc_of(direction);
        let (at, x, y) = cell_of(&self.shell_grid, &self.shell_scale, disc);
        let nodes = self.shell_grid.nodes;
        let Some(corner) = self.shells.get(at..at + nodes + 2) else { return Vec4::ZERO };
        let corners = [
            (&corner[0], (1.0 - x) * (1.0 - y)),
            (&corner[1], x * (1.0 - y)),
            (&corner[nodes], (1.0 - x) * y),
            (&corner[nodes + 1], x * y),
        ];
        let weights = shell_weights(part);
        let mut light = Vec3A::ZERO;
        for (shells, share) in corners {
            let along = |shell: usize| shells[shell].light(normal) * weights[shell];
            light += (along(0) + along(1) + along(2)) * share;
        }
        // What the outer shell's coarser table lacks of the undeformed membrane's light belongs to that one's own place and
        // normal, and is lost on the way from there.
        let near = smooth_step(1.0 - (1.0 - part).abs() / LACKING_PART)
            * smooth_step(1.0 - (1.0 - normal.dot(direction)) / LACKING_TILT);
        if near > 0.0 {
            let mut outer = Vec3A::ZERO;
            for (shells, share) in corners {
                outer += shells[0].light(direction) * share;
            }
            light += (Vec3A::from_vec4(self.still_at(disc)) - outer) * near;
        }
        light.max(Vec3A::ZERO).extend(0.0)
    }

    /// Irradiance of the sheet's top beside the dome, from below: a white marker's.
    pub fn beside(&self, ways: &Ways, prepared: &Prepared, position_mm: DVec3) -> [f64; 3] {
        let rule = EmitterRule::default();
        let mut light = [0.0; 3];
        for source in &ways.sources {
            let one = ways.flux(source, position_mm, &rule).z.max(0.0);
            light = std::array::from_fn(|c| light[c] + one * source.seen_mw[c]);
        }
        if let Some(own) = self.own.as_ref().filter(|_| ways.fresnel) {
            for (c, room) in prepared.rooms(ways).iter().enumerate() {
                light[c] += room.beside(&ways.optics[c], &own.exitance[c], position_mm);
            }
        }
        light
    }

    /// Largest irradiance of each channel on the undeformed membrane.
    pub fn brightest(&self) -> [f64; 3] {
        self.brightest
    }

    /// Largest error of a light's table seen in the probes, as a part of its largest value.
    pub fn error(&self) -> f64 {
        self.error
    }

    /// Points at which every light was worked out exactly to make the tables.
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// Largest difference of the undeformed membrane's light between near places over their distance, 1/mm.
    pub fn steepest_per_mm(&self) -> f64 {
        self.steepest_per_mm
    }
}

impl ShellNode {
    /// Light on a surface of this normal.
    #[inline]
    fn light(&self, normal: Vec3A) -> Vec3A {
        let [x, y, z] = self.along;
        (x * normal.x + y * normal.y) + (z * normal.z + self.own)
    }
}

/// Depth, as a part of the radius, and turn of the normal, as one less its cosine, at which what the outer shell lacks
/// does not count any more.
const LACKING_PART: f32 = 0.05;
const LACKING_TILT: f32 = 0.02;

/// A function of the disc at a place, beyond its rim as the parabola through the rim and two places inside goes on, as
/// far apart as the place lies outside.
fn continued<const K: usize>(place: DVec2, inside: impl Fn(DVec2) -> [f64; K]) -> [f64; K] {
    let radius = place.length();
    if radius <= 1.0 {
        return inside(place);
    }
    // The square's corners lie far out, where nothing is looked up.
    let beyond = (radius - 1.0).min(0.45);
    let [rim, near, deep] = [1.0, 1.0 - beyond, 1.0 - 2.0 * beyond].map(|r| inside(place * (r / radius)));
    std::array::from_fn(|k| 3.0 * (rim[k] - near[k]) + deep[k])
}

/// The lights' tables as the channels see them together.
fn channels(ways: &Ways, tables: &Tables<1>) -> Vec<[f64; 3]> {
    let mut sum = vec![[0.0; 3]; tables.grid.nodes * tables.grid.nodes];
    for (source, table) in ways.sources.iter().zip(&tables.sources) {
        for (total, [light]) in sum.iter_mut().zip(table) {
            for (channel, seen) in total.iter_mut().zip(source.seen_mw) {
                *channel += light * seen;
            }
        }
    }
    sum
}

/// Lagrange's weights of the three shells for a radius, part of the dome's.
#[inline]
fn shell_weights(part: f32) -> [f32; 3] {
    const PARTS: [f32; 3] = [SHELLS[0] as f32, SHELLS[1] as f32, SHELLS[2] as f32];
    let [a, b, c] = PARTS;
    let p = part.clamp(0.5, 1.1);
    [
        (p - b) * (p - c) * (1.0 / ((a - b) * (a - c))),
        (p - a) * (p - c) * (1.0 / ((b - a) * (b - c))),
        (p - a) * (p - b) * (1.0 / ((c - a) * (c - b))),
    ]
}
