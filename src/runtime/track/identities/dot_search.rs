//! The dots from frame to frame: what is where each should be, and what its neighbours say.

use glam::DVec2;

use super::dot_track::DotTrack;
use super::groups::Groups;
use super::skin;
use crate::track::frame::Plane;
use crate::track::marks::{DarkSpot, MarkState, SpotFault, SpotMeter};
use crate::track::model::DotModel;

/// How far from its prediction a spot is a dot without asking its neighbours, in parts of its spacing: with motions up
/// to half of the spacing, no other dot can be so near.
const OWN_REACH: f64 = 0.3;
/// The same from a prediction that the neighbours made in this frame.
const NEIGHBOR_REACH: f64 = 0.35;
/// Two dots nearer than this part of their spacing are one blob.
const ONE_BLOB: f64 = 0.3;
/// Two starts nearer than this part of the spacing lead to the same spot.
const SAME_PLACE: f64 = 0.25;
/// A dot's displacement that differs by less than this from the mean of its neighbours', in parts of its spacing, is that
/// of the skin; beyond, the skin is asked as a plane through the dots around.
const SURELY_SMOOTH: f64 = 0.3;
/// How far a dot's motion may differ from its neighbours', in parts of its spacing.
const MAX_UNLIKE: f64 = 0.4;
/// A dot this near to where the skin leads is no other one, in parts of its spacing; farther off it may be a neighbour that fits
/// by no more than this worse.
const MAX_CLEAR: f64 = 0.25;
const UNCLEAR: f64 = 0.15;
/// One dot in so many is looked at anew in each frame.
const LOOKED_AT_PART: usize = 4;
/// Rounds in which found dots lead to their neighbours.
const MAX_ROUNDS: usize = 64;

/// Everything that the search for dots works with.
pub(super) struct DotSearch<'a, 'b> {
    pub plane: &'a Plane<'b>,
    pub meter: &'a mut SpotMeter,
    pub models: &'a [DotModel],
    pub tracks: &'a mut [DotTrack],
    pub order: &'a mut Vec<usize>,
    pub groups: &'a mut Groups,
}

impl DotSearch<'_, '_> {
    fn measure(
        &mut self,
        index: usize,
        start: DVec2,
        stray_px: f64,
        known: Option<&DarkSpot>,
    ) -> Result<DarkSpot, SpotFault> {
        self.meter.measure(self.plane, start, &self.tracks[index].outline, stray_px, known)
    }

    /// Each dot where its own past puts it: what the pose expects and it was displaced by.
    pub fn follow(&mut self, turn: usize) {
        for index in 0..self.tracks.len() {
            let track = &mut self.tracks[index];
            // The looks of some are taken anew in each frame, and of all whose size has changed.
            let known = track.spot.take().filter(|_| !(index + turn).is_multiple_of(LOOKED_AT_PART));
            track.start_px = None;
            if !track.is_wanted() {
                continue;
            }
            track.state = track.absent();
            let Some(start) = track.expected_px.zip(track.displaced_px).map(|(e, d)| e + d) else { continue };
            track.start_px = Some(start);
            let reach = OWN_REACH * self.models[index].spacing_px;
            match self.measure(index, start, reach, known.as_ref()) {
                Ok(spot) => self.tracks[index].find(spot),
                Err(SpotFault::Misshapen) => self.tracks[index].state = MarkState::Merged,
                Err(_) => {}
            }
        }
    }

    /// Mean over the found neighbours of how far they are from where they were looked for, and from where the
    /// undeformed dome would have them; how many they are.
    fn neighbors(&self, index: usize) -> (DVec2, DVec2, usize) {
        let (mut moved, mut displaced, mut count) = (DVec2::ZERO, DVec2::ZERO, 0);
        for other in &self.models[index].neighbors {
            let track = &self.tracks[*other];
            if let (Some(now), Some(expected)) = (track.now_px(), track.expected_px) {
                moved += now - track.start_px.unwrap_or(now);
                displaced += now - expected;
                count += 1;
            }
        }
        let n = f64::from(count as u32).max(1.0);
        (moved / n, displaced / n, count)
    }

    /// Lost dots where their neighbours, found in this frame, put them; each one found may lead to the next.
    pub fn spread(&mut self) {
        for _ in 0..MAX_ROUNDS {
            let mut more = false;
            for index in 0..self.tracks.len() {
                let track = self.tracks[index];
                if track.spot.is_some() || !track.is_wanted() {
                    continue;
                }
                let (moved, displaced, count) = self.neighbors(index);
                let Some(expected) = track.expected_px.filter(|_| count > 0) else { continue };
                let spacing = self.models[index].spacing_px;
                let guess = expected + track.displaced_px.map_or(displaced, |own| own + moved);
                let at = |other: usize| self.tracks[other].expected_px;
                let by = |other: usize| self.tracks[other].off_px();
                let lead = skin::estimate(index, self.models, at, by);
                let starts = [expected + lead.map_or(displaced, |lead| lead.displaced_px), guess];
                for start in starts {
                    // What was no spot from there is none from there again.
                    let again = track.start_px.is_some_and(|p| p.distance(start) < SAME_PLACE * spacing);
                    if track.state == MarkState::Merged && again {
                        continue;
                    }
                    let Ok(spot) = self.measure(index, start, NEIGHBOR_REACH * spacing, None) else {
                        continue;
                    };
                    if self.is_free(index, spot.at_px) {
                        if self.tracks[index].start_px.is_none() {
                            self.tracks[index].start_px = Some(start);
                        }
                        self.tracks[index].find(spot);
                        more = true;
                        break;
                    }
                }
            }
            if !more {
                break;
            }
        }
    }

    /// Whether no other found dot is at a place.
    fn is_free(&self, index: usize, at: DVec2) -> bool {
        let apart = ONE_BLOB * self.models[index].spacing_px;
        let other = |(i, track): (usize, &DotTrack)| {
            i != index && track.now_px().is_some_and(|p| p.distance_squared(at) < apart * apart)
        };
        !self.tracks.iter().enumerate().any(other)
    }

    /// Two dots in one place are neither; a dot that moved unlike all its neighbours, or where the skin could not have it,
    /// is another one's blob. Returns how many were so.
    pub fn check(&mut self) -> usize {
        self.order.clear();
        self.order.extend((0..self.tracks.len()).filter(|i| self.tracks[*i].spot.is_some()));
        let x = |track: &DotTrack| track.now_px().map_or(0.0, |p| p.x);
        let tracks = &mut *self.tracks;
        self.order.sort_unstable_by(|a, b| x(&tracks[*a]).total_cmp(&x(&tracks[*b])).then(a.cmp(b)));
        for position in 0..self.order.len() {
            let first = self.order[position];
            for second in self.order.iter().skip(position + 1) {
                let apart = ONE_BLOB * self.models[first].spacing_px.min(self.models[*second].spacing_px);
                let (Some(a), Some(b)) = (tracks[first].now_px(), tracks[*second].now_px()) else { continue };
                if b.x - a.x > apart {
                    break;
                }
                if a.distance(b) < apart {
                    for index in [first, *second] {
                        tracks[index].lose(MarkState::Merged);
                    }
                }
            }
        }
        let mut torn_dots = 0;
        // What a lost dot spoke for is judged again without it.
        for _ in 0..MAX_ROUNDS {
            let lost = self.lose_torn();
            torn_dots += lost;
            if lost == 0 {
                break;
            }
        }
        if torn_dots > 0 {
            torn_dots += self.lose_islands();
        }
        self.lose_unclear();
        torn_dots
    }

    /// Where the skin is folded together, a dot's blob may be that of a neighbour which is not found: a dot that lies beside
    /// where the skin leads, on a place that the neighbour fits as well, is of unsure identity.
    fn lose_unclear(&mut self) {
        for index in 0..self.tracks.len() {
            let (models, tracks) = (self.models, &*self.tracks);
            let Some(now) = tracks[index].now_px() else { continue };
            let at = |other: usize| tracks[other].expected_px;
            let by = |other: usize| tracks[other].off_px();
            let off_px = |dot: usize| {
                let lead = skin::estimate(dot, models, at, by)?;
                Some(now.distance(at(dot)? + lead.displaced_px))
            };
            let spacing = models[index].spacing_px;
            let Some(own_px) = off_px(index).filter(|own_px| *own_px > MAX_CLEAR * spacing) else { continue };
            let may_be = |other: &usize| {
                let is_absent = tracks[*other].spot.is_none() && tracks[*other].is_wanted();
                is_absent && off_px(*other).is_some_and(|off_px| off_px < own_px + UNCLEAR * spacing)
            };
            if models[index].neighbors.iter().any(may_be) {
                let track = &mut self.tracks[index];
                track.lose(MarkState::IdentityUnsure);
                track.displaced_px = None;
            }
        }
    }

    /// Loses the dots that moved unlike their neighbours, or that the skin around them could not have there; how many.
    fn lose_torn(&mut self) -> usize {
        let mut lost = 0;
        for index in 0..self.tracks.len() {
            let track = self.tracks[index];
            let (Some(now), Some(start)) = (track.now_px(), track.start_px) else { continue };
            let (moved, displaced, count) = self.neighbors(index);
            let spacing = self.models[index].spacing_px;
            let unlike = (now - start).distance(moved) > MAX_UNLIKE * spacing;
            let own = track.expected_px.map_or(displaced, |expected| now - expected);
            let at = |other: usize| self.tracks[other].expected_px;
            let by = |other: usize| self.tracks[other].off_px();
            let rough = own.distance(displaced) > SURELY_SMOOTH * spacing;
            let torn = rough && skin::is_torn(index, self.models, at, by);
            if count >= 2 && (unlike || torn) {
                lost += 1;
                let track = &mut self.tracks[index];
                track.lose(if torn { MarkState::IdentityUnsure } else { track.absent() });
                // Where it was is not where it is to be looked for.
                track.displaced_px = None;
            }
        }
        lost
    }

    /// Where the skin is torn, only the most of it that hangs together is sure: a patch may lie a whole step of the pattern
    /// beside its place, and fit its neighbours' blobs. Loses the others; how many.
    fn lose_islands(&mut self) -> usize {
        let tracks = &*self.tracks;
        let by = |index: usize| tracks[index].off_px();
        self.groups.find(
            self.models,
            |index| by(index).is_some(),
            |one, other| {
                let apart = by(one).zip(by(other)).map(|(one, other)| one.distance(other));
                apart.is_some_and(|apart| apart < MAX_UNLIKE * self.models[one].spacing_px)
            },
        );
        let mut lost = 0;
        for (index, track) in self.tracks.iter_mut().enumerate() {
            if track.spot.is_some() && !self.groups.is_in_largest(index) {
                lost += 1;
                track.lose(MarkState::IdentityUnsure);
                track.displaced_px = None;
            }
        }
        lost
    }
}
