//! Which blob is which dot, from the constants' neighbour graph: no grid is assumed, and any dot may be missing.
//!
//! Most of the dome is where the pose puts it, or everything moved alike: the commonest offset between blobs and
//! expected dots gives the first pairs. From there each dot that has neighbours in place is looked for where they
//! lead, the best fit first. What fits nothing stays a blob without a name.

use glam::DVec2;

use super::dot_track::DotTrack;
use crate::track::marks::DarkBlob;
use crate::track::model::DotModel;

/// Half of the square in which offsets are counted, px, and the side of its cells.
const VOTE_HALF_PX: f64 = 24.0;
const CELL_PX: f64 = 1.5;
const CELLS: usize = 32;
/// First pairs lie this near to the commonest offset, in parts of the dot's spacing.
const SEED_REACH: f64 = 0.2;
/// A blob is this near to where the neighbours lead, in parts of the dot's spacing.
const GROW_REACH: f64 = 0.38;
/// A blob's area over the dot's may lie between these.
const AREA_RATIO: [f64; 2] = [0.35, 2.2];
const MAX_ROUNDS: usize = 256;

/// Matches blobs to dots; keeps its buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct BlobMatcher {
    /// The blob of each dot.
    pub blob_of: Vec<Option<usize>>,
    /// Whether a blob is some dot's.
    pub taken: Vec<bool>,
    pairs: Vec<(f64, usize, usize)>,
    buckets: Buckets,
}

/// Blobs by place.
#[derive(Debug, Clone, Default)]
struct Buckets {
    across: usize,
    down: usize,
    starts: Vec<u32>,
    items: Vec<u32>,
}

const BUCKET_PX: f64 = 16.0;

impl Buckets {
    fn fill(&mut self, blobs: &[DarkBlob], width: f64, height: f64) {
        self.across = (width / BUCKET_PX).ceil().max(1.0) as usize;
        self.down = (height / BUCKET_PX).ceil().max(1.0) as usize;
        self.starts.clear();
        self.starts.resize(self.across * self.down + 1, 0);
        for blob in blobs {
            let cell = self.cell(blob.at_px);
            self.starts[cell + 1] += 1;
        }
        for i in 1..self.starts.len() {
            self.starts[i] += self.starts[i - 1];
        }
        self.items.clear();
        self.items.resize(blobs.len(), 0);
        // From the back, each start ends up where it was.
        for (index, blob) in blobs.iter().enumerate().rev() {
            let cell = self.cell(blob.at_px);
            self.starts[cell + 1] -= 1;
            self.items[self.starts[cell + 1] as usize] = index as u32;
        }
        // Now starts[cell + 1] is the start of the cell: shift back.
        for i in 1..self.starts.len() {
            self.starts[i - 1] = self.starts[i];
        }
        if let Some(last) = self.starts.last_mut() {
            *last = blobs.len() as u32;
        }
    }

    fn cell(&self, at: DVec2) -> usize {
        let clamp = |v: f64, end: usize| ((v / BUCKET_PX).max(0.0) as usize).min(end - 1);
        clamp(at.y, self.down) * self.across + clamp(at.x, self.across)
    }

    /// The blobs in the cells around a place.
    fn near(&self, at: DVec2, reach_px: f64) -> impl Iterator<Item = usize> + '_ {
        let clamp = |v: f64, end: usize| ((v / BUCKET_PX).max(0.0) as usize).min(end - 1);
        let (x0, x1) = (clamp(at.x - reach_px, self.across), clamp(at.x + reach_px, self.across));
        let (y0, y1) = (clamp(at.y - reach_px, self.down), clamp(at.y + reach_px, self.down));
        (y0..=y1)
            .flat_map(move |y| {
                let row = y * self.across;
                self.starts[row + x0] as usize..self.starts[row + x1 + 1] as usize
            })
            .map(|slot| self.items[slot] as usize)
    }
}

/// Where a dot is expected, all that is known of it taken together.
fn prior(track: &DotTrack) -> Option<DVec2> {
    let expected = track.expected_px.filter(|_| track.is_wanted())?;
    Some(expected + track.displaced_px.unwrap_or(DVec2::ZERO))
}

impl BlobMatcher {
    /// Buffers for so many dots and blobs.
    pub fn new(dots: usize, blobs: usize) -> Self {
        Self {
            blob_of: Vec::with_capacity(dots),
            taken: Vec::with_capacity(blobs),
            pairs: Vec::with_capacity(dots),
            buckets: Buckets {
                across: 0,
                down: 0,
                starts: Vec::with_capacity(blobs / 4 + 2),
                items: Vec::with_capacity(blobs),
            },
        }
    }

    /// Fills [`BlobMatcher::blob_of`]; the answer does not depend on the order of dots or blobs but for exact ties.
    pub fn match_blobs(
        &mut self,
        blobs: &[DarkBlob],
        models: &[DotModel],
        tracks: &[DotTrack],
        size: [usize; 2],
    ) -> usize {
        self.blob_of.clear();
        self.blob_of.resize(models.len(), None);
        self.taken.clear();
        self.taken.resize(blobs.len(), false);
        self.buckets.fill(blobs, size[0] as f64, size[1] as f64);
        let offset = self.commonest_offset(blobs, models, tracks);
        self.pairs.clear();
        for (index, (model, track)) in models.iter().zip(tracks).enumerate() {
            if let Some(at) = prior(track) {
                self.propose(blobs, model, index, at + offset, SEED_REACH);
            }
        }
        self.take_best();
        for round in 0..MAX_ROUNDS {
            // Two neighbours in place first; when that ends, one will do.
            let mut count = 0;
            for needed in [2, 1] {
                self.pairs.clear();
                for (index, (model, track)) in models.iter().zip(tracks).enumerate() {
                    let Some(at) = prior(track).filter(|_| self.blob_of[index].is_none()) else { continue };
                    if let Some(lead) = self.lead(blobs, models, tracks, index, needed) {
                        self.propose(blobs, model, index, at + lead, GROW_REACH);
                    }
                }
                count = self.take_best();
                if count > 0 {
                    break;
                }
            }
            if count == 0 || round + 1 == MAX_ROUNDS {
                break;
            }
        }
        self.blob_of.iter().flatten().count()
    }

    /// The offset that most dots agree in: the fullest 3 x 3 cells of all offsets between a dot and the blobs around.
    fn commonest_offset(&self, blobs: &[DarkBlob], models: &[DotModel], tracks: &[DotTrack]) -> DVec2 {
        let mut votes = [[0_u16; CELLS]; CELLS];
        for (model, track) in models.iter().zip(tracks) {
            let Some(at) = prior(track) else { continue };
            // Beyond the spacing other dots would vote for the lattice's next fit.
            let reach = (0.75 * model.spacing_px).min(VOTE_HALF_PX - CELL_PX);
            for index in self.buckets.near(at, reach) {
                let away = blobs[index].at_px - at;
                if away.length() < reach {
                    let cell = |v: f64| (((v + VOTE_HALF_PX) / CELL_PX) as usize).min(CELLS - 1);
                    votes[cell(away.y)][cell(away.x)] += 1;
                }
            }
        }
        let (mut best, mut offset) = (0.0, DVec2::ZERO);
        for y in 1..CELLS - 1 {
            for x in 1..CELLS - 1 {
                let (mut sum, mut moment) = (0.0, DVec2::ZERO);
                for (dy, row) in votes.iter().enumerate().skip(y - 1).take(3) {
                    for (dx, count) in row.iter().enumerate().skip(x - 1).take(3) {
                        let center = |i: usize| (i as f64 + 0.5) * CELL_PX - VOTE_HALF_PX;
                        sum += f64::from(*count);
                        moment += DVec2::new(center(dx), center(dy)) * f64::from(*count);
                    }
                }
                // Of equal votes the smaller motion.
                let score = sum - 1e-3 * (moment / f64::max(sum, 1.0)).length();
                if score > best {
                    (best, offset) = (score, moment / sum);
                }
            }
        }
        offset
    }

    /// Mean over the neighbours in place (at least `needed`) of their blob less where they were expected.
    fn lead(
        &self,
        blobs: &[DarkBlob],
        models: &[DotModel],
        tracks: &[DotTrack],
        index: usize,
        needed: usize,
    ) -> Option<DVec2> {
        let (mut sum, mut count) = (DVec2::ZERO, 0);
        for other in &models[index].neighbors {
            if let (Some(blob), Some(at)) = (self.blob_of[*other], prior(&tracks[*other])) {
                sum += blobs[blob].at_px - at;
                count += 1;
            }
        }
        (count >= needed).then(|| sum / f64::from(count as u32))
    }

    fn propose(&mut self, blobs: &[DarkBlob], model: &DotModel, index: usize, at: DVec2, reach: f64) {
        let reach_px = reach * model.spacing_px;
        let mut best: Option<(f64, usize)> = None;
        for blob in self.buckets.near(at, reach_px) {
            let part = blobs[blob].area_px / model.outline.area_px;
            let distance = blobs[blob].at_px.distance(at);
            let fits =
                !self.taken[blob] && distance < reach_px && (AREA_RATIO[0]..AREA_RATIO[1]).contains(&part);
            if fits && best.is_none_or(|(d, _)| distance < d) {
                best = Some((distance, blob));
            }
        }
        if let Some((distance, blob)) = best {
            self.pairs.push((distance / model.spacing_px, index, blob));
        }
    }

    /// Of the proposed pairs the nearest first; returns how many were taken.
    fn take_best(&mut self) -> usize {
        self.pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut count = 0;
        for (_, dot, blob) in &self.pairs {
            if !self.taken[*blob] && self.blob_of[*dot].is_none() {
                self.taken[*blob] = true;
                self.blob_of[*dot] = Some(*blob);
                count += 1;
            }
        }
        count
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::identities::false_dots::find_false_dots;
    use crate::track::marks::{MarkState, SpotOutline};

    const SPACING_PX: f64 = 20.0;

    /// Dots of a lattice, where they are expected, and blobs a third of the spacing away from there.
    fn scene(missing: &[usize]) -> (Vec<DotModel>, Vec<DotTrack>, Vec<DarkBlob>) {
        let outline = SpotOutline { radius_px: 3.5, area_px: 38.0, spread_px2: 6.0 };
        let models = DotModel::lattice(6, 5, SPACING_PX, outline);
        let at =
            |i: usize| DVec2::new(30.0 + SPACING_PX * (i % 6) as f64, 30.0 + SPACING_PX * (i / 6) as f64);
        let track = |i: usize| DotTrack {
            expected_px: Some(at(i)),
            outline,
            state: MarkState::Missing,
            ..DotTrack::default()
        };
        // A shear on top of the shift: the neighbours lead where the commonest offset does not.
        let moved = |p: DVec2| p + DVec2::new(7.0 + 0.04 * (p.y - 30.0), -3.0);
        let blob = |i: usize| DarkBlob { at_px: moved(at(i)), area_px: 36.0, spread_px2: 6.0 };
        let seen = (0..models.len()).filter(|i| !missing.contains(i));
        let blobs = seen.rev().map(blob).collect();
        (models, (0..30).map(track).collect(), blobs)
    }

    #[test]
    fn shifted_and_sheared_blobs_keep_their_dots() {
        let missing = [8, 21];
        let (models, tracks, blobs) = scene(&missing);
        let mut matcher = BlobMatcher::new(30, 64);
        assert_eq!(matcher.match_blobs(&blobs, &models, &tracks, [200, 160]), 28);
        for (dot, blob) in matcher.blob_of.iter().enumerate() {
            let Some(blob) = blob else {
                assert!(missing.contains(&dot));
                continue;
            };
            let y = tracks[dot].expected_px.unwrap().y - 30.0;
            let away = blobs[*blob].at_px - tracks[dot].expected_px.unwrap();
            assert!(away.distance(DVec2::new(7.0 + 0.04 * y, -3.0)) < 1e-9, "{dot}: {away}");
        }
    }

    #[test]
    fn a_blob_between_dots_that_are_found_is_a_false_dot() {
        let (models, mut tracks, mut blobs) = scene(&[]);
        let mut matcher = BlobMatcher::new(30, 64);
        matcher.match_blobs(&blobs, &models, &tracks, [200, 160]);
        for (track, blob) in tracks.iter_mut().zip(&matcher.blob_of) {
            track.spot = blob.map(|blob| crate::track::marks::DarkSpot {
                at_px: blobs[blob].at_px,
                contrast: 0.5,
                area_px: 36.0,
                spread_px2: 6.0,
                sd_px: 0.02,
                ground: 150.0,
            });
        }
        let between = tracks[0].now_px().unwrap() + SPACING_PX * 0.5;
        blobs.push(DarkBlob { at_px: between, area_px: 30.0, spread_px2: 5.0 });
        // Too small, and too far from the pattern.
        blobs.push(DarkBlob { at_px: between + 2.0, area_px: 3.0, spread_px2: 0.5 });
        blobs.push(DarkBlob { at_px: DVec2::splat(-80.0), area_px: 30.0, spread_px2: 5.0 });
        let mut found = Vec::new();
        find_false_dots(&blobs, &models, &tracks, &mut found);
        assert_eq!(found, [between]);
    }
}
