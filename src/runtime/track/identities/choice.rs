//! Which of several ways to number the blobs is right.
//!
//! The whole skin may have moved by about the pattern's spacing, or a part of it between two frames: then more than one
//! numbering finds blobs. Each is grown from its own start; the one that makes the smoothest skin of the most dots counts,
//! and the key must still be a gap in it. What another one that is nearly as good says otherwise stays open.

use glam::DVec2;

use super::blob_matching::{BlobMatcher, Hypothesis};
use super::dot_track::DotTrack;
use crate::track::marks::DarkBlob;
use crate::track::model::{DotModel, SensorModel};

/// A blob where the key says that there is none costs this share of the dots.
const FILLED_KEY_COST: f64 = 0.05;
/// A numbering of this share of the dots needs no rivals.
const CLEAR: f64 = 0.96;
/// A rival this near to the best, in parts of the dots, leaves open what it says otherwise.
const NEARLY: f64 = 0.01;
/// Steps of the lattice to each side that the skin may have moved as a whole.
const MAX_STEPS: i32 = 2;

/// The numbering that counts, and what is not clear of it.
#[derive(Debug, Clone, Default)]
pub(super) struct IdentityChoice {
    /// The blob of each dot.
    pub blob_of: Vec<Option<usize>>,
    /// Dots that a numbering nearly as good has elsewhere.
    pub is_unsure: Vec<bool>,
    /// Whether it is another one than that by which the dots were followed into the frame.
    pub is_new: bool,
    /// How good it is: dots, each less by how rough the skin is there.
    score: f64,
    second: Vec<Option<usize>>,
    second_score: f64,
}

impl IdentityChoice {
    /// Buffers for so many dots.
    pub fn new(dots: usize) -> Self {
        Self {
            blob_of: Vec::with_capacity(dots),
            is_unsure: Vec::with_capacity(dots),
            second: Vec::with_capacity(dots),
            ..Self::default()
        }
    }

    /// Numbers the blobs; `key_px`: where the pose has the key on the undeformed dome.
    pub fn choose(
        &mut self,
        matcher: &mut BlobMatcher,
        blobs: &[DarkBlob],
        model: &SensorModel,
        tracks: &[DotTrack],
        key_px: Option<DVec2>,
    ) {
        let dots = &model.dots;
        self.blob_of.clear();
        self.second.clear();
        (self.score, self.second_score) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        let wanted = tracks.iter().filter(|track| track.is_wanted()).count() as f64;
        self.weigh(matcher, blobs, model, tracks, key_px, Hypothesis::Followed);
        // What is as good as what was followed is no reason to change.
        self.score += 0.5;
        let followed = self.score;
        if tracks.iter().any(|track| track.displaced_px.is_some()) {
            self.weigh(matcher, blobs, model, tracks, key_px, Hypothesis::FromLast);
        }
        let step_px = DVec2::ZERO;
        self.weigh(matcher, blobs, model, tracks, key_px, Hypothesis::FromRest { step_px });
        if self.score < CLEAR * wanted
            && let Some([along, up]) = lattice(model)
        {
            for (i, j) in (-MAX_STEPS..=MAX_STEPS).flat_map(|j| (-MAX_STEPS..=MAX_STEPS).map(move |i| (i, j)))
            {
                let step_px = along * f64::from(i) + up * f64::from(j);
                if (i, j) != (0, 0) {
                    self.weigh(matcher, blobs, model, tracks, key_px, Hypothesis::FromRest { step_px });
                }
            }
        }
        self.is_new = self.score > followed;
        self.is_unsure.clear();
        self.is_unsure.resize(dots.len(), false);
        if self.second_score > self.score - NEARLY * wanted - 1.0 {
            for ((unsure, best), second) in self.is_unsure.iter_mut().zip(&self.blob_of).zip(&self.second) {
                *unsure = best.is_some() && second.is_some() && best != second;
            }
        }
    }

    fn weigh(
        &mut self,
        matcher: &mut BlobMatcher,
        blobs: &[DarkBlob],
        model: &SensorModel,
        tracks: &[DotTrack],
        key_px: Option<DVec2>,
        hypothesis: Hypothesis,
    ) {
        matcher.grow(blobs, &model.dots, tracks, hypothesis);
        let mut score = matcher.smoothness(blobs, &model.dots, tracks);
        if let (Some(key), Some(at)) = (&model.key, key_px)
            && matcher.has_blob_at(blobs, &model.dots, &key.dot, at, tracks) == Some(true)
        {
            score -= FILLED_KEY_COST * model.dots.len() as f64;
        }
        let differs = |of: &[Option<usize>]| {
            let pairs = of.iter().zip(&matcher.blob_of);
            pairs.filter(|(a, b)| a.is_some() && b.is_some() && a != b).count() > 0
        };
        if score > self.score {
            // What says the same is no rival.
            if differs(&self.blob_of) {
                std::mem::swap(&mut self.second, &mut self.blob_of);
                self.second_score = self.score;
            }
            self.score = score;
            self.blob_of.clear();
            self.blob_of.extend_from_slice(&matcher.blob_of);
        } else if score > self.second_score && differs(&self.blob_of) {
            self.second_score = score;
            self.second.clear();
            self.second.extend_from_slice(&matcher.blob_of);
        }
    }
}

/// Two steps of the pattern near its middle, px: from a dot with the most neighbours to two of them that are not in a line.
fn lattice(model: &SensorModel) -> Option<[DVec2; 2]> {
    let dots = &model.dots;
    let count = dots.len() as f64;
    let middle = dots.iter().map(|dot| dot.rest_px).sum::<DVec2>() / count;
    let sides = dots.iter().map(|dot| dot.neighbors.len()).max()?;
    let full = dots.iter().filter(|dot| dot.neighbors.len() == sides);
    let from_middle = |dot: &&DotModel| dot.rest_px.distance_squared(middle);
    let dot = full.min_by(|a, b| from_middle(a).total_cmp(&from_middle(b)))?;
    let steps = dot.neighbors.iter().map(|other| dots[*other].rest_px - dot.rest_px);
    let along = steps.clone().next()?;
    let sine = |step: &DVec2| step.perp_dot(along).abs() / (step.length() * along.length()).max(1e-9);
    let up = steps.max_by(|a, b| sine(a).total_cmp(&sine(b)))?;
    (sine(&up) > 0.5).then_some([along, up])
}
