//! The dots of one frame: each where it is expected, the whole frame where too few are there.

use glam::DVec2;

use super::blob_matching::BlobMatcher;
use super::choice::IdentityChoice;
use super::dot_faults::DotFaults;
use super::dot_prediction::DotPrediction;
use super::dot_search::DotSearch;
use super::dot_track::DotTrack;
use super::false_dots::{MAX_FALSE_DOTS, find_false_dots};
use super::groups::Groups;
use super::key_check::{KeyCheck, KeyFrame, Orientation};
use super::shifted_rows::ShiftedRows;
use super::vanished_dots::VanishedDots;
use crate::track::frame::{Mask, Plane};
use crate::track::marks::{BlobScan, DarkBlob, MarkState, SpotMeter};
use crate::track::model::{DotModel, SensorModel};
use crate::track::options::TrackOptions;
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;

/// Under load a dot's image grows and shrinks by some tenths: radii over that at rest.
const RADIUS_RATIO: [f64; 2] = [0.6, 1.6];
/// Blobs that the search of the whole frame can hold.
const MAX_BLOBS: usize = 1 << 15;
/// One in so many dots lost between two frames calls for a search of the whole frame.
const SUDDENLY_LOST: usize = 80;
/// Frames between two searches while it is open which dot some blobs are.
const OPEN_EVERY: u32 = 5;
/// A blob's dot is at most this far from it, in parts of its spacing.
const BLOB_REACH: f64 = 0.3;

/// One frame, as the dots are looked for in it.
pub(in crate::track) struct DotFrame<'a, 'b> {
    pub plane: &'a Plane<'b>,
    pub mask: &'a Mask,
    pub model: &'a SensorModel,
    /// At the pose.
    pub optics: &'a SensorOptics,
    /// The platform's pose; `None` before the first one is found.
    pub pose: Option<Rigid>,
}

/// What was found in a frame.
#[derive(Debug, Clone, Copy)]
pub(in crate::track) struct DotsFound<'a> {
    /// Each dot of the constants, in their order.
    pub tracks: &'a [DotTrack],
    /// Whether the whole frame was searched, and the blobs in it that are no dots.
    pub searched: bool,
    pub false_dots: &'a [DVec2],
    /// How the picture lies against the constants' camera.
    pub orientation: Orientation,
}

/// Dots and the buffers of their search.
#[derive(Debug, Clone)]
struct Dots {
    meter: SpotMeter,
    tracks: Vec<DotTrack>,
    order: Vec<usize>,
    groups: Groups,
}

impl Dots {
    fn search<'a, 'b>(&'a mut self, plane: &'a Plane<'b>, models: &'a [DotModel]) -> DotSearch<'a, 'b> {
        let Self { meter, tracks, order, groups } = self;
        DotSearch { plane, meter, models, tracks, order, groups }
    }

    fn found(&self) -> usize {
        self.tracks.iter().filter(|t| t.spot.is_some()).count()
    }

    /// Measures each dot at its blob; the past is what the match says, not what was followed before.
    fn measure_at(
        &mut self,
        plane: &Plane<'_>,
        models: &[DotModel],
        blob_of: impl Fn(usize) -> Option<DVec2>,
    ) {
        for (index, (track, model)) in self.tracks.iter_mut().zip(models).enumerate() {
            if !track.is_wanted() {
                continue;
            }
            track.lose(track.absent());
            let Some(at) = blob_of(index) else { continue };
            let reach = BLOB_REACH * model.spacing_px;
            if let Ok(spot) = self.meter.measure(plane, at, &track.outline, reach, None) {
                track.find(spot);
                track.start_px = Some(spot.at_px);
                if let Some(expected) = track.expected_px {
                    track.displaced_px = Some(spot.at_px - expected);
                }
            }
        }
    }
}

/// Mean level of nine pixels at a place inside of the frame.
fn level_at(plane: &Plane<'_>, at: DVec2) -> Option<f64> {
    let inside = |v: f64, end: usize| v > 1.0 && v < end as f64 - 2.0;
    if !(inside(at.x, plane.width()) && inside(at.y, plane.height())) {
        return None;
    }
    let mut levels = [0.0; 9];
    plane.square_into(at.x.round() as i32 - 1, at.y.round() as i32 - 1, 3, &mut levels);
    Some(f64::from(levels.iter().sum::<f32>()) / 9.0)
}

/// Follows the dots through the frames.
#[derive(Debug, Clone)]
pub(in crate::track) struct DotIdentities {
    dots: Dots,
    prediction: DotPrediction,
    scan: BlobScan,
    matcher: BlobMatcher,
    choice: IdentityChoice,
    search_every: u32,
    since_search: u32,
    searched: bool,
    false_dots: Vec<DVec2>,
    key: KeyCheck,
    faults: DotFaults,
    shifted: ShiftedRows,
    vanished: VanishedDots,
    /// Frames so far.
    turn: usize,
}

impl DotIdentities {
    /// For the dots of a sensor, in frames of one size.
    pub fn new(model: &SensorModel, [width, height]: [usize; 2], options: &TrackOptions) -> Self {
        let models = &model.dots;
        let mut meter = SpotMeter::default();
        let [smallest, largest] = RADIUS_RATIO;
        for model in models.iter().chain(model.key.as_ref().map(|key| &key.dot)) {
            let mut radius = smallest * model.outline.radius_px;
            while radius < largest * model.outline.radius_px {
                meter.prepare(radius);
                radius += 0.2;
            }
            meter.prepare(largest * model.outline.radius_px);
        }
        let count = models.len();
        let widest_px = models.iter().map(|model| model.outline.radius_px).fold(0.0, f64::max);
        Self {
            dots: Dots {
                meter,
                tracks: vec![DotTrack::default(); count],
                order: Vec::with_capacity(count),
                groups: Groups::new(count),
            },
            prediction: DotPrediction::default(),
            scan: BlobScan::new(width, height, widest_px),
            matcher: BlobMatcher::new(count, MAX_BLOBS),
            choice: IdentityChoice::new(count),
            search_every: options.search_every,
            since_search: u32::MAX,
            searched: false,
            false_dots: Vec::with_capacity(MAX_FALSE_DOTS),
            key: KeyCheck::new(options.camera_turned_rad.is_some(), width, height),
            faults: DotFaults::new(count),
            shifted: ShiftedRows::new(count),
            vanished: VanishedDots::new(count),
            turn: 0,
        }
    }

    /// Finds the dots of the next frame.
    pub fn find(&mut self, frame: &DotFrame<'_, '_>) {
        let &DotFrame { plane, mask, model, optics, ref pose } = frame;
        let models = &model.dots;
        self.searched = false;
        self.false_dots.clear();
        match pose {
            Some(pose) => {
                self.prediction.predict(pose, optics, mask, models, &mut self.dots.tracks);
                self.find_predicted(frame);
            }
            None => self.dots.tracks.iter_mut().for_each(|track| track.spot = None),
        }
        if let Some(key) = &model.key
            && !self.key.is_sure()
        {
            let Dots { meter, tracks, .. } = &mut self.dots;
            self.key.test(&mut KeyFrame { plane, meter, key, models, tracks, optics });
            if self.key.wants_search() {
                let blobs = self.scan.dark_blobs(plane, |y| mask.span(y));
                self.key.search(blobs.unwrap_or_default(), key, models, model.optics.lens().spec());
            }
        }
        self.faults.judge(models, &mut self.dots.tracks);
        let Dots { meter, tracks, .. } = &mut self.dots;
        self.shifted.judge(models, tracks, |tracks, index, at| {
            let reach_px = BLOB_REACH * models[index].spacing_px;
            let spot = meter.measure(plane, at, &tracks[index].outline, reach_px, None);
            let is_other =
                |at: DVec2| tracks.iter().filter_map(DotTrack::now_px).all(|p| p.distance(at) > reach_px);
            spot.is_ok_and(|spot| is_other(spot.at_px))
        });
        let blobs = self.searched.then_some(self.false_dots.as_slice());
        self.vanished.judge(models, &mut self.dots.tracks, blobs, |at| level_at(plane, at));
        self.dots.tracks.iter_mut().for_each(DotTrack::remember);
    }

    /// Each dot of the constants, in their order.
    pub fn tracks(&self) -> &[DotTrack] {
        &self.dots.tracks
    }

    /// Whether nothing tells that the numbers are other dots'.
    pub fn is_as_built(&self) -> bool {
        matches!(self.key.orientation(), Orientation::AsBuilt | Orientation::NoKey)
    }

    /// The pose was found with the dots themselves: where it puts each of them.
    pub fn expect_at(&mut self, optics: &SensorOptics, models: &[DotModel]) {
        for (track, model) in self.dots.tracks.iter_mut().zip(models) {
            let at = optics.project(model.surface_mm).ok().map(|center| center + track.offset_px);
            track.expected_px = track.expected_px.and(at);
            track.displaced_px = track.off_px().or(track.displaced_px);
        }
    }

    fn find_predicted(&mut self, frame: &DotFrame<'_, '_>) {
        let models = &frame.model.dots;
        let wanted = self.dots.tracks.iter().filter(|t| t.is_wanted());
        let (known, wanted) =
            wanted.fold((0, 0), |(known, all), t| (known + usize::from(t.displaced_px.is_some()), all + 1));
        let mut search = self.dots.search(frame.plane, models);
        search.follow(self.turn);
        self.turn = self.turn.wrapping_add(1);
        search.spread();
        let torn = search.check();
        let found = self.dots.found();
        self.since_search = self.since_search.saturating_add(1);
        let few = 4 * found < 3 * known.max(1) || (known == 0 && wanted > 0);
        // What moved by half of the spacing or more between two frames leaves gaps around it, or fills the key's.
        let lost =
            self.dots.tracks.iter().filter(|t| t.is_wanted() && t.last_px.is_some() && t.spot.is_none());
        let has_vanished = lost.clone().any(|track| track.state == MarkState::Lost);
        let has_jumped = lost.count() > (known / SUDDENLY_LOST).max(1) || torn > 0;
        let is_open = self.since_search >= OPEN_EVERY && self.dots.tracks.iter().any(|t| t.is_unsure);
        let is_filled = self.is_key_filled(frame);
        let due = self.search_every > 0 && self.since_search >= self.search_every;
        let identify = few || has_jumped || is_filled || is_open;
        if identify || due || has_vanished {
            self.search_frame(frame, identify, is_filled);
        }
    }

    /// Whether a dot is where the key's gap was a frame ago.
    fn is_key_filled(&mut self, frame: &DotFrame<'_, '_>) -> bool {
        let Some(key) = &frame.model.key else { return false };
        let (plane, models, optics) = (frame.plane, frame.model.dots.as_slice(), frame.optics);
        let Dots { meter, tracks, .. } = &mut self.dots;
        self.key.is_filled(&mut KeyFrame { plane, meter, key, models, tracks, optics })
    }

    /// The whole frame: for dots that were not found where they should be, and for blobs that are no dots.
    fn search_frame(&mut self, frame: &DotFrame<'_, '_>, identify: bool, is_filled: bool) {
        let &DotFrame { plane, mask, model, optics, .. } = frame;
        let models = &model.dots;
        let blobs = self.scan.dark_blobs(plane, |y| mask.span(y));
        // More blobs than dots could make are noise. Nothing is known of false dots then.
        let Some(blobs) = blobs else { return };
        self.since_search = 0;
        self.searched = true;
        if identify {
            let key_px = model.key.as_ref().and_then(|key| optics.project(key.dot.surface_mm).ok());
            self.matcher.take(blobs, [plane.width(), plane.height()]);
            self.choice.choose(&mut self.matcher, blobs, model, &self.dots.tracks, key_px);
            if self.choice.is_new {
                let matched = &self.choice.blob_of;
                let at = |blob: usize| blobs.get(blob).map(|blob: &DarkBlob| blob.at_px);
                self.dots.measure_at(plane, models, |dot| matched.get(dot).copied().flatten().and_then(at));
                let mut search = self.dots.search(plane, models);
                search.spread();
                search.check();
                // Numbers are given anew: the key is asked again.
                self.key.forget();
            } else if is_filled {
                // No other numbering is better: it is dirt.
                self.key.look_away();
            }
            for (track, is_unsure) in self.dots.tracks.iter_mut().zip(&self.choice.is_unsure) {
                track.is_unsure = *is_unsure;
            }
        }
        find_false_dots(blobs, models, &self.dots.tracks, &mut self.false_dots);
    }

    /// A frame in which nothing was looked for.
    pub fn miss(&mut self) -> DotsFound<'_> {
        self.searched = false;
        self.false_dots.clear();
        for track in &mut self.dots.tracks {
            track.lose(track.absent());
            track.motion_px = None;
        }
        self.forget_last();
        self.found()
    }

    /// What was found in the last frame.
    pub fn found(&self) -> DotsFound<'_> {
        DotsFound {
            tracks: &self.dots.tracks,
            searched: self.searched,
            false_dots: &self.false_dots,
            orientation: self.key.orientation(),
        }
    }

    /// The last frame does not count: the next one has nothing to be followed from.
    pub fn forget_last(&mut self) {
        self.dots.tracks.iter_mut().for_each(DotTrack::forget_last);
    }

    /// Forgets all frames.
    pub fn restart(&mut self) {
        self.forget_last();
        self.dots.tracks.fill(DotTrack::default());
        self.prediction = DotPrediction::default();
        self.turn = 0;
        self.key.restart();
        self.vanished.restart();
    }
}
