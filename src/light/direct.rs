//! Light straight from the emitters: through the sheet into the silicone, to a point.
//!
//! Between a place of the emitter and a point there is one refracted way ([`domecast_optics::LightTube`]). What a
//! small area `dA` of the emitter of intensity `I` gives a surface there is
//! `I dA/A * transmitted * sr_per_mm2 * (arriving . normal)`, so the sum over the emitter is a vector, the
//! *vector irradiance*, whose product with the normal is the irradiance of any surface that faces the light.

use glam::{DAffine3, DVec2, DVec3, DVec4, Vec3Swizzles, Vec4Swizzles};

use super::cavity::Cavities;
use super::fresnel;
use super::lobe::Lobe;
use super::visible::Share;
pub use super::visible::{EmitterRule, PLACES};
use domecast_optics::SensorOptics;

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

impl DirectLight<'_> {
    /// Vector irradiance at a point of the dome or the sheet's top, mW/mm^2, sensor frame. Its product with the
    /// unit normal *away from* the light is the irradiance.
    ///
    /// The rays from the rule's places are solved. Between them, flux and way are smooth, and the polynomial through the places
    /// interpolates both: so the platform's shadow is cut without another solve.
    pub fn vector_irradiance(&self, emitter: &Emitter, point_mm: DVec3, rule: &EmitterRule) -> DVec3 {
        let side = 2.0 * emitter.half_side_mm;
        let pose = &emitter.platform_from_emitter;
        let place =
            |u: f64, v: f64| pose.transform_point3(DVec3::new((u - 0.5) * side, (v - 0.5) * side, 0.0));
        let indices = self.indices(point_mm.z);
        let mut all = Vec::with_capacity(rule.places().len().pow(2));
        let (mut near, mut low, mut high) = (0.0, DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &(u, _) in rule.places() {
            for &(v, _) in rule.places() {
                let source = place(u, v);
                let Some((share, underside_mm)) = self.share(emitter, source, point_mm, &indices, &mut near)
                else {
                    return DVec3::ZERO;
                };
                all.push(share);
                for end in [source, underside_mm] {
                    (low, high) = (low.min(end), high.max(end));
                }
            }
        }
        let open = if self.cavities.is_some() { self.through_platform } else { 1.0 };
        let mut sum = DVec3::ZERO;
        // The sheet's underside lies over all emitters.
        let underside_z_mm = high.z;
        let mut gather = |part: f64, is_free: &mut dyn FnMut(DVec3, DVec3) -> bool| {
            let reaches = |from_mm: DVec3, at_mm: DVec4| {
                self.enters(at_mm.xy())
                    && self.is_in_foot(at_mm.zw())
                    && is_free(from_mm, at_mm.xy().extend(underside_z_mm))
            };
            sum += part * rule.visible_flux(&all, place, reaches);
        };
        if open > 0.0 {
            gather(open, &mut |_, _| true);
        }
        if let Some(cavities) = self.cavities.filter(|_| open < 1.0) {
            // The emitter's corners lie a little beyond the rule's places.
            let beyond = DVec3::splat(emitter.half_side_mm);
            let mut hollows = cavities.near(low - beyond, high + beyond);
            gather(1.0 - open, &mut |source, end| hollows.is_free(source, end));
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

    /// Whether a place of the plane of the sheet's underside is the sheet's.
    fn enters(&self, underside_mm: DVec2) -> bool {
        underside_mm.abs().cmple(self.sheet_half_mm).all()
    }

    /// Whether a place of the plane of the sheet's top lies under the dome: only there light goes on into the silicone.
    fn is_in_foot(&self, top_mm: DVec2) -> bool {
        top_mm.length() <= self.optics.dome().rim_radius_mm()
    }

    /// What a place of the emitter sends to a point, and where its ray meets the sheet's underside; `None` where no ray leads
    /// there. `near` is a neighbour's tangent.
    fn share(
        &self,
        emitter: &Emitter,
        source: DVec3,
        point_mm: DVec3,
        indices: &[f64],
        near: &mut f64,
    ) -> Option<(Share, DVec3)> {
        let tube = self.optics.light_tube(source, point_mm, *near).ok()?;
        *near = tube.tangent;
        let per_sr = emitter.lobe.per_sr(tube.leaving.dot(emitter.platform_from_emitter.matrix3.z_axis));
        let passed = if self.fresnel { fresnel::through(indices, tube.snell_invariant) } else { 1.0 };
        let flux = tube.arriving * (per_sr * passed * tube.sr_per_mm2);
        let top_mm = if point_mm.z > 0.0 {
            point_mm - tube.arriving * (point_mm.z / tube.arriving.z)
        } else {
            DVec3::ZERO
        };
        let crossings_mm = tube.underside_mm.xy().extend(top_mm.x).extend(top_mm.y);
        Some((Share { crossings_mm, flux }, tube.underside_mm))
    }
}
