//! The pictures of `track`: `--overlay` and `--undistorted`.

use std::path::PathBuf;

use glam::DVec3;

use super::arguments::TrackArguments;
use crate::commands::output::{Failure, Output};
use domecast_files::{OutputRules, StagedFolder};
use domecast_live::decode;
use domecast_optics::SensorOptics;
use domecast_runtime::constants::Constants;
use domecast_runtime::overlay::{OverlayLayers, depth_range_mm, overlay_png};
use domecast_runtime::shape::ShapeMap;
use domecast_runtime::track::{CameraFrame, Tracked, Tracker, Undistorted};

/// Folders that get a picture of each frame.
pub(super) struct Pictures {
    overlay: Option<StagedFolder>,
    magnify: f64,
    rest: SensorOptics,
    /// The deepest touch so far, mm: the scale of the skin's depth never shrinks, so that colours do not flicker.
    deepest_mm: f64,
    undistorted: Option<(StagedFolder, Undistorted)>,
    buffer: Vec<u8>,
}

impl Pictures {
    pub(super) fn new(
        arguments: &TrackArguments,
        rules: &OutputRules<'_>,
        constants: &Constants,
        tracker: &Tracker,
    ) -> Result<Self, Failure> {
        let folder = |path: &PathBuf| StagedFolder::new(path, "track", rules);
        let undistorted = match &arguments.undistorted {
            Some(path) => {
                Some((folder(path)?, Undistorted::new(constants).map_err(|e| arguments.unfit(&e))?))
            }
            None => None,
        };
        let overlay = arguments.overlay.as_ref().map(folder).transpose()?;
        let rest = tracker.optics().clone();
        let (magnify, deepest_mm, buffer) = (arguments.magnify, 0.0, Vec::new());
        Ok(Self { overlay, magnify, rest, deepest_mm, undistorted, buffer })
    }

    pub(super) fn write(
        &mut self,
        output: &Output,
        number: u64,
        frame: &CameraFrame<'_>,
        tracked: &Tracked,
        tractions: &[(DVec3, DVec3)],
        skin: Option<&ShapeMap>,
    ) -> Result<(), Failure> {
        if let Some(folder) = &self.overlay {
            let name = format!("overlay_{number:04}.png");
            let touch = skin.and_then(|map| map.contact.as_ref());
            self.deepest_mm = touch.map_or(self.deepest_mm, |touch| self.deepest_mm.max(touch.depth_mm));
            let skin = skin.map(|map| (map, depth_range_mm(self.deepest_mm)));
            let layers = OverlayLayers { magnify: self.magnify, tractions, skin };
            match overlay_png(frame, tracked, &self.rest, &layers) {
                Ok(png) => folder.write(&name, &png)?,
                Err(error) => output.warn(&format!("{name}: {error}")),
            }
        }
        if let Some((folder, map)) = &self.undistorted
            && let Some(bytes) = map.of(frame, &mut self.buffer)
        {
            let png = decode::png_of(frame.width(), frame.height(), frame.channels(), bytes);
            folder.write(&format!("undistorted_{number:04}.png"), &png.map_err(Failure::Internal)?)?;
        }
        Ok(())
    }

    pub(super) fn end(self, output: &Output) -> Result<(), Failure> {
        for folder in self.overlay.into_iter().chain(self.undistorted.map(|(folder, _)| folder)) {
            output.kept(folder.commit()?);
        }
        Ok(())
    }
}
