//! The sensor's marks in its frames: from pictures to the observations that [`super::optics`] fits.
//!
//! Blobs are matched to where the constants say that the marks are: white markers first, by the pose that fits them
//! best, then each as the disc that `track` fits, so that calibration and runtime see one place; then black dots, at that pose, with the affine rest that a sensor that is off its nominal numbers leaves.

mod matching;

use glam::{DMat2, DVec2, DVec3};

use matching::{Blobs, affine, area_of, combinations, with_spacing};

use super::optics::{Kind, Observation};
use crate::constants::Constants;
use crate::frames::{BlobSide, Gray};
use crate::track::{CameraFrame, marker_in_still};
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;
use domecast_optics::pose::{PoseOptions, PoseSolver, Sighting, outline_centroid_offset};

/// Smoothing before the levels are taken, px: noise of single pixels makes no blobs then.
const SMOOTHING_PX: f64 = 0.7;
/// Farthest that a white marker may be from its place at rest, as a part of its distance to the nearest other one.
const WHITE_REACH: f64 = 0.45;
/// The same for a black dot, from where the pose puts it.
const BLACK_REACH: f64 = 0.45;
/// Candidates for each white marker that are tried.
const CANDIDATES: usize = 4;
/// What the nominal numbers may be off by in a white marker's place, px, when the fit assigns blobs to markers.
const NOMINAL_PX: f64 = 4.0;
/// Rounds of matching the dots and fitting what is left of their places.
const ROUNDS: usize = 4;

/// What one frame shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The marks that were found.
    pub observations: Vec<Observation>,
    /// How many black dots the constants have that were not found.
    pub black_missing: usize,
}

/// Why a frame tells nothing.
#[derive(Debug, Clone, PartialEq)]
pub enum DetectError {
    /// The constants describe no sensor.
    Constants(String),
    /// The frame does not have the camera's size.
    Size {
        /// Width and height of the frame.
        frame: [usize; 2],
        /// Width and height of the camera's.
        camera: [usize; 2],
    },
    /// Near a white marker's place nothing looks like it.
    NoWhiteMarker {
        /// Its number.
        id: usize,
    },
    /// Where a white marker should be is something bright that is no disc on the sheet.
    NoDisc {
        /// Its number.
        id: usize,
    },
    /// Blobs are there, but no choice of them fits the white markers.
    WhiteMarkersDoNotFit,
}

impl std::fmt::Display for DetectError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Constants(what) => f.write_str(what),
            Self::Size { frame: [w, h], camera: [cw, ch] } => {
                write!(f, "is {w} x {h} pixels, but the camera's frames are {cw} x {ch}")
            }
            Self::NoWhiteMarker { id } => {
                write!(f, "shows nothing like white marker {id} near its place at rest")
            }
            Self::NoDisc { id } => {
                write!(f, "shows white marker {id} as no clean disc: glare, dirt or a cover")
            }
            Self::WhiteMarkersDoNotFit => {
                write!(f, "shows bright blobs, but no four of them fit the white markers")
            }
        }
    }
}

impl std::error::Error for DetectError {}

/// Finds the marks of one sensor in any of its frames.
pub struct Detector<'a> {
    constants: &'a Constants,
    optics: SensorOptics,
    solver: PoseSolver,
}

impl<'a> Detector<'a> {
    /// A detector for the sensor that the constants describe.
    ///
    /// # Errors
    /// [`DetectError::Constants`].
    pub fn new(constants: &'a Constants) -> Result<Self, DetectError> {
        let optics = constants.sensor().map_err(DetectError::Constants)?;
        let reach_mm = 10.0 * optics.air_gap_mm().abs().max(1.0);
        let options = PoseOptions::new(NOMINAL_PX, reach_mm);
        let solver = PoseSolver::new(&optics, &constants.markers(), options)
            .map_err(|error| DetectError::Constants(format!("white markers: {error}")))?;
        Ok(Self { constants, optics, solver })
    }

    /// The marks in a frame (raw, as the camera gives it), whatever the platform's pose.
    ///
    /// # Errors
    /// [`DetectError`] where the white markers are not found; black dots may be missing.
    pub fn observe(&self, frame: &Gray, number: usize) -> Result<Found, DetectError> {
        let spec = self.optics.lens().spec();
        let camera = [spec.width as usize, spec.height as usize];
        if [frame.width(), frame.height()] != camera {
            return Err(DetectError::Size { frame: [frame.width(), frame.height()], camera });
        }
        let smooth = frame.blurred(SMOOTHING_PX);
        let (blobs, pose) = self.white_markers(frame, &smooth)?;
        let white_markers = self.discs(frame, blobs, &pose)?;
        let mut observations: Vec<Observation> = white_markers
            .into_iter()
            .map(|(id, centroid_px)| Observation { frame: number, kind: Kind::White, id, centroid_px })
            .collect();
        let black_dots = self.black_dots(frame, &smooth, &pose);
        let black_missing = self.constants.black_dots.len() - black_dots.len();
        observations.extend(black_dots.into_iter().map(|(id, centroid_px)| Observation {
            frame: number,
            kind: Kind::Black,
            id,
            centroid_px,
        }));
        Ok(Found { observations, black_missing })
    }

    /// Each white marker's centroid, and the pose that fits them.
    fn white_markers(
        &self,
        frame: &Gray,
        smooth: &Gray,
    ) -> Result<(Vec<(usize, DVec2)>, Rigid), DetectError> {
        let mut wanted = Vec::new();
        for marker in self.solver.markers() {
            let lost = DetectError::NoWhiteMarker { id: marker.id as usize };
            let image = marker.image(&self.optics).map_err(|_| lost.clone())?;
            let outline = marker.outline_px(&self.optics).map_err(|_| lost)?;
            wanted.push((marker.id as usize, image.centroid_px, area_of(&outline)));
        }
        let wanted = with_spacing(wanted);
        let bright = Blobs::of(smooth, BlobSide::Bright, &wanted);
        let mut choices: Vec<Vec<DVec2>> = Vec::new();
        for one in &wanted {
            let mut near: Vec<(f64, DVec2)> = bright
                .near(one, one.at_px, WHITE_REACH)
                .filter_map(|number| bright.centroid(frame, number))
                .map(|at| (at.distance(one.at_px), at))
                .collect();
            near.sort_by(|a, b| a.0.total_cmp(&b.0));
            near.truncate(CANDIDATES);
            if near.is_empty() {
                return Err(DetectError::NoWhiteMarker { id: one.id });
            }
            choices.push(near.into_iter().map(|(_, at)| at).collect());
        }
        let mut best: Option<(f64, Vec<DVec2>, Rigid)> = None;
        for choice in combinations(&choices) {
            let sightings: Vec<Sighting> = wanted
                .iter()
                .zip(&choice)
                .map(|(one, at)| Sighting { id: one.id as u32, centroid_px: *at })
                .collect();
            if let Ok(found) = self.solver.solve(&sightings)
                && best.as_ref().is_none_or(|(rms, ..)| found.rms_px < *rms)
            {
                best = Some((found.rms_px, choice, found.pose));
            }
        }
        let (_, choice, pose) = best.ok_or(DetectError::WhiteMarkersDoNotFit)?;
        Ok((wanted.iter().map(|one| one.id).zip(choice).collect(), pose))
    }

    /// The white markers as discs beside the dome: a blob's centroid takes some of the bright rim in.
    fn discs(
        &self,
        frame: &Gray,
        blobs: Vec<(usize, DVec2)>,
        pose: &Rigid,
    ) -> Result<Vec<(usize, DVec2)>, DetectError> {
        let size = || DetectError::Size { frame: [frame.width(), frame.height()], camera: [0, 0] };
        let optics = self.optics.at_pose(pose).map_err(|_| DetectError::WhiteMarkersDoNotFit)?;
        let bytes: Vec<u8> =
            frame.values().iter().map(|v| (255.0 * v).round().clamp(0.0, 255.0) as u8).collect();
        let camera = CameraFrame::new(frame.width(), frame.height(), 1, &bytes).map_err(|_| size())?;
        let disc = |(id, start): (usize, DVec2)| {
            let marker = self.solver.markers().iter().find(|marker| marker.id as usize == id);
            let at = marker.and_then(|marker| marker_in_still(&optics, marker, &camera, start));
            at.map(|at| (id, at)).ok_or(DetectError::NoDisc { id })
        };
        blobs.into_iter().map(disc).collect()
    }

    /// The black dots that are found at a pose.
    fn black_dots(&self, frame: &Gray, smooth: &Gray, pose: &Rigid) -> Vec<(usize, DVec2)> {
        let Ok(optics) = self.optics.at_pose(pose) else { return Vec::new() };
        let dome = *self.optics.dome();
        let seen = |dot: &crate::constants::BlackDot| {
            let at = DVec3::from_array(dot.surface_mm);
            let east = DVec3::new(-at.y, at.x, 0.0).try_normalize().unwrap_or(DVec3::X);
            let north = dome.outward_mm(at).cross(east).normalize_or_zero();
            let center = optics.project(at).ok()?;
            let mut outline = Vec::new();
            let offset = outline_centroid_offset(center, |cos, sin| {
                let there = at + (east * cos + north * sin) * (0.5 * dot.diameter_mm);
                let pixel = optics.project(dome.onto(there)).ok()?;
                outline.push(pixel);
                Some(pixel)
            })?;
            Some((dot.id, center + offset, area_of(&outline)))
        };
        let wanted = with_spacing(self.constants.black_dots.iter().filter_map(seen).collect());
        let dark = Blobs::of(smooth, BlobSide::Dark, &wanted);
        let middle = 0.5 * DVec2::new(frame.width() as f64, frame.height() as f64);
        let (mut shift, mut stretch) = (DVec2::ZERO, DMat2::IDENTITY);
        let mut matched: Vec<(usize, usize)> = Vec::new();
        for _ in 0..ROUNDS {
            matched.clear();
            for (w, one) in wanted.iter().enumerate() {
                let at = stretch * (one.at_px - middle) + middle + shift;
                let away = |number: &usize| dark.all[*number].middle_px.distance_squared(at);
                let nearest = dark.near(one, at, BLACK_REACH).min_by(|a, b| away(a).total_cmp(&away(b)));
                matched.extend(nearest.map(|number| (w, number)));
            }
            // A blob that two dots claim is neither's.
            let mut claims = vec![0; dark.all.len()];
            matched.iter().for_each(|(_, place)| claims[*place] += 1);
            matched.retain(|(_, place)| claims[*place] == 1);
            let pairs: Vec<(DVec2, DVec2)> = matched
                .iter()
                .map(|(w, place)| (wanted[*w].at_px - middle, dark.all[*place].middle_px - middle))
                .collect();
            let Some(fit) = affine(&pairs) else { break };
            (shift, stretch) = fit;
        }
        matched
            .into_iter()
            .filter_map(|(w, place)| Some((wanted[w].id, dark.centroid(frame, place)?)))
            .collect()
    }
}
