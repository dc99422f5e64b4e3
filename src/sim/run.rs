//! A whole sequence: frames and truth into a folder, written whole or not at all.

use std::fmt;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::Serialize;

use super::SimError;
use super::frame::Image8;
use super::plan::Plan;
use super::render::{Around, Drawn, Renderer, Scratch};
use super::scene::Scene;
use super::touch::Touch;
use super::truth::{ContactTruth, FrameTruth};
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
    /// Frames whose contact is not what the level asks for, by its status in the truth.
    pub contact: Vec<ContactFault>,
    /// What it took in all.
    pub work: Work,
}

/// Frames whose contact ended in the same way, short of what the level asks for.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ContactFault {
    /// The contact's status in the truth.
    pub status: &'static str,
    /// How many frames.
    pub frames: u32,
    /// Number of the first one.
    pub first: u32,
    /// What the status means in that one.
    pub note: String,
}

impl Summary {
    /// Takes what a frame's truth says that is not as asked.
    fn note(&mut self, truth: FrameTruth) {
        if let Some(note) = truth.note {
            self.notes.push((truth.frame, format!("{}: {note}", truth.status)));
        }
        let Some(ContactTruth { status, note: Some(note), .. }) = truth.contact else { return };
        match self.contact.iter_mut().find(|fault| fault.status == status) {
            Some(fault) => fault.frames += 1,
            None => self.contact.push(ContactFault { status, frames: 1, first: truth.frame, note }),
        }
    }
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
    let mut stepper = renderer.stepper()?;
    // The touched dome, solved in order, from the frame before the batch to the one after it.
    let mut touches: Vec<Touch> = Vec::new();
    let mut first = 0;
    while first < count {
        let end = count.min(first.saturating_add(batch));
        let start = first.saturating_sub(1);
        if let Some(stepper) = &mut stepper {
            let solved = start as usize + touches.len();
            for number in solved as u32..count.min(end.saturating_add(1)) {
                touches.push(stepper.next(number, scene.time_s(number), &mut summary.work)?);
            }
        }
        let drawn: Vec<Result<Coded, SimError>> = (first..end)
            .into_par_iter()
            .map_init(Scratch::default, |scratch, number| {
                let around = Around::of(&touches, (number - start) as usize);
                let drawn = renderer.frame_around(number, around.as_ref(), scratch)?;
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
            write_extras(scene, &drawn, &fresh)?;
            writeln!(truth, "{}", drawn.truth.to_line()).map_err(fault("write the truth", &truth_path))?;
            summary.note(drawn.truth);
            summary.work.merge(&drawn.work);
            summary.frames += 1;
        }
        first = end;
        if stepper.is_some() {
            touches.drain(..(first.saturating_sub(1) - start) as usize);
        }
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

/// Samples along each side of a height map.
const HEIGHT_SIDE: u32 = 200;

/// The membrane's heights and the contact's pressure, where the scene wants them.
fn write_extras(scene: &Scene, drawn: &Drawn, folder: &Path) -> Result<(), RunError> {
    let wanted = scene.file().output;
    let number = drawn.truth.frame;
    let radius_mm = scene.optics().dome_radius_mm();
    let write = |path: PathBuf, bytes: Vec<u8>| {
        fs::write(&path, bytes).map_err(|source| RunError::Io { doing: "write the file", path, source })
    };
    if wanted.heights {
        let heights = match &drawn.contact {
            Some(contact) => contact.height_map_mm(radius_mm, HEIGHT_SIDE as usize),
            None => still_heights_mm(radius_mm, HEIGHT_SIDE as usize),
        };
        let path = folder.join(format!("heights_{number:04}.tif"));
        let bytes = float_tiff(&heights, HEIGHT_SIDE).map_err(|error| RunError::Io {
            doing: "code the heights",
            path: path.clone(),
            source: io::Error::other(error.to_string()),
        })?;
        write(path, bytes)?;
    }
    if wanted.pressure {
        let nodes = drawn.contact.as_ref().map_or(&[][..], |contact| &contact.nodes);
        let told: Vec<_> = nodes
            .iter()
            .map(|node| {
                serde_json::json!({
                    "at_mm": node.at_mm.to_array(), "area_mm2": node.area_mm2, "force_n": node.force_n.to_array(),
                    "pressure_mpa": node.pressure_mpa, "sticks": node.sticks,
                })
            })
            .collect();
        let text = serde_json::json!({
            "frame": number,
            "contact_radius_mm": drawn.contact.as_ref().map(|contact| contact.contact_radius_mm),
            "peak_pressure_mpa": drawn.contact.as_ref().map(|contact| contact.peak_pressure_mpa),
            "nodes": told,
        });
        write(folder.join(format!("pressure_{number:04}.json")), format!("{text}\n").into_bytes())?;
    }
    Ok(())
}

/// Heights of the undeformed dome on the raster of [`domecast_contact::ContactState::height_map_mm`].
fn still_heights_mm(radius_mm: f64, side: usize) -> Vec<f64> {
    let at = |i: usize| ((2 * i + 1) as f64 / side as f64 - 1.0) * radius_mm;
    let height =
        |k: usize| (radius_mm * radius_mm - at(k % side).powi(2) - at(k / side).powi(2)).max(0.0).sqrt();
    (0..side * side).map(height).collect()
}

/// A square raster as 32-bit float TIFF.
fn float_tiff(values: &[f64], side: u32) -> tiff::TiffResult<Vec<u8>> {
    let mut bytes = io::Cursor::new(Vec::new());
    let values: Vec<f32> = values.iter().map(|v| *v as f32).collect();
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut bytes)?;
    encoder.write_image::<tiff::encoder::colortype::Gray32Float>(side, side, &values)?;
    Ok(bytes.into_inner())
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
