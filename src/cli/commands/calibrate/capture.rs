//! The frames of a step: from a device as they come, or from a folder.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::noise::{centroids_of, tolerance_px};
use crate::commands::calibrate_optics::{observations_of, table_of};
use crate::commands::input::input_fault;
use crate::commands::live::{Device, cure_of, open_device};
use crate::commands::output::Failure;
use domecast_live::decode::{Picture, PictureFormat, picture, png_of};
use domecast_live::frame_files::{numbered, pictures_in, read_whole};
use domecast_live::{LiveEvent, LiveReader};
use domecast_runtime::calibrate::optics::{Kind, Observation};
use domecast_runtime::constants::Constants;
use domecast_runtime::track::{MarkState, TrackOptions, Tracked, Tracker};

/// A device that gives no frame for so long is not waited for.
const PATIENCE: Duration = Duration::from_secs(10);
/// More frames of one step say nothing more: what is left is not noise.
const MAX_FRAMES: usize = 200;
/// A still sensor's centroids scatter by less than this many of their stated deviations.
const MAX_SCATTER_SDS: f64 = 4.0;
const FRAMES: &str = "PNG or JPEG frames of the sensor, raw as the camera gives them, none of them moving";

/// Where the frames of a step are.
#[derive(Debug, Clone)]
pub struct FrameWish<'a> {
    /// A device of `domecast live`, or a folder.
    pub device: Device<'a>,
    /// The step's name: its folder, where the source is a folder of folders.
    pub step: &'a str,
    /// How many are taken of a device.
    pub count: usize,
}

/// The frames of a step as PNG, and their marks.
pub struct Taken {
    pub frames: Vec<Vec<u8>>,
    pub marks: Vec<Observation>,
}

/// A folder's own frames, or those of its folder of the step's name.
fn place_of(folder: &Path, step: &str) -> PathBuf {
    let own = folder.join(step);
    if own.is_dir() { own } else { folder.to_path_buf() }
}

fn as_png(picture: &Picture) -> Result<Vec<u8>, String> {
    png_of(picture.width, picture.height, picture.channels, &picture.bytes)
}

fn of_folder(folder: &Path) -> Result<Vec<(Vec<u8>, Picture)>, Failure> {
    let fault = |path: &Path, problem: String| input_fault(path, problem, FRAMES);
    let files = pictures_in(folder).map_err(|e| fault(folder, format!("cannot be read ({e})")))?;
    if files.is_empty() {
        return Err(fault(folder, "holds no PNG or JPEG frame".into()));
    }
    let read = |path: PathBuf| {
        let bytes = read_whole(&path).map_err(|e| fault(&path, format!("cannot be read ({e})")))?;
        let picture = picture(&bytes).map_err(|e| fault(&path, e))?;
        let bytes = match PictureFormat::of(&bytes) {
            Some(PictureFormat::Png) => bytes,
            _ => as_png(&picture).map_err(|e| fault(&path, e))?,
        };
        Ok((bytes, picture))
    };
    numbered(files).into_iter().take(MAX_FRAMES).map(|(_, path)| read(path)).collect()
}

fn of_device(wish: &FrameWish, constants: &Constants) -> Result<Vec<(Vec<u8>, Picture)>, Failure> {
    let name = wish.device.name.to_owned();
    let fault = |problem: String| input_fault(Path::new(&name), problem, FRAMES);
    // of a player of a folder of folders, the step's
    let device = match name.strip_prefix("player:") {
        Some(spec) => {
            let (folder, options) = spec.split_once('?').map_or((spec, ""), |(f, o)| (f, o));
            let own = place_of(Path::new(folder), wish.step);
            let options = if options.is_empty() { String::new() } else { format!("?{options}") };
            format!("player:{}{options}", own.display())
        }
        None => name.clone(),
    };
    let source = open_device(&Device { name: &device, ..wish.device.clone() }, constants)?;
    let reader = LiveReader::start(source, wish.count.max(4)).map_err(Failure::Print)?;
    let mut found = Vec::new();
    let mut heard = Instant::now();
    while found.len() < wish.count {
        match reader.next(Duration::from_millis(100)) {
            Some(LiveEvent::Frame(frame, _)) => {
                heard = Instant::now();
                // a damaged frame is no fault of the step
                let Ok(picture) = frame.data.decode() else { continue };
                found.push((as_png(&picture).map_err(&fault)?, (*picture).clone()));
            }
            Some(LiveEvent::Ended(why)) => {
                if found.is_empty() {
                    return Err(fault(why.unwrap_or_else(|| "gave no frame that can be read".into())));
                }
                break;
            }
            _ if heard.elapsed() > PATIENCE => {
                return Err(fault(format!("gave no frame for {} s", PATIENCE.as_secs())));
            }
            _ => {}
        }
    }
    Ok(found)
}

/// The marks of a frame that the tracker is sure of, as it will see them in use.
fn marks_of(tracked: &Tracked, frame: usize) -> Vec<Observation> {
    let one = |kind: Kind, id: u32, state: MarkState, centroid_px: Option<glam::DVec2>| {
        let centroid_px = centroid_px.filter(|_| state == MarkState::Ok)?;
        Some(Observation { frame, kind, id: id as usize, centroid_px })
    };
    let white = tracked.white_markers.iter().map(|m| one(Kind::White, m.id, m.state, m.centroid_px));
    let black = tracked.black_dots.iter().map(|d| one(Kind::Black, d.id, d.state, d.centroid_px));
    white.chain(black).flatten().collect()
}

/// Takes the frames of a step and finds their marks.
pub fn take(wish: &FrameWish, constants: &Constants) -> Result<Taken, Failure> {
    let folder = Path::new(wish.device.name);
    let (found, place) = if folder.is_dir() {
        let place = place_of(folder, wish.step);
        (of_folder(&place)?, place)
    } else {
        (of_device(wish, constants)?, folder.to_path_buf())
    };
    let fault = |problem: String| input_fault(&place, problem, FRAMES);
    let mut tracker = Tracker::new(constants, TrackOptions::default()).map_err(|e| fault(e.to_string()))?;
    let mut taken = Taken { frames: Vec::new(), marks: Vec::new() };
    for (number, (bytes, picture)) in found.into_iter().enumerate() {
        let frame = picture.frame().map_err(fault)?;
        let tracked = tracker.track(number as u64, &frame);
        if let Some(what) = tracked.problems.iter().find_map(|problem| cure_of(problem, tracked)) {
            return Err(fault(format!("frame {number}: {what}")));
        }
        let marks = marks_of(tracked, number);
        let (found, wanted) =
            (marks.iter().filter(|mark| mark.kind == Kind::White).count(), constants.white_markers.len());
        if found < wanted {
            let problem = format!(
                "frame {number} shows {found} of {wanted} white markers clearly; clean the sheet, see that nothing covers it"
            );
            return Err(fault(problem));
        }
        taken.marks.extend(marks);
        taken.frames.push(bytes);
    }
    still(&taken.marks, constants).map_err(&fault)?;
    // as they are kept: a wizard that goes on has the same numbers
    taken.marks = observations_of(&table_of(&taken.marks)).map_err(|e| fault(e.to_string()))?;
    Ok(taken)
}

/// Whether nothing moved while the frames were taken.
fn still(marks: &[Observation], constants: &Constants) -> Result<(), String> {
    let allowed_px = MAX_SCATTER_SDS * tolerance_px(constants);
    for marker in &constants.white_markers {
        let Some((own, mean)) = centroids_of(marks, marker.id) else { continue };
        let far = own.iter().map(|at| at.distance(mean)).fold(0.0, f64::max);
        if far > allowed_px {
            return Err(format!(
                "the sensor moved while the frames were taken: white marker {} by {far:.2} px, {allowed_px:.2} are allowed; \
                 wait until the weight hangs still and nobody touches the bench, and take the step again",
                marker.id
            ));
        }
    }
    Ok(())
}
