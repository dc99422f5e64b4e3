//! How the membrane moved over a square, and how much of what it shows no node of the square tells.

use glam::{DVec3, Vec3A};

use super::smooth::Verdict;
use super::{Known, LARGEST, Lit, LitSurface};
use crate::sim::shading::Turned;

/// Distance of the pixels of which the membrane's motion is kept, px: the nodes of the largest squares.
const KEPT_STEP: usize = LARGEST / 2;
/// What moves by less than this, mm, stands still.
const STILL_MM: f32 = 1e-6;

/// Parts of the tolerance. The motion is told from nine nodes where the bound on what that leaves in the light is below the
/// first; the change of the light is, where it is also nearer than the second to what straight lines through its
/// neighbours say.
const SMOOTH: f32 = 1.8;
const LITTLE: f32 = 0.3;
/// Where the edge of the dome cuts a square, the tables know less of it: there no normal in the middle may be further than
/// this from what those on both sides say, rad.
const AT_EDGE_RAD: f32 = 2e-3;
/// Nearer to the base than this part of the radius, rays graze the dome: what they show bends more than the light does.
const GRAZING: f64 = 0.2;
/// Where the light's change is not smooth in itself, its own bend is counted as so many of the resting light's.
const ALSO: f32 = 1.5;
/// A ray slants by no more than this; those that do more graze the dome.
const MOST_SLANT: f32 = 3.0;

/// How the light may bend over a square.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bend {
    /// Bound on what the surface through the nodes leaves, full scales.
    pub most: f32,
    /// Whether all of it lies well inside the rim, and the bound is the whole truth there.
    pub is_inside: bool,
}

/// How the membrane moved where a ray met it undeformed.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Motion {
    /// The point of the undeformed dome on the ray, mm; zero where there is none.
    pub place_mm: Vec3A,
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
}

/// How the pixels of a largest square come by their place on the membrane.
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

/// What is known of a largest square as a whole.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Square {
    pub source: Source,
    /// Whether all nine nodes have a ray.
    is_whole: bool,
    /// The steepest of them.
    slant: f32,
    turned: Turned,
}

/// Weights of a square's three nodes at each of its columns or rows.
const WEIGHTS: [[f32; 3]; LARGEST + 1] = {
    let mut weights = [[0.0; 3]; LARGEST + 1];
    let mut i = 0;
    while i <= LARGEST {
        let t = i as f32 / KEPT_STEP as f32;
        weights[i] = [0.5 * (t - 1.0) * (t - 2.0), t * (2.0 - t), 0.5 * t * (t - 1.0)];
        i += 1;
    }
    weights
};

impl<const N: usize> Lit<N> {
    pub(super) fn kept_at(&self, (x, y): (usize, usize)) -> Option<usize> {
        (x.is_multiple_of(KEPT_STEP) && y.is_multiple_of(KEPT_STEP))
            .then(|| y / KEPT_STEP * self.kept_across() + x / KEPT_STEP)
    }

    fn kept_across(&self) -> usize {
        self.width.div_ceil(KEPT_STEP)
    }

    /// Room for the motions of a picture; of the last one, nothing is left that could tell on this one's bytes.
    pub(super) fn lay_out_motions(&mut self) {
        self.moved_mm = DVec3::ZERO;
        self.motions.clear();
        let count = self.kept_across() * self.height.div_ceil(KEPT_STEP);
        self.motions.resize(count, Motion::default());
        self.squares.clear();
        self.squares.resize((self.width / LARGEST) * (self.height / LARGEST), Square::default());
    }

    fn square(&self, (x, y): (usize, usize)) -> Square {
        let at = y / LARGEST * (self.width / LARGEST) + x / LARGEST;
        self.squares.get(at).copied().unwrap_or_default()
    }

    pub(super) fn source(&self, corner: (usize, usize)) -> Source {
        self.square(corner).source
    }

    /// Decides how the pixels of a largest square, of which the nine nodes are known, come by their places.
    pub(super) fn settle(&mut self, surface: &LitSurface<'_>, (x, y): (usize, usize)) {
        let mut places = [DVec3::ZERO; 9];
        let (mut count, mut slant) = (0, 0.0_f32);
        for i in 0..9 {
            let node = (x + i % 3 * KEPT_STEP, y + i / 3 * KEPT_STEP);
            let kept = self.kept(node);
            let is_lit = self.known.get(node.1 * self.width + node.0) == Some(&Known::Lit);
            if let Some(place) = places.get_mut(count).filter(|_| is_lit && kept.place_mm != Vec3A::ZERO) {
                *place = kept.place_mm.as_dvec3();
                slant = slant.max(kept.slant.min(MOST_SLANT));
                count += 1;
            }
        }
        let (Some(places), Some(seen)) = (places.get(..count), surface.at(y)) else { return };
        let is_whole = count == 9;
        let turned = surface
            .dents(y, y + LARGEST)
            .map(|dent| dent.bend(places, f64::from(slant)))
            .fold(Turned::default(), Turned::or);
        let per_radius = 1.0 / seen.optics.dome_radius_mm();
        let mut directions = [DVec3::Z; 9];
        directions.iter_mut().zip(places).for_each(|(to, from)| *to = *from * per_radius);
        let directions = directions.get(..count).unwrap_or_default();
        let room = SMOOTH * surface.tolerance;
        let tilted = Turned { tilt_rad: turned.tilt_rad, ..Turned::default() };
        let source = if count == 0 {
            Source::Exact
        } else if turned.moved_mm <= STILL_MM {
            Source::Still
        } else if surface.shading.moved_bend(directions, tilted) <= room
            && (is_whole || self.bends_mildly((x, y), |motion| motion.tilt, AT_EDGE_RAD))
        {
            let is_little = surface.shading.moved_bend(directions, turned) <= room
                && self.bends_mildly((x, y), |motion| motion.change, LITTLE * surface.tolerance);
            if is_little { Source::Little } else { Source::Smooth }
        } else {
            Source::Exact
        };
        let at = y / LARGEST * (self.width / LARGEST) + x / LARGEST;
        if let Some(square) = self.squares.get_mut(at) {
            *square = Square { source, is_whole, slant, turned };
        }
    }

    fn kept(&self, (x, y): (usize, usize)) -> Motion {
        let at = y / KEPT_STEP * self.kept_across() + x / KEPT_STEP;
        self.motions.get(at).copied().unwrap_or_default()
    }

    /// Whether a part of the motion in the middles is what the straight lines through their neighbours say, within some
    /// room.
    fn bends_mildly(&self, (x, y): (usize, usize), part: impl Fn(Motion) -> Vec3A, room: f32) -> bool {
        let at = |i: usize, j: usize| part(self.kept((x + i * KEPT_STEP, y + j * KEPT_STEP)));
        let mild = |a: Vec3A, b: Vec3A, c: Vec3A| (0.5 * (a + c) - b).abs().max_element() <= room;
        (0..3).all(|k| mild(at(k, 0), at(k, 1), at(k, 2)) && mild(at(0, k), at(1, k), at(2, k)))
            && mild(at(0, 0), at(1, 1), at(2, 2))
            && mild(at(2, 0), at(1, 1), at(0, 2))
    }

    /// How far the light may be from the surface through the nodes of a part of a largest square, full scales. `None` where
    /// that is not known.
    pub(super) fn bend(
        &self,
        surface: &LitSurface<'_>,
        (x, y): (usize, usize),
        side: usize,
        told: Verdict,
    ) -> Option<Bend> {
        let largest = (x / LARGEST * LARGEST, y / LARGEST * LARGEST);
        let Square { source, is_whole, slant, turned } = self.square(largest);
        // At the edge of the dome, and where the membrane bends sharply, the bound only ever divides.
        if (!is_whole || source == Source::Exact) && told != Verdict::Smooth {
            return None;
        }
        let seen = surface.at(y)?;
        let corners = [(x, y), (x + side, y), (x, y + side), (x + side, y + side)];
        let mut places = [DVec3::ZERO; 4];
        for (place, (x, y)) in places.iter_mut().zip(corners) {
            *place = if is_whole {
                self.told(largest, (x - largest.0, y - largest.1), |motion| [motion.place_mm])[0].as_dvec3()
            } else {
                seen.optics.follow_continued(surface.rays?.at(x, y)?).ok()?.0
            };
        }
        let per_radius = 1.0 / seen.optics.dome_radius_mm();
        let directions = places.map(|place| place * per_radius);
        let still = surface.shading.bend(&directions);
        let further = |turned: Turned| (ALSO - 1.0) * still + surface.shading.moved_bend(&directions, turned);
        let more = match source {
            Source::Still | Source::Little => 0.0,
            Source::Smooth => further(Turned { tilt_rad: 0.0, ..turned }),
            Source::Exact => {
                let slant = f64::from(if is_whole { slant } else { MOST_SLANT });
                let bends = surface.dents(y, y + side).map(|dent| dent.bend(&places, slant));
                let turned = bends.fold(Turned::default(), Turned::or);
                if turned.moved_mm > STILL_MM { further(turned) } else { 0.0 }
            }
        };
        let is_known = source != Source::Exact || more == 0.0;
        let is_inside = is_whole && is_known && places.iter().all(|place| place.z * per_radius > GRAZING);
        Some(Bend { most: still + more, is_inside })
    }

    /// Parts of the motion at a pixel of a largest square, by the parabolas through its nine nodes.
    fn told<const K: usize>(
        &self,
        (x, y): (usize, usize),
        (dx, dy): (usize, usize),
        parts: impl Fn(&Motion) -> [Vec3A; K],
    ) -> [Vec3A; K] {
        let (wx, wy) = (WEIGHTS[dx.min(LARGEST)], WEIGHTS[dy.min(LARGEST)]);
        let across = self.kept_across();
        let start = y / KEPT_STEP * across + x / KEPT_STEP;
        let mut sums = [Vec3A::ZERO; K];
        for (j, wy) in wy.iter().enumerate() {
            let row = self.motions.get(start + j * across..start + j * across + 3).unwrap_or_default();
            for (node, wx) in row.iter().zip(wx) {
                for (sum, part) in sums.iter_mut().zip(parts(node)) {
                    *sum += part * (wx * wy);
                }
            }
        }
        sums
    }

    /// How the membrane moves about a pixel of a largest square whose nodes are known, mm: there a search begins.
    pub(super) fn foretold_mm(&self, corner: (usize, usize), (x, y): (usize, usize)) -> DVec3 {
        self.told(corner, (x - corner.0, y - corner.1), |motion| [motion.moved_mm])[0].as_dvec3()
    }

    /// Whether all nine nodes of a largest square have rays; not before they are known.
    pub(super) fn is_whole(&self, corner: (usize, usize)) -> bool {
        self.square(corner).is_whole
    }

    /// The motion at a place of a largest square, by the parabolas through its nine nodes.
    pub(super) fn motion(&self, corner: (usize, usize), place: (usize, usize)) -> Motion {
        let parts = |motion: &Motion| [motion.shift_mm, motion.tilt, motion.change];
        let [shift_mm, tilt, change] = self.told(corner, place, parts);
        Motion { shift_mm, tilt, change, ..Motion::default() }
    }
}
