//! A data set in memory, at the size that the network sees.

use std::collections::HashMap;
use std::path::Path;

use domecast_hardness::physics::{Dome, PressRow, Prior, hardness};
use domecast_hardness::{COLUMNS, FrameView, PRESS_COLUMNS, Shrinker, rest_profile};
use serde_json::Value;

use crate::options::{Leak, Options};
use crate::tar::{Problem, members, npy};

/// Levels are kept in parts of so many of one.
pub const LEVEL_PARTS: f32 = 64.0;
/// Readings of the wrench and the platform's motion, and those of the dots.
const WRENCH: [&str; 12] = [
    "fx_n", "fy_n", "fz_n", "mx_nmm", "my_nmm", "mz_nmm", "tx_mm", "ty_mm", "tz_mm", "rx_rad", "ry_rad",
    "rz_rad",
];
/// The hand's travel, which a robot knows and `track` does not.
const TRAVEL: [&str; 1] = ["robot_travel_mm"];
/// What contact mechanics makes of the frames so far, travel and contact included: log10 of the modulus in MPa, and half of the 90 %
/// interval.
const PHYSICS: [&str; 2] = ["physics_log10_e", "physics_half_width"];
const DOTS: [&str; 3] = ["dots_mean_px", "dots_radial_px", "dots_divergence"];

/// Which of three parts of the set a video belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Split {
    /// To fit weights.
    Train,
    /// To calibrate what the network states.
    Val,
    /// To judge.
    Test,
}

/// One press.
#[derive(Debug, Clone)]
pub(crate) struct Video {
    /// Its number in the set.
    pub key: String,
    /// Its part of the set.
    pub split: Split,
    /// The class by its number.
    pub label: usize,
    /// log10 of Young's modulus in MPa.
    pub log10_e: f32,
    /// The differences from rest, `[frame][row][column][channel]`, in parts of a level; empty where no picture is used.
    pub picture: Vec<i16>,
    /// What the picture at rest looks like; empty where no picture is used.
    pub rest: Vec<f64>,
    /// `[frame][reading]`.
    pub readings: Vec<f32>,
    /// The shape's name.
    pub shape: String,
}

/// All videos that are used.
#[derive(Debug)]
pub(crate) struct DataSet {
    /// In the order of their keys.
    pub videos: Vec<Video>,
    /// Names of the classes.
    pub classes: Vec<String>,
    /// Whether the classes are the set's own, not cut from the modulus.
    pub own_classes: bool,
    /// Names of the readings: those that the network sees, then those that are only held to their range.
    pub readings: Vec<String>,
    /// How many of them the network sees.
    pub seen: usize,
    /// Frames of a video.
    pub frames: usize,
    /// Height and width of the pictures, where they are used.
    pub picture: Option<[usize; 2]>,
    /// Videos left out, by reason.
    pub left_out: HashMap<&'static str, usize>,
    /// What stands for the set in a report.
    pub name: String,
}

impl DataSet {
    /// The videos of a part.
    pub fn part(&self, split: Split) -> Vec<&Video> {
        self.videos.iter().filter(|video| video.split == split).collect()
    }

    /// Numbers of one frame's picture.
    pub fn pixels(&self) -> usize {
        self.picture.map_or(0, |[height, width]| height * width * 3)
    }
}

/// Where a reading comes from.
#[derive(Debug, Clone, Copy)]
enum Reading {
    /// A column of the set's table.
    Column(usize),
    /// One of [`PHYSICS`].
    Physics(usize),
}

impl Reading {
    fn named(name: &str, columns: &[String]) -> Result<Self, Problem> {
        if let Some(at) = PHYSICS.iter().position(|known| *known == name) {
            return Ok(Self::Physics(at));
        }
        let at = columns.iter().position(|column| column == name);
        at.map(Self::Column).ok_or_else(|| format!("no column `{name}`"))
    }
}

/// What contact mechanics needs.
struct Physics {
    dome: Dome,
    prior: Prior,
    columns: [usize; PRESS_COLUMNS.len()],
}

impl Physics {
    fn new(set: &Value, columns: &[String]) -> Result<Self, Problem> {
        let place = |at: &usize| columns.iter().position(|c| c == COLUMNS[*at]);
        let places: Option<Vec<usize>> = PRESS_COLUMNS.iter().map(place).collect();
        let places = places.and_then(|places| places.try_into().ok());
        let (dome, prior) = (Dome::of_set(set), Prior::of_set(set));
        let (columns, (dome, prior)) =
            places.zip(dome.zip(prior)).ok_or("has not all that contact mechanics needs")?;
        Ok(Self { dome, prior, columns })
    }

    /// The numbers of each frame, from it and those before.
    fn of(&self, frames: &[&[f32]]) -> Vec<[f32; PHYSICS.len()]> {
        let row = |frame: &&[f32]| self.columns.map(|at| f64::from(frame[at]));
        let rows: Vec<PressRow> = frames.iter().map(row).collect();
        let until = |count: usize| {
            let found = hardness(&rows[..count], &self.dome, &self.prior);
            let [low, high] = found.interval;
            [found.log10_young as f32, (0.5 * (high - low)) as f32]
        };
        (1..=rows.len()).map(until).collect()
    }
}

/// How the members of a video are read.
struct Layout {
    frames: usize,
    size: [usize; 2],
    picture: Option<[usize; 2]>,
    columns: usize,
    used: Vec<Reading>,
    physics: Option<Physics>,
    leak: Leak,
    middle_log10: Option<f32>,
}

impl Layout {
    fn video(
        &self,
        key: &str,
        parts: &HashMap<String, Vec<u8>>,
    ) -> Result<Result<Video, &'static str>, Problem> {
        let at = |name: &str| format!("video {key}, {name}");
        let part = |name: &str| parts.get(name).ok_or_else(|| format!("{} is missing", at(name)));
        let json: Value =
            serde_json::from_slice(part("json")?).map_err(|e| format!("{}: {e}", at("json")))?;
        let number = |name: &str| {
            let value = json.get(name).and_then(Value::as_f64);
            value.ok_or_else(|| format!("{}: no number `{name}`", at("json")))
        };
        let split = match json.get("split").and_then(Value::as_str) {
            Some("train") => Split::Train,
            Some("val") => Split::Val,
            Some("test") => Split::Test,
            other => return Err(format!("{}: split {other:?}; allowed: train, val, test", at("json"))),
        };
        let log10_e = number("youngs_modulus_mpa")?.log10() as f32;
        let label = match self.middle_log10 {
            Some(middle) => usize::from(log10_e > middle),
            None => number("label")? as usize,
        };
        let first_contact = number("first_contact_frame")? as usize;
        if self.leak == Leak::BeforeContact && first_contact == 0 {
            return Ok(Err("no frame before contact"));
        }
        // a window that never touches: the last frame before contact stands for all that follow
        let last = if self.leak == Leak::BeforeContact { first_contact - 1 } else { usize::MAX };
        let shown: Vec<usize> = (0..self.frames).map(|frame| frame.min(last)).collect();

        let (sides, content) =
            npy(part("readings.npy")?, "<f4", 4).map_err(|e| format!("{} {e}", at("readings.npy")))?;
        if sides != [self.frames, self.columns] {
            return Err(format!("{} has the shape {sides:?}", at("readings.npy")));
        }
        let table: Vec<f32> =
            content.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        let rows: Vec<&[f32]> = shown.iter().map(|f| &table[f * self.columns..][..self.columns]).collect();
        let physics = self.physics.as_ref().map(|physics| physics.of(&rows)).unwrap_or_default();
        let value = |frame: usize, reading: &Reading| match *reading {
            Reading::Column(at) => rows[frame][at],
            Reading::Physics(at) => physics[frame][at],
        };
        let readings: Vec<f32> =
            (0..rows.len()).flat_map(|frame| self.used.iter().map(move |r| value(frame, r))).collect();
        if readings.iter().any(|value| !value.is_finite()) || !log10_e.is_finite() {
            return Ok(Err("a reading is missing"));
        }
        let (picture, rest) = match self.picture {
            Some(picture) => self
                .picture(picture, &shown, part("frames.npy")?, part("rest.npy")?)
                .map_err(|e| format!("video {key}, frames or rest: {e}"))?,
            None => (Vec::new(), Vec::new()),
        };
        let shape = json.pointer("/shape/name").and_then(Value::as_str).unwrap_or("").to_string();
        Ok(Ok(Video { key: key.into(), split, label, log10_e, picture, rest, readings, shape }))
    }

    fn picture(
        &self,
        to: [usize; 2],
        shown: &[usize],
        frames: &[u8],
        rest: &[u8],
    ) -> Result<(Vec<i16>, Vec<f64>), Problem> {
        let [height, width] = self.size;
        let ((sides, frames), (rest_sides, rest)) = (npy(frames, "|u1", 1)?, npy(rest, "|u1", 1)?);
        if sides != [self.frames, height, width, 3] || rest_sides != [height, width, 3] {
            return Err(format!("have the shapes {sides:?} and {rest_sides:?}"));
        }
        let mut shrinker = Shrinker::default();
        let mut shrunk = |bytes: &[u8]| {
            let mut out = vec![0.0_f32; to[0] * to[1] * 3];
            shrinker.shrink(&FrameView { width, height, channels: 3, bytes }, to, &mut out);
            out
        };
        let rest = shrunk(rest);
        let mut picture = Vec::with_capacity(self.frames * rest.len());
        for frame in shown {
            let levels = shrunk(&frames[frame * height * width * 3..][..height * width * 3]);
            picture.extend(
                levels.iter().zip(&rest).map(|(level, rest)| ((level - rest) * LEVEL_PARTS).round() as i16),
            );
        }
        Ok((picture, rest_profile(&rest, to).to_vec()))
    }
}

fn text_list(value: Option<&Value>) -> Option<Vec<String>> {
    value?.as_array()?.iter().map(|item| item.as_str().map(str::to_string)).collect()
}

/// Reads a set.
///
/// # Errors
/// What of it cannot be used, and where.
pub fn load(folder: &Path, options: &Options) -> Result<DataSet, Problem> {
    let path = folder.join("dataset.json");
    let fault = |problem: String| format!("{}: {problem}", path.display());
    let text = std::fs::read_to_string(&path).map_err(|e| fault(e.to_string()))?;
    let set: Value = serde_json::from_str(&text).map_err(|e| fault(e.to_string()))?;
    let count = |name: &str| {
        let value = set.get(name).and_then(Value::as_u64).filter(|value| (1..=100_000_000).contains(value));
        value.map(|value| value as usize).ok_or_else(|| fault(format!("no number `{name}`")))
    };
    if set.get("format").and_then(Value::as_str) != Some("domecast-dataset") || count("version")? != 1 {
        return Err(fault("is no data set of version 1".into()));
    }
    let columns =
        text_list(set.pointer("/readings/columns")).ok_or_else(|| fault("no `readings.columns`".into()))?;
    let groups = [(options.wrench, &WRENCH[..]), (options.dots, &DOTS[..])];
    let group =
        |is_seen: bool| groups.iter().filter(move |(seen, _)| *seen == is_seen).flat_map(|(_, names)| *names);
    // those that `track` does not have are seen or left out
    let beside = TRAVEL.iter().filter(|_| options.travel).chain(PHYSICS.iter().filter(|_| options.physics));
    let wanted: Vec<&str> = group(true).chain(beside.clone()).chain(group(false)).copied().collect();
    let seen = group(true).chain(beside).count();
    let used = wanted.iter().map(|name| Reading::named(name, &columns)).collect::<Result<Vec<_>, Problem>>();
    let used = used.map_err(fault)?;
    let physics = options.physics.then(|| Physics::new(&set, &columns)).transpose().map_err(fault)?;
    let size = [count("height")?, count("width")?];
    // the nearest height of the same shape that halves four times
    let height = ((options.width * size[0]) as f64 / (16 * size[1]) as f64).round().max(1.0) as usize * 16;
    let classes = text_list(set.get("classes"));
    let range = set
        .get("label_range_mpa")
        .and_then(Value::as_array)
        .map(|range| range.iter().filter_map(Value::as_f64).map(|e| e.log10() as f32).collect::<Vec<_>>());
    let middle_log10 = match (&classes, range.as_deref()) {
        (Some(_), _) => None,
        (None, Some([low, high])) => Some((low + high) / 2.0),
        _ => return Err(fault("neither `classes` nor `label_range_mpa`".into())),
    };
    let layout = Layout {
        frames: count("frames")?,
        size,
        picture: options.picture.then_some([height, options.width]),
        columns: columns.len(),
        leak: options.leak,
        middle_log10,
        used,
        physics,
    };
    let own_classes = classes.is_some();
    let cut = || middle_log10.map_or(0.0, |middle| 10_f32.powf(middle));
    let classes =
        classes.unwrap_or_else(|| ["below", "above"].map(|side| format!("{side} {:.2} MPa", cut())).to_vec());
    let mut result = DataSet {
        videos: Vec::new(),
        own_classes,
        readings: wanted.into_iter().map(str::to_string).collect(),
        seen,
        frames: layout.frames,
        picture: layout.picture,
        left_out: HashMap::new(),
        name: set.get("name").and_then(Value::as_str).unwrap_or("").into(),
        classes,
    };
    let shards = set.get("shards").and_then(Value::as_array).ok_or_else(|| fault("no `shards`".into()))?;
    for shard in shards {
        let file = shard.get("file").and_then(Value::as_str).unwrap_or("");
        if shard.get("sha256").is_none_or(Value::is_null) {
            return Err(fault(format!(
                "the shard \"{file}\" is not made yet: run `domecast dataset` to its end"
            )));
        }
        read_shard(&folder.join(file), &layout, options, &mut result)?;
    }
    check(&result).map_err(fault)?;
    Ok(result)
}

fn read_shard(path: &Path, layout: &Layout, options: &Options, result: &mut DataSet) -> Result<(), Problem> {
    let mut videos: Vec<(String, HashMap<String, Vec<u8>>)> = Vec::new();
    for (name, content) in members(path)? {
        let Some((key, part)) = name.split_once('.') else {
            return Err(format!("{}: a member \"{name}\"", path.display()));
        };
        if videos.last().is_none_or(|(last, _)| last != key) {
            videos.push((key.to_string(), HashMap::new()));
        }
        if let Some((_, parts)) = videos.last_mut() {
            parts.insert(part.to_string(), content);
        }
    }
    for (key, parts) in videos {
        if options.max_videos.is_some_and(|max| result.videos.len() >= max) {
            break;
        }
        match layout.video(&key, &parts).map_err(|e| format!("{}: {e}", path.display()))? {
            Ok(video) => result.videos.push(video),
            Err(reason) => *result.left_out.entry(reason).or_default() += 1,
        }
    }
    Ok(())
}

fn check(set: &DataSet) -> Result<(), Problem> {
    if let Some(video) = set.videos.iter().find(|video| video.label >= set.classes.len()) {
        return Err(format!(
            "video {} has the label {} of {} classes",
            video.key,
            video.label,
            set.classes.len()
        ));
    }
    for (split, min_count) in [(Split::Train, 8), (Split::Val, 4), (Split::Test, 1)] {
        let count = set.part(split).len();
        if count < min_count {
            return Err(format!("{count} usable videos of {split:?}; allowed: {min_count} or more"));
        }
    }
    if set.frames < 2 || (set.picture.is_none() && set.seen == 0) {
        return Err("nothing to learn from: fewer than two frames, or neither picture nor readings".into());
    }
    Ok(())
}
