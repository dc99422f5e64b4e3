//! The light on the undeformed dome, place by place over equal areas: each colour's vector irradiance, and what the
//! camera makes of it.

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

use super::direct::EmitterRule;
use super::dome_map::DomeFace;
use super::gloss::Gloss;
use super::parts::LightUse;
use super::setup::{self, Channels};
use super::shade::{ShadedDome, leaves};
use super::tables::Ways;
use crate::SimError;
use crate::scene::Scene;
use crate::work::Work;

/// Places in rings round the axis, every one of the same area.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlaceGrid {
    /// Rings of equal height, from the rim up: on a sphere and on a cylinder these have equal areas (Archimedes).
    pub rings: usize,
    /// Places in each ring.
    pub places: usize,
}

impl PlaceGrid {
    /// Place on the unit dome at a share of the rings from the rim and a share of the round.
    pub fn on_unit_dome(&self, face: DomeFace, ring: f64, place: f64) -> DVec3 {
        let azimuth = std::f64::consts::TAU * place / self.places as f64;
        face.place(azimuth, face.level((ring / self.rings as f64).clamp(0.0, 1.0)))
    }

    /// Middle of a place on the unit dome.
    pub fn middle(&self, face: DomeFace, index: usize) -> DVec3 {
        let (ring, place) = (index / self.places.max(1), index % self.places.max(1));
        self.on_unit_dome(face, ring as f64 + 0.5, place as f64 + 0.5)
    }

    /// How many places in all; place `p` of ring `r` is number `r * places + p`.
    pub fn count(&self) -> usize {
        self.rings * self.places
    }
}

/// The light on a place of the dome.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IlluminatedPlace {
    /// Angle between the axis and the way from the sphere's centre to the place, degrees.
    pub polar_deg: f64,
    /// Angle about the axis from x, degrees, 0 to 360.
    pub azimuth_deg: f64,
    /// Outward unit normal.
    pub normal: DVec3,
    /// Where the camera sees the place, raw image; `None` where it does not.
    pub image_px: Option<DVec2>,
    /// Share of the light from the place that leaves the sheet towards the camera, for each channel.
    pub passed: Channels,
    /// Direct vector irradiance by the red, green and blue lights, mW/mm^2.
    pub vector_mw_mm2: [DVec3; 3],
    /// Irradiance that each channel sees, with the dome lighting itself, mW/mm^2.
    pub total_mw_mm2: Channels,
}

impl IlluminatedPlace {
    /// The direct light on a point of the dome; its angles and normal are left to the caller.
    fn of(scene: &Scene, ways: &Ways, point_mm: DVec3, rule: &EmitterRule) -> Self {
        let mut vector_mw_mm2 = [DVec3::ZERO; 3];
        for source in &ways.sources {
            let color = source.optics.channel() as usize;
            // What its own channel sees of a colour is all of it.
            if let (Some(sum), Some(mw)) = (vector_mw_mm2.get_mut(color), source.seen_mw.get(color)) {
                *sum += ways.flux(source, point_mm, rule) * *mw;
            }
        }
        let view = view(scene, point_mm);
        // The channels' ways differ by dispersion alone, far less than what Fresnel's share would notice.
        let momentum = view.map_or(0.0, |(_, momentum)| momentum);
        Self {
            polar_deg: 0.0,
            azimuth_deg: 0.0,
            normal: DVec3::Z,
            image_px: view.map(|(pixel, _)| pixel),
            passed: std::array::from_fn(|c| leaves(&ways.optics[c], momentum, false)),
            vector_mw_mm2,
            total_mw_mm2: [0.0; 3],
        }
    }

    /// `L`: its rows are the vector irradiances of the three colours, mW/mm^2.
    pub fn light(&self) -> DMat3 {
        let [red, green, blue] = self.vector_mw_mm2;
        DMat3::from_cols(red, green, blue).transpose()
    }

    /// Irradiance by the red, green and blue lights directly, mW/mm^2.
    pub fn direct_mw_mm2(&self) -> Channels {
        self.vector_mw_mm2.map(|vector| vector.dot(self.normal).max(0.0))
    }
}

/// The light on the whole dome.
#[derive(Debug, Clone, PartialEq)]
pub struct Illumination {
    /// How the places lie.
    pub grid: PlaceGrid,
    /// The face that they lie on.
    pub face: DomeFace,
    /// The places.
    pub places: Vec<IlluminatedPlace>,
    /// `C`: what each channel (row) sees of each colour (column).
    pub crosstalk: DMat3,
    /// Level, of full scale, for each mW/mm^2 on the membrane at an exposure of 1 and with nothing lost at the sheet:
    /// reflectance over the square of the index, by which radiance falls on its way out into air.
    pub level_per_irradiance: Channels,
}

impl Illumination {
    /// The light of a scene at rest; `None` where it is not lit by the design's lights.
    ///
    /// # Errors
    /// Lights that do not fit the design, or a platform that cannot be made.
    pub fn of(scene: &Scene, grid: PlaceGrid) -> Result<Option<Self>, SimError> {
        let Some(mut light) = Self::direct(scene, grid, 180.0)? else { return Ok(None) };
        let Some(shaded) = ShadedDome::new(scene, &LightUse::ALL, &mut Work::default())? else {
            return Ok(None);
        };
        for (index, place) in light.places.iter_mut().enumerate() {
            let total = shaded.field().still(grid.middle(light.face, index).as_vec3a());
            place.total_mw_mm2 = [total.x, total.y, total.z].map(f64::from);
        }
        Ok(Some(light))
    }

    /// The same without what the dome adds (`total_mw_mm2` is 0), in a fraction of the time; of places beyond a polar
    /// angle there is nothing.
    ///
    /// # Errors
    /// As [`Illumination::of`].
    pub fn direct(scene: &Scene, grid: PlaceGrid, max_polar_deg: f64) -> Result<Option<Self>, SimError> {
        if scene.file().light.leds.is_none() {
            return Ok(None);
        }
        let ways = setup::ways(scene, &LightUse::ALL)?;
        Ok(Self::along(scene, &ways, grid, max_polar_deg, &EmitterRule::default()))
    }

    /// [`Illumination::direct`] for lights and ways of the caller's: other places, tilts and diffusers than the design's.
    pub fn along(
        scene: &Scene,
        ways: &Ways,
        grid: PlaceGrid,
        max_polar_deg: f64,
        rule: &EmitterRule,
    ) -> Option<Self> {
        let light = scene.file().light.leds.as_ref()?;
        let face = ways.face();
        let one = |index: usize| {
            let place = grid.middle(face, index);
            let polar_deg = place.truncate().length().atan2(place.z).to_degrees();
            (polar_deg <= max_polar_deg).then(|| IlluminatedPlace {
                polar_deg,
                azimuth_deg: 360.0 * ((index % grid.places) as f64 + 0.5) / grid.places as f64,
                normal: face.normal(place),
                ..IlluminatedPlace::of(scene, ways, ways.point(place, 1.0), rule)
            })
        };
        let places = (0..grid.count()).into_par_iter().filter_map(one).collect();
        let reflectance = scene.design().sections().elastomer.membrane_reflectance.to_array();
        Some(Self {
            grid,
            face,
            places,
            crosstalk: setup::crosstalk_matrix(light.crosstalk),
            level_per_irradiance: std::array::from_fn(|c| {
                reflectance[c] / setup::index_at(&ways.optics[c], false).powi(2)
            }),
        })
    }

    /// `C L` of a place, mW/mm^2.
    pub fn seen(&self, place: &IlluminatedPlace) -> DMat3 {
        self.crosstalk * place.light()
    }

    /// `C L` of a place in grey levels of a full scale of 255, for an exposure; levels are this times the normal.
    pub fn seen_levels(&self, place: &IlluminatedPlace, level_per_mw_mm2: f64) -> DMat3 {
        let gain: Channels = std::array::from_fn(|c| self.grey_per_mw_mm2(place, c, level_per_mw_mm2));
        DMat3::from_diagonal(DVec3::from_array(gain)) * self.seen(place)
    }

    /// Grey levels, of 255, of a channel for each mW/mm^2 on a place.
    pub fn grey_per_mw_mm2(&self, place: &IlluminatedPlace, channel: usize, level_per_mw_mm2: f64) -> f64 {
        let of = |values: &Channels| values.get(channel).copied().unwrap_or(0.0);
        255.0 * level_per_mw_mm2 * of(&self.level_per_irradiance) * of(&place.passed)
    }
}

/// Where the camera sees a point of the dome at rest, and the sine of the way's angle in air; `None` outside of the image.
fn view(scene: &Scene, point_mm: DVec3) -> Option<(DVec2, f64)> {
    let optics = scene.optics();
    let pixel = optics.project(point_mm).ok()?;
    let ray = optics.lens().unproject(pixel).ok()?;
    let direction = optics.sensor_from_camera().vector(ray);
    is_in_image(scene, pixel).then(|| (pixel, direction.truncate().length().min(1.0)))
}

/// Whether a place is in the raw image, pixel centres being whole numbers.
fn is_in_image(scene: &Scene, pixel: DVec2) -> bool {
    let spec = scene.optics().lens().spec();
    let size = DVec2::new(f64::from(spec.width), f64::from(spec.height));
    pixel.cmpge(DVec2::splat(-0.5)).all() && pixel.cmplt(size - 0.5).all()
}

/// A light's image in the faces of sheet and silicone, as the camera sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflection {
    /// Its middle in the raw image.
    pub image_px: DVec2,
    /// Levels of red, green and blue that it adds, of full scale.
    pub level: [f32; 3],
}

/// The pieces of the lights that the camera sees mirrored in the faces of sheet and silicone, at rest.
///
/// # Errors
/// Lights that do not fit the design.
pub fn reflections(scene: &Scene) -> Result<Vec<Reflection>, SimError> {
    let Some(gloss) = Gloss::of(scene)? else { return Ok(Vec::new()) };
    let seen = gloss.glints(scene.optics()).into_iter().filter_map(|glint| {
        let image_px = glint.corners_px.iter().sum::<DVec2>() / 4.0;
        is_in_image(scene, image_px).then_some(Reflection { image_px, level: glint.level })
    });
    Ok(seen.collect())
}
