//! How the picture lies: where the gap is that the pattern's key leaves.
//!
//! A symmetric pattern looks the same turned or mirrored but for its key. Where dots are followed, the gap is looked for
//! at the key and at its images, each where the dots around it put it. Where they are not, because the picture is turned
//! by an angle at which nothing fits, the dark blobs of the whole frame are compared with the dots at rest, turned by
//! each angle.

use std::f64::consts::{PI, TAU};

use glam::DVec2;

use super::dot_track::DotTrack;
use super::skin;
use crate::track::frame::Plane;
use crate::track::marks::{DarkBlob, SpotFault, SpotMeter, SpotOutline};
use crate::track::model::{DotModel, KeyModel};
use domecast_optics::SensorOptics;
use domecast_optics::camera::LensSpec;

/// A place is looked at within this part of the dots' spacing.
const REACH: f64 = 0.35;
/// The key is asked where this share of the dots that should be seen is found: fewer may be numbered at random.
const MIN_FOUND: f64 = 0.75;
/// Frames between two comparisons of all blobs with all turns.
const SEARCH_EVERY: u32 = 15;
/// Turns that are compared.
const TURNS: usize = 720;
/// A blob is a dot's within this part of its spacing.
const BLOB_REACH: f64 = 0.22;
/// A turn explains the frame where this share of its dots meets blobs, and rivals the best with this share of its dots.
const MIN_MET: f64 = 0.7;
const RIVAL: f64 = 0.9;
/// A peak is the highest of so many turns on each side.
const PEAK: usize = 10;
/// Dots that a turn is refined by, and blobs beyond which a frame is noise, as a multiple of its dots.
const REFINED_DOTS: usize = 400;
const MAX_BLOBS_PER_DOT: usize = 8;
/// Turns nearer than this are one, rad; a picture turned by less is not called turned.
const ONE_TURN_RAD: f64 = 0.1;

/// How a picture is turned against the constants' camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraTurn {
    /// From image x towards image y, rad, from 0 to a full turn; after the mirroring, if there is one.
    pub turned_rad: f64,
    /// Whether it is mirrored left to right.
    pub is_mirrored: bool,
}

/// How the picture lies against the constants' camera.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Orientation {
    /// The constants name no key, or the user says how it lies.
    #[default]
    NoKey,
    /// As the constants have it.
    AsBuilt,
    /// The gap is not seen, or more than one.
    Unsure,
    /// Turned, or mirrored.
    Turned(CameraTurn),
}

/// One frame, as the key is looked for in it.
pub(super) struct KeyFrame<'a, 'b> {
    pub plane: &'a Plane<'b>,
    pub meter: &'a mut SpotMeter,
    pub key: &'a KeyModel,
    pub models: &'a [DotModel],
    /// After the search.
    pub tracks: &'a [DotTrack],
    /// At the pose.
    pub optics: &'a SensorOptics,
}

/// What is at a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Found {
    Dot,
    Gap,
    Unclear,
}

impl KeyFrame<'_, '_> {
    /// What is where the found dots around a dot put it.
    fn look(&mut self, model: &DotModel, expected_px: DVec2, outline: &SpotOutline) -> Found {
        let at = |other: usize| self.tracks[other].expected_px;
        let by = |other: usize| self.tracks[other].off_px();
        let lead = skin::beside(model, expected_px, usize::MAX, self.models, at, by);
        let Some(lead) = lead.filter(|lead| lead.neighbors >= 2) else { return Found::Unclear };
        match self.meter.measure(
            self.plane,
            expected_px + lead.displaced_px,
            outline,
            REACH * model.spacing_px,
            None,
        ) {
            Ok(_) => Found::Dot,
            Err(SpotFault::Faint | SpotFault::Strayed) => Found::Gap,
            Err(SpotFault::NoGround | SpotFault::Misshapen) => Found::Unclear,
        }
    }

    fn at_dot(&mut self, index: usize) -> Found {
        let track = &self.tracks[index];
        match (track.spot, track.expected_px) {
            (Some(_), _) => Found::Dot,
            (None, Some(expected_px)) if track.is_wanted() => {
                let outline = track.outline;
                self.look(&self.models[index], expected_px, &outline)
            }
            _ => Found::Unclear,
        }
    }

    fn at_key(&mut self) -> Found {
        let key = self.key;
        let Ok(center) = self.optics.project(key.dot.surface_mm) else { return Found::Unclear };
        let Some((offset, outline)) = key.dot.image_at(self.optics, center) else { return Found::Unclear };
        self.look(&key.dot, center + offset, &outline)
    }

    /// Where the one gap is; `None` where the dots are too few to be asked. `is_trusted`: the camera was as built before, so
    /// that other gaps are lost dots.
    fn orientation(&mut self, is_trusted: bool) -> Option<Orientation> {
        let (mut wanted, mut found) = (0.0, 0.0);
        for track in self.tracks.iter().filter(|track| track.is_wanted() && track.expected_px.is_some()) {
            wanted += 1.0;
            found += if track.spot.is_some() { 1.0 } else { 0.0 };
        }
        if wanted == 0.0 || found < MIN_FOUND * wanted {
            return None;
        }
        let key = self.key;
        let own = self.at_key();
        let (mut gaps, mut turn) = (u32::from(own == Found::Gap), None);
        let mut dots = 0;
        for (turned_rad, is_mirrored, index) in &key.images {
            match self.at_dot(*index) {
                Found::Gap => {
                    gaps += 1;
                    turn = Some(CameraTurn { turned_rad: *turned_rad, is_mirrored: *is_mirrored });
                }
                Found::Dot => dots += 1,
                Found::Unclear => {}
            }
        }
        if own == Found::Unclear && gaps == 0 {
            return None;
        }
        // Where a place cannot be looked at, the others must speak for it.
        let clear = 2 * dots >= key.images.len();
        Some(match (gaps, own, turn) {
            (_, Found::Gap, _) if is_trusted => Orientation::AsBuilt,
            (1, Found::Gap, _) if clear => Orientation::AsBuilt,
            (1, Found::Dot, Some(turn)) if clear => Orientation::Turned(turn),
            _ => Orientation::Unsure,
        })
    }
}

/// Asks the key until it is sure; keeps its buffer.
#[derive(Debug, Clone)]
pub(super) struct KeyCheck {
    orientation: Orientation,
    /// The user says how the picture lies: being unsure is no fault.
    is_given: bool,
    /// Whether it once lay as the constants have it.
    was_as_built: bool,
    /// Whether there is dirt on the key.
    is_dirty: bool,
    since_search: u32,
    size: [usize; 2],
    /// Pixels near a blob.
    near: Vec<bool>,
}

impl KeyCheck {
    /// For frames of one size; `is_given`: the user says how the picture lies.
    pub fn new(is_given: bool, width: usize, height: usize) -> Self {
        let near = vec![false; width * height];
        Self {
            orientation: Orientation::NoKey,
            is_given,
            was_as_built: false,
            is_dirty: false,
            since_search: u32::MAX,
            size: [width, height],
            near,
        }
    }

    /// What is known.
    pub fn orientation(&self) -> Orientation {
        match self.orientation {
            Orientation::Unsure if self.is_given => Orientation::NoKey,
            orientation => orientation,
        }
    }

    /// Whether the key need not be asked again.
    pub fn is_sure(&self) -> bool {
        self.orientation == Orientation::AsBuilt
    }

    /// The numbers of the dots are given anew.
    pub fn forget(&mut self) {
        if self.orientation == Orientation::AsBuilt {
            self.orientation = Orientation::NoKey;
        }
        self.since_search = u32::MAX;
    }

    /// Whether a dot is where the gap was a frame ago: all numbers may be off by one then.
    pub fn is_filled(&self, frame: &mut KeyFrame<'_, '_>) -> bool {
        self.is_sure() && !self.is_dirty && frame.at_key() == Found::Dot
    }

    /// There is dirt on the key: it says nothing from now on.
    pub fn look_away(&mut self) {
        self.is_dirty = true;
    }

    /// Looks for the gap among the dots of a frame.
    pub fn test(&mut self, frame: &mut KeyFrame<'_, '_>) {
        let turned = matches!(self.orientation, Orientation::Turned(_));
        match frame.orientation(self.was_as_built) {
            // What the whole frame said stands until the dots say something.
            None | Some(Orientation::Unsure) if turned => {}
            Some(orientation) => self.orientation = orientation,
            // A camera that was mounted right is not turned because a hand covers the dots.
            None if self.was_as_built => self.orientation = Orientation::NoKey,
            None => self.orientation = Orientation::Unsure,
        }
        self.was_as_built |= self.is_sure();
    }

    /// Forgets all frames.
    pub fn restart(&mut self) {
        self.forget();
        (self.orientation, self.was_as_built, self.is_dirty) = (Orientation::NoKey, false, false);
    }

    /// Whether the whole frame should be compared with all turns.
    pub fn wants_search(&mut self) -> bool {
        self.since_search = self.since_search.saturating_add(1);
        self.orientation == Orientation::Unsure && self.since_search >= SEARCH_EVERY
    }

    /// Compares the blobs of the whole frame with the dots at rest, turned by each angle, mirrored and not. One turn that
    /// explains them, and at whose key there is a gap, is how the picture lies.
    pub fn search(&mut self, blobs: &[DarkBlob], key: &KeyModel, models: &[DotModel], lens: &LensSpec) {
        self.since_search = 0;
        if blobs.len() > MAX_BLOBS_PER_DOT * models.len() {
            return;
        }
        let reach_px = BLOB_REACH * models.iter().map(|model| model.spacing_px).fold(f64::INFINITY, f64::min);
        self.mark(blobs, reach_px);
        let [[_, _, cx], [_, _, cy], _] = lens.matrix;
        let center = DVec2::new(cx, cy);
        let met = |index: usize| {
            models.iter().filter(|model| self.is_near(turned(model.rest_px, turn_of(index), center))).count()
        };
        let mut counts = [0; 2 * TURNS];
        for (index, count) in counts.iter_mut().enumerate() {
            *count = met(index);
        }
        let Some(best) = counts.iter().copied().max() else { return };
        if (best as f64) < MIN_MET * models.len() as f64 {
            return;
        }
        // The best of each run of turns that rival the best, at whose key there is a gap.
        let mut gaps: [Option<CameraTurn>; 2] = [None; 2];
        for index in 0..counts.len() {
            let beside = |step: usize| {
                let half = index / TURNS * TURNS;
                counts[half + (index - half + step) % TURNS]
            };
            let is_top =
                (1..=PEAK).all(|step| beside(step) <= counts[index] && beside(TURNS - step) < counts[index]);
            let rivals = counts[index] as f64 >= RIVAL * best as f64;
            if !(rivals && is_top) {
                continue;
            }
            let turn = self.refined(turn_of(index), center, blobs, models);
            if !self.is_near(turned(key.dot.rest_px, turn, center)) {
                gaps = [gaps[1], Some(turn)];
                if gaps[0].is_some() {
                    return;
                }
            }
        }
        let [None, Some(turn)] = gaps else { return };
        let away = (turn.turned_rad + PI).rem_euclid(TAU) - PI;
        if turn.is_mirrored || away.abs() > ONE_TURN_RAD {
            self.orientation = Orientation::Turned(turn);
        }
    }

    /// The turn that brings the dots nearest to the blobs: a few steps of least squares.
    fn refined(
        &self,
        start: CameraTurn,
        center: DVec2,
        blobs: &[DarkBlob],
        models: &[DotModel],
    ) -> CameraTurn {
        let mut turn = start;
        let step = models.len().div_ceil(REFINED_DOTS).max(1);
        for _ in 0..3 {
            let (mut across, mut square) = (0.0, 0.0);
            for model in models.iter().step_by(step) {
                let place = turned(model.rest_px, turn, center);
                let reach = 2.0 * BLOB_REACH * model.spacing_px;
                let away = blobs.iter().map(|blob| blob.at_px - place);
                let nearest = away.min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
                if let Some(away) = nearest.filter(|away| away.length() < reach) {
                    across += (place - center).perp_dot(away);
                    square += (place - center).length_squared();
                }
            }
            if square > 0.0 {
                turn.turned_rad = (turn.turned_rad + across / square).rem_euclid(TAU);
            }
        }
        turn
    }

    fn mark(&mut self, blobs: &[DarkBlob], reach_px: f64) {
        self.near.fill(false);
        let [width, height] = self.size;
        for blob in blobs {
            let at = blob.at_px;
            let rows =
                (at.y - reach_px).max(0.0).ceil() as usize..((at.y + reach_px) as usize + 1).min(height);
            for y in rows {
                let half = (reach_px * reach_px - (y as f64 - at.y).powi(2)).max(0.0).sqrt();
                let (start, end) = ((at.x - half).max(0.0).ceil() as usize, (at.x + half) as usize + 1);
                let end = end.min(width);
                if start < end {
                    self.near[y * width + start..y * width + end].fill(true);
                }
            }
        }
    }

    fn is_near(&self, at: DVec2) -> bool {
        let (x, y) = (at.x.round(), at.y.round());
        let [width, height] = self.size.map(|v| v as f64);
        let inside = x >= 0.0 && y >= 0.0 && x < width && y < height;
        inside && self.near[y as usize * self.size[0] + x as usize]
    }
}

/// Where a picture that is so turned about the centre shows a place.
fn turned(place: DVec2, turn: CameraTurn, center: DVec2) -> DVec2 {
    let from = place - center;
    let from = if turn.is_mirrored { DVec2::new(-from.x, from.y) } else { from };
    center + DVec2::from_angle(turn.turned_rad).rotate(from)
}

/// The turn of a number.
fn turn_of(index: usize) -> CameraTurn {
    CameraTurn { turned_rad: TAU * (index % TURNS) as f64 / TURNS as f64, is_mirrored: index >= TURNS }
}
