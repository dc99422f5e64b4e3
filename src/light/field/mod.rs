//! The light on the membrane as tables: looked up in every frame.
//!
//! The lights ride on the platform, so in the sensor frame the light on the undeformed membrane never changes:
//! one table of it serves every frame. Where an object has moved the membrane, its place and its normal differ;
//! what that changes of their light is looked up beside it (`field::shells`).

mod own;
mod places;
mod shells;

use glam::{DVec2, DVec3, Vec2, Vec3A, Vec4};
use rayon::prelude::*;

use self::own::OwnLight;
use self::places::{Inside, Middle, Scale, continued, split};
use self::shells::{Shells, along};
use crate::direct::EmitterRule;
use crate::dome_map::{DomeGrid, bicubic};
use crate::splines::{Degree, cubics, to_coefficients};
pub use crate::tables::FieldParts;
use crate::tables::{Prepared, Tables, Ways};

/// Light on a point before its normal is known, by channel: irradiance is `base + vectors^T normal`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BeforeNormal {
    /// What does not change with the normal.
    pub base: Vec3A,
    /// `[k]` has component k of each channel's vector irradiance.
    pub vectors: [Vec3A; 3],
    /// What comes straight from the lights where the skin is as at rest.
    pub direct: Vec3A,
}

impl BeforeNormal {
    /// Irradiance of each channel on a surface with this unit normal, beside the base.
    #[inline]
    pub fn along(&self, normal: Vec3A) -> Vec3A {
        along(&self.vectors, normal)
    }
}

/// Light on the membrane for the three channels of the camera, mW/mm^2 weighted by their responses.
#[derive(Debug, Clone)]
pub struct LightField {
    middle: Middle,
    scale: Scale,
    /// Coefficients of a cubic spline.
    still: Vec<Vec4>,
    shells: Option<Shells>,
    brightest: [f64; 3],
    error: f64,
    evaluations: u64,
    own: Option<OwnLight>,
}

impl LightField {
    /// Puts the tables of all lights together.
    pub fn new(ways: &Ways, prepared: &Prepared, parts: &FieldParts) -> Self {
        let mut field = Self {
            middle: Middle::of(ways),
            scale: Scale::of(&DomeGrid::with_cells(8)),
            still: Vec::new(),
            shells: None,
            brightest: [0.0; 3],
            error: 0.0,
            evaluations: 0,
            own: None,
        };
        let rule = EmitterRule::default();
        let (grid, table) = if parts.falloff {
            let tables = prepared.dome(ways);
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
            let grid = DomeGrid::with_cells(8).over(ways.face());
            (grid, vec![pole; grid.nodes * grid.nodes])
        };
        let own = parts.albedo.map(|albedo| OwnLight::new(ways, prepared, albedo, &grid, &table));
        field.set_still(&grid, &table, own.as_ref());
        if parts.moved && parts.falloff {
            let tables = prepared.shells(ways);
            field.evaluations += tables.iter().map(|tables| tables.evaluations).sum::<u64>();
            field.shells = Shells::new(ways, prepared.dome(ways), tables, own.as_ref());
        }
        field.own = own;
        field
    }

    /// The table is small, so that it stays in the nearest caches, and looked up as a cubic spline: a picture of it has no
    /// creases of the table's making.
    fn set_still(&mut self, grid: &DomeGrid, table: &[[f64; 3]], own: Option<&OwnLight>) {
        let more = |place: DVec2| own.map_or([0.0; 3], |own| own.at(grid.face.place_of_disc(place)));
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
        to_coefficients(&mut self.still, grid.nodes, Degree::Cubic);
        self.scale = Scale::of(grid);
        self.brightest = self.brightest_node(grid);
    }

    fn brightest_node(&self, grid: &DomeGrid) -> [f64; 3] {
        let reach = grid.face.reach() as f32;
        let inside = (0..grid.nodes * grid.nodes).map(|i| grid.place(i % grid.nodes, i / grid.nodes));
        let light =
            inside.filter(|place| place.length() <= 1.0).map(|place| self.still_at(place.as_vec2() * reach));
        let brightest = light.fold(Vec4::ZERO, Vec4::max);
        [brightest.x, brightest.y, brightest.z].map(f64::from)
    }

    /// Irradiance of an undeformed point at this place of the face ([`crate::dome_map::DomeFace`]), for the channels red, green, blue; the fourth number means
    /// nothing.
    #[inline]
    pub fn still(&self, direction: Vec3A) -> Vec4 {
        self.still_at(self.scale.flat(direction)).max(Vec4::ZERO)
    }

    /// The undeformed membrane's light at a place of the equal-area plane.
    #[inline]
    fn still_at(&self, disc: Vec2) -> Vec4 {
        self.cubic_at(&self.still, disc).max(Vec4::ZERO)
    }

    /// A table on the undeformed membrane's grid at a place of the equal-area plane.
    #[inline]
    fn cubic_at(&self, table: &[Vec4], disc: Vec2) -> Vec4 {
        let nodes = self.scale.nodes;
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
        let at = self.middle.inside(point_mm);
        let change = self.change_at(&at, normal);
        (self.still(at.place) + change.extend(0.0)).max(Vec4::ZERO)
    }

    /// [`LightField::moved`] before the normal is known; `None` without shells.
    #[inline]
    pub fn before_normal(&self, point_mm: Vec3A) -> Option<BeforeNormal> {
        let at = self.middle.inside(point_mm);
        let [vectors, outer, own] = self.shells.as_ref()?.vectors(&at);
        let out = at.outward;
        let still = Vec3A::from_vec4(self.still(at.place));
        Some(BeforeNormal { base: still - along(&outer, out), vectors, direct: still - along(&own, out) })
    }

    #[inline]
    fn change_at(&self, at: &Inside, normal: Vec3A) -> Vec3A {
        self.shells.as_ref().map_or(Vec3A::ZERO, |shells| shells.change(at, normal))
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

    /// Largest irradiance of each channel at the nodes of the undeformed membrane's table.
    pub fn brightest(&self) -> [f64; 3] {
        self.brightest
    }

    /// Largest error of a light's table seen in the probes, as a part of its largest value.
    pub fn error(&self) -> f64 {
        self.error
    }

    /// Points at which every light was computed exactly to make the tables.
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }
}

/// The lights' irradiance of the undeformed membrane as the channels see it together.
fn channels(ways: &Ways, tables: &Tables) -> Vec<[f64; 3]> {
    let mut sum = vec![[0.0; 3]; tables.grid.nodes * tables.grid.nodes];
    for (source, table) in ways.sources.iter().zip(&tables.sources) {
        for (total, [.., light]) in sum.iter_mut().zip(table) {
            for (channel, seen) in total.iter_mut().zip(source.seen_mw) {
                *channel += light * seen;
            }
        }
    }
    sum
}
