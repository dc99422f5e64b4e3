//! What tells rays and motion of a whole square from its nodes, and how much of what it shows none of them tells.

use glam::Vec3A;

use super::motion::{Motion, SMALLEST, Source, Square};
use super::smooth::Verdict;
use super::{Lit, LitSurface, nine};
use crate::shading::Turned;
use crate::work::Work;

/// What moves by less than this, mm, stands still.
const STILL_MM: f32 = 1e-6;

/// Parts of the tolerance. The motion is told from nine nodes where the bound on what that leaves in the light is below the
/// first; the change of the light is, where it is also nearer than the second to what straight lines through its
/// neighbours say.
const SMOOTH: f32 = 1.8;
const LITTLE: f32 = 0.3;
const FORESEEN: f32 = 0.8;
const FORESEEN_FAR: f32 = 0.5;
const SURE_TILT: f32 = 0.4;
/// Where the edge of the dome cuts a square, the tables know less of it: there no normal in the middle may be further than
/// this from what those on both sides say, rad.
const AT_EDGE_RAD: f32 = 2e-3;
/// Nearer to the base than this part of the radius, rays graze the dome: what they show bends more than the light does.
const GRAZING: f32 = 0.2;
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

impl Lit {
    /// Decides how the pixels of a square, of which the nine nodes are known, come by their rays and places.
    pub(super) fn settle(
        &mut self,
        surface: &LitSurface<'_>,
        corner: (usize, usize),
        side: usize,
        work: &mut Work,
    ) {
        let before = self.square(corner);
        let mut square = Square { corner, side, ..before };
        let mut places = [Vec3A::ZERO; 9];
        let mut count = 0;
        square.slant = 0.0;
        for (node, at) in nine(corner, side).into_iter().zip(&mut square.nodes) {
            *at = self.kept_at(node);
            if !self.motions.get(*at as usize).is_some_and(|kept| kept.is_whole) {
                self.keep_motion(surface, &before, node, work);
                *at = self.kept_at(node);
            }
            let Some(kept) = self.motions.get(*at as usize).filter(|kept| kept.is_whole) else { continue };
            if let Some(place) = places.get_mut(count) {
                *place = kept.place_mm;
                square.slant = square.slant.max(kept.slant.min(MOST_SLANT));
                count += 1;
            }
        }
        square.is_whole = count == 9;
        let places = places.get(..count).unwrap_or_default();
        self.find_source(surface, &mut square, &before, places);
        self.set_square(square);
    }

    /// Decides how the motion of a square comes about, of which some nodes have rays that meet the undeformed dome at
    /// `places`.
    fn find_source(&self, surface: &LitSurface<'_>, square: &mut Square, before: &Square, places: &[Vec3A]) {
        let (top, bottom) = (square.corner.1, square.corner.1 + square.side);
        let Some(seen) = surface.at(top) else { return };
        square.turned = surface
            .dents(top, bottom)
            .map(|dent| dent.bend(places, square.slant))
            .fold(Turned::default(), Turned::or);
        let turned = square.turned;
        let per_radius = 1.0 / seen.optics.dome_radius_mm() as f32;
        let mut directions = [Vec3A::Z; 9];
        directions.iter_mut().zip(places).for_each(|(to, from)| *to = *from * per_radius);
        let directions = directions.get(..places.len()).unwrap_or_default();
        let room = SMOOTH * surface.tolerance;
        if places.is_empty() || turned.moved_mm <= STILL_MM {
            square.source = if places.is_empty() { Source::Exact } else { Source::Still };
            return;
        }
        let further = surface.shading.moved_bend(directions, turned);
        square.source = if further.tilt <= room
            && (square.is_whole || self.bends_mildly(square, |motion| motion.tilt, AT_EDGE_RAD))
        {
            let is_little = (further.table + further.tilt <= room
                && self.bends_mildly(square, |motion| motion.change, LITTLE * surface.tolerance))
                || {
                    let (part, most) =
                        if square.side == SMALLEST { (FORESEEN, 1.0) } else { (FORESEEN_FAR, SURE_TILT) };
                    further.tilt <= most * room
                        && self.was_foreseen(square, before, |motion| motion.change, part * surface.tolerance)
                };
            if is_little { Source::Little } else { Source::Smooth }
        } else {
            Source::Exact
        };
    }

    /// Whether a part of the motion is at all nodes what the nine of the square that this one is a quarter of say there, within
    /// some room. Tables have few knots in such a square: what is left between nodes half as far apart is a fraction of the
    /// room.
    fn was_foreseen(
        &self,
        square: &Square,
        before: &Square,
        part: impl Fn(&Motion) -> Vec3A,
        room: f32,
    ) -> bool {
        square.is_whole
            && before.is_whole
            && before.side == 2 * square.side
            && nine(square.corner, square.side).into_iter().zip(square.nodes).all(|(node, at)| {
                let [told] = self.told(before, node, |motion| [part(motion)]);
                let found = self.motions.get(at as usize).map_or(Vec3A::ZERO, &part);
                (told - found).abs().max_element() <= room
            })
    }

    /// Whether a part of the motion in the middles is what the straight lines through their neighbours say, within some
    /// room.
    fn bends_mildly(&self, square: &Square, part: impl Fn(&Motion) -> Vec3A, room: f32) -> bool {
        let nodes = square.nodes.map(|at| self.motions.get(at as usize).map_or(Vec3A::ZERO, &part));
        let mild = |a: usize, b: usize, c: usize| {
            (0.5 * (nodes[a] + nodes[c]) - nodes[b]).abs().max_element() <= room
        };
        (0..3).all(|k| mild(3 * k, 3 * k + 1, 3 * k + 2) && mild(k, k + 3, k + 6))
            && mild(0, 4, 8)
            && mild(2, 4, 6)
    }

    /// How far the light may be from the surface through the nodes of a part of a settled square, full scales. `None` where
    /// that is not known.
    pub(super) fn bend(
        &self,
        surface: &LitSurface<'_>,
        (x, y): (usize, usize),
        side: usize,
        told: Verdict,
    ) -> Option<Bend> {
        let square = self.square((x, y));
        let Square { source, is_whole, turned, .. } = square;
        // At the edge of the dome, and where the membrane bends sharply, the bound only ever divides.
        if (!is_whole || source == Source::Exact) && told != Verdict::Smooth {
            return None;
        }
        let seen = surface.at(y)?;
        let corners = [(x, y), (x + side, y), (x, y + side), (x + side, y + side)];
        let mut places = [Vec3A::ZERO; 4];
        for (place, (x, y)) in places.iter_mut().zip(corners) {
            // Most corners are nodes.
            *place = if let Some(kept) = self.kept((x, y)).filter(|_| self.is_kept((x, y))) {
                kept.place_mm
            } else if is_whole {
                self.told(&square, (x, y), |motion| [motion.place_mm])[0]
            } else {
                seen.optics.follow_continued(surface.rays?.at(x, y)?).ok()?.0.as_vec3a()
            };
        }
        let per_radius = 1.0 / seen.optics.dome_radius_mm() as f32;
        let directions = places.map(|place| place * per_radius);
        let still = surface.shading.bend(&directions);
        let further = |turned: Turned| {
            let bend = surface.shading.moved_bend(&directions, turned);
            (ALSO - 1.0) * still + bend.table + bend.tilt
        };
        let more = match source {
            Source::Still | Source::Little => 0.0,
            // What the tilt leaves has been found small.
            Source::Smooth => further(Turned { tilt_rad: 0.0, ..turned }),
            Source::Exact => {
                let slant = if is_whole { square.slant } else { MOST_SLANT };
                let bends = surface.dents(y, y + side).map(|dent| dent.bend(&places, slant));
                let turned = bends.fold(Turned::default(), Turned::or);
                if turned.moved_mm > STILL_MM { further(turned) } else { 0.0 }
            }
        };
        let is_known = source != Source::Exact || more == 0.0;
        let is_inside = is_whole && is_known && places.iter().all(|place| place.z * per_radius > GRAZING);
        Some(Bend { most: still + more, is_inside })
    }
}
