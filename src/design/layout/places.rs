//! The places of a pattern inside its edge, and the pitch that gives a wanted number of them.

use std::f64::consts::{PI, TAU};

use glam::DVec2;

use super::boundary::Boundary;
use super::fill;
use super::pattern::{Pattern, PatternError};
use crate::spec::sections::{CentredOn, PatternKind};

/// Bound on the number of places of one pattern: ten times what a camera of 100 megapixels could tell apart.
const MAX_DOTS: usize = 4_000_000;

/// Share of the pitch by which a solved pitch stays on the finer side of the one at which places reach the edge.
const EDGE_SHARE: f64 = 1e-6;

impl Pattern {
    /// The places of all dots inside the edge, from the centre outwards and by angle.
    ///
    /// # Errors
    /// No dot fits, or far too many do.
    pub fn places(&self, edge: &Boundary) -> Result<Vec<DVec2>, PatternError> {
        let about = edge.area_px2() / (self.pitch_px * self.pitch_px);
        if about.is_nan() || about > MAX_DOTS as f64 {
            return Err(PatternError::TooMany { about, max: MAX_DOTS });
        }
        let mut places = match self.kind {
            PatternKind::Square | PatternKind::Hexagonal => self.lattice(edge),
            PatternKind::Rings => self.rings(edge),
            PatternKind::Fill => fill::relaxed(self, edge),
        };
        if places.is_empty() {
            return Err(PatternError::Empty);
        }
        outwards(&mut places, self.pitch_px);
        Ok(places)
    }

    /// How many places [`Self::places`] gives, without finding them exactly: relaxing moves places, but
    /// neither adds nor takes any.
    pub(super) fn count(&self, edge: &Boundary) -> usize {
        if edge.area_px2() / (self.pitch_px * self.pitch_px) > MAX_DOTS as f64 {
            return usize::MAX;
        }
        match self.kind {
            PatternKind::Square | PatternKind::Hexagonal => self.lattice(edge).len(),
            PatternKind::Rings => self.rings(edge).len(),
            PatternKind::Fill => fill::seeds(self, edge).len(),
        }
    }

    fn lattice(&self, edge: &Boundary) -> Vec<DVec2> {
        let mut places = self.unit_lattice(edge.largest_px() / self.pitch_px);
        for place in &mut places {
            *place *= self.pitch_px;
        }
        places.retain(|place| edge.contains(*place));
        places
    }

    /// Rings one pitch apart, each with as many dots as fit without coming closer than the pitch; turned by
    /// half a step against the ring before.
    fn rings(&self, edge: &Boundary) -> Vec<DVec2> {
        let mut rings = self.ring_radii(edge);
        if let Some(wanted) = self.wanted {
            thin_out(&mut rings, wanted);
        }
        let mut places = Vec::new();
        for (index, (radius, count)) in rings.into_iter().enumerate() {
            let step = TAU / count as f64;
            let phase = self.rotation_rad + if index % 2 == 0 { 0.0 } else { 0.5 * step };
            let around = (0..count).map(|k| DVec2::from_angle(phase + step * k as f64) * radius);
            places.extend(around.filter(|place| edge.contains(*place)));
        }
        places
    }

    /// Radius of each ring and how many dots fit on it.
    fn ring_radii(&self, edge: &Boundary) -> Vec<(f64, usize)> {
        let pitch = self.pitch_px;
        let (mut rings, first) = match self.centred_on {
            CentredOn::Dot => (vec![(0.0, 1)], pitch),
            // Three dots around the gap, one pitch apart.
            CentredOn::Gap => (Vec::new(), pitch / 3f64.sqrt()),
        };
        // As for `Boundary::contains`: a ring on the edge is inside.
        let last = edge.largest_px() * (1.0 + 1e-9);
        let mut radius = first;
        while radius <= last {
            // The slack keeps a count that is whole by construction (6 on the first ring) from rounding down.
            rings.push((radius, (PI / (0.5 * pitch / radius).asin() + 1e-9).floor() as usize));
            radius = first + pitch * (rings.len() - usize::from(first == pitch)) as f64;
        }
        rings
    }

    /// The pitch at which the pattern has as close to `wanted` places inside the edge as it can; the pattern's
    /// own pitch is not read. Rings and a fill get a pitch with at least as many, since they can give some up.
    ///
    /// # Errors
    /// No dot fits.
    pub fn pitch_for_count(&self, wanted: usize, edge: &Boundary) -> Result<f64, PatternError> {
        let count_at = |pitch_px: f64| Self { pitch_px, wanted: None, ..*self }.count(edge);
        let can_give_up = matches!(self.kind, PatternKind::Rings | PatternKind::Fill);
        let area = edge.area_px2();
        if area <= 0.0 {
            return Err(PatternError::Empty);
        }
        if wanted > MAX_DOTS {
            return Err(PatternError::TooMany { about: wanted as f64, max: MAX_DOTS });
        }
        let guess = (area / wanted.max(1) as f64).sqrt();
        // Bracket: more than wanted at `fine`, no more than wanted at `coarse`.
        let (mut fine, mut coarse) = (0.5 * guess, 2.0 * guess);
        for _ in 0..8 {
            if count_at(fine) >= wanted {
                break;
            }
            fine *= 0.7;
        }
        for _ in 0..16 {
            if count_at(coarse) <= wanted {
                break;
            }
            coarse *= 1.5;
        }
        let mut best = (usize::MAX, guess);
        // Counts are not quite monotone in the pitch, so the best that was met is kept, not the last.
        for _ in 0..48 {
            let middle = 0.5 * (fine + coarse);
            let count = count_at(middle);
            let off = if can_give_up && count < wanted { usize::MAX } else { count.abs_diff(wanted) };
            if off < best.0 || (off == best.0 && middle > best.1) {
                best = (off, middle);
            }
            if count > wanted {
                fine = middle;
            } else {
                coarse = middle;
            }
            if coarse - fine < 1e-9 * guess {
                break;
            }
        }
        let count = count_at(best.1);
        if count == 0 {
            return Err(PatternError::Empty);
        }
        // The search ends where places lie on the edge itself, where rounding lets some of equal places in and others
        // not: a little finer, all of them are inside.
        let inside = best.1 * (1.0 - EDGE_SHARE);
        let converged = count_at(inside);
        Ok(if converged == count || converged.abs_diff(wanted) <= best.0 { inside } else { best.1 })
    }
}

/// Takes dots from the rings, from each about in proportion to its number, until `wanted` are left. The dot at
/// the centre and three on each ring stay.
fn thin_out(rings: &mut [(f64, usize)], wanted: usize) {
    let all: usize = rings.iter().map(|(_, count)| count).sum();
    let mut surplus = all.saturating_sub(wanted);
    let mut before = 0;
    for (_, count) in rings.iter_mut() {
        // Surplus of all rings up to this one, rounded, less what the rings before gave.
        let share =
            (before + *count) * all.saturating_sub(wanted) / all - before * all.saturating_sub(wanted) / all;
        before += *count;
        let give = share.min(surplus).min(count.saturating_sub(3));
        *count -= give;
        surplus -= give;
    }
    for (_, count) in rings.iter_mut().rev() {
        let give = surplus.min(count.saturating_sub(3));
        *count -= give;
        surplus -= give;
    }
}

/// Sorts places from the centre outwards, those of one radius by angle from +x. Radii and angles are compared
/// in steps far above rounding, so that equal places sort alike on every system.
fn outwards(places: &mut [DVec2], pitch_px: f64) {
    let step_px = 1e-6 * pitch_px;
    let key = |place: &DVec2| {
        let radius = (place.length() / step_px).round() as i64;
        let turn = place.to_angle() / TAU;
        let angle = ((turn - (turn + 1e-9).floor()) * 1e9).round() as i64;
        (radius, angle)
    };
    places.sort_by_cached_key(key);
}
