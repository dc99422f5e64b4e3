//! What the light of the model gives at the places that were seen.

use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use super::observed::{Observed, depth_on_ball};
use crate::constants::LightConstants;
use domecast_light::direct::EmitterRule;
use domecast_light::dome_map::{DomeFace, DomeGrid, bicubic};
use domecast_light::radiosity::{DomeRoom, Rings, Underside};
use domecast_light::tables::Ways;
use domecast_optics::SensorOptics;

/// Places across a light, each way: the rule's error is far below a camera's noise.
const PLACES: usize = 3;
/// Cells across the dome of the tables that derivatives are taken from.
const CELLS: usize = 16;
/// Rounds of the dome's own light, and the change at which they end, a part of the direct light.
const MAX_ROUNDS: usize = 400;
const ROUNDS_END: f64 = 1e-7;
/// Rings and patches of the dome as a room: a third of those that frames are drawn with, and within a thousandth of their light.
const RINGS: usize = 10;
const PATCHES: usize = 24;
/// Step along the ray over which the light on a cap changes, mm.
const DEPTH_STEP_MM: f64 = 0.05;

/// One light on a place of a cap, for a flux of one.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct CapFlux {
    /// Irradiance of the undeformed dome there; negative where the light comes from behind.
    pub undeformed: f64,
    /// Vector irradiance at the skin, and what a mm along the ray changes of it.
    pub vector: DVec3,
    pub per_mm: DVec3,
}

/// One light at all places, for a flux of one.
#[derive(Debug, Clone, Default)]
pub(super) struct SourceFlux {
    pub still: Vec<f64>,
    pub patches: Vec<f64>,
    pub caps: Vec<CapFlux>,
}

/// What is the same for every light of the sensor.
pub(super) struct Physics {
    optics: SensorOptics,
    rule: EmitterRule,
    rings: Rings,
    grid: DomeGrid,
    /// Irradiance of each patch by an exitance of one of each, by channel.
    mutual: Vec<DMatrix<f64>>,
    dome_center_mm: DVec3,
    dome_mm: f64,
}

/// A light's vector irradiance at the nodes of a coarse grid over the dome.
pub(super) type Table = Vec<[f64; 3]>;

/// Where the caps' skin lies: mm along the ray, and its outward normal.
pub(super) type CapShape = Vec<Option<(f64, DVec3)>>;

impl Physics {
    /// The sensor's optics with this light's layers between.
    ///
    /// # Errors
    /// A sentence that names the field at fault.
    pub fn new(optics: &SensorOptics, light: &LightConstants) -> Result<Self, String> {
        let ways = light.ways(optics)?;
        let rings = Rings { rings: RINGS, patches: PATCHES, face: ways.face() };
        let mutual = ways.optics.iter().map(|optics| {
            let room = DomeRoom::new(optics, rings, Underside::Fresnel);
            let mut columns = DMatrix::zeros(rings.count(), rings.count());
            let mut one = vec![0.0; rings.count()];
            for patch in 0..rings.count() {
                one[patch] = 1.0;
                columns.column_mut(patch).copy_from_slice(&room.irradiance(&one));
                one[patch] = 0.0;
            }
            columns
        });
        let dome = optics.dome();
        Ok(Self {
            optics: optics.clone(),
            rule: EmitterRule::with_places(PLACES),
            rings,
            grid: DomeGrid::with_cells(CELLS).over(rings.face),
            mutual: mutual.collect(),
            dome_center_mm: dome.center_mm(),
            dome_mm: dome.radius_mm(),
        })
    }

    /// The ways of a light through this sensor.
    ///
    /// # Errors
    /// A sentence that names the field at fault.
    pub fn ways(&self, light: &LightConstants) -> Result<Ways, String> {
        light.ways(&self.optics)
    }

    /// The sphere of the dome: its centre and radius, mm.
    pub fn dome(&self) -> (DVec3, f64) {
        (self.dome_center_mm, self.dome_mm)
    }

    /// A light over the dome, coarsely, for a flux of one: what its derivatives are taken from.
    pub fn table(&self, ways: &Ways, source: usize) -> Table {
        let Some(source) = ways.sources.get(source) else { return Table::new() };
        self.grid.fill_in_parallel(|place| {
            let flux = ways.flux(source, ways.point(place, 1.0), &self.rule);
            if flux.is_finite() { flux.to_array() } else { [0.0; 3] }
        })
    }

    /// What a table says at a point of the dome or inside it.
    fn look_up(&self, table: &Table, point_mm: DVec3) -> DVec3 {
        let place = (point_mm - self.dome_center_mm) / self.dome_mm;
        DVec3::from_array(bicubic(&self.grid, table, self.grid.coordinates(place)))
    }

    /// A light at all places after a change that a table has.
    pub fn changed(&self, flux: &SourceFlux, change: &Table, seen: &Observed) -> SourceFlux {
        let more = |point_mm: DVec3| self.look_up(change, point_mm);
        let still = seen.still.iter().zip(&flux.still);
        let caps = seen.caps.iter().zip(&flux.caps);
        let patch = |(i, flux): (usize, &f64)| {
            let place = self.rings.place(i / self.rings.patches, i % self.rings.patches);
            let more = DVec3::from_array(bicubic(&self.grid, change, self.grid.coordinates(place)));
            (flux + more.dot(self.rings.face.normal(place))).max(0.0)
        };
        SourceFlux {
            still: still.map(|(at, flux)| (flux + more(at.point_mm).dot(at.normal)).max(0.0)).collect(),
            patches: flux.patches.iter().enumerate().map(patch).collect(),
            caps: caps
                .map(|(at, flux)| {
                    let more = more(at.point_mm);
                    CapFlux {
                        undeformed: flux.undeformed + more.dot(at.normal),
                        vector: flux.vector + more,
                        per_mm: flux.per_mm,
                    }
                })
                .collect(),
        }
    }

    /// The dome's own light at its patches for all channels: `B = a (E + K B)`, summed up.
    pub fn own_patches(
        &self,
        light: &LightConstants,
        fluxes: &[&SourceFlux],
        seen: &[DVec3],
    ) -> [Vec<f64>; 3] {
        std::array::from_fn(|c| {
            let mut direct = DVector::zeros(self.rings.count());
            for (flux, seen) in fluxes.iter().zip(seen) {
                direct.iter_mut().zip(&flux.patches).for_each(|(sum, value)| *sum += seen[c] * value);
            }
            let (albedo, mutual) = (light.mean_reflectance[c], &self.mutual[c]);
            let mut own: DVector<f64> = DVector::zeros(direct.len());
            for _ in 0..MAX_ROUNDS {
                let next = mutual * ((&direct + &own) * albedo);
                let change = (&next - &own).amax();
                own = next;
                if change <= ROUNDS_END * direct.amax() {
                    break;
                }
            }
            own.iter().copied().collect()
        })
    }

    /// The dome's own light of a channel at a place, from that of its patches.
    pub fn own_at(&self, patches: &[f64], point_mm: DVec3) -> f64 {
        let place = (point_mm - self.dome_center_mm) / self.dome_mm;
        self.rings.around(place).iter().map(|(patch, weight)| weight * patches[*patch]).sum()
    }

    /// One light at all places; with `per_mm` also how it changes along the rays of the caps.
    pub fn flux(
        &self,
        ways: &Ways,
        source: usize,
        seen: &Observed,
        shape: &CapShape,
        per_mm: bool,
    ) -> SourceFlux {
        let Some(source) = ways.sources.get(source) else { return SourceFlux::default() };
        let at = |point_mm: DVec3| {
            let flux = ways.flux(source, point_mm, &self.rule);
            if flux.is_finite() { flux } else { DVec3::ZERO }
        };
        let face: DomeFace = self.rings.face;
        let patch = |i: usize| {
            let place = self.rings.place(i / self.rings.patches, i % self.rings.patches);
            at(ways.point(place, 1.0)).dot(face.normal(place)).max(0.0)
        };
        let cap = |(place, shape): (&super::observed::CapPlace, &Option<(f64, DVec3)>)| {
            let Some((depth_mm, _)) = *shape else { return CapFlux::default() };
            let vector = at(place.point_mm + place.ray * depth_mm);
            let deeper = || at(place.point_mm + place.ray * (depth_mm - DEPTH_STEP_MM));
            CapFlux {
                undeformed: at(place.point_mm).dot(place.normal),
                vector,
                per_mm: if per_mm { (vector - deeper()) / DEPTH_STEP_MM } else { DVec3::ZERO },
            }
        };
        SourceFlux {
            still: seen.still.iter().map(|place| at(place.point_mm).dot(place.normal).max(0.0)).collect(),
            patches: (0..self.rings.count()).map(patch).collect(),
            caps: seen.caps.iter().zip(shape).map(cap).collect(),
        }
    }
}

/// The shape of the caps under balls.
pub(super) fn cap_shape(seen: &Observed, centers_mm: &[DVec3], radius_mm: f64) -> CapShape {
    let one = |place: &super::observed::CapPlace| {
        let center_mm = *centers_mm.get(place.press)?;
        let depth_mm = depth_on_ball(place.point_mm, place.ray, center_mm, radius_mm)?;
        let at = place.point_mm + place.ray * depth_mm;
        Some((depth_mm, (center_mm - at) / radius_mm))
    };
    seen.caps.iter().map(one).collect()
}

/// What the camera's channels see of each light: flux times crosstalk.
pub(super) fn seen_flux(light: &LightConstants) -> Vec<DVec3> {
    let column = |led: &crate::constants::LedConstants| {
        let color = ["red", "green", "blue"].iter().position(|name| *name == led.color).unwrap_or(0);
        DVec3::from_array(light.crosstalk.map(|row| row[color])) * led.flux
    };
    light.leds.iter().map(column).collect()
}
