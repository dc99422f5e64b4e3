//! Where the dots are in three dimensions: on the rays on which they are seen, as deep as the elastic model has them.

use glam::{DVec2, DVec3};

use super::forces::ForceDistribution;
use super::model::Dot;
use super::seen_dots::MODEL_PART;
use crate::track::DotResult;

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
        // A touch of radius a comes out as one of sqrt(a^2 + c^2), c being as far as pressures are taken to be alike, and by so much less deep
        // under the same force: the depth of Hertz' contact goes as 1 / a.
        let (mut blurred_part, mut force_part) = (0.0, 0.0);
        if let Some(contact) = &self.result.contact {
            let square = self.model.correlation_mm.powi(2) * std::f64::consts::PI / contact.area_mm2;
            blurred_part = 1.0 - (1.0 - square).max(0.0).sqrt();
            force_part = contact.force_sd_n.length() / contact.force_n.length();
        }
        for (k, (dot, found)) in self.dots.iter().zip(found).enumerate() {
            let moved_mm = self.dots_moved_mm[k];
            let ray = dot.ray();
            let by_node = |node: usize| self.softness * ray.dot(self.model.dots_mm[node * d + k]);
            let seen_sd_mm = self.posterior.depth_sd_mm(k, dot.rest_frames, by_node);
            let young_part = if self.reference_mm.is_none() { self.model.young_sd_part } else { 0.0 };
            let (mut pressed, mut strain) = (0.0, 0.0);
            for (node, share) in self.model.about(dot.surface_mm) {
                let pressure = self.set.tractions[node];
                pressed += if pressure > 0.0 { share } else { 0.0 };
                strain += share * pressure / self.model.young_mpa;
            }
            let part =
                MODEL_PART.hypot(young_part).hypot(force_part).hypot(strain).hypot(pressed * blurred_part);
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
