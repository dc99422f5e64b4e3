//! Which dots do not look like dots, and how far off that may put them.
//!
//! Three things are held against a dot: what no ellipse explains of its pixels, more than of the frame's other dots; its area
//! against what the pose expects, beside that of the dots around; its elongation likewise. A frame that is blurred,
//! compressed or sharpened changes all dots alike, and so does ink that came out thin: what is usual in the frame does not
//! count.

use super::dot_track::DotTrack;
use crate::track::marks::{DarkSpot, MarkState, SpotOutline};
use crate::track::model::DotModel;

/// Dots around one that its size and its sides are compared with.
const MAX_AROUND: usize = 8;
/// What shape, size and sides may differ by at least before it counts: prints and touches do as much.
const FREE: [f64; 3] = [0.03, 0.06, 0.06];
/// The same in parts of what is usual in the frame.
const FREE_OF_USUAL: f64 = 3.0;
/// Deviation of the centroid, in parts of the dot's radius, for each part of the area that is out of place. Dirt of the area
/// m at the rim puts the centroid off by m radii; its sd is half of that, so that five of them cover dirt and what hides it.
const RADII_BY_PART: f64 = 0.5;
/// Dots that may be farther off than this have no numbers: px, and in parts of the radius.
const MAX_SD_PX: f64 = 0.2;
const MAX_SD_RADII: f64 = 0.06;
/// What is farther beyond the gate than this says nothing of what is usual around it: at the rim two smeared neighbours of
/// three would vouch for a third.
const GROSS: f64 = 1.5;
/// Part of the spot's area that is brighter than the ground from which on it is glare.
const GLARE: f64 = 0.01;
/// What is smaller than it should be by this (logarithm of the area) is partly hidden.
const HIDDEN: f64 = 0.12;
/// Ellipses explain what is smeared but for this part of what its size and its sides differ by.
const SMOOTH: f64 = 0.15;

/// Judges the dots of a frame; keeps its buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct DotFaults {
    /// Logarithm of each dot's area over what it should be, and its elongation less what it should be.
    sides: Vec<Option<[f64; 3]>>,
    /// By how much shape, size and sides of each dot differ.
    unlike: Vec<Option<Unlike>>,
    /// What no ellipse explains of the frame's dots, their size and sides: medians.
    misfit: f64,
    frame: [f64; 3],
    /// Which dots are too far off to say what is usual around them.
    is_gross: Vec<bool>,
    values: Vec<f64>,
}

/// By how much a dot differs: misfit, logarithm of the area, elongation.
#[derive(Debug, Clone, Copy)]
struct Unlike {
    misfit: f64,
    area: f64,
    elongation: f64,
}

impl Unlike {
    fn parts(self) -> [f64; 3] {
        [self.misfit, self.area.abs(), self.elongation]
    }

    /// Deviation of a centroid that it means, where so much is usual in the frame, px.
    fn sd_px(self, usual: [f64; 3], radius_px: f64) -> f64 {
        let mut square = 0.0;
        for ((part, free), usual) in self.parts().into_iter().zip(FREE).zip(usual) {
            let free = f64::max(free, FREE_OF_USUAL * usual);
            square += (part - free).max(0.0).powi(2);
        }
        RADII_BY_PART * radius_px * square.sqrt()
    }
}

/// Size and sides of a spot against its outline.
fn sides_of(spot: &DarkSpot, outline: &SpotOutline) -> [f64; 3] {
    let elongation = spot.elongation_beside(outline);
    [(spot.area_px / outline.area_px).ln(), elongation.x, elongation.y]
}

/// Radius of what a dot should be, px.
fn radius_px(track: &DotTrack) -> f64 {
    (track.outline.area_px / std::f64::consts::PI).sqrt()
}

/// What does not look like a dot: beside an ellipse, and beyond the window.
fn misfit_of(spot: &DarkSpot) -> f64 {
    spot.shape.misfit() + spot.shape.one_sided
}

/// The median, the mean of the two in the middle where there are two.
fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    let is_even = values.len().is_multiple_of(2);
    let (below, upper, _) =
        if values.is_empty() { return None } else { values.select_nth_unstable_by(middle, f64::total_cmp) };
    let lower = if is_even { below.iter().copied().fold(f64::NEG_INFINITY, f64::max) } else { *upper };
    Some(0.5 * (lower + *upper))
}

impl DotFaults {
    /// For so many dots.
    pub fn new(dots: usize) -> Self {
        Self {
            sides: Vec::with_capacity(dots),
            unlike: Vec::with_capacity(dots),
            is_gross: Vec::with_capacity(dots),
            values: Vec::with_capacity(dots),
            ..Self::default()
        }
    }

    /// Adds to the deviation of each found dot what its looks mean, and names what is beyond the gate.
    pub fn judge(&mut self, models: &[DotModel], tracks: &mut [DotTrack]) {
        for track in &mut *tracks {
            track.fault = None;
        }
        self.measure(tracks);
        let mut usual = [0.0; 3];
        // Then without the gross ones.
        self.is_gross.clear();
        self.is_gross.resize(tracks.len(), false);
        for is_first in [true, false] {
            self.compare(models, tracks);
            if is_first {
                usual = std::array::from_fn(|k| {
                    self.values.clear();
                    self.values.extend(self.unlike.iter().flatten().map(|unlike| unlike.parts()[k].abs()));
                    median(&mut self.values).unwrap_or(0.0)
                });
            }
            let judged = tracks.iter_mut().zip(&self.unlike).zip(&mut self.is_gross);
            for ((track, unlike), is_gross) in judged {
                let (Some(spot), Some(unlike)) = (&track.spot, unlike) else { continue };
                let radius_px = radius_px(track);
                let over = unlike.sd_px(usual, radius_px) / f64::max(MAX_SD_PX, MAX_SD_RADII * radius_px);
                if over > 1.0 {
                    track.fault = Some(reason(spot, *unlike));
                }
                *is_gross |= over > GROSS;
            }
            if !self.is_gross.contains(&true) {
                break;
            }
        }
        for (track, unlike) in tracks.iter_mut().zip(&self.unlike) {
            let radius_px = radius_px(track);
            let (Some(spot), Some(unlike)) = (&mut track.spot, unlike) else { continue };
            spot.sd_px = spot.sd_px.hypot(unlike.sd_px(usual, radius_px));
        }
    }

    /// What is usual in the frame.
    fn measure(&mut self, tracks: &[DotTrack]) {
        self.values.clear();
        self.values.extend(tracks.iter().filter_map(|track| Some(misfit_of(&track.spot?))));
        self.misfit = median(&mut self.values).unwrap_or(0.0);
        self.sides.clear();
        self.sides.extend(tracks.iter().map(|track| Some(sides_of(&track.spot?, &track.outline))));
        self.frame = std::array::from_fn(|k| {
            self.values.clear();
            self.values.extend(self.sides.iter().flatten().map(|sides| sides[k]));
            median(&mut self.values).unwrap_or(0.0)
        });
    }

    /// Each dot against the frame and the dots around it.
    fn compare(&mut self, models: &[DotModel], tracks: &[DotTrack]) {
        let (misfit, frame) = (self.misfit, self.frame);
        self.unlike.clear();
        for (index, model) in models.iter().enumerate() {
            let unlike = self.sides[index].zip(tracks[index].spot).map(|(own, spot)| {
                let mut around = [[0.0; MAX_AROUND]; 3];
                let mut count = 0;
                let sound = model.neighbors.iter().filter(|other| !self.is_gross[**other]);
                for sides in sound.filter_map(|other| self.sides[*other]).take(MAX_AROUND) {
                    for (list, value) in around.iter_mut().zip(sides) {
                        list[count] = value;
                    }
                    count += 1;
                }
                let around = around.map(|mut list| median(&mut list[..count]));
                // A touch changes the dots around too, and dirt beside a dot is none on it: the likelier of both counts.
                let beside = |k: usize| own[k] - around[k].unwrap_or(frame[k]);
                let alone = |k: usize| own[k] - frame[k];
                let area = if beside(0).abs() < alone(0).abs() { beside(0) } else { alone(0) };
                let elongation = beside(1).hypot(beside(2)).min(alone(1).hypot(alone(2)));
                Unlike { misfit: misfit_of(&spot) - misfit, area, elongation }
            });
            self.unlike.push(unlike);
        }
    }
}

/// Why a spot does not look like a dot.
fn reason(spot: &DarkSpot, unlike: Unlike) -> MarkState {
    if spot.shape.bright > GLARE {
        MarkState::Glare
    } else if unlike.area < -HIDDEN {
        MarkState::PartlyHidden
    } else if unlike.misfit < SMOOTH * unlike.area.hypot(unlike.elongation) {
        MarkState::Smeared
    } else {
        MarkState::Dirty
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::track::marks::SpotOutline;

    /// A lattice of dots that look alike but for one.
    fn judged(all: impl Fn(usize, &mut DarkSpot), one: impl Fn(&mut DarkSpot)) -> Vec<DotTrack> {
        let outline = SpotOutline { radius_px: 4.0, area_px: 50.0, spread_px2: 8.0, elongation: DVec2::ZERO };
        let models = DotModel::lattice(6, 5, 20.0, outline);
        let mut tracks: Vec<DotTrack> = (0..models.len())
            .map(|index| {
                let mut spot =
                    DarkSpot { area_px: 50.0, spread_px2: 8.0, sd_px: 0.01, ..DarkSpot::default() };
                (spot.shape.over, spot.shape.under) = (0.03, 0.03);
                all(index, &mut spot);
                if index == 14 {
                    one(&mut spot);
                }
                DotTrack { spot: Some(spot), outline, ..DotTrack::default() }
            })
            .collect();
        DotFaults::new(models.len()).judge(&models, &mut tracks);
        tracks
    }

    #[test]
    fn one_that_differs_is_named_and_its_neighbours_are_not() {
        type Spoil = fn(&mut DarkSpot);
        let cases: [(MarkState, Spoil); 4] = [
            (MarkState::Dirty, |spot| (spot.shape.over, spot.area_px) = (0.2, 60.0)),
            (MarkState::Smeared, |spot| (spot.shape.elongation, spot.area_px) = (DVec2::new(0.3, 0.1), 70.0)),
            (MarkState::Glare, |spot| (spot.shape.under, spot.shape.bright) = (0.3, 0.05)),
            (MarkState::PartlyHidden, |spot| (spot.shape.under, spot.area_px) = (0.15, 35.0)),
        ];
        for (state, spoil) in cases {
            let tracks = judged(|_, _| {}, spoil);
            assert_eq!(tracks[14].fault, Some(state));
            assert!(tracks[14].spot.unwrap().sd_px > 0.2);
            let others = tracks.iter().enumerate().filter(|(index, _)| *index != 14);
            assert!(others.clone().count() == 29 && others.clone().all(|(_, track)| track.fault.is_none()));
            assert!(others.into_iter().all(|(_, track)| track.spot.unwrap().sd_px == 0.01), "{state:?}");
        }
    }

    #[test]
    fn a_dot_at_the_rim_is_named_though_two_of_its_three_neighbours_are_spoilt_alike() {
        let outline = SpotOutline { radius_px: 4.0, area_px: 50.0, spread_px2: 8.0, elongation: DVec2::ZERO };
        let mut models = DotModel::lattice(6, 5, 20.0, outline);
        // The middle of the left column, of whose neighbours the ones above and below are spoilt too.
        let spoilt = [6, 12, 18];
        models[12].neighbors = vec![6, 18, 13];
        let mut tracks: Vec<DotTrack> = (0..models.len())
            .map(|index| {
                let mut spot =
                    DarkSpot { area_px: 50.0, spread_px2: 8.0, sd_px: 0.01, ..DarkSpot::default() };
                spot.area_px *= if spoilt.contains(&index) { 1.8 } else { 1.0 };
                DotTrack { spot: Some(spot), outline, ..DotTrack::default() }
            })
            .collect();
        DotFaults::new(models.len()).judge(&models, &mut tracks);
        assert!(spoilt.iter().all(|index| tracks[*index].fault.is_some()));
        assert_eq!(tracks.iter().filter(|track| track.fault.is_some()).count(), 3);
    }

    #[test]
    fn what_a_frame_or_a_touch_does_to_all_is_no_fault() {
        // Thin ink, compression, and a touch that makes the dots to one side larger and longer.
        let all = |index: usize, spot: &mut DarkSpot| {
            spot.area_px *= 0.8 * (1.0 + 0.04 * (index % 6) as f64);
            spot.shape.over = 0.15 + 0.01 * (index % 3) as f64;
            spot.shape.elongation = DVec2::new(0.03 * (index % 6) as f64, 0.0);
        };
        assert!(judged(all, |_| {}).iter().all(|track| track.fault.is_none()));
        // A little dirt makes a dot less sure, no more.
        let tracks = judged(|_, _| {}, |spot| spot.shape.over = 0.1);
        let spot = tracks[14].spot.unwrap();
        assert!(tracks[14].fault.is_none() && spot.sd_px > 0.05 && spot.sd_px < 0.2, "{}", spot.sd_px);
    }
}
