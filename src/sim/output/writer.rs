//! The files of a sequence, written in the order of the frames by one thread.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::mpsc;

use super::coded::CodedFrame;
use super::depth::DEPTH_FOLDER;
use super::error::{RunError, fault};
use super::parts::{Pending, Sent, Summary, TRUTH_NAME, VIDEO_NAME};
use super::video::VideoFiles;
use crate::scene::Scene;
use crate::scene::file::ToleranceSection;

/// Writes frames, video and truth.
pub(super) struct Writer {
    folder: PathBuf,
    truth: BufWriter<File>,
    truth_path: PathBuf,
    video: VideoFiles,
    video_path: PathBuf,
    summary: Summary,
    tolerance: ToleranceSection,
}

impl Writer {
    pub fn new(scene: &Scene, folder: &Path) -> Result<Self, RunError> {
        let truth_path = folder.join(TRUTH_NAME);
        if scene.file().output.depth {
            let depth = folder.join(DEPTH_FOLDER);
            fs::create_dir(&depth).map_err(fault("make the folder", &depth))?;
        }
        let truth = File::create(&truth_path).map_err(fault("write the truth", &truth_path))?;
        Ok(Self {
            folder: folder.to_path_buf(),
            truth: BufWriter::new(truth),
            truth_path,
            video: VideoFiles::new(folder.join(VIDEO_NAME), scene.file().frames.rate_hz),
            video_path: folder.join(VIDEO_NAME),
            summary: Summary::default(),
            tolerance: scene.file().tolerance,
        })
    }

    /// Writes what comes, in the order of the frames, until no more can come.
    ///
    /// # Errors
    /// The first fault by frame; then the others stop.
    pub fn write_all(mut self, frames: &mpsc::Receiver<Sent>, state: &Pending) -> Result<Summary, RunError> {
        let result = self.write_ordered(frames, state);
        if result.is_err() {
            state.stopped.store(true, Ordering::Release);
        }
        result?;
        self.truth.flush().map_err(fault("write the truth", &self.truth_path))?;
        self.video.finish().map_err(fault("write the video", &self.video_path))?;
        Ok(self.summary)
    }

    fn write_ordered(&mut self, frames: &mpsc::Receiver<Sent>, state: &Pending) -> Result<(), RunError> {
        let mut early = BTreeMap::new();
        let mut next = 0;
        for (number, frame) in frames {
            early.insert(number, frame);
            while let Some(frame) = early.remove(&next) {
                self.write(frame?)?;
                next += 1;
                state.written.store(next, Ordering::Release);
            }
        }
        Ok(())
    }

    fn write(&mut self, frame: CodedFrame) -> Result<(), RunError> {
        let number = frame.truth.frame;
        if let Some(image) = frame.image {
            let path = self.folder.join(format!("frame_{number:04}.png"));
            fs::write(&path, image.png).map_err(fault("write the frame", &path))?;
            let added = self.video.add(image.width, image.height, &image.jpeg);
            added.map_err(fault("write the video", &self.video_path))?;
        }
        for (name, bytes) in frame.extras {
            let path = self.folder.join(name);
            fs::write(&path, bytes).map_err(fault("write the file", &path))?;
        }
        writeln!(self.truth, "{}", frame.line).map_err(fault("write the truth", &self.truth_path))?;
        self.summary.note(frame.truth, &self.tolerance);
        self.summary.add_coding(frame.coding);
        self.summary.work.merge(&frame.work);
        self.summary.frames += 1;
        Ok(())
    }
}
