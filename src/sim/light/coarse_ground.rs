//! The membrane's brightness as the coarse picture of the light has it, to draw scenes with before their light is computed.

use std::f64::consts::TAU;

use glam::{DVec3, Vec4};

use super::bound_samples::RINGS;
use super::dome_map::DomeFace;
use super::setup::Channels;
use super::shading::{Shading, SurfaceSample};
use crate::scene::Scene;
use crate::work::Work;
use domecast_optics::DomeShape;

/// Levels of the patches, linear in between, and of the white markers.
#[derive(Debug, Clone)]
pub struct CoarseGround {
    pub(super) dome: DomeShape,
    /// By patch, as the rings are numbered.
    pub(super) patches: Vec<Channels>,
    pub(super) markers: Vec<(DVec3, Channels)>,
}

impl CoarseGround {
    /// The level on a ring, by channel, at an azimuth in turns.
    fn on_ring(&self, ring: usize, turns: f64) -> Vec4 {
        let at = turns * RINGS.patches as f64 - 0.5;
        let patch = |step: f64| {
            let number = (at.floor() + step).rem_euclid(RINGS.patches as f64) as usize % RINGS.patches;
            wide(self.patches.get(ring * RINGS.patches + number).copied().unwrap_or_default())
        };
        patch(0.0).lerp(patch(1.0), (at - at.floor()) as f32)
    }

    /// The mean of the ring about the pole.
    fn at_pole(&self) -> Vec4 {
        let ring = self.patches.iter().rev().take(RINGS.patches);
        ring.fold(Vec4::ZERO, |sum, patch| sum + wide(*patch)) / RINGS.patches as f32
    }
}

fn wide([red, green, blue]: Channels) -> Vec4 {
    Vec4::new(red as f32, green as f32, blue as f32, 0.0)
}

impl Shading for CoarseGround {
    fn level(&self, sample: &SurfaceSample) -> Vec4 {
        let place = (sample.material_mm.as_dvec3() - self.dome.center_mm()) / self.dome.radius_mm();
        let [rim, pole] = [0.0, 1.0].map(|share| DomeFace::of(&self.dome).level(share));
        let up = ((place.z - rim) / (pole - rim) * RINGS.rings as f64 - 0.5).max(0.0);
        let turns = place.truncate().to_angle().rem_euclid(TAU) / TAU;
        let (ring, part) = (up.floor().min((RINGS.rings - 1) as f64), up.fract());
        let below = self.on_ring(ring as usize, turns);
        if ring as usize + 1 < RINGS.rings {
            return below.lerp(self.on_ring(ring as usize + 1, turns), part as f32);
        }
        // Above the middle of the last ring all azimuths come together.
        below.lerp(self.at_pole(), (2.0 * (up - ring)).clamp(0.0, 1.0) as f32)
    }

    fn count(&self, _still: u64, _moved: u64, _work: &mut Work) {}

    fn marker_level(&self, _scene: &Scene, position_mm: DVec3) -> [f32; 3] {
        let far = |marker: &&(DVec3, Channels)| marker.0.distance_squared(position_mm);
        let nearest = self.markers.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
        nearest.map_or([0.0; 3], |(_, level)| level.map(|level| level as f32))
    }
}
