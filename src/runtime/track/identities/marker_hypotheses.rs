//! Which discs the four markers may be, without a pose to start from.

use glam::DVec2;

use crate::track::frame::Plane;
use crate::track::marks::{Candidate, FIT_REACH_PX, FittedDisc, MarkerView};
use crate::track::model::MarkerModels;

/// Discs kept for each marker.
pub(in crate::track) const DISCS: usize = 4;
/// Places that are tried for them: most are no discs.
const PLACES: usize = 12;
/// Combinations that are tried.
const MAX_COMBINATIONS: usize = 96;

/// A disc for each of four markers, by its rank; `None`: the marker is not used.
pub(in crate::track) type Choice = [Option<usize>; 4];

/// Views of the four markers at several poses: a platform pressed down shows them larger.
pub(in crate::track) type Views = [[Option<MarkerView>; 4]; 3];

/// For each of four markers up to four discs that it may be, the likeliest first.
#[derive(Debug, Clone, Copy)]
pub(in crate::track) struct MarkerHypotheses {
    discs: [[Option<FittedDisc>; DISCS]; 4],
}

impl MarkerHypotheses {
    /// The likeliest discs within reach of each marker's place at rest, at most so many. The second of the views says what a
    /// candidate looks like; all of them are fitted, and the best fit counts.
    pub fn propose(plane: &Plane<'_>, models: &MarkerModels, views: &Views, count_of_each: usize) -> Self {
        let mut discs = [[None; DISCS]; 4];
        for (index, discs) in discs.iter_mut().enumerate() {
            let Some(view) = views[1][index].or(views[0][index]) else { continue };
            let mut places = [Candidate::default(); PLACES];
            let (start, reach) = (models.rest_px[index], models.reach_px[index]);
            let count = view.candidates(plane, start, reach, &mut places);
            let fits = places[..count].iter().filter_map(|place| {
                let fits = views.iter().filter_map(|views| {
                    views[index]?.fit(plane, place.at_px, FIT_REACH_PX, None, DVec2::ZERO)
                });
                fits.min_by(|a, b| a.misfit.total_cmp(&b.misfit))
            });
            for (to, disc) in discs.iter_mut().take(count_of_each).zip(fits) {
                *to = Some(disc);
            }
        }
        Self { discs }
    }

    /// Whether there is a disc that a marker may be.
    pub fn is_seen(&self, marker: usize) -> bool {
        self.disc(marker, 0).is_some()
    }

    /// A marker's disc by its rank.
    pub fn disc(&self, marker: usize, rank: usize) -> Option<FittedDisc> {
        self.discs.get(marker)?.get(rank).copied().flatten()
    }

    /// Combinations of one disc for each marker that has any, but for one that is left out, each as the discs' ranks, the
    /// likeliest first: by the sum of the ranks, which comes with them. At most [`MAX_COMBINATIONS`].
    pub fn combinations(&self, left_out: Option<usize>) -> impl Iterator<Item = (usize, Choice)> + use<'_> {
        let absent = move |marker: usize| left_out == Some(marker) || !self.is_seen(marker);
        (0..=4 * (DISCS - 1))
            .flat_map(|sum| (0..DISCS.pow(4)).map(move |code| (sum, code)))
            .map(|(sum, code)| (sum, std::array::from_fn(|i| code / DISCS.pow(i as u32) % DISCS)))
            .filter(move |(sum, ranks): &(usize, [usize; 4])| {
                let is_there = |(marker, rank): (usize, &usize)| {
                    if absent(marker) { *rank == 0 } else { self.disc(marker, *rank).is_some() }
                };
                ranks.iter().sum::<usize>() == *sum && ranks.iter().enumerate().all(is_there)
            })
            .map(move |(sum, ranks)| {
                (sum, std::array::from_fn(|marker| (!absent(marker)).then_some(ranks[marker])))
            })
            .take(MAX_COMBINATIONS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn combinations_come_by_rank_and_only_of_what_there_is() {
        let disc = FittedDisc { sd_px: 0.1, misfit: 0.1, levels: [1.0; 3], ..FittedDisc::default() };
        let some = Some(disc);
        let all = |discs| MarkerHypotheses { discs }.combinations(None).collect::<Vec<_>>();
        let found = all([[some, some, None, None], [some, None, None, None], [some; 4], [some; 4]]);
        assert_eq!(found.len(), 2 * 4 * 4);
        assert_eq!(found[0], (0, [Some(0); 4]));
        assert!(found.is_sorted_by_key(|(sum, _)| *sum));
        assert!(
            found
                .iter()
                .all(|(sum, ranks)| ranks.iter().flatten().sum::<usize>() == *sum && ranks[1] == Some(0))
        );
        assert_eq!(all([[some; 4]; 4]).len(), MAX_COMBINATIONS);
        let none = MarkerHypotheses { discs: [[some; 4], [None; 4], [some; 4], [some; 4]] };
        assert!(!none.is_seen(1) && none.is_seen(0));
        // Three markers are combined without the fourth, whether it is not seen or left out.
        assert!(none.combinations(None).all(|(_, ranks)| ranks[1].is_none() && ranks[2].is_some()));
        let three = MarkerHypotheses { discs: [[some; 4]; 4] };
        assert!(three.combinations(Some(2)).all(|(_, ranks)| ranks[2].is_none() && ranks[1].is_some()));
        assert_eq!(three.combinations(Some(2)).count(), 4 * 4 * 4);
    }
}
