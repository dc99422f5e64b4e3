//! Rays and the membrane's motion at few nodes of the picture, and between them.

use glam::Vec3A;

use super::rays::Rays;
use super::{LARGEST, Lit};
use crate::shading::Turned;

/// Distance of the pixels of which ray and motion are kept, px: the nodes of the squares half as large as the largest.
const KEPT_STEP: usize = SMALLEST / 2;
/// Side of the smallest squares of which something is known as a whole, px.
pub(super) const SMALLEST: usize = 8;
/// A ray, and how the membrane moved where it met it undeformed.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Motion {
    /// The point of the undeformed dome on the ray, mm.
    pub place_mm: Vec3A,
    /// Where the ray passes the plane of the dome's base, mm, and its unit direction from there.
    pub base_mm: Vec3A,
    pub inside: Vec3A,
    /// Tangent of the ray's angle with the normal there.
    pub slant: f32,
    /// From the undeformed point on the ray to the deformed one, mm.
    pub shift_mm: Vec3A,
    /// How the point of the membrane on the ray moved, mm.
    pub moved_mm: Vec3A,
    /// Change of the unit normal.
    pub tilt: Vec3A,
    /// Change of the light, full scales.
    pub change: Vec3A,
    /// Whether all this is known, and not the ray alone.
    pub is_whole: bool,
}

impl Motion {
    /// With its ray, which meets the undeformed dome at a place with a unit normal, along a unit direction.
    pub fn along(self, (place_mm, inside): (Vec3A, Vec3A), normal: Vec3A) -> Self {
        let cosine = inside.dot(normal).abs();
        let slant = (1.0 - cosine * cosine).max(0.0).sqrt() / cosine.max(1e-3);
        Self { place_mm, inside, slant, base_mm: place_mm - inside * (place_mm.z / inside.z), ..self }
    }
}

/// How the pixels of a square come by their place on the membrane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Source {
    /// Each ray is followed to the deformed membrane.
    #[default]
    Exact,
    /// No part of the square moves.
    Still,
    /// The motion is smooth: the parabolas through the nine nodes tell it.
    Smooth,
    /// So is the change of the light.
    Little,
}

/// What is known of a square as a whole.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Square {
    pub corner: (usize, usize),
    /// Its side, px; 0 before anything is known.
    pub side: usize,
    pub source: Source,
    /// Whether all nine nodes have a ray.
    pub is_whole: bool,
    /// The steepest of them.
    pub slant: f32,
    pub turned: Turned,
    /// Where the nodes' motions are kept, row by row.
    pub nodes: [u32; 9],
}

impl Square {
    /// Whether a smaller square may know more.
    pub fn is_open(self) -> bool {
        let is_sure = matches!(self.source, Source::Still | Source::Little);
        self.side == 0 || (self.side > SMALLEST && !is_sure)
    }
}

/// Where the motion of nodes without a ray is kept: the rim is bonded, and what is beyond it does not move.
pub(super) const NONE: u32 = 0;

/// Weights of a square's three nodes at each of its columns or rows.
const WEIGHTS: [[f32; 3]; LARGEST + 1] = {
    let mut weights = [[0.0; 3]; LARGEST + 1];
    let mut i = 0;
    while i <= LARGEST {
        let t = 2.0 * i as f32 / LARGEST as f32;
        weights[i] = [0.5 * (t - 1.0) * (t - 2.0), t * (2.0 - t), 0.5 * t * (t - 1.0)];
        i += 1;
    }
    weights
};

/// Weights of a square's three columns or rows of nodes at a pixel's, from its first.
#[inline]
pub(super) fn shares(square: &Square, at: usize, from: usize) -> [f32; 3] {
    let fine = LARGEST / square.side.clamp(1, LARGEST);
    WEIGHTS[(at.saturating_sub(from) * fine).min(LARGEST)]
}

impl Lit {
    /// Room for the motions of a picture; of the last one, nothing is left that could tell on this one's bytes.
    pub(super) fn lay_out_motions(&mut self) {
        self.moved_mm = Vec3A::ZERO;
        self.motions.clear();
        self.motions.push(Motion::default());
        let lay = |part: usize| (self.width.div_ceil(part), self.height.div_ceil(part));
        let ((across, down), (columns, rows)) = (lay(KEPT_STEP), lay(SMALLEST));
        self.kept.clear();
        self.kept.resize(across * down, NONE);
        self.known_squares.clear();
        self.known_squares.push(Square::default());
        self.squares.clear();
        self.squares.resize(columns * rows, 0);
        self.known_rays.clear();
        self.known_rays.push(Rays::default());
        self.rays.clear();
        self.rays.resize(columns * rows, 0);
    }

    /// Where something is known of the smallest square that holds a pixel.
    pub(super) fn square_at(&self, (x, y): (usize, usize)) -> usize {
        y / SMALLEST * self.width.div_ceil(SMALLEST) + x / SMALLEST
    }

    /// What is known of the square around it.
    pub(super) fn square(&self, pixel: (usize, usize)) -> Square {
        let index = self.squares.get(self.square_at(pixel)).copied().unwrap_or(0);
        self.known_squares.get(index as usize).copied().unwrap_or_default()
    }

    pub(super) fn set_square(&mut self, square: Square) {
        let (across, parts) = (self.width.div_ceil(SMALLEST), square.side / SMALLEST);
        let (column, row) = (square.corner.0 / SMALLEST, square.corner.1 / SMALLEST);
        let index = self.known_squares.len() as u32;
        self.known_squares.push(square);
        for row in row..row + parts {
            let places = self.squares.get_mut(row * across + column..row * across + column + parts);
            places.into_iter().for_each(|places| places.fill(index));
        }
    }

    /// Whether a pixel is a node of which ray and motion are kept.
    pub(super) fn is_kept(&self, (x, y): (usize, usize)) -> bool {
        x.is_multiple_of(KEPT_STEP) && y.is_multiple_of(KEPT_STEP)
    }

    fn kept_index(&self, (x, y): (usize, usize)) -> usize {
        y / KEPT_STEP * self.width.div_ceil(KEPT_STEP) + x / KEPT_STEP
    }

    /// Keeps those of a node.
    pub(super) fn keep(&mut self, node: (usize, usize), motion: Motion) {
        let at = self.kept_index(node);
        if let Some(place) = self.kept.get_mut(at) {
            *place = self.motions.len() as u32;
            self.motions.push(motion);
        }
    }

    /// Where those of a node are kept.
    pub(super) fn kept_at(&self, node: (usize, usize)) -> u32 {
        let index = self.kept_index(node);
        self.kept.get(index).copied().filter(|_| node.0 < self.width).unwrap_or(NONE)
    }

    /// Those of a node that has a ray and is known.
    pub(super) fn kept(&self, node: (usize, usize)) -> Option<&Motion> {
        let at = self.kept_at(node);
        self.motions.get(at as usize).filter(|_| at != NONE)
    }

    /// Parts of rays and motions at a pixel of a whole square, by the parabolas through its nine nodes.
    #[inline]
    pub(super) fn told<const K: usize>(
        &self,
        square: &Square,
        (x, y): (usize, usize),
        parts: impl Fn(&Motion) -> [Vec3A; K],
    ) -> [Vec3A; K] {
        let (wx, wy) = (shares(square, x, square.corner.0), shares(square, y, square.corner.1));
        let mut sums = [Vec3A::ZERO; K];
        for (row, wy) in square.nodes.chunks_exact(3).zip(wy) {
            for (node, wx) in row.iter().zip(wx) {
                let Some(motion) = self.motions.get(*node as usize) else { continue };
                for (sum, part) in sums.iter_mut().zip(parts(motion)) {
                    *sum += part * (wx * wy);
                }
            }
        }
        sums
    }

    /// How the membrane moves about a pixel of a whole square, mm: there a search begins.
    pub(super) fn foretold_mm(&self, square: &Square, pixel: (usize, usize)) -> Vec3A {
        self.told(square, pixel, |motion| [motion.moved_mm])[0]
    }
}
