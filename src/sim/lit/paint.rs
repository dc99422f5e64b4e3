//! Pixels of squares where all that it takes to light them is told, many at a time.

use glam::Vec3A;

use super::motion::{Motion, SMALLEST, Source, shares};
use super::{Known, Lit, LitSurface, rays, units};
use crate::shading::PlainSample;
use crate::work::Work;

impl Lit {
    /// Lights every so many-th pixel, those on all four sides included, of a part of a smallest settled square of which the rays
    /// are told and the membrane stands still or its light changes smoothly; `false`, and nothing is done, where that is not
    /// so.
    pub(super) fn paint(
        &mut self,
        surface: &LitSurface<'_>,
        corner: (usize, usize),
        (side, step): (usize, usize),
        work: &mut Work,
    ) -> bool {
        let (square, rays) = (self.square(corner), self.rays(corner));
        let is_plain = matches!(square.source, Source::Still | Source::Little);
        let Some(seen) = surface.at(corner.1).filter(|_| is_plain && rays.are_told) else { return false };
        let radius_mm = seen.optics.dome_radius_mm() as f32;
        let (is_little, per_radius) = (square.source == Source::Little, 1.0 / radius_mm);
        let motion = |node: u32| self.motions.get(node as usize).copied().unwrap_or_default();
        let (nodes, moves) = (rays.nodes.map(motion), square.nodes.map(motion));
        let weights = |at: usize, from: usize| rays::WEIGHTS[at.saturating_sub(from).min(SMALLEST)];
        self.plain.clear();
        self.painted.clear();
        for y in (corner.1..=corner.1 + side).step_by(step) {
            // Along y in the columns of nodes, then along x.
            let wy = weights(y, rays.corner.1);
            let column = |i: usize| {
                let sum = |part: fn(&Motion) -> Vec3A| {
                    (part(&nodes[i]) * wy[0] + part(&nodes[4 + i]) * wy[1])
                        + (part(&nodes[8 + i]) * wy[2] + part(&nodes[12 + i]) * wy[3])
                };
                [sum(|node| node.base_mm), sum(|node| node.inside)]
            };
            let columns = [column(0), column(1), column(2), column(3)];
            let wy = shares(&square, y, square.corner.1);
            let move_of = |i: usize| {
                let sum = |part: fn(&Motion) -> Vec3A| {
                    part(&moves[i]) * wy[0] + part(&moves[3 + i]) * wy[1] + part(&moves[6 + i]) * wy[2]
                };
                [sum(|node| node.shift_mm), sum(|node| node.change)]
            };
            let moves = if is_little { [move_of(0), move_of(1), move_of(2)] } else { [[Vec3A::ZERO; 2]; 3] };
            let row = y * self.width;
            for x in (corner.0..=corner.0 + side).step_by(step) {
                if self.known.get(row + x) != Some(&Known::Nothing) {
                    continue;
                }
                let w = weights(x, rays.corner.0);
                let across = |part: usize| {
                    (columns[0][part] * w[0] + columns[1][part] * w[1])
                        + (columns[2][part] * w[2] + columns[3][part] * w[3])
                };
                let Some((place_mm, inside)) = rays::on_dome(across(0), across(1), radius_mm) else {
                    return false;
                };
                let mut sample =
                    PlainSample { direction: place_mm * per_radius, cosine: -inside.z, change: Vec3A::ZERO };
                if is_little {
                    let w = shares(&square, x, square.corner.0);
                    let across = |k: usize| moves[0][k] * w[0] + moves[1][k] * w[1] + moves[2][k] * w[2];
                    sample.direction = (place_mm + across(0)).normalize_or(Vec3A::Z);
                    sample.change = across(1);
                }
                self.plain.push(sample);
                self.painted.push(row + x);
            }
        }
        self.shown.clear();
        surface.shading.plain_levels(&self.plain, &mut self.shown, work);
        work.add_base(self.plain.len() as u64 * units::TOLD_RAY);
        for (at, level) in self.painted.iter().zip(&self.shown) {
            self.levels.get_mut(*at).into_iter().for_each(|place| *place = *level);
            self.known.get_mut(*at).into_iter().for_each(|place| *place = Known::Lit);
        }
        true
    }
}
