//! `--rest FRAME`: the frame of the untouched sensor that shape, forces and hardness are read against.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::input::input_fault;
use super::output::Failure;
use domecast_hardness::TrackedRest;
use domecast_live::decode::{self, Picture};
use domecast_live::frame_files::read_whole;
use domecast_runtime::track::{CameraFrame, Tracked, Tracker};

/// The frame, and what is tracked in it by a tracker of its own.
pub struct RestFrame {
    path: PathBuf,
    picture: Picture,
    pub tracked: Tracked,
}

impl RestFrame {
    /// `None` where none is given; `is_mirrored` as the frames are.
    pub fn open(path: Option<&Path>, is_mirrored: bool, tracker: &Tracker) -> Result<Option<Self>, Failure> {
        let Some(path) = path else { return Ok(None) };
        let bytes = read_whole(path)
            .map_err(|error| input_fault(path, format!("cannot be read: {error}"), "a PNG or JPEG frame"))?;
        let mut picture = decode::picture(&bytes).map_err(|problem| fault(path, problem))?;
        if is_mirrored {
            picture.mirror();
        }
        let mut own = tracker.clone();
        let tracked = own.track(0, &picture.frame().map_err(|problem| fault(path, problem))?).clone();
        Ok(Some(Self { path: path.to_owned(), picture, tracked }))
    }

    /// As trackers take it.
    pub fn frame(&self) -> Result<CameraFrame<'_>, Failure> {
        self.picture.frame().map_err(|problem| self.fault(problem))
    }

    /// What wrench and displacement about a point are counted from.
    pub fn counted_from(&self, at_mm: DVec3) -> Result<TrackedRest, Failure> {
        let rest = TrackedRest::new(&self.tracked, at_mm);
        if rest.is_known() {
            return Ok(rest);
        }
        Err(self.fault(format!("has no wrench (status \"{}\")", self.tracked.status())))
    }

    /// That it cannot be used.
    pub fn fault(&self, problem: String) -> Failure {
        fault(&self.path, problem)
    }
}

fn fault(path: &Path, problem: String) -> Failure {
    input_fault(path, problem, "a frame of the untouched sensor")
}
