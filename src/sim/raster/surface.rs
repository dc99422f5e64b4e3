//! What single rays show of the lit membrane.

use std::ops::Range;

use glam::{DVec2, DVec3, Vec3A, Vec4};

use crate::contact::displacement_map::{DisplacementMap, MAX_OFF_RAY_MM};
use crate::effect_name::EffectName;
use crate::light::shading::{Shading, SurfaceSample};
use crate::raster::lens_field::LensRays;
use crate::work::Work;
use domecast_optics::SensorOptics;

/// What moves by less is not displaced, mm.
const STILL_MM: f32 = 1e-6;

/// Pixels without a ray take the brightness of others up to so many pixels away.
const MAX_BESIDE_PX: u32 = 4;

/// Counted work of a ray to the dome, and of its way on to the displaced membrane.
const RAY_UNITS: u64 = 60;
const DISPLACED_UNITS: u64 = 250;

/// The membrane under light, as some rows see it.
pub struct ShadedSlice<'a> {
    /// The row after the last.
    pub end: usize,
    /// Camera, layers and dome, for the channel.
    pub optics: &'a SensorOptics,
    /// The displaced part.
    pub map: Option<&'a DisplacementMap>,
}

/// The membrane under light.
pub struct ShadedSurface<'a> {
    /// Slices of rows that see it at times of their own, from the first row; not empty.
    pub slices: &'a [ShadedSlice<'a>],
    /// What the pixels see.
    pub rays: &'a LensRays,
    /// The light.
    pub shading: &'a dyn Shading,
    /// The channels whose brightness is wanted, of 0 to 2.
    pub channels: Range<usize>,
    /// The middle of the dome in the picture, px.
    pub center: DVec2,
    /// How far a pixel that is interpolated may be from what its own ray shows, full scales; with 0 every pixel is traced.
    pub tolerance: f32,
}

/// Where the search for the next point begins, and how many rays were followed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Traced {
    /// The motion of the last point, mm: neighbours move alike.
    near_mm: Vec3A,
    still: u64,
    moved: u64,
    /// Of these, rays that end beside the membrane.
    beside: u64,
}

impl Traced {
    /// A search that begins without a neighbour.
    pub fn start_anew(&mut self) {
        self.near_mm = Vec3A::ZERO;
    }

    /// Counts the work done since the last time.
    pub fn count(&mut self, shading: &dyn Shading, work: &mut Work) {
        work.add_base((self.still + self.moved) * RAY_UNITS);
        work.add(EffectName::Contact, self.moved * DISPLACED_UNITS);
        shading.count(self.still, self.moved, work);
        work.add_rays(self.still + self.moved, self.beside);
        *self = Self::default();
    }
}

impl<'a> ShadedSurface<'a> {
    /// As a row sees it; what lies below the picture belongs to the last slice.
    fn at(&self, y: usize) -> Option<&ShadedSlice<'a>> {
        self.slices.get(self.slices.partition_point(|slice| slice.end <= y)).or(self.slices.last())
    }

    /// Whether the membrane may hide a part of itself in a row, so that the brightness jumps.
    pub fn may_jump(&self, y: usize) -> bool {
        self.at(y).and_then(|seen| seen.map).is_some_and(DisplacementMap::may_fold)
    }

    /// Brightness of what a ray of a row shows, red, green and blue; `None` where it misses the dome. Dome and membrane go on
    /// beyond the rim, so that the brightness does.
    #[inline]
    pub fn ray_level(&self, y: usize, ray: DVec3, traced: &mut Traced) -> Option<Vec4> {
        let seen = self.at(y)?;
        let (place_mm, inside) = seen.optics.follow_continued(ray).ok()?;
        let (rest_mm, inside) = (place_mm.as_vec3a(), inside.as_vec3a());
        let dome = seen.optics.dome();
        let normal = dome.outward_mm(place_mm).as_vec3a() * (1.0 / dome.radius_mm() as f32);
        let mut sample = SurfaceSample {
            point_mm: rest_mm,
            material_mm: rest_mm,
            normal,
            to_camera: -inside,
            is_moved: false,
        };
        if let Some(map) = seen.map {
            // Where a ray may meet the membrane more than once, what it shows may not depend on a neighbour.
            let near_mm = if map.may_fold() { Vec3A::ZERO } else { traced.near_mm };
            let met = map.meet(rest_mm, inside, near_mm);
            traced.near_mm = met.map_or(Vec3A::ZERO, |(_, deformed)| deformed.displacement_mm);
            if let Some((undeformed_mm, deformed)) = met
                && deformed.displacement_mm.length_squared() > STILL_MM * STILL_MM
            {
                sample.point_mm = undeformed_mm + deformed.displacement_mm;
                sample.material_mm = undeformed_mm;
                sample.normal = deformed.normal;
                sample.is_moved = true;
                traced.beside += u64::from(deformed.off_ray_mm > MAX_OFF_RAY_MM);
            }
        }
        if sample.is_moved {
            traced.moved += 1
        } else {
            traced.still += 1
        }
        Some(self.shading.level(&sample))
    }

    /// Brightness of a pixel; where its ray misses the dome, that of the nearest place towards the middle whose ray does not.
    pub fn pixel_level(&self, (x, y): (usize, usize), traced: &mut Traced) -> Vec4 {
        let own = self.rays.pixel(x, y).and_then(|ray| self.ray_level(y, ray, traced));
        own.unwrap_or_else(|| self.level_beside((x, y), traced))
    }

    #[cold]
    fn level_beside(&self, (x, y): (usize, usize), traced: &mut Traced) -> Vec4 {
        let from = DVec2::new(x as f64, y as f64);
        let step = (self.center - from).normalize_or_zero();
        let beside = |k: u32| {
            let place = (from + step * f64::from(k)).round().max(DVec2::ZERO);
            let (x, y) = (place.x as usize, place.y as usize);
            self.ray_level(y, self.rays.pixel(x, y)?, traced)
        };
        (1..=MAX_BESIDE_PX).find_map(beside).unwrap_or(Vec4::ZERO)
    }
}
