//! Where the dots are in three dimensions: on the rays on which they are seen, as deep as the elastic model has them.

use glam::{DVec2, DVec3};

use super::forces::ForceDistribution;
use super::model::Dot;
use super::result::ContactEstimate;
use super::seen_dots::MODEL_PART;
use crate::track::DotResult;

/// What a touch that comes out broader than it is may be deeper by under the same force, as a part of the depth found: where the camera looks
/// along the pressure, areas come out up to eight times the true one, and depth goes as one over the radius.
const BROAD_PART: f64 = 0.5;

impl Dot {
    /// Unit direction in which its image does not move.
    pub(super) fn ray(&self) -> DVec3 {
        self.by_point[0].cross(self.by_point[1]).normalize_or_zero()
    }

    /// The smallest motion that moves its image by so much, mm.
    fn across_mm(&self, image_px: DVec2) -> DVec3 {
        let [u, v] = self.by_point;
        let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
        let determinant = uu * vv - uv * uv;
        if determinant <= 0.0 {
            return DVec3::ZERO;
        }
        let [a, b] = [vv * image_px.x - uv * image_px.y, uu * image_px.y - uv * image_px.x];
        (u * a + v * b) / determinant
    }
}

impl ForceDistribution {
    /// Each dot's place and the deviation of its depth along its ray.
    pub(super) fn place_dots(&mut self, found: &[DotResult]) {
        let d = self.dots.len();
        self.placed.clear();
        let touch = self.result.contact.as_ref();
        let force_part = touch.map_or(0.0, |touch| touch.force_sd_n.length() / touch.force_n.length());
        for (k, (dot, found)) in self.dots.iter().zip(found).enumerate() {
            let moved_mm = self.dots_moved_mm[k];
            let ray = dot.ray();
            let by_node = |node: usize| self.softness * ray.dot(self.model.dots_mm[node * d + k]);
            let seen_sd_mm = self.posterior.depth_sd_mm(k, dot.rest_frames, by_node);
            let young_part = if self.reference_mm.is_none() { self.model.young_sd_part } else { 0.0 };
            let pressure = |(node, share): (usize, f64)| share * self.set.tractions[node];
            let strain = self.model.about(dot.surface_mm).map(pressure).sum::<f64>() / self.model.young_mpa;
            let is_under = |touch: &&ContactEstimate| {
                let radius_mm = (touch.area_mm2 / std::f64::consts::PI).sqrt();
                touch.point_mm.distance(dot.rest_mm + moved_mm) < radius_mm
            };
            let broad_part = touch.filter(is_under).map_or(0.0, |_| BROAD_PART);
            let part = MODEL_PART.hypot(young_part).hypot(force_part).hypot(strain).hypot(broad_part);
            let model_sd_mm = part * ray.dot(moved_mm);
            // Pressures that nodes are too coarse for.
            let coarse = |node: &usize| {
                by_node(*node).powi(2) * self.model.variance_within(*node, &self.set.tractions)
            };
            let coarse_mm2: f64 = self.set.active.iter().map(coarse).sum();
            let pose_sd_mm = found.displacement_sd_random_mm.unwrap_or(0.0);
            let aside_mm = if dot.per_sd > 0.0 {
                dot.across_mm(dot.seen_px - self.nonlinear_px(k) - dot.linear_px)
            } else {
                DVec3::ZERO
            };
            self.placed.push((
                dot.rest_mm + moved_mm + aside_mm,
                seen_sd_mm.hypot(model_sd_mm).hypot(pose_sd_mm).hypot(coarse_mm2.sqrt()),
            ));
        }
    }
}
