//! Rays told from those of few pixels.
//!
//! Where a ray passes the plane of the dome's base, and its direction there, are smooth over the picture, beyond the dome's
//! rim as well: cubics through a lattice of them tell the rays between, and only the sphere is met for each.

use glam::Vec3A;

use super::motion::{NONE, SMALLEST};
use super::{Lit, LitSurface};
use crate::field::lagrange;
use crate::work::Work;

/// Part of the tolerance that a told ray may take where the light is steepest, and the most that it may be off, mm.
const PART: f32 = 0.1;
const MOST_MM: f32 = 1e-3;
/// The cubics are furthest off in the middle, which is tried; elsewhere they may be somewhat more.
const SURE: f32 = 2.0;

/// Weights of four nodes at the pixels from the second to the third.
pub(super) const WEIGHTS: [[f32; 4]; SMALLEST + 1] = {
    let mut weights = [[0.0; 4]; SMALLEST + 1];
    let mut i = 0;
    while i <= SMALLEST {
        let wide = lagrange(i as f64 / SMALLEST as f64);
        let mut k = 0;
        while k < 4 {
            weights[i][k] = wide[k] as f32;
            k += 1;
        }
        i += 1;
    }
    weights
};

/// What tells the rays of a square of the lattice.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Rays {
    pub corner: (usize, usize),
    /// Where the rays of the sixteen nodes about it are kept.
    pub nodes: [u32; 16],
    pub are_told: bool,
}

impl Lit {
    /// What tells the rays of the smallest settled square that holds a pixel.
    pub(super) fn rays(&self, (x, y): (usize, usize)) -> Rays {
        let index = self.rays.get(self.square_at((x, y))).copied().unwrap_or(0);
        self.known_rays.get(index as usize).copied().unwrap_or_default()
    }

    /// Finds out whether the nodes about a square, of which the rays are known, tell its rays; the one in its middle is
    /// asked for.
    pub(super) fn find_rays(&mut self, surface: &LitSurface<'_>, corner: (usize, usize), work: &mut Work) {
        // Slices of rows see the dome each at a time of its own.
        let [seen] = surface.slices else { return };
        let mut rays = Rays { corner, ..Rays::default() };
        for (i, at) in rays.nodes.iter_mut().enumerate() {
            let node = |corner: usize, i: usize| (corner + i * SMALLEST).checked_sub(SMALLEST);
            let (Some(x), Some(y)) = (node(corner.0, i % 4), node(corner.1, i / 4)) else { return };
            if self.kept_at((x, y)) == NONE {
                self.keep_ray(surface, (x, y), work);
            }
            match self.kept_at((x, y)) {
                NONE => return,
                kept => *at = kept,
            }
        }
        let middle = (corner.0 + SMALLEST / 2, corner.1 + SMALLEST / 2);
        self.ask(surface, corner, [middle], work);
        let Some(kept) = self.kept(middle) else { return };
        let [base_mm, inside] = self.told_base(&rays, middle);
        let radius_mm = seen.optics.dome_radius_mm() as f32;
        let off_mm = (kept.base_mm - base_mm).length() + (kept.inside - inside).length() * radius_mm;
        let room_mm = PART * surface.tolerance / (surface.shading.steepest_per_mm() as f32).max(1e-3);
        // A ray that slants meets the dome so much further off.
        rays.are_told = SURE * (1.0 + kept.slant) * off_mm <= room_mm.min(MOST_MM);
        let (at, index) = (self.square_at(corner), self.known_rays.len() as u32);
        if let Some(place) = self.rays.get_mut(at) {
            *place = index;
            self.known_rays.push(rays);
        }
    }

    #[inline]
    fn told_base(&self, rays: &Rays, (x, y): (usize, usize)) -> [Vec3A; 2] {
        let weights = |at: usize, from: usize| WEIGHTS[at.saturating_sub(from).min(SMALLEST)];
        let (wx, wy) = (weights(x, rays.corner.0), weights(y, rays.corner.1));
        let mut sums = [Vec3A::ZERO; 2];
        for (row, wy) in rays.nodes.chunks_exact(4).zip(wy) {
            for (node, wx) in row.iter().zip(wx) {
                let Some(kept) = self.motions.get(*node as usize) else { continue };
                sums[0] += kept.base_mm * (wx * wy);
                sums[1] += kept.inside * (wx * wy);
            }
        }
        sums
    }

    /// Where the ray of a pixel meets the undeformed dome, mm, and its unit direction; `None` where it does not.
    #[inline]
    pub(super) fn told_ray(
        &self,
        rays: &Rays,
        pixel: (usize, usize),
        radius_mm: f32,
    ) -> Option<(Vec3A, Vec3A)> {
        let [base_mm, inside] = self.told_base(rays, pixel);
        on_dome(base_mm, inside, radius_mm)
    }
}

/// Where a ray from a point of the base meets the undeformed dome, and its direction as a unit; `None` where it does not.
#[inline]
pub(super) fn on_dome(base_mm: Vec3A, inside: Vec3A, radius_mm: f32) -> Option<(Vec3A, Vec3A)> {
    let inside = inside * inside.length_recip();
    let along = base_mm.dot(inside);
    let left = along * along + (radius_mm * radius_mm - base_mm.length_squared());
    (left > 0.0).then(|| (base_mm + inside * (left.sqrt() - along), inside))
}
