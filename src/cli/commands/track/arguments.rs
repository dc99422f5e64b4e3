//! The options of `domecast track`.

use std::path::{Path, PathBuf};

use super::source::RawSize;
use crate::commands::input::input_fault;
use crate::commands::output::{Failure, Output};
use crate::commands::tracker_arguments::TrackerArguments;
use domecast_runtime::track::{Field, TrackError};

/// What is written for each frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// A JSON object a line.
    Jsonl,
    /// Pose and wrench, a line a frame.
    Csv,
    /// The dots, a line each.
    DotsCsv,
    /// Pose and wrench as binary records of 240 bytes, a frame each: for loops that have no time to read text.
    Records,
}

/// Arguments of `domecast track`.
#[derive(Debug, clap::Args)]
#[command(group(clap::ArgGroup::new("read_against_rest").args(["shape", "hardness", "traction"]).multiple(true)))]
pub struct TrackArguments {
    /// A folder of PNG or JPEG frames, frames, a video (through ffmpeg), a file of raw frames (with --raw), or `-` for
    /// standard input (PGM or PPM pictures one after the other, or raw with --raw).
    #[arg(required = true)]
    pub frames: Vec<PathBuf>,
    /// The constants.json of the sensor.
    #[arg(long)]
    pub constants: PathBuf,
    /// Where to write [default: standard output].
    #[arg(long)]
    pub out: Option<PathBuf>,
    #[arg(long, value_enum, default_value = "jsonl")]
    pub format: Format,
    /// Only these members of the JSON lines, separated by commas: `frame`, `status` and `problems` are always there. A loop
    /// that needs the wrench alone reads a tenth of the bytes.
    #[arg(long, value_name = "NAME,..", value_delimiter = ',', value_parser = field)]
    pub fields: Vec<Field>,
    /// State the forces on the skin as well: traction (pressure and shear) at each dot, and what touches as a whole. Give --reference or
    /// --rest with it: dots are printed to a tenth of a millimetre, which a light touch does not move them by.
    #[arg(long)]
    pub traction: bool,
    /// Draw dots, axes and force over each frame, into this folder; with --shape the skin's depth as colours and the outline
    /// of what touches too, with --traction the forces on the skin.
    #[arg(long)]
    pub overlay: Option<PathBuf>,
    /// Write a page (HTML) of all frames: a summary, curves of force, torque, pose, and with --shape of the contact, and the
    /// skin in 3D. It opens from a disk without a network.
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Record frames, wrench, pose, dots and status as ROS 2 messages, which Foxglove, rerun and `ros2 bag` open; with --shape
    /// the skin's heights too. It grows in its place: killed, it is there to its last half second. Without --times frames
    /// stand a thirtieth of a second apart.
    #[arg(long, value_name = "FILE")]
    pub mcap: Option<PathBuf>,
    /// How many times as long as they are the arrows of the dots are drawn.
    #[arg(long, default_value_t = 1.0)]
    pub magnify: f64,
    /// Write each frame undistorted and masked, as the paper's runtime sees it, into this folder.
    #[arg(long)]
    pub undistorted: Option<PathBuf>,
    /// Read the skin's shape from each frame's colours, into this folder: `frame_NNNN.height.npy` (mm from its shape at
    /// rest, negative where it is pressed in), `.height_sd.npy`, `.normal.npy` and `.contact.npy`, all on the raw image's grid;
    /// `.height.png` (16 bits) and `.ply` (the skin as triangles).
    #[arg(long, requires = "rest")]
    pub shape: Option<PathBuf>,
    /// State how hard what is touched is, by this model (ONNX, from `domecast-learn`), over a window of frames: class, Young's
    /// modulus with its 90 % interval, or `unsure` where the touch is unlike what the model was trained with.
    #[arg(long, requires = "rest", value_name = "MODEL")]
    pub hardness: Option<PathBuf>,
    /// The model sees each so many-th frame: its window should last about as long as the videos that it was trained with.
    #[arg(long, requires = "hardness", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..), value_name = "N")]
    pub hardness_every: u64,
    /// How far the hand has brought sensor and object together: a file (or a pipe) with mm, a line a frame, from anywhere. With it
    /// each line states `contact_hardness`: Young's modulus of what is touched by contact mechanics, with its 90 % interval, over the
    /// frames of the touch so far.
    #[arg(long, requires_all = ["rest", "traction", "shape"], value_name = "FILE")]
    pub travel: Option<PathBuf>,
    /// Standard deviation of that travel, mm: of encoders and wrist.
    #[arg(long, requires = "travel", default_value_t = 0.02, value_parser = deviation, value_name = "MM")]
    pub travel_sd: f64,
    /// A frame of the untouched sensor, which shape, forces on the skin and hardness are read against.
    #[arg(long, requires = "read_against_rest", value_name = "FRAME")]
    pub rest: Option<PathBuf>,
    /// Raw frames of this size: WIDTHxHEIGHT:gray, WIDTHxHEIGHT:rgb or, blue first as OpenCV has them, WIDTHxHEIGHT:bgr.
    #[arg(long)]
    pub raw: Option<RawSize>,
    /// A file (or a pipe) with the time of each frame, s, a line each: lines have `time_s`, and frames that are missing by
    /// their times are gaps.
    #[arg(long, value_name = "FILE")]
    pub times: Option<PathBuf>,
    /// How gravity lies: a file (or a pipe) with three numbers a line, a line a frame: gravity less the sensor's own acceleration,
    /// sensor frame, m/s^2 (upright: 0 0 -9.81; an accelerometer reads the opposite). The weight of what the springs carry is then
    /// taken off the wrench. Without it a sensor that is turned over reports twice its own weight as a load.
    #[arg(long, requires = "reference", value_name = "FILE")]
    pub gravity: Option<PathBuf>,
    #[command(flatten)]
    pub tracker: TrackerArguments,
    // taken for one version more, without effect
    #[arg(long, hide = true)]
    flow: bool,
    #[arg(long, hide = true)]
    pyramid_levels: Option<u32>,
    #[arg(long, hide = true)]
    thresholds: Option<String>,
    #[arg(long, hide = true)]
    sharpen: bool,
    #[arg(long, hide = true)]
    no_blur: bool,
    #[arg(long, hide = true)]
    open: bool,
}

fn deviation(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|v: &f64| (1e-6..=10.0).contains(v));
    number.ok_or_else(|| "a number of mm from 1e-6 to 10".into())
}

/// A field by its name.
pub fn field(text: &str) -> Result<Field, String> {
    let names = || Field::ALL.map(Field::as_str).join(", ");
    Field::from_name(text.trim()).ok_or_else(|| format!("one of {}", names()))
}

impl TrackArguments {
    /// Constants that cannot be tracked with.
    pub fn unfit(&self, error: &TrackError) -> Failure {
        input_fault(&self.constants, error.to_string(), "constants of a sensor")
    }

    /// What is wrong with a frame's gravity: in its own file, or in the constants.
    pub fn unfit_gravity(&self, error: &TrackError, frame: u64) -> Failure {
        match &self.gravity {
            Some(path) if error.field == "gravity" => {
                input_fault(path, format!("frame {frame}: {error}"), "gravity in the sensor frame")
            }
            _ => self.unfit(error),
        }
    }

    /// Refuses a file whose numbers only JSON lines have a place for.
    pub fn need_jsonl(&self, path: &Path) -> Result<(), Failure> {
        if self.format == Format::Jsonl {
            return Ok(());
        }
        Err(input_fault(path, "has no place in this --format", "--format jsonl"))
    }

    /// Says so where an option is given that has no effect any more.
    pub fn note_what_is_gone(&self, output: &Output) {
        let gone = [
            (self.flow, "--flow"),
            (self.pyramid_levels.is_some(), "--pyramid-levels"),
            (self.thresholds.is_some(), "--thresholds"),
            (self.sharpen, "--sharpen"),
            (self.no_blur, "--no-blur"),
            (self.open, "--open"),
        ];
        for (_, option) in gone.iter().filter(|(is_given, _)| *is_given) {
            output.warn(&format!(
                "{option} has no effect any more: dots are found where the pose puts them; the next version does not take it"
            ));
        }
    }
}
