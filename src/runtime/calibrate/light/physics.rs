//! What the light of the model gives at the places that were seen.

use glam::DVec3;
use nalgebra::DMatrix;

use super::observed::{Observed, depth_on_ball};
use crate::constants::LightConstants;
use domecast_light::direct::EmitterRule;
use domecast_light::dome_map::DomeFace;
use domecast_light::radiosity::{DomeRoom, Rings, Underside};
use domecast_light::tables::Ways;
use domecast_optics::SensorOptics;

/// Places across a light, each way: the rule's error is far below a camera's noise.
const PLACES: usize = 3;
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
    /// Irradiance of each patch by an exitance of one of each, by channel.
    mutual: Vec<DMatrix<f64>>,
    dome_center_mm: DVec3,
    dome_mm: f64,
}

/// The dome's own light at its patches by their direct light, by channel.
pub(super) type OwnLight = [DMatrix<f64>; 3];

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

    /// What the dome gives itself: `a (1 - a K)^-1 K` for a reflectance a.
    pub fn own_light(&self, light: &LightConstants) -> Option<OwnLight> {
        let of = |c: usize| -> Option<DMatrix<f64>> {
            let (albedo, mutual) = (light.mean_reflectance[c], self.mutual.get(c)?);
            let left = DMatrix::identity(mutual.nrows(), mutual.ncols()) - mutual * albedo;
            left.lu().solve(&(mutual * albedo))
        };
        Some([of(0)?, of(1)?, of(2)?])
    }

    /// The dome's own light of a channel at a place, from that of its patches.
    pub fn own_at(&self, patches: &[f64], point_mm: DVec3) -> f64 {
        let place = (point_mm - self.dome_center_mm) / self.dome_mm;
        self.rings.around(place).iter().map(|(patch, weight)| weight * patches[*patch]).sum()
    }

    /// One light at all places; with `per_mm` also how it changes along the rays of the caps.
    pub fn flux(&self, ways: &Ways, source: usize, seen: &Observed, shape: &CapShape, per_mm: bool) -> SourceFlux {
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

/// The dome's own light at its patches, for all channels.
pub(super) fn own_patches(own: &OwnLight, fluxes: &[&SourceFlux], seen: &[DVec3]) -> [Vec<f64>; 3] {
    std::array::from_fn(|c| {
        let mut direct = nalgebra::DVector::zeros(own[c].ncols());
        for (flux, seen) in fluxes.iter().zip(seen) {
            for (sum, value) in direct.iter_mut().zip(&flux.patches) {
                *sum += seen[c] * value;
            }
        }
        (&own[c] * direct).iter().copied().collect()
    })
}
