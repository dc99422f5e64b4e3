//! `domecast track FRAMES --constants FILE`

mod decode;
mod source;

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use glam::DVec3;
use serde_json::json;

use super::input::{input_fault, read_constants};
use super::output::{Failure, Output};
use domecast_files::StagedFile;
use domecast_runtime::track::{
    CSV_HEADER, CameraFrame, Channel, DOTS_CSV_HEADER, FollowMethod, Reference, Steps, Thresholds,
    TrackOptions, Tracked, Tracker, Undistorted, overlay_png, write_csv, write_dots_csv, write_json,
};
use source::{RawSize, Source};

/// What is written for each frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// A JSON object a line.
    Jsonl,
    /// Pose and wrench, a line a frame.
    Csv,
    /// The dots, a line each.
    DotsCsv,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum ChannelName {
    Red,
    Green,
    Blue,
    /// The paper's grey.
    Luma,
}

/// What the command line says.
#[derive(Debug, clap::Args)]
pub struct TrackArguments {
    /// A folder of PNG or JPEG frames, frames, a video (through ffmpeg), a file of raw frames (with --raw), or `-` for
    /// standard input (PGM or PPM pictures one after the other, or raw with --raw).
    #[arg(required = true)]
    frames: Vec<PathBuf>,
    /// The constants.json of the sensor.
    #[arg(long)]
    constants: PathBuf,
    /// Where to write [default: standard output].
    #[arg(long)]
    out: Option<PathBuf>,
    #[arg(long, value_enum, default_value = "jsonl")]
    format: Format,
    /// Draw dots, axes and force over each frame, into this folder.
    #[arg(long)]
    overlay: Option<PathBuf>,
    /// How many times as long as they are the arrows of the dots are drawn.
    #[arg(long, default_value_t = 1.0)]
    magnify: f64,
    /// Write each frame undistorted and masked, as the paper's runtime sees it, into this folder.
    #[arg(long)]
    undistorted: Option<PathBuf>,
    /// Raw frames of this size: WIDTHxHEIGHT:gray or WIDTHxHEIGHT:rgb.
    #[arg(long)]
    raw: Option<RawSize>,
    /// The channel that marks are measured in: colour filters and JPEG leave luma whole, where they are not, green is
    /// free of dispersion.
    #[arg(long, value_enum, default_value = "luma")]
    channel: ChannelName,
    /// The paper's fixed levels, BLACK,WHITE (0 to 255), instead of adaptive ones.
    #[arg(long, value_parser = levels)]
    thresholds: Option<[u8; 2]>,
    /// Follow dots by pyramidal Lucas-Kanade, as the paper does.
    #[arg(long)]
    flow: bool,
    /// Levels of its pyramid: each doubles the way that a dot can be followed.
    #[arg(long, default_value_t = 3, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=5), requires = "flow")]
    pyramid_levels: usize,
    /// Sharpen before the whole frame is searched.
    #[arg(long)]
    sharpen: bool,
    /// Do not blur before it.
    #[arg(long)]
    no_blur: bool,
    /// Open (3 x 3) the thresholded frame.
    #[arg(long)]
    open: bool,
    /// Count from the mean of the first so many good frames, which are without load, not from the constants' rest.
    #[arg(long)]
    reference: Option<u32>,
    /// Search the whole frame at least every so many frames; 0: only when needed.
    #[arg(long, default_value_t = 30)]
    search_every: u32,
    /// Largest rms of the white markers' residuals that is still a pose, px.
    #[arg(long, default_value_t = 2.0)]
    most_residual_px: f64,
    /// Share of the dots' spacing by which three quarters of them may be misplaced before the constants are called
    /// another sensor's.
    #[arg(long, default_value_t = 0.5)]
    most_misplaced: f64,
}

fn levels(text: &str) -> Result<[u8; 2], String> {
    let parts: Vec<u8> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    match parts.as_slice() {
        [black, white] if black < white => Ok([*black, *white]),
        _ => Err("two levels from 0 to 255, the black one first: 60,200".into()),
    }
}

impl TrackArguments {
    fn options(&self) -> TrackOptions {
        TrackOptions {
            channel: match self.channel {
                ChannelName::Red => Channel::Red,
                ChannelName::Green => Channel::Green,
                ChannelName::Blue => Channel::Blue,
                ChannelName::Luma => Channel::Luma,
            },
            thresholds: self
                .thresholds
                .map_or(Thresholds::Adaptive, |[black, white]| Thresholds::Fixed { black, white }),
            steps: Steps { blur: !self.no_blur, sharpen: self.sharpen, open: self.open },
            motion: if self.flow { FollowMethod::LucasKanade } else { FollowMethod::Predicted },
            pyramid_levels: self.pyramid_levels,
            reference: self.reference.map_or(Reference::Constants, Reference::Frames),
            search_every: self.search_every,
            max_residual_px: self.most_residual_px,
            max_misplaced: self.most_misplaced,
        }
    }
}

/// Where the lines go: a file that is there whole or not at all, or standard output, frame by frame.
enum Sink {
    File(StagedFile),
    Standard(io::Stdout),
}

impl Sink {
    fn new(out: Option<&Path>) -> Result<Self, Failure> {
        Ok(match out {
            Some(path) => Self::File(StagedFile::new(path)?),
            None => Self::Standard(io::stdout()),
        })
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        match self {
            Self::File(file) => Ok(file.write(bytes)?),
            Self::Standard(out) => Ok(out.write_all(bytes).and_then(|()| out.flush())?),
        }
    }

    fn end(self) -> Result<(), Failure> {
        match self {
            Self::File(file) => Ok(file.commit()?),
            Self::Standard(_) => Ok(()),
        }
    }
}

fn unwritable(path: &Path, error: &io::Error) -> Failure {
    input_fault(path, format!("cannot be written ({error})"), "a place that can be written")
}

/// Tracks every frame that there is; a frame that cannot be had is told and passed over.
pub fn run(output: &Output, arguments: &TrackArguments) -> Result<(), Failure> {
    let constants = read_constants(&arguments.constants)?;
    let fault = |error: domecast_runtime::track::TrackError| {
        input_fault(&arguments.constants, error.to_string(), "constants of a sensor")
    };
    let mut tracker = Tracker::new(&constants, arguments.options()).map_err(fault)?;
    let undistorted = match &arguments.undistorted {
        Some(_) => Some(Undistorted::new(&constants).map_err(fault)?),
        None => None,
    };
    for folder in [&arguments.overlay, &arguments.undistorted].into_iter().flatten() {
        fs::create_dir_all(folder).map_err(|e| unwritable(folder, &e))?;
    }
    let mut source = Source::open(&arguments.frames, arguments.raw)?;
    let mut sink = Sink::new(arguments.out.as_deref())?;
    let mut line = Vec::new();
    match arguments.format {
        Format::Jsonl => {}
        Format::Csv => sink.put(format!("{CSV_HEADER}\n").as_bytes())?,
        Format::DotsCsv => sink.put(format!("{DOTS_CSV_HEADER}\n").as_bytes())?,
    }
    let at_mm = tracker.springs().map_or(DVec3::ZERO, domecast_runtime::track::Springs::at_mm);
    let rest = tracker.optics().clone();
    let mut counts: BTreeMap<&'static str, u64> = BTreeMap::new();
    let mut times: Vec<Duration> = Vec::new();
    let mut spare = Vec::new();
    while let Some(next) = source.next_frame() {
        output.step(&format!("frame {}", next.number));
        let picture = match &next.picture {
            Ok(picture) => CameraFrame::new(picture.width, picture.height, picture.channels, &picture.bytes)
                .map_err(|error| error.to_string()),
            Err(problem) => Err(problem.clone()),
        };
        let began = Instant::now();
        let tracked: &Tracked = match &picture {
            Ok(frame) => tracker.track(next.number, frame),
            Err(problem) => {
                output.warn(&format!("frame {}: {problem}", next.number));
                tracker.skip(next.number)
            }
        };
        if picture.is_ok() {
            times.push(began.elapsed());
        }
        *counts.entry(tracked.status()).or_default() += 1;
        line.clear();
        match arguments.format {
            Format::Jsonl => write_json(&mut line, tracked)?,
            Format::Csv => write_csv(&mut line, tracked, at_mm)?,
            Format::DotsCsv => write_dots_csv(&mut line, tracked)?,
        }
        sink.put(&line)?;
        if let (Some(folder), Ok(frame)) = (&arguments.overlay, &picture) {
            let path = folder.join(format!("overlay_{:04}.png", next.number));
            match overlay_png(frame, tracked, &rest, arguments.magnify) {
                Ok(png) => fs::write(&path, png).map_err(|e| unwritable(&path, &e))?,
                Err(error) => output.warn(&format!("{}: {error}", path.display())),
            }
        }
        if let (Some(folder), Some(map), Ok(frame)) = (&arguments.undistorted, &undistorted, &picture) {
            let path = folder.join(format!("undistorted_{:04}.png", next.number));
            if let Some(bytes) = map.of(frame, &mut spare) {
                let png = decode::png_of(frame.width(), frame.height(), frame.channels(), bytes);
                let png = png.map_err(Failure::Internal)?;
                fs::write(&path, png).map_err(|e| unwritable(&path, &e))?;
            }
        }
    }
    output.steps_done();
    sink.end()?;
    source.end()?;
    let frames: u64 = counts.values().sum();
    if frames == 0 {
        return Err(input_fault(
            &arguments.frames[0],
            "holds no frame",
            "PNG or JPEG frames, a video, or raw",
        ));
    }
    times.sort_unstable();
    let at = |part: f64| {
        let index = ((times.len() as f64 * part) as usize).min(times.len().saturating_sub(1));
        times.get(index).map_or(0.0, |t| 1e3 * t.as_secs_f64())
    };
    if let Some(path) = &arguments.out {
        let told: Vec<String> = counts.iter().map(|(status, n)| format!("{n} {status}")).collect();
        output.say(&format!("{}: {frames} frames, {}", path.display(), told.join(", ")))?;
        output.say(&format!("{:.2} ms a frame (median), {:.2} ms (99 of 100)", at(0.5), at(0.99)))?;
        output.result(&json!({
            "ok": true,
            "out": path.display().to_string(),
            "frames": frames,
            "status": counts,
            "median_ms": at(0.5),
            "p99_ms": at(0.99),
        }))?;
    }
    if counts.keys().all(|status| *status == "unreadable") { Err(Failure::Negative) } else { Ok(()) }
}
