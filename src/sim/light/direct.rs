//! Light straight from the emitters: through the sheet into the silicone, to a point.
//!
//! Between a place of the emitter and a point there is one refracted way ([`domecast_optics::LightTube`]). What a
//! small area `dA` of the emitter of intensity `I` gives a surface there is
//! `I dA/A * transmitted * sr_per_mm2 * (arriving . normal)`, so the sum over the emitter is a vector, the
//! *vector irradiance*, whose product with the normal is the irradiance of any surface that faces the light.

use glam::{DAffine3, DVec3};

use super::cavity::Cavities;
use super::fresnel;
use super::lobe::Lobe;
use super::quadrature::GaussRule;
use domecast_optics::SensorOptics;

/// Places across the emitter, each way. The emitter is small against its distance from the dome: with four,
/// the rule's error is below 1e-5 (tested against 64).
pub const PLACES: usize = 4;

/// Places at which a line of the emitter is looked at to find the pieces of it that are in sight.
const LOOKS: usize = 5;

/// Halvings between two looks of which one is in sight: the edge is then known to 1/1280 of the line.
const HALVINGS: u32 = 7;

/// A square that emits, everywhere alike.
#[derive(Debug, Clone, PartialEq)]
pub struct Emitter {
    /// Its pose: origin at the centre, z out of the face; sensor frame, mm.
    pub platform_from_emitter: DAffine3,
    /// Half of its side, mm.
    pub half_side_mm: f64,
    /// Flux of the bare light, mW.
    pub flux_mw: f64,
    /// Intensity by direction, for a flux of one.
    pub lobe: Lobe,
}

/// Where the light of emitters goes.
#[derive(Debug, Clone, Copy)]
pub struct DirectLight<'a> {
    /// Layers and dome, for the light's colour.
    pub optics: &'a SensorOptics,
    /// What the platform leaves open; `None` where nothing stands in the way.
    pub cavities: Option<&'a Cavities>,
    /// Share of the light that gets through the platform where it stands in the way.
    pub through_platform: f64,
    /// Half sides of the sheet, whose edge ends the way in, mm.
    pub sheet_half_mm: glam::DVec2,
    /// Whether interfaces take their share (Fresnel).
    pub fresnel: bool,
}

/// The rule across the emitter, made once.
#[derive(Debug, Clone)]
pub struct EmitterRule(GaussRule);

impl Default for EmitterRule {
    fn default() -> Self {
        Self(GaussRule::new(PLACES))
    }
}

impl EmitterRule {
    /// A rule with another number of places, to see how much the number matters.
    pub fn with_places(count: usize) -> Self {
        Self(GaussRule::new(count))
    }
}

/// What one place of the emitter gives.
struct Share {
    flux: DVec3,
    tangent: f64,
    free: bool,
}

impl DirectLight<'_> {
    /// Vector irradiance at a point of the dome or the sheet's top, mW/mm^2, sensor frame. Its product with the
    /// unit normal *away from* the light is the irradiance.
    pub fn vector_irradiance(&self, emitter: &Emitter, point_mm: DVec3, rule: &EmitterRule) -> DVec3 {
        let side = 2.0 * emitter.half_side_mm;
        let indices = self.indices(point_mm.z);
        let mut near = 0.0;
        let mut sum = DVec3::ZERO;
        for &(u, across) in rule.0.nodes() {
            let mut at = |v: f64| {
                let place = DVec3::new((u - 0.5) * side, (v - 0.5) * side, 0.0);
                let share = self.share(emitter, place, point_mm, &indices, near);
                near = share.tangent;
                share
            };
            let Some(_) = self.cavities else {
                for &(v, up) in rule.0.nodes() {
                    sum += at(v).flux * (across * up);
                }
                continue;
            };
            if self.through_platform > 0.0 {
                for &(v, up) in rule.0.nodes() {
                    sum += at(v).flux * (across * up * self.through_platform);
                }
            }
            let pieces = pieces_in_sight(|v| at(v).free);
            for (low, high) in pieces {
                for (v, up) in rule.0.over(low, high) {
                    sum += at(v).flux * (across * up * (1.0 - self.through_platform));
                }
            }
        }
        sum * emitter.flux_mw
    }

    /// The media from the air to the point.
    fn indices(&self, z_mm: f64) -> Vec<f64> {
        let layers = self.optics.layers();
        let channel = self.optics.channel();
        let count = if z_mm > 0.0 { layers.len() } else { layers.len().saturating_sub(1).max(1) };
        layers[..count].iter().map(|layer| layer.index_for(channel)).collect()
    }

    fn share(&self, emitter: &Emitter, place: DVec3, point_mm: DVec3, indices: &[f64], near: f64) -> Share {
        let pose = &emitter.platform_from_emitter;
        let source = pose.transform_point3(place);
        let dark = Share { flux: DVec3::ZERO, tangent: near, free: false };
        let Ok(tube) = self.optics.light_tube(source, point_mm, near) else { return dark };
        let per_sr = emitter.lobe.per_sr(tube.leaving.dot(pose.matrix3.z_axis));
        // Between two emitters' faces and beyond the sheet's edge there is no way in.
        let inside = tube.underside_mm.truncate().abs().cmple(self.sheet_half_mm).all();
        if per_sr <= 0.0 || !inside {
            return Share { tangent: tube.tangent, ..dark };
        }
        let passed = if self.fresnel { fresnel::through(indices, tube.momentum) } else { 1.0 };
        let free = self.cavities.is_none_or(|cavities| cavities.is_free(source, tube.underside_mm));
        Share { flux: tube.arriving * (per_sr * passed * tube.sr_per_mm2), tangent: tube.tangent, free }
    }
}

/// The pieces of [0, 1] that are in sight: looked for at evenly spaced places, their ends by halving.
fn pieces_in_sight(mut free: impl FnMut(f64) -> bool) -> Vec<(f64, f64)> {
    let mut pieces = Vec::new();
    let mut before = (0.0, free(0.0));
    let mut begun = before.1.then_some(0.0);
    for k in 1..=LOOKS {
        let here = (k as f64 / LOOKS as f64, free(k as f64 / LOOKS as f64));
        if here.1 != before.1 {
            let (mut low, mut high) = (before.0, here.0);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if free(middle) == before.1 { low = middle } else { high = middle }
            }
            let edge = 0.5 * (low + high);
            match begun.take() {
                Some(start) => pieces.push((start, edge)),
                None => begun = Some(edge),
            }
        }
        before = here;
    }
    if let Some(start) = begun {
        pieces.push((start, 1.0));
    }
    pieces
}
