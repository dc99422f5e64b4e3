//! The lights mirrored in the sheet's faces, as the camera sees them.
//!
//! Each flat face between two media throws back Fresnel's share of what comes from below. The way from the pupil up to the
//! face and down again to a light is unfolded: air twice, each layer below the face twice, with one momentum (index times
//! sine) throughout. A light that sends the radiance `L` appears with `L R`, `R` being the share that passes the faces
//! before, is thrown back, and passes them again. A white surface in air shows `E / pi` under the irradiance `E`, so the
//! level of a radiance is `pi` times that of an irradiance. Light that is thrown back and forth more often is left out: it is a
//! thousandth of that.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::cavity::Cavities;
use super::fresnel;
use super::parts::LightUse;
use super::setup;
use super::tables::Source;
use crate::SimError;
use crate::scene::Scene;
use domecast_optics::SensorOptics;
use domecast_optics::camera::Lens;

/// Pieces along each side of an emitter: each is in sight or not as a whole.
pub(crate) const PIECES: usize = 6;

/// Halvings that find the momentum of a way: 2^-50.
const HALVINGS: u32 = 50;

/// Steps that find the pupil of a way: the pupil moves little with the angle.
const PUPIL_STEPS: u32 = 3;

/// The lights and what stands before them.
#[derive(Debug, Clone)]
pub struct Gloss {
    sources: Vec<Source>,
    cavities: Cavities,
    /// Below this height nothing is in the way, mm.
    lowest_mm: f64,
    sheet_half_mm: DVec2,
    /// Level of a white surface in air for each mW/mm^2.
    level_per_mw_mm2: f64,
}

/// Faces that mirror: between each layer and the next, of which the first is the air below the sheet.
fn faces(optics: &SensorOptics) -> usize {
    optics.layers().len().saturating_sub(1)
}

/// The image of a piece of a light in a face.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Glint {
    /// Its corners, px.
    pub corners_px: [DVec2; 4],
    /// Red, green and blue level.
    pub level: [f32; 3],
}

/// A way from the pupil to a place below the sheet, by way of a face.
#[derive(Debug, Clone, Copy)]
struct MirrorWay {
    pixel: DVec2,
    /// Index times sine, the same in every layer.
    momentum: f64,
    /// Where it meets the underside, on the camera's side and on the light's.
    under_mm: [DVec3; 2],
    /// Distance of the mirroring place from the axis, mm.
    mirror_mm: DVec2,
    /// Unit direction in which light leaves towards the face.
    leaving: DVec3,
}

impl Gloss {
    /// The lights of a scene; `None` where it has none.
    ///
    /// # Errors
    /// Lights that do not fit the design.
    pub fn of(scene: &Scene) -> Result<Option<Self>, SimError> {
        let Some(light) = &scene.file().light.leds else { return Ok(None) };
        let design = scene.design();
        let leds = &design.sections().leds;
        Ok(Some(Self {
            sources: setup::sources(scene, &LightUse::ALL)?,
            cavities: setup::cavities(design)?,
            lowest_mm: leds.center_z_mm - leds.emitter_mm - leds.diffuser_thickness_mm,
            sheet_half_mm: setup::sheet_half_mm(design),
            level_per_mw_mm2: light.level_per_mw_mm2,
        }))
    }

    /// Ways that are looked for at one time.
    pub(crate) fn way_count(&self) -> u64 {
        let ways = |source: &Source| PIECES * PIECES * faces(&source.optics) * 5;
        self.sources.iter().map(ways).sum::<usize>() as u64
    }

    /// What the camera sees of the lights in the sheet's faces, as `optics` stands over it.
    pub(crate) fn glints(&self, optics: &SensorOptics) -> Vec<Glint> {
        let mut glints = Vec::new();
        for source in &self.sources {
            for face in 0..faces(&source.optics) {
                for piece in 0..PIECES * PIECES {
                    glints.extend(self.glint(optics, source, face, (piece % PIECES, piece / PIECES)));
                }
            }
        }
        glints
    }

    fn glint(
        &self,
        optics: &SensorOptics,
        source: &Source,
        face: usize,
        (i, j): (usize, usize),
    ) -> Option<Glint> {
        let emitter = &source.emitter;
        let place = |u: f64, v: f64| {
            let at = |k: f64| emitter.half_side_mm * (2.0 * k / PIECES as f64 - 1.0);
            emitter.platform_from_emitter.transform_point3(DVec3::new(at(u), at(v), 0.0))
        };
        let (i, j) = (i as f64, j as f64);
        let middle = place(i + 0.5, j + 0.5);
        let way = self.way(optics, source, face, middle)?;
        let shown = self.thrown_back(source, face, &way);
        let normal = emitter.platform_from_emitter.matrix3.z_axis;
        let cosine = normal.dot(way.leaving);
        if shown <= 0.0 || cosine <= 1e-6 || !self.is_free(middle, &way) {
            return None;
        }
        let area_mm2 = (2.0 * emitter.half_side_mm).powi(2);
        let radiance_per_mw = emitter.flux_mw * emitter.lobe.per_sr(cosine) / (area_mm2 * cosine);
        let corner = |u: f64, v: f64| self.way(optics, source, face, place(u, v)).map(|way| way.pixel);
        let corners_px = [corner(i, j)?, corner(i + 1.0, j)?, corner(i + 1.0, j + 1.0)?, corner(i, j + 1.0)?];
        let level =
            source.seen_mw.map(|mw| (self.level_per_mw_mm2 * PI * mw * radiance_per_mw * shown) as f32);
        Some(Glint { corners_px, level })
    }

    /// The share of light that comes back from a face, 0 to 1.
    fn thrown_back(&self, source: &Source, face: usize, way: &MirrorWay) -> f64 {
        let layers = source.optics.layers();
        let index = |k: usize| layers.get(k).map_or(1.0, |layer| layer.index_for(source.optics.channel()));
        if way.mirror_mm.abs().cmpgt(self.sheet_half_mm).any() {
            return 0.0;
        }
        let passed: Vec<f64> = (0..=face).map(index).collect();
        let last = passed.last().copied().unwrap_or(1.0);
        // Beside the dome's foot there is air above the sheet.
        let beside = face + 2 == layers.len() && way.mirror_mm.length() > source.optics.dome_radius_mm();
        let next = if beside { 1.0 } else { index(face + 1) };
        let up = fresnel::through_polarised(&passed, way.momentum);
        let turned = fresnel::transmitted(last, next, way.momentum).map(|passes| 1.0 - passes);
        (0.5 * (up[0] * up[0] * turned[0] + up[1] * up[1] * turned[1])).clamp(0.0, 1.0)
    }

    /// Whether the platform leaves both ends of a way open.
    fn is_free(&self, light_mm: DVec3, way: &MirrorWay) -> bool {
        let [camera_side, light_side] = way.under_mm;
        // A hair below the underside, where the hollows end.
        let below = |place: DVec3| place - DVec3::Z * 1e-6;
        let back = DVec3::new(-way.leaving.x, -way.leaving.y, way.leaving.z);
        let down = camera_side + back * ((self.lowest_mm - camera_side.z) / way.leaving.z);
        self.cavities.is_free(light_mm, below(light_side)) && self.cavities.is_free(below(camera_side), down)
    }

    /// The way from the camera to a place below the sheet by the face above so many solid layers.
    fn way(&self, optics: &SensorOptics, source: &Source, face: usize, place_mm: DVec3) -> Option<MirrorWay> {
        let layers = source.optics.layers().get(1..=face)?;
        let plate = |k: usize| {
            let layer = layers.get(k)?;
            Some((layer.thickness_mm?, layer.index_for(source.optics.channel())))
        };
        let plates: Vec<(f64, f64)> = (0..face).map(plate).collect::<Option<_>>()?;
        let solid = source.optics.layers().iter().skip(1);
        let thickness_mm: f64 = solid.filter_map(|layer| layer.thickness_mm).sum();
        let camera = optics.sensor_from_camera();
        let mut shift_mm = 0.0;
        let mut found = None;
        let steps = if optics.lens().is_central() { 1 } else { PUPIL_STEPS };
        for _ in 0..steps {
            let pupil = camera.point(DVec3::Z * shift_mm);
            let (up_mm, down_mm) = (-thickness_mm - pupil.z, -thickness_mm - place_mm.z);
            if up_mm <= 0.0 || down_mm <= 0.0 {
                return None;
            }
            let sideways = (place_mm - pupil).truncate();
            let in_plates = |momentum: f64| -> f64 {
                plates
                    .iter()
                    .map(|(mm, index)| mm * momentum / (index * index - momentum * momentum).sqrt())
                    .sum()
            };
            let in_air = |momentum: f64| momentum / (1.0 - momentum * momentum).sqrt();
            let reach = |momentum: f64| (up_mm + down_mm) * in_air(momentum) + 2.0 * in_plates(momentum);
            // The reach rises with the momentum, from nothing to more than anything.
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..HALVINGS {
                let half = 0.5 * (low + high);
                if reach(half) < sideways.length() { low = half } else { high = half }
            }
            let momentum = 0.5 * (low + high);
            let aside = sideways.normalize_or_zero();
            let way = (aside * momentum).extend((1.0 - momentum * momentum).sqrt());
            let ray = camera.rotation.transpose() * way;
            shift_mm = optics.lens().pupil_shift_mm(Lens::field_angle_rad(ray)).0;
            let camera_side = pupil.truncate() + aside * (up_mm * in_air(momentum));
            let light_side = place_mm.truncate() - aside * (down_mm * in_air(momentum));
            found = optics.lens().project(ray).ok().map(|pixel| MirrorWay {
                pixel,
                momentum,
                under_mm: [camera_side.extend(-thickness_mm), light_side.extend(-thickness_mm)],
                mirror_mm: camera_side + aside * in_plates(momentum),
                leaving: (-aside * momentum).extend(way.z),
            });
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn scene() -> Scene {
        let text = r#"{ "version": 1, "name": "gloss", "design": "thumb24.json",
            "frames": { "count": 1, "rate_hz": 30 }, "tolerance": { "px": 0.01, "grey": 0.5 },
            "light": { "leds": { "level_per_mw_mm2": 450, "gloss": true } } }"#;
        let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs");
        Scene::from_text(text, &folder).unwrap()
    }

    #[test]
    fn the_first_face_shows_the_mirrored_light_where_a_straight_ray_shows_it() {
        let scene = scene();
        let gloss = Gloss::of(&scene).unwrap().unwrap();
        let optics = scene.optics();
        let under_mm = scene.design().sheet_underside_z_mm();
        for source in &gloss.sources {
            let place = source.emitter.platform_from_emitter.translation;
            let way = gloss.way(optics, source, 0, place).unwrap();
            let mirrored = place.with_z(2.0 * under_mm - place.z);
            let straight =
                optics.lens().project(optics.sensor_from_camera().inverse().point(mirrored)).unwrap();
            assert!(straight.distance(way.pixel) < 1e-6, "{straight} {}", way.pixel);
            // Fresnel's two reflectances, from the angles by Snell's law.
            let (i, n) = (way.momentum.asin(), source.optics.layers()[1].index_for(source.optics.channel()));
            let t = (way.momentum / n).asin();
            let across = ((i - t).sin() / (i + t).sin()).powi(2);
            let along = ((i - t).tan() / (i + t).tan()).powi(2);
            let shown = gloss.thrown_back(source, 0, &way);
            assert!((shown - 0.5 * (across + along)).abs() < 1e-12, "{shown}");
        }
    }

    #[test]
    fn ways_by_the_top_face_are_those_of_the_camera_and_of_the_lights_tubes() {
        let scene = scene();
        let gloss = Gloss::of(&scene).unwrap().unwrap();
        for source in &gloss.sources {
            let place = source.emitter.platform_from_emitter.translation;
            // Both ends by solvers of their own: from the top's mirroring place to the camera, and from the light to it.
            let way = gloss.way(&source.optics, source, 1, place).unwrap();
            let top = way.mirror_mm.extend(0.0);
            assert!(source.optics.project(top).unwrap().distance(way.pixel) < 1e-5);
            let tube = source.optics.light_tube(place, top, 0.0).unwrap();
            assert!(tube.leaving.distance(way.leaving) < 1e-6, "{} {}", tube.leaving, way.leaving);
            assert!(tube.underside_mm.distance(way.under_mm[1]) < 1e-6);
            // Acrylic and silicone are so alike that little comes back.
            let shown = gloss.thrown_back(source, 1, &way);
            assert!(shown > 1e-5 && shown < 3e-3, "{shown}");
        }
    }

    #[test]
    fn what_the_lip_hides_is_not_mirrored() {
        let scene = scene();
        let gloss = Gloss::of(&scene).unwrap().unwrap();
        let glints = gloss.glints(scene.optics());
        let all = 2 * gloss.sources.len() * PIECES * PIECES;
        println!("{} of {all} pieces are mirrored", glints.len());
        assert!(!glints.is_empty() && glints.len() < all);
        assert!(
            glints.iter().all(|glint| glint.level.iter().all(|level| level.is_finite() && *level >= 0.0))
        );
    }
}
