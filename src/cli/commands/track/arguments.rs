//! The options of `domecast track`.

use std::path::PathBuf;

use super::source::RawSize;
use crate::commands::input::input_fault;
use crate::commands::output::{Failure, Output};
use domecast_runtime::track::{Channel, Field, Reference, Steps, Thresholds, TrackError, TrackOptions};

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

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum ChannelName {
    Red,
    Green,
    Blue,
    /// The paper's grey.
    Luma,
}

/// Arguments of `domecast track`.
#[derive(Debug, clap::Args)]
#[group(skip)]
#[command(group = clap::ArgGroup::new("read_against_rest").multiple(true))]
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
    /// State the forces on the skin as well: traction (pressure and shear) at each dot, and what touches as a whole.
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
    /// How many times as long as they are the arrows of the dots are drawn.
    #[arg(long, default_value_t = 1.0)]
    pub magnify: f64,
    /// Write each frame undistorted and masked, as the paper's runtime sees it, into this folder.
    #[arg(long)]
    pub undistorted: Option<PathBuf>,
    /// Read the skin's shape from each frame's colours, into this folder: `frame_NNNN.height.npy` (mm from its shape at
    /// rest, negative where it is pressed in), `.height_sd.npy`, `.normal.npy` and `.contact.npy`, all on the raw image's grid;
    /// `.height.png` (16 bits) and `.ply` (the skin as triangles).
    #[arg(long, requires = "rest", group = "read_against_rest")]
    pub shape: Option<PathBuf>,
    /// A frame of the untouched sensor, which the shape and the hardness are read against.
    #[arg(long, requires = "read_against_rest", value_name = "FRAME")]
    pub rest: Option<PathBuf>,
    /// State the hardness of what is touched as well, by this model (ONNX, of `domecast-learn`): class, log10 of Young's modulus
    /// with a 90 % interval, or that it is unsure.
    #[arg(long, requires = "rest", value_name = "MODEL", group = "read_against_rest")]
    pub hardness: Option<PathBuf>,
    /// The hardness is read from every so many frames: the model's window then spans as long a press as those that it was
    /// trained with.
    #[arg(long, requires = "hardness", default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    pub hardness_every: u64,
    /// Raw frames of this size: WIDTHxHEIGHT:gray or WIDTHxHEIGHT:rgb.
    #[arg(long)]
    pub raw: Option<RawSize>,
    /// A file (or a pipe) with the time of each frame, s, a line each: lines have `time_s`, and frames that are missing by
    /// their times are gaps.
    #[arg(long, value_name = "FILE")]
    pub times: Option<PathBuf>,
    /// The channel that marks are measured in: colour filters and JPEG leave luma whole, where they are not, green is
    /// free of dispersion.
    #[arg(long, value_enum, default_value = "luma")]
    channel: ChannelName,
    /// The paper's fixed levels, BLACK,WHITE (0 to 255), instead of adaptive ones.
    #[arg(long, value_parser = levels)]
    thresholds: Option<[u8; 2]>,
    // taken for one version more, without effect
    #[arg(long, hide = true)]
    flow: bool,
    #[arg(long, hide = true)]
    pyramid_levels: Option<u32>,
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
    #[arg(long, alias = "most-residual-px", default_value_t = 2.0)]
    max_residual_px: f64,
    /// Share of the dots' spacing by which three quarters of them may be misplaced before the constants are called
    /// another sensor's.
    #[arg(long, alias = "most-misplaced", default_value_t = 0.5)]
    max_misplaced: f64,
    /// The camera is mounted so that the picture is turned clockwise by so many degrees against the constants. With a
    /// number, 0 too, a key that cannot be seen is no fault.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = degrees)]
    camera_turned: Option<f64>,
    /// The picture is mirrored left to right, before it is turned; pixels are then stated as in the picture mirrored back.
    #[arg(long)]
    pub camera_mirrored: bool,
    /// Temperature of the springs, degrees C [default: that of the constants' stiffness].
    #[arg(long, value_name = "C", allow_negative_numbers = true, value_parser = crate::commands::calibrate_force::celsius)]
    temperature: Option<f64>,
}

fn field(text: &str) -> Result<Field, String> {
    let names = || Field::ALL.map(Field::as_str).join(", ");
    Field::from_name(text.trim()).ok_or_else(|| format!("one of {}", names()))
}

fn degrees(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|v: &f64| v.abs() <= 360.0);
    number.ok_or_else(|| "a number of degrees from -360 to 360".into())
}

fn levels(text: &str) -> Result<[u8; 2], String> {
    let parts: Vec<u8> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    match parts.as_slice() {
        [black, white] if black < white => Ok([*black, *white]),
        _ => Err("two levels from 0 to 255, the black one first: 60,200".into()),
    }
}

impl TrackArguments {
    /// A picture that is mirrored and then turned is, mirrored back, turned the other way.
    fn camera_turned_rad(&self) -> Option<f64> {
        let turned_rad = self.camera_turned.map(f64::to_radians);
        if self.camera_mirrored { Some(-turned_rad.unwrap_or(0.0)) } else { turned_rad }
    }

    /// Constants that cannot be tracked with.
    pub fn unfit(&self, error: &TrackError) -> Failure {
        input_fault(&self.constants, error.to_string(), "constants of a sensor")
    }

    /// Says so where an option is given that has no effect any more.
    pub fn note_what_is_gone(&self, output: &Output) {
        if self.flow || self.pyramid_levels.is_some() {
            output.warn(
                "--flow and --pyramid-levels have no effect any more: dots are found where the pose puts them; the next version does \
                 not take them",
            );
        }
    }

    /// What the tracker is to do.
    pub fn options(&self) -> TrackOptions {
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
            reference: self.reference.map_or(Reference::Constants, Reference::Frames),
            search_every: self.search_every,
            max_residual_px: self.max_residual_px,
            max_misplaced: self.max_misplaced,
            camera_turned_rad: self.camera_turned_rad(),
            temperature_c: self.temperature,
        }
    }
}
