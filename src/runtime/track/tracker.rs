//! The state that goes from frame to frame, and the order of the steps.

use glam::{DVec2, DVec3};
use nalgebra::Matrix6;

use super::dots::{DotSearch, DotTrack};
use super::error::TrackError;
use super::frame::{Frame, Plane};
use super::identify::Identifier;
use super::image::flow::Flow;
use super::image::scan::{Scan, ScanSettings};
use super::image::spot::SpotMeter;
use super::light::{Glance, Light, sharpness};
use super::model::SensorModel;
use super::options::{Motion, Reference, Thresholds, TrackOptions};
use super::refine::{Refined, Seen, refine};
use super::result::{DotResult, MOST_FALSE_DOTS, MarkerResult, Tracked};
use super::springs::Springs;
use super::status::{MarkState, Problem};
use super::surplus::Surplus;
use super::tilt::Tilt;
use super::whites::{Disc, View};
use crate::constants::Constants;
use domecast_optics::numeric::Rigid;
use domecast_optics::pose::{Sighting, displacement_from_motion};
use domecast_optics::{RayLimit, SensorOptics, SurfacePoint};
use domecast_springs::Displacement;

/// How far from where the last pose puts it a white marker is looked for, in parts of the dots' spacing, when it is
/// not at once in place; and where there are no dots, px.
const MARKER_REACH: f64 = 0.9;
const MARKER_REACH_PX: f64 = 14.0;
/// A fit may go so far from its candidate, px.
const FIT_REACH_PX: f64 = 4.0;
/// Markers that are looked for again from the pose of the others.
const MOST_AGAIN: usize = 8;
/// Candidates for each marker, and combinations of them that are tried.
const CANDIDATES: usize = 4;
/// Places that are tried for them: most are no discs.
const PLACES: usize = 12;
const MOST_COMBINATIONS: usize = 96;
/// Offsets of centroids from centres change with the pose, by a few hundredths of a pixel a millimetre. After a move of
/// the first length (mm; a turn counts at ten millimetres) each frame finds some of them anew, the oldest first; after
/// one of the second, all at once.
const RENEW_SOME_MM: f64 = 0.02;
const RENEW_ALL_MM: f64 = 0.6;
/// Part of the dots that one frame finds offsets anew for.
const RENEWED_PART: usize = 8;
/// Dots whose rays are traced at a time.
const TRACE_RUN: usize = 1024;
/// A spread wider than expected by this factor is blur.
const BLURRED: f64 = 1.7;
/// Contrast below which there is nothing to see, levels.
const LEAST_CONTRAST: u8 = 10;
/// A sharp edge takes at least this part of a frame's contrast in four pixels.
const LEAST_SHARPNESS: f64 = 0.45;
/// A part of the dots that should be seen, lost, that is worth a word.
const LOST_PART: f64 = 0.05;

/// Follows one sensor's marks through its frames.
#[derive(Debug, Clone)]
pub struct Tracker {
    options: TrackOptions,
    model: SensorModel,
    /// The optics at the last pose.
    optics: SensorOptics,
    meter: SpotMeter,
    scan: Scan,
    identifier: Identifier,
    flow: Option<Flow>,
    glance: Glance,
    tracks: Vec<DotTrack>,
    order: Vec<usize>,
    scratch: Vec<f64>,
    /// Dots that were found, their centres in the image, and where those are on the dome.
    found: Vec<usize>,
    centers: Vec<DVec2>,
    hits: Vec<Result<SurfacePoint, RayLimit>>,
    seen: Vec<Seen>,
    discs: Vec<Option<Disc>>,
    /// How the light falls off across each marker.
    tilts: Vec<Tilt>,
    /// The last pose that was found.
    pose: Option<Rigid>,
    /// The oldest pose that an offset may be for, the one that the newest are for, and the dot whose turn is next.
    offsets_from: Option<Rigid>,
    offsets_at: Option<Rigid>,
    next_offset: usize,
    last_number: Option<u64>,
    since_search: u32,
    reference: ReferenceSum,
    surplus: Surplus,
    result: Tracked,
}

/// What the reference frames showed.
#[derive(Debug, Clone, Default)]
struct ReferenceSum {
    frames: u32,
    wrench: [f64; 6],
    displacement: Vec<(DVec3, u32)>,
}

impl Tracker {
    /// A tracker for the sensor that the constants describe.
    ///
    /// # Errors
    /// [`TrackError`] names the first field of the constants that cannot be used.
    pub fn new(constants: &Constants, options: TrackOptions) -> Result<Self, TrackError> {
        let gates = [options.most_residual_px, options.most_misplaced];
        if gates.iter().any(|v| !(*v > 0.0 && *v < 1e6)) {
            return Err(TrackError::at("options", "need gates above zero"));
        }
        let model = SensorModel::new(constants, options.most_residual_px)?;
        let (width, height) = (constants.camera.width as usize, constants.camera.height as usize);
        let mut meter = SpotMeter::default();
        for dot in &model.dots {
            // Under load a dot's image grows and shrinks by some tenths.
            let mut radius = 0.6 * dot.shape.radius_px;
            while radius < 1.6 * dot.shape.radius_px {
                meter.prepare(radius);
                radius += 0.2;
            }
            meter.prepare(1.6 * dot.shape.radius_px);
        }
        let dots = model.dots.len();
        let result = Tracked {
            black_dots: model.dots.iter().map(|d| DotResult { id: d.id, ..DotResult::default() }).collect(),
            white_markers: model
                .markers
                .iter()
                .map(|m| MarkerResult { id: m.id, ..MarkerResult::default() })
                .collect(),
            false_dots: Vec::with_capacity(MOST_FALSE_DOTS),
            ..Tracked::default()
        };
        Ok(Self {
            optics: model.optics.clone(),
            meter,
            scan: Scan::new(width, height),
            identifier: Identifier::new(dots, 1 << 15),
            flow: (options.motion == Motion::LucasKanade)
                .then(|| Flow::new(width, height, options.pyramid_levels)),
            glance: Glance::default(),
            tracks: vec![DotTrack::default(); dots],
            order: Vec::with_capacity(dots),
            scratch: Vec::with_capacity(dots),
            found: Vec::with_capacity(dots),
            centers: Vec::with_capacity(dots),
            hits: Vec::with_capacity(dots),
            seen: Vec::with_capacity(model.markers.len()),
            discs: vec![None; model.markers.len()],
            tilts: vec![Tilt::default(); model.markers.len()],
            pose: None,
            offsets_from: None,
            offsets_at: None,
            next_offset: 0,
            last_number: None,
            since_search: u32::MAX,
            surplus: Surplus::new(model.markers.len()),
            reference: ReferenceSum { displacement: vec![(DVec3::ZERO, 0); dots], ..ReferenceSum::default() },
            result,
            model,
            options,
        })
    }

    /// What the last frame told.
    pub fn result(&self) -> &Tracked {
        &self.result
    }

    /// The sensor's optics at rest.
    pub fn optics(&self) -> &SensorOptics {
        &self.model.optics
    }

    /// The springs' law, where the constants have one.
    pub fn springs(&self) -> Option<&Springs> {
        self.model.springs.as_ref()
    }

    /// Whether a pixel is inside of the runtime's circle.
    pub fn mask_holds(&self, at_px: DVec2) -> bool {
        self.model.mask.holds(at_px)
    }

    /// Forgets everything but the constants, the reference too.
    pub fn restart(&mut self) {
        self.forget_last();
        self.pose = None;
        self.last_number = None;
        self.surplus.forget();
        self.tilts.fill(Tilt::default());
        self.tracks.fill(DotTrack::default());
        self.reference.frames = 0;
        self.reference.wrench = [0.0; 6];
        self.reference.displacement.fill((DVec3::ZERO, 0));
    }

    fn forget_last(&mut self) {
        for track in &mut self.tracks {
            track.last_px = None;
        }
        self.glance.forget();
        if let Some(flow) = &mut self.flow {
            flow.forget();
        }
    }

    /// A frame that could not be had (a broken file, a cut stream): its number is used up, nothing else changes.
    pub fn skip(&mut self, number: u64) -> &Tracked {
        self.begin(number);
        self.result.problems.add(Problem::Unreadable);
        self.end_unseen();
        &self.result
    }

    fn begin(&mut self, number: u64) {
        let result = &mut self.result;
        result.frame = number;
        result.problems = Default::default();
        (result.pose, result.pose_sd, result.pose_rms_px) = (None, None, None);
        (result.wrench, result.wrench_sd) = (None, None);
        result.searched = false;
        result.false_dots.clear();
        for marker in &mut result.white_markers {
            let seen = marker.state != MarkState::Missing;
            let state = if seen { MarkState::Lost } else { MarkState::Missing };
            *marker = MarkerResult { id: marker.id, state, ..MarkerResult::default() };
        }
        if self.last_number.is_some_and(|last| number != last.wrapping_add(1)) {
            result.problems.add(Problem::Gap);
            self.forget_last();
        }
        self.last_number = Some(number);
    }

    /// Ends a frame in which nothing was looked for.
    fn end_unseen(&mut self) {
        for (track, dot) in self.tracks.iter_mut().zip(&mut self.result.black_dots) {
            track.spot = None;
            track.state = if track.ever_seen { MarkState::Lost } else { MarkState::Missing };
            *dot = DotResult { id: dot.id, state: track.state, ..DotResult::default() };
        }
        self.forget_last();
    }

    /// Takes the next frame in. Numbers that leave one out are a gap; nothing else depends on them.
    pub fn track(&mut self, number: u64, frame: &Frame<'_>) -> &Tracked {
        self.begin(number);
        let spec = self.model.optics.lens().spec();
        if frame.width() != spec.width as usize || frame.height() != spec.height as usize {
            self.result.problems.add(Problem::WrongSize);
            self.end_unseen();
            return &self.result;
        }
        let plane = frame.plane(self.options.channel);
        let light = self.glance.look(&plane, &self.model.mask);
        let contrast = light.high.saturating_sub(light.low);
        if light.same {
            self.result.problems.add(Problem::Frozen);
        }
        if light.high < 24 {
            self.result.problems.add(Problem::Dark);
        }
        if light.saturated > 0.5 {
            self.result.problems.add(Problem::Saturated);
        }
        if contrast < LEAST_CONTRAST {
            if self.result.problems.is_empty() {
                self.result.problems.add(Problem::NoMarks);
            }
            self.end_unseen();
            return &self.result;
        }
        if let Some(flow) = &mut self.flow {
            let has_last = self.tracks.iter().any(|t| t.last_px.is_some());
            flow.take(&plane, has_last);
        }
        let refined = self.find_pose(&plane);
        self.place_dots();
        self.find_dots(&plane);
        self.tell(&plane, &light, refined.as_ref());
        &self.result
    }

    /// The pose from the white markers: where the last one puts them, or from anywhere.
    fn find_pose(&mut self, plane: &Plane<'_>) -> Option<Refined> {
        let mut refined = None;
        if let Some(pose) = self.pose {
            self.markers_near(plane, &pose);
            refined = self.refine_seen(&pose);
            if let Some(found) = &refined
                && self.discs.iter().any(Option::is_none)
            {
                let found = found.pose;
                refined = self.markers_left(plane, &found).or(refined);
            }
        }
        if refined.is_none() {
            refined = self.markers_anywhere(plane);
        }
        match &refined {
            Some(found) => self.pose = Some(found.pose),
            None => {
                let seen = self.discs.iter().flatten().count();
                let few = seen < self.model.markers.len();
                self.result.problems.add(if few {
                    Problem::MarkersMissing
                } else {
                    Problem::MarkersDoNotFit
                });
                if let Some(pose) = self.pose {
                    // It was movable a frame ago; if not, the optics stay where they are.
                    let _ = self.optics.move_to(&pose);
                }
            }
        }
        refined
    }

    fn refine_seen(&mut self, start: &Rigid) -> Option<Refined> {
        self.seen.clear();
        let found = self.model.markers.iter().zip(&self.discs);
        self.seen.extend(found.filter_map(|(marker, disc)| {
            disc.map(|d| Seen { marker: *marker, centroid_px: d.centroid_px, sd_px: d.sd_px })
        }));
        let refined = refine(&mut self.optics, &self.seen, start)?;
        let reach = refined.pose.translation_mm.length() < 20.0;
        (refined.rms_px <= self.options.most_residual_px && reach).then_some(refined)
    }

    fn markers_near(&mut self, plane: &Plane<'_>, pose: &Rigid) {
        if self.optics.move_to(pose).is_err() {
            self.discs.fill(None);
            return;
        }
        let spacing = self.model.dots.first().map_or(MARKER_REACH_PX, |d| MARKER_REACH * d.spacing_px);
        let white = self.white();
        for ((marker, disc), tilt) in self.model.markers.iter().zip(&mut self.discs).zip(&self.tilts) {
            let tilt = tilt.known();
            let levels = disc.take().map(|d| d.levels);
            let Ok(image) = marker.image(&self.optics) else { continue };
            let Some(view) = View::new(&self.optics, marker) else { continue };
            let start = image.centroid_px;
            *disc = view.fit(plane, start, FIT_REACH_PX, levels, tilt);
            if disc.is_none() {
                let mut best = [(0.0, DVec2::ZERO); 1];
                if view.candidates(plane, start, spacing, white, &mut best) > 0 {
                    *disc = view.fit(plane, best[0].1, FIT_REACH_PX, None, tilt);
                }
            }
        }
    }

    /// Looks for the markers that were not found where the pose of the others puts them; `None` if none is there.
    fn markers_left(&mut self, plane: &Plane<'_>, pose: &Rigid) -> Option<Refined> {
        self.optics.move_to(pose).ok()?;
        let mut more = [None; MOST_AGAIN];
        let mut count = 0;
        for (index, (marker, disc)) in self.model.markers.iter().zip(&mut self.discs).enumerate() {
            if disc.is_some() || count == MOST_AGAIN {
                continue;
            }
            let Ok(image) = marker.image(&self.optics) else { continue };
            let Some(view) = View::new(&self.optics, marker) else { continue };
            *disc = view.fit(plane, image.centroid_px, FIT_REACH_PX, None, self.tilts[index].known());
            if disc.is_some() {
                more[count] = Some(index);
                count += 1;
            }
        }
        if count == 0 {
            return None;
        }
        let refined = self.refine_seen(pose);
        if refined.is_none() {
            // What was there was no marker.
            for index in more.into_iter().flatten() {
                self.discs[index] = None;
            }
            self.refine_seen(pose)
        } else {
            refined
        }
    }

    fn white(&self) -> Option<u8> {
        match self.options.thresholds {
            Thresholds::Adaptive => None,
            Thresholds::Fixed { white, .. } => Some(white),
        }
    }

    /// Candidates over all that the platform can reach; the combination that fits best.
    fn markers_anywhere(&mut self, plane: &Plane<'_>) -> Option<Refined> {
        self.discs.fill(None);
        let rest = Rigid::identity();
        let count = self.model.markers.len();
        if count != 4 {
            // More markers than the paper's four: the nearest to rest, or to the last pose, will do.
            let start = self.pose.unwrap_or(rest);
            self.markers_near(plane, &start);
            return self.refine_seen(&start);
        }
        // A platform pressed down shows its markers larger: each is looked at as at rest, half way down, and down.
        let mut views = [[None; 4]; 3];
        for (views, part) in views.iter_mut().zip([0.0, 0.5, 1.0]) {
            let down = DVec3::new(0.0, 0.0, -part * self.model.deepest_mm);
            if self.optics.move_to(&Rigid::new(glam::DMat3::IDENTITY, down)).is_ok() {
                for (view, marker) in views.iter_mut().zip(&self.model.markers) {
                    *view = View::new(&self.optics, marker);
                }
            }
        }
        let mut found: [[Option<Disc>; CANDIDATES]; 4] = [[None; CANDIDATES]; 4];
        for index in 0..4 {
            let view = views[1][index].or(views[0][index])?;
            let mut places = [(0.0, DVec2::ZERO); PLACES];
            let (start, reach) = (self.model.markers_px[index], self.model.markers_reach_px[index]);
            let n = view.candidates(plane, start, reach, self.white(), &mut places);
            let mut next = 0;
            for (_, at) in &places[..n] {
                if next == CANDIDATES {
                    break;
                }
                let fits = views
                    .iter()
                    .filter_map(|views| views[index]?.fit(plane, *at, FIT_REACH_PX, None, DVec2::ZERO));
                if let Some(disc) = fits.min_by(|a, b| a.misfit.total_cmp(&b.misfit)) {
                    found[index][next] = Some(disc);
                    next += 1;
                }
            }
            self.discs[index] = found[index][0];
        }
        if found.iter().any(|list| list[0].is_none()) {
            return None;
        }
        let mut best: Option<(Refined, [usize; 4])> = None;
        let mut tried = 0;
        // Best candidates first: by the sum of their places in the lists.
        for rank in 0..=4 * (CANDIDATES - 1) {
            for code in 0..CANDIDATES.pow(4) {
                let choice: [usize; 4] =
                    std::array::from_fn(|i| code / CANDIDATES.pow(i as u32) % CANDIDATES);
                let usable = choice.iter().enumerate().all(|(i, c)| found[i][*c].is_some());
                if choice.iter().sum::<usize>() != rank || !usable || tried == MOST_COMBINATIONS {
                    continue;
                }
                tried += 1;
                for (index, disc) in self.discs.iter_mut().enumerate() {
                    *disc = found[index][choice[index]];
                }
                if let Some(refined) = self.refine_seen(&rest)
                    && best.as_ref().is_none_or(|(b, _)| refined.rms_px < b.rms_px)
                {
                    best = Some((refined, choice));
                }
            }
            // The first choices fitting well need no rivals.
            if best.as_ref().is_some_and(|(b, _)| b.rms_px < 0.25 * self.options.most_residual_px) {
                break;
            }
        }
        let (coarse, choice) = best.or_else(|| {
            for (index, disc) in self.discs.iter_mut().enumerate() {
                *disc = found[index][0];
            }
            None
        })?;
        // Fitted again as they look from there; and asked whether another pose fits as well.
        self.optics.move_to(&coarse.pose).ok()?;
        for index in 0..4 {
            let view = View::new(&self.optics, &self.model.markers[index]);
            let seen = found[index][choice[index]]?;
            let at = seen.centroid_px;
            // Before any frame has told how the light falls off, this one does.
            let mut tilt = self.tilts[index];
            tilt.add(seen.tilt);
            let tilt = tilt.known();
            self.discs[index] =
                view.and_then(|v| v.fit(plane, at, FIT_REACH_PX, None, tilt)).or(found[index][choice[index]]);
        }
        let refined = self.refine_seen(&coarse.pose)?;
        let mut sightings = [Sighting { id: 0, centroid_px: DVec2::ZERO }; 4];
        for (to, from) in sightings.iter_mut().zip(&self.seen) {
            *to = Sighting { id: from.marker.id, centroid_px: from.centroid_px };
        }
        if self.model.solver.solve(&sightings).is_ok_and(|estimate| estimate.is_ambiguous()) {
            self.result.problems.add(Problem::AmbiguousPose);
        }
        Some(refined)
    }

    /// Where the pose puts each dot on the undeformed dome.
    fn place_dots(&mut self) {
        let Some(pose) = self.pose else { return };
        let is_all_old =
            self.offsets_from.as_ref().is_none_or(|from| distance_mm(from, &pose) > RENEW_ALL_MM);
        let is_some_old = self.offsets_at.as_ref().is_none_or(|at| distance_mm(at, &pose) > RENEW_SOME_MM);
        let count = self.tracks.len();
        let part = count.div_ceil(RENEWED_PART);
        // A round over all dots that began after the last move ends it.
        let renewed = if is_all_old {
            0..count
        } else if is_some_old || self.next_offset > 0 {
            self.next_offset..(self.next_offset + part).min(count)
        } else {
            0..0
        };
        for (index, (track, model)) in self.tracks.iter_mut().zip(&self.model.dots).enumerate() {
            track.expected_px = None;
            track.state = MarkState::Hidden;
            let Ok(center) = self.optics.project(model.surface_mm) else { continue };
            // A dot that could not be seen whole when its turn was has no shape yet.
            if renewed.contains(&index) || track.shape.area_px == 0.0 {
                let Some((offset, shape)) = model.look(&self.optics, center) else { continue };
                (track.offset_px, track.shape) = (offset, shape);
            }
            let at = center + track.offset_px;
            track.expected_px = Some(at);
            if self.model.mask.holds(at + track.displaced_px.unwrap_or(DVec2::ZERO)) {
                track.state = MarkState::Missing;
            }
        }
        if is_all_old {
            (self.offsets_from, self.offsets_at, self.next_offset) = (Some(pose), Some(pose), 0);
        } else if !renewed.is_empty() {
            if renewed.start == 0 {
                // What the last round left is as old as its beginning.
                self.offsets_from = self.offsets_at.replace(pose);
            }
            self.next_offset = if renewed.end == count { 0 } else { renewed.end };
        }
    }

    fn find_dots(&mut self, plane: &Plane<'_>) {
        if self.pose.is_none() {
            for track in &mut self.tracks {
                track.spot = None;
            }
            return;
        }
        let known = self.tracks.iter().filter(|t| t.is_wanted() && t.displaced_px.is_some()).count();
        let wanted = self.tracks.iter().filter(|t| t.is_wanted()).count();
        let mut search = DotSearch {
            plane,
            meter: &mut self.meter,
            models: &self.model.dots,
            tracks: &mut self.tracks,
            order: &mut self.order,
        };
        search.follow(self.flow.as_ref());
        search.spread();
        search.check();
        let found = self.tracks.iter().filter(|t| t.spot.is_some()).count();
        self.since_search = self.since_search.saturating_add(1);
        let few = 4 * found < 3 * known.max(1) || (known == 0 && wanted > 0);
        let due = self.options.search_every > 0 && self.since_search >= self.options.search_every;
        if few || due {
            self.search_all(plane, few);
        }
        DotSearch {
            plane,
            meter: &mut self.meter,
            models: &self.model.dots,
            tracks: &mut self.tracks,
            order: &mut self.order,
        }
        .settle();
    }

    /// The whole frame: for dots that were not found where they should be, and for blobs that are no dots.
    fn search_all(&mut self, plane: &Plane<'_>, identify: bool) {
        let level = match self.options.thresholds {
            Thresholds::Adaptive => None,
            Thresholds::Fixed { black, .. } => Some(black),
        };
        let steps = self.options.steps;
        let settings = ScanSettings {
            blur: steps.blur,
            sharpen: steps.sharpen,
            open: steps.open,
            level,
            least_contrast: 0.12,
        };
        let mask = &self.model.mask;
        if self.scan.dark_blobs(plane, |y| mask.span(y), &settings).is_none() {
            // More blobs than dots could make: noise. Nothing is known of false dots then.
            return;
        }
        self.since_search = 0;
        self.result.searched = true;
        let blobs = self.scan.blobs();
        if identify {
            let size = [plane.width(), plane.height()];
            let count = self.identifier.identify(blobs, &self.model.dots, &self.tracks, size);
            let now = self.tracks.iter().filter(|t| t.spot.is_some()).count();
            if count > now {
                self.take_identified(plane);
            }
        }
        // A blob of a dot's size on which no dot stands.
        for blob in self.scan.blobs() {
            let mut own = false;
            let mut nearest = (f64::INFINITY, 0);
            for (index, track) in self.tracks.iter().enumerate() {
                let spacing = self.model.dots[index].spacing_px;
                own |= track.now_px().is_some_and(|p| p.distance(blob.at_px) < 0.4 * spacing);
                let from = track.expected_px.map_or(f64::INFINITY, |p| p.distance(blob.at_px));
                if from < nearest.0 {
                    nearest = (from, index);
                }
            }
            let Some(model) = self.model.dots.get(nearest.1).filter(|_| nearest.0.is_finite()) else {
                continue;
            };
            let part = blob.area_px / model.shape.area_px;
            let near = nearest.0 < 2.5 * model.spacing_px;
            if !own && near && (0.3..4.0).contains(&part) && self.result.false_dots.len() < MOST_FALSE_DOTS {
                self.result.false_dots.push(blob.at_px);
            }
        }
    }

    /// Measures each dot at its blob; the past is what the search said, not what was followed before.
    fn take_identified(&mut self, plane: &Plane<'_>) {
        for index in 0..self.tracks.len() {
            let track = &mut self.tracks[index];
            if !track.is_wanted() {
                continue;
            }
            track.spot = None;
            track.state = if track.ever_seen { MarkState::Lost } else { MarkState::Missing };
            let blob = self.identifier.blob_of.get(index).copied().flatten();
            let Some(blob) = blob.and_then(|b| self.scan.blobs().get(b)) else { continue };
            let shape = track.shape;
            if let Ok(spot) =
                self.meter.measure(plane, blob.at_px, &shape, 0.3 * self.model.dots[index].spacing_px)
            {
                track.spot = Some(spot);
                track.state = MarkState::Ok;
                track.start_px = Some(spot.at_px);
                if let Some(expected) = track.expected_px {
                    track.displaced_px = Some(spot.at_px - expected);
                }
            }
        }
        let mut search = DotSearch {
            plane,
            meter: &mut self.meter,
            models: &self.model.dots,
            tracks: &mut self.tracks,
            order: &mut self.order,
        };
        search.spread();
        search.check();
    }

    /// Fills the result.
    fn tell(&mut self, plane: &Plane<'_>, light: &Light, refined: Option<&Refined>) {
        self.tell_pose(refined);
        let known = refined.is_some();
        self.scratch.clear();
        self.found.clear();
        self.centers.clear();
        let result = &mut self.result;
        let dots = self.tracks.iter_mut().zip(&self.model.dots).zip(&mut result.black_dots);
        for (index, ((track, model), dot)) in dots.enumerate() {
            *dot = DotResult { id: model.id, state: track.state, ..DotResult::default() };
            if known && track.is_wanted() {
                dot.undeformed_px = track.expected_px.map(|p| p - track.offset_px);
            }
            let Some(spot) = track.spot else {
                track.last_px = None;
                continue;
            };
            let center = spot.at_px - track.offset_px;
            dot.centroid_px = Some(spot.at_px);
            dot.image_px = Some(center);
            dot.sd_px = Some(spot.sd_px);
            dot.motion_px = track.last_px.map(|last| spot.at_px - last);
            track.last_px = Some(spot.at_px);
            self.found.push(index);
            self.centers.push(center);
            self.scratch.push(spot.spread_px2 / track.shape.spread_px2.max(1e-9));
        }
        if known {
            self.hits.clear();
            self.hits.resize(self.centers.len(), Err(RayLimit::MissesDome));
            // In runs, which one thread does: a long slice would be shared among several.
            for (centers, hits) in self.centers.chunks(TRACE_RUN).zip(self.hits.chunks_mut(TRACE_RUN)) {
                // Slices of one length are all that it asks for.
                let _ = self.optics.trace_all(centers, hits);
            }
            for (index, hit) in self.found.iter().zip(&self.hits) {
                if let Ok(hit) = hit {
                    let rest = self.model.dots[*index].surface_mm;
                    result.black_dots[*index].displacement_mm = Some(hit.surface_mm - rest);
                }
            }
        }
        let found = self.scratch.len();
        if quantile(&mut self.scratch, 0.5).is_some_and(|wide| found >= 8 && wide > BLURRED) {
            result.problems.add(Problem::Blurred);
        }
        self.scratch.clear();
        if known {
            for (track, model) in self.tracks.iter().zip(&self.model.dots) {
                if let (Some(now), Some(expected)) = (track.now_px(), track.expected_px) {
                    self.scratch.push(now.distance(expected) / model.spacing_px);
                }
            }
        }
        // A finger moves some of the dots; foreign constants misplace nearly all.
        let misplaced = quantile(&mut self.scratch, 0.25).is_some_and(|q| q > self.options.most_misplaced);
        let wanted = self.tracks.iter().filter(|t| t.is_wanted()).count();
        let lost = result.count(MarkState::Lost) + result.count(MarkState::Merged);
        let missing = result.count(MarkState::Missing);
        let unknown = known && wanted >= 8 && 2 * missing > wanted;
        let foreign = refined.is_some_and(|found| found.rms_px > self.model.foreign_rms_px);
        if misplaced || unknown || foreign {
            result.problems.add(Problem::ForeignConstants);
        }
        if lost as f64 > (LOST_PART * wanted as f64).max(1.0) {
            result.problems.add(Problem::DotsLost);
        }
        if !known && found == 0 && sharpness(plane, &self.model.mask, light) < LEAST_SHARPNESS {
            result.problems.add(Problem::Blurred);
        }
        if !known && found == 0 && result.white_markers.iter().all(|m| m.state != MarkState::Ok) {
            result.problems.add(Problem::NoMarks);
        }
        self.refer(known && result_is_good(&self.result));
    }

    fn tell_pose(&mut self, refined: Option<&Refined>) {
        let result = &mut self.result;
        for ((marker, disc), told) in
            self.model.markers.iter().zip(&self.discs).zip(&mut result.white_markers)
        {
            let Some(disc) = disc else { continue };
            told.state = MarkState::Ok;
            told.centroid_px = Some(disc.centroid_px);
            told.sd_px = Some(disc.sd_px);
            if refined.is_some()
                && let Ok(image) = marker.image(&self.optics)
            {
                told.residual_px = Some(disc.centroid_px - image.centroid_px);
                told.image_px = Some(disc.centroid_px - (image.centroid_px - image.center_px));
            }
        }
        let Some(refined) = refined else { return };
        result.pose = Some(refined.pose);
        result.pose_rms_px = Some(refined.rms_px);
        if self.seen.len() == 3 {
            result.problems.add(Problem::ThreeMarkers);
        }
        let at_mm = self.model.springs.as_ref().map_or(DVec3::ZERO, Springs::at_mm);
        let transfer = displacement_from_motion(&refined.pose, at_mm);
        let left = |told: &MarkerResult| Some((told.residual_px?, told.sd_px?));
        self.surplus.add(result.white_markers.iter().map(left));
        for (tilt, disc) in self.tilts.iter_mut().zip(&self.discs) {
            tilt.add(disc.and_then(|disc| disc.tilt));
        }
        let covariance = transfer * refined.covariance * transfer.transpose() * self.surplus.factor();
        result.pose_sd = deviations(&covariance);
        if let Some(springs) = &self.model.springs {
            let displacement = Displacement::of_pose(&refined.pose, at_mm);
            if !springs.can_stand(&refined.pose) {
                result.problems.add(Problem::BeyondSprings);
            }
            match springs.wrench(&displacement) {
                Some((wrench, tangent)) => {
                    result.wrench = Some(wrench);
                    result.wrench_sd = deviations(&(tangent * covariance * tangent.transpose()));
                }
                None => result.problems.add(Problem::BeyondSprings),
            }
        }
    }

    /// Collects or takes off what the reference frames showed.
    fn refer(&mut self, good: bool) {
        let Reference::Frames(wanted) = self.options.reference else { return };
        let sum = &mut self.reference;
        if sum.frames < wanted {
            if !good {
                return;
            }
            sum.frames += 1;
            if let Some(wrench) = self.result.wrench {
                for (to, from) in sum.wrench.iter_mut().zip(wrench) {
                    *to += from;
                }
            }
            for (dot, (to, count)) in self.result.black_dots.iter().zip(&mut sum.displacement) {
                if let Some(displacement) = dot.displacement_mm {
                    *to += displacement;
                    *count += 1;
                }
            }
        }
        if sum.frames == 0 {
            return;
        }
        if let Some(wrench) = &mut self.result.wrench {
            for (value, from) in wrench.iter_mut().zip(sum.wrench) {
                *value -= from / f64::from(sum.frames);
            }
        }
        for (dot, (from, count)) in self.result.black_dots.iter_mut().zip(&sum.displacement) {
            if let Some(displacement) = dot.displacement_mm.as_mut().filter(|_| *count > 0) {
                *displacement -= *from / f64::from(*count);
            }
        }
    }
}

/// How far a pose is from another, mm; a turn counts at ten millimetres.
fn distance_mm(from: &Rigid, to: &Rigid) -> f64 {
    let between = from.inverse().compose(to);
    let turn = between.rotation - glam::DMat3::IDENTITY;
    let turned = turn.to_cols_array().iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    between.translation_mm.length().max(10.0 * turned)
}

fn result_is_good(result: &Tracked) -> bool {
    result.problems.iter().all(|p| p >= Problem::Frozen)
}

fn deviations(covariance: &Matrix6<f64>) -> Option<[f64; 6]> {
    let sd: [f64; 6] = std::array::from_fn(|i| covariance[(i, i)].max(0.0).sqrt());
    sd.iter().all(|v| v.is_finite()).then_some(sd)
}

/// The value that a part of the list is below; the list is reordered.
fn quantile(values: &mut [f64], part: f64) -> Option<f64> {
    let at = ((values.len() as f64 * part) as usize).min(values.len().checked_sub(1)?);
    Some(*values.select_nth_unstable_by(at, f64::total_cmp).1)
}
