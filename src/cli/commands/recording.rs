//! The recording of `track --mcap` and `live --record`.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::output::{Failure, Output};
use domecast_files::{GrowingFile, OutputRules};
use domecast_live::decode::PictureFormat;
use domecast_live::record::{BehindWriter, McapError, McapRecorder, RecordedPicture};
use domecast_runtime::constants::Constants;
use domecast_runtime::shape::ShapeMap;
use domecast_runtime::track::{CameraFrame, Tracked, Tracker};

/// Frames a second where nothing says when they were taken.
const FRAMES_PER_S: f64 = 30.0;

/// A recording that grows in its place: what is in it counts, even if the program is killed.
pub struct Recording {
    path: PathBuf,
    recorder: McapRecorder<BufWriter<RecordingFile>>,
}

/// How the file is written.
enum RecordingFile {
    /// At once: when a frame's line is out, its chunk is in the file.
    AtOnce(GrowingFile),
    /// Behind the reading, which waits for no disk; a kill costs what the disk is behind.
    Behind(BehindWriter<GrowingFile>),
}

impl Write for RecordingFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::AtOnce(file) => file.write(bytes),
            Self::Behind(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::AtOnce(file) => file.flush(),
            Self::Behind(file) => file.flush(),
        }
    }
}

/// Who waits while a chunk is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordingPace {
    /// Whoever adds a frame.
    WithFrames,
    /// A thread.
    BehindFrames,
}

impl Recording {
    /// Begins one in the place that the user named.
    pub fn begin(
        output: &Output,
        path: &Path,
        command: &'static str,
        rules: &OutputRules<'_>,
        constants: &Constants,
        tracker: &Tracker,
        pace: RecordingPace,
    ) -> Result<Self, Failure> {
        let (file, kept) = GrowingFile::new(path, command, rules)?;
        output.kept(kept);
        let file = match pace {
            RecordingPace::WithFrames => RecordingFile::AtOnce(file),
            RecordingPace::BehindFrames => {
                RecordingFile::Behind(BehindWriter::start(file).map_err(Failure::Print)?)
            }
        };
        let recorder = McapRecorder::new(BufWriter::new(file), constants, tracker);
        let recorder = recorder.map_err(|error| fault(path, &error))?;
        Ok(Self { path: path.to_path_buf(), recorder })
    }

    /// Adds a frame at a time since 1970, ns.
    pub fn add(
        &mut self,
        time_ns: u64,
        picture: RecordedPicture<'_>,
        tracked: &Tracked,
        skin: Option<&ShapeMap>,
    ) -> Result<(), Failure> {
        self.recorder.write(time_ns, picture, tracked, skin).map_err(|error| fault(&self.path, &error))
    }

    /// Adds the skin of a frame, which is measured later than the rest of it.
    pub fn add_height(&mut self, time_ns: u64, skin: &ShapeMap) -> Result<(), Failure> {
        self.recorder.write_height(time_ns, skin).map_err(|error| fault(&self.path, &error))
    }

    /// Ends it with its index.
    pub fn end(self) -> Result<(), Failure> {
        let file = self.recorder.finish().map_err(|error| fault(&self.path, &error))?;
        let file = file.into_inner().map_err(|error| error.into_error()).and_then(|file| match file {
            RecordingFile::AtOnce(file) => Ok(file),
            RecordingFile::Behind(file) => file.into_inner(),
        });
        let named = |error| Failure::Record(self.path, format!("the recording cannot be written ({error})"));
        Ok(file.map_err(named)?.end()?)
    }
}

fn fault(path: &Path, error: &McapError) -> Failure {
    Failure::Record(path.to_path_buf(), error.to_string())
}

/// When a frame of `track` was taken, ns: by its time, else by its number.
pub fn time_ns(tracked: &Tracked) -> u64 {
    let time_s = tracked.time_s.unwrap_or(tracked.frame as f64 / FRAMES_PER_S);
    (time_s * 1e9).round().max(0.0) as u64
}

/// The bytes of the frame's file where it came as one that viewers know, else its pixels.
pub fn recorded<'a>(frame: Option<CameraFrame<'a>>, encoded: Option<&'a [u8]>) -> RecordedPicture<'a> {
    let coded = encoded.and_then(|bytes| Some((PictureFormat::of(bytes)?, bytes)));
    match (frame, coded) {
        (Some(_), Some((format, bytes))) => RecordedPicture::Encoded(format, bytes),
        (Some(frame), None) => RecordedPicture::Pixels(frame),
        (None, _) => RecordedPicture::None,
    }
}
