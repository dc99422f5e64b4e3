//! A whole sequence: frames and truth into a folder, written whole or not at all.

use std::fmt;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::SimError;
use super::frame::Image8;
use super::plan::Plan;
use super::render::{Drawn, Renderer};
use super::scene::Scene;
use super::video::VideoWriter;
use super::work::Work;

/// Frames that are drawn before they are written, for each thread.
const BATCH_PER_THREAD: usize = 4;

/// Names of the files beside the frames.
pub const TRUTH_NAME: &str = "truth.jsonl";
/// The frames as one file.
pub const VIDEO_NAME: &str = "video.avi";
/// The plan and what it took.
pub const PLAN_NAME: &str = "plan.json";

/// Why a sequence could not be made. The folder is then as it was.
#[derive(Debug)]
pub enum RunError {
    /// The scene is at fault.
    Scene(SimError),
    /// The system refused.
    Io {
        /// What was being done.
        doing: &'static str,
        /// Where.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// The folder holds something that no earlier sequence put there.
    NotOurs {
        /// The folder.
        path: PathBuf,
        /// What it holds.
        foreign: String,
    },
}

impl From<SimError> for RunError {
    fn from(error: SimError) -> Self {
        Self::Scene(error)
    }
}

impl fmt::Display for RunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scene(error) => error.fmt(f),
            Self::Io { doing, path, source } => write!(f, "{}: cannot {doing} ({source})", path.display()),
            Self::NotOurs { path, foreign } => {
                write!(f, "{}: holds \"{foreign}\", which no earlier sequence put there", path.display())
            }
        }
    }
}

impl std::error::Error for RunError {}

/// A frame and its picture as PNG.
type Coded = (Drawn, Option<Vec<u8>>);

/// What a run made.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Summary {
    /// Frames written.
    pub frames: u32,
    /// What could not be as asked, by frame: the platform is held.
    pub notes: Vec<(u32, String)>,
    /// What it took in all.
    pub work: Work,
}

/// Draws all frames of a scene with a plan into a folder; `progress` is told after each batch how many are done.
///
/// The folder is filled beside its place and moved there at the end: it is whole or as it was. Frames are drawn
/// in parallel on rayon's threads; the bytes do not depend on their number.
///
/// # Errors
/// [`RunError`].
pub fn run(
    scene: &Scene,
    plan: &Plan,
    out: &Path,
    progress: &mut dyn FnMut(u32),
) -> Result<Summary, RunError> {
    let fault = |doing, path: &Path| {
        let path = path.to_path_buf();
        move |source| RunError::Io { doing, path, source }
    };
    if let Some(foreign) = foreign_entry(out).map_err(fault("look into the folder", out))? {
        return Err(RunError::NotOurs { path: out.to_path_buf(), foreign });
    }
    let renderer = Renderer::new(scene, plan)?;
    let parent = out.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    fs::create_dir_all(parent).map_err(fault("make the folder", parent))?;
    let staging = tempfile::Builder::new()
        .prefix(".domecast-")
        .tempdir_in(parent)
        .map_err(fault("make a temporary folder", parent))?;
    let fresh = staging.path().join("new");
    fs::create_dir_all(&fresh).map_err(fault("make the folder", &fresh))?;
    let truth_path = fresh.join(TRUTH_NAME);
    let truth_file = File::create(&truth_path).map_err(fault("write the truth", &truth_path))?;
    let mut truth = BufWriter::new(truth_file);
    let video_path = fresh.join(VIDEO_NAME);
    let mut video = None;
    let mut summary = Summary { work: *renderer.setup(), ..Summary::default() };

    let count = scene.frame_count();
    let batch = (BATCH_PER_THREAD * rayon::current_num_threads()).max(1) as u32;
    let mut first = 0;
    while first < count {
        let end = count.min(first.saturating_add(batch));
        let drawn: Vec<Result<Coded, SimError>> = (first..end)
            .into_par_iter()
            .map(|number| {
                let drawn = renderer.frame(number)?;
                let png =
                    drawn.image.as_ref().map(png_bytes).transpose().map_err(|error| SimError::Frame {
                        frame: number,
                        problem: format!("the picture cannot be coded: {error}"),
                    })?;
                Ok((drawn, png))
            })
            .collect();
        for result in drawn {
            let (drawn, png) = result?;
            let number = drawn.truth.frame;
            if let (Some(image), Some(bytes)) = (&drawn.image, png) {
                let path = fresh.join(format!("frame_{number:04}.png"));
                fs::write(&path, bytes).map_err(fault("write the frame", &path))?;
                if video.is_none() {
                    let rate = scene.file().frames.rate_hz;
                    let made = VideoWriter::create(&video_path, image.width, image.height, rate);
                    video = Some(made.map_err(fault("write the video", &video_path))?);
                }
                if let Some(video) = &mut video {
                    video.add(image).map_err(fault("write the video", &video_path))?;
                }
            }
            writeln!(truth, "{}", drawn.truth.to_line()).map_err(fault("write the truth", &truth_path))?;
            if let Some(note) = drawn.truth.note {
                summary.notes.push((number, format!("{}: {note}", drawn.truth.status)));
            }
            summary.work.merge(&drawn.work);
            summary.frames += 1;
        }
        first = end;
        progress(first);
    }
    truth.flush().map_err(fault("write the truth", &truth_path))?;
    if let Some(video) = video {
        video.finish().map_err(fault("write the video", &video_path))?;
    }
    let plan_path = fresh.join(PLAN_NAME);
    // numbers, strings and lists only: nothing here can fail to be written
    let text = serde_json::to_string_pretty(plan).unwrap_or_default() + "\n";
    fs::write(&plan_path, text).map_err(fault("write the plan", &plan_path))?;
    put_in_place(staging, &fresh, out)?;
    Ok(summary)
}

/// Moves a finished folder to its place; an earlier one makes room, and comes back if the move fails.
fn put_in_place(staging: tempfile::TempDir, fresh: &Path, out: &Path) -> Result<(), RunError> {
    let earlier = staging.path().join("earlier");
    let had_earlier = out.exists();
    if had_earlier {
        fs::rename(out, &earlier).map_err(|source| RunError::Io {
            doing: "move the earlier result aside",
            path: out.to_path_buf(),
            source,
        })?;
    }
    let Err(source) = fs::rename(fresh, out) else { return Ok(()) };
    if had_earlier && fs::rename(&earlier, out).is_err() {
        let kept = staging.keep();
        return Err(RunError::Io { doing: "put the earlier result back; it is kept", path: kept, source });
    }
    Err(RunError::Io { doing: "put the new result in place", path: out.to_path_buf(), source })
}

/// The first entry of an existing folder that is not part of an earlier sequence.
fn foreign_entry(out: &Path) -> io::Result<Option<String>> {
    match fs::metadata(out) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
        Ok(about) if !about.is_dir() => return Ok(Some("a file of that name".into())),
        Ok(_) => {}
    }
    let mut names = Vec::new();
    for entry in fs::read_dir(out)? {
        names.push(entry?.file_name().to_string_lossy().into_owned());
    }
    names.sort();
    let ours = |name: &str| {
        let numbered = |start: &str, end: &str| {
            let middle = name.strip_prefix(start).and_then(|rest| rest.strip_suffix(end));
            middle.is_some_and(|digits| digits.len() >= 4 && digits.bytes().all(|b| b.is_ascii_digit()))
        };
        [TRUTH_NAME, VIDEO_NAME, PLAN_NAME].contains(&name)
            || numbered("frame_", ".png")
            || numbered("heights_", ".tif")
            || numbered("pressure_", ".json")
    };
    let complete = names.is_empty() || names.iter().any(|name| name == TRUTH_NAME);
    Ok(names.into_iter().find(|name| !complete || !ours(name)))
}

/// A picture as PNG: grey or RGB, 8 bits, coded fast.
pub fn png_bytes(image: &Image8) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let width = u32::try_from(image.width).unwrap_or(u32::MAX);
    let height = u32::try_from(image.height).unwrap_or(u32::MAX);
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(if image.channels == 3 { png::ColorType::Rgb } else { png::ColorType::Grayscale });
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&image.bytes)?;
    writer.finish()?;
    Ok(bytes)
}
