//! The light on the sensor at rest, place by place: what a check of a design looks at, without a picture.

use glam::{DVec2, DVec3, Vec3A};

use super::parts::LightUse;
use super::shade::ShadedDome;
use super::shading::{Shading, SurfaceSample};
use crate::SimError;
use crate::scene::Scene;
use crate::work::Work;

/// A place of the undeformed membrane in the image, and how bright it is there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DomeLight {
    /// The place in the raw image, px.
    pub image_px: DVec2,
    /// The place on the dome, sensor frame, mm.
    pub surface_mm: DVec3,
    /// Levels of red, green and blue without ink, linear, full scale 1; not cut off above it.
    pub level: [f64; 3],
    /// What of that comes from the lights directly, not by way of the dome.
    pub direct: [f64; 3],
}

/// The dome and the white markers under the design's lights, with every effect of light.
#[derive(Debug, Clone, PartialEq)]
pub struct RestLight {
    /// The places that were asked for and lie on the dome, in their order.
    pub dome: Vec<DomeLight>,
    /// Levels of each white marker.
    pub markers: Vec<[f64; 3]>,
}

impl RestLight {
    /// The light at the pixels that show the dome; `None` where the scene is not lit by the design's lights.
    ///
    /// # Errors
    /// Lights that do not fit the design.
    pub fn of(scene: &Scene, pixels: impl Iterator<Item = DVec2>) -> Result<Option<Self>, SimError> {
        let shaded = |used: &LightUse| ShadedDome::new(scene, used, &mut Work::default());
        let (Some(all), Some(direct)) =
            (shaded(&LightUse::ALL)?, shaded(&LightUse { interreflection: false, ..LightUse::ALL })?)
        else {
            return Ok(None);
        };
        let optics = scene.optics();
        let seen = pixels.filter_map(|image_px| {
            let hit = optics.trace(image_px).ok()?;
            let (_, inside) = optics.trace_continued(image_px).ok()?;
            let sample = SurfaceSample {
                point_mm: hit.surface_mm.as_vec3a(),
                material_mm: hit.surface_mm.as_vec3a(),
                normal: hit.normal.as_vec3a(),
                to_camera: Vec3A::from(-inside.as_vec3()),
                is_moved: false,
            };
            let [level, direct] = [&all, &direct].map(|shaded| {
                let level = shaded.level(&sample);
                [level.x, level.y, level.z].map(f64::from)
            });
            Some(DomeLight { image_px, surface_mm: hit.surface_mm, level, direct })
        });
        let dome = seen.collect();
        let marker = |marker: &domecast_optics::pose::Marker| {
            all.marker_level(scene, marker.position_mm).map(f64::from)
        };
        Ok(Some(Self { dome, markers: scene.markers().iter().map(marker).collect() }))
    }
}
