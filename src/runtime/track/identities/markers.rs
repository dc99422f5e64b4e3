//! The white markers of one frame, where a pose puts them.

use super::marker_hypotheses::{Choice, MarkerHypotheses, Views};
use crate::track::frame::Plane;
use crate::track::marks::{Candidate, FIT_REACH_PX, FittedDisc, MarkerView, ShadingSlope};
use crate::track::model::MarkerModels;
use domecast_optics::SensorOptics;

/// Markers that are looked for again from the pose of the others.
const MAX_REFOUND: usize = 8;

/// One frame, as the white markers are looked for in it.
pub(in crate::track) struct MarkerFrame<'a, 'b> {
    pub plane: &'a Plane<'b>,
    pub models: &'a MarkerModels,
    /// How far from where the last pose puts it a marker is looked for when it is not at once in place, px.
    pub reach_px: f64,
}

/// Markers that were found in a second look.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::track) struct Refound {
    markers: [usize; MAX_REFOUND],
    count: usize,
}

impl Refound {
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

/// The white markers as they were last found.
#[derive(Debug, Clone)]
pub(in crate::track) struct MarkerIdentities {
    discs: Vec<Option<FittedDisc>>,
    /// How the light falls off across each marker.
    shading: Vec<ShadingSlope>,
}

impl MarkerIdentities {
    /// For so many markers.
    pub fn new(count: usize) -> Self {
        Self { discs: vec![None; count], shading: vec![ShadingSlope::default(); count] }
    }

    /// The disc of each marker, in the order of the constants.
    pub fn discs(&self) -> &[Option<FittedDisc>] {
        &self.discs
    }

    /// Whether every marker is found.
    pub fn are_all_found(&self) -> bool {
        self.discs.iter().all(Option::is_some)
    }

    /// How many markers are found.
    pub fn found(&self) -> usize {
        self.discs.iter().flatten().count()
    }

    /// No marker is found.
    pub fn clear(&mut self) {
        self.discs.fill(None);
    }

    /// Each marker where optics at the last pose show it, then around there.
    pub fn follow(&mut self, frame: &MarkerFrame<'_, '_>, optics: &SensorOptics) {
        for ((marker, disc), shading) in frame.models.all.iter().zip(&mut self.discs).zip(&self.shading) {
            let shading = shading.estimate();
            let levels = disc.take().map(|d| d.levels);
            let Ok(image) = marker.image(optics) else { continue };
            let Some(view) = MarkerView::new(optics, marker) else { continue };
            let start = image.centroid_px;
            *disc = view.fit_closely(frame.plane, start, FIT_REACH_PX, levels, shading);
            if disc.is_none() {
                let mut best = [Candidate::default(); 1];
                if view.candidates(frame.plane, start, frame.reach_px, &mut best) > 0 {
                    *disc = view.fit_closely(frame.plane, best[0].at_px, FIT_REACH_PX, None, shading);
                }
            }
        }
    }

    /// Looks for the markers that are not found where optics at the pose of the others show them.
    pub fn find_again(&mut self, frame: &MarkerFrame<'_, '_>, optics: &SensorOptics) -> Refound {
        let mut refound = Refound::default();
        for (index, (marker, disc)) in frame.models.all.iter().zip(&mut self.discs).enumerate() {
            if disc.is_some() || refound.count == MAX_REFOUND {
                continue;
            }
            let Ok(image) = marker.image(optics) else { continue };
            let Some(view) = MarkerView::new(optics, marker) else { continue };
            let shading = self.shading[index].estimate();
            *disc = view.fit_closely(frame.plane, image.centroid_px, FIT_REACH_PX, None, shading);
            if disc.is_some() {
                refound.markers[refound.count] = index;
                refound.count += 1;
            }
        }
        refound
    }

    /// What was found in a second look is no marker.
    pub fn drop_refound(&mut self, refound: &Refound) {
        for index in &refound.markers[..refound.count] {
            self.discs[*index] = None;
        }
    }

    /// Four markers anywhere in their reach, without a pose to start from: up to so many discs that each of them may be. The
    /// best of each are taken as found.
    pub fn find_anywhere(
        &mut self,
        frame: &MarkerFrame<'_, '_>,
        views: &Views,
        discs: usize,
    ) -> MarkerHypotheses {
        let hypotheses = MarkerHypotheses::propose(frame.plane, frame.models, views, discs);
        self.choose(&hypotheses, [Some(0); 4]);
        hypotheses
    }

    /// Takes one disc for each marker that is used.
    pub fn choose(&mut self, hypotheses: &MarkerHypotheses, choice: Choice) {
        for (index, (disc, rank)) in self.discs.iter_mut().zip(choice).enumerate() {
            *disc = rank.and_then(|rank| hypotheses.disc(index, rank));
        }
    }

    /// Fits the discs again as optics at their pose show them.
    pub fn refit(&mut self, frame: &MarkerFrame<'_, '_>, optics: &SensorOptics) {
        for ((marker, disc), shading) in frame.models.all.iter().zip(&mut self.discs).zip(&self.shading) {
            let Some(found) = *disc else { continue };
            // Before any frame has shown how the light falls off, this one does.
            let mut shading = *shading;
            shading.add(found.shading);
            let view = MarkerView::new(optics, marker);
            let again = view.and_then(|view| {
                view.fit_closely(frame.plane, found.centroid_px, FIT_REACH_PX, None, shading.estimate())
            });
            *disc = again.or(*disc);
        }
    }

    /// Takes in how the light falls off across the discs of a frame whose pose is good.
    pub fn learn_shading(&mut self) {
        for (shading, disc) in self.shading.iter_mut().zip(&self.discs) {
            shading.add(disc.filter(|disc| disc.fault.is_none()).and_then(|disc| disc.shading));
        }
    }

    /// Forgets all frames.
    pub fn restart(&mut self) {
        self.shading.fill(ShadingSlope::default());
    }
}
