//! The options of `domecast live`.

use std::path::PathBuf;

use crate::commands::track::field;
use crate::commands::tracker_arguments::TrackerArguments;
use domecast_live::source::ControlRequest;
use domecast_runtime::track::Field;

/// Arguments of `domecast live`.
#[derive(Debug, clap::Args)]
pub struct LiveArguments {
    /// A camera (`/dev/video0`), `-` for PPM pictures on standard input (from ffmpeg), or recorded frames played as a camera
    /// would give them: `player:FOLDER?rate=60`. Further settings of the player, each after `&`: frames, drop, repeat, tear,
    /// delay, delay_ms, unplug, unplug_s, seed.
    #[arg(value_name = "DEVICE")]
    pub device: String,
    /// The constants.json of the sensor.
    #[arg(long)]
    pub constants: PathBuf,
    /// Record frames, wrench, pose, dots and status as ROS 2 messages (MCAP). It grows in its place: killed, it is there to its
    /// last half second.
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Show the readings in a page of this machine, at http://127.0.0.1:PORT/ [default port: one that is free].
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "0")]
    pub show: Option<u16>,
    /// A frame of the untouched sensor: the page then shows the depth of the skin too, and the recording has its heights, of the frames
    /// that there is time for. `--hardness` reads against it as well.
    #[arg(long, value_name = "FRAME")]
    pub rest: Option<PathBuf>,
    /// State how hard what is touched is, by this model, as `track --hardness` does.
    #[arg(long, requires = "rest", value_name = "MODEL")]
    pub hardness: Option<PathBuf>,
    /// The model sees each so many-th frame.
    #[arg(long, requires = "hardness", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..), value_name = "N")]
    pub hardness_every: u64,
    /// Only these members of the JSON lines, separated by commas: `frame`, `time_s`, `status`, `problems`, `age_ms` and
    /// `dropped` are always there.
    #[arg(long, value_name = "NAME,..", value_delimiter = ',', value_parser = field)]
    pub fields: Vec<Field>,
    /// Frames a second that the camera is asked for.
    #[arg(long, value_name = "HZ", default_value_t = 30.0, value_parser = rate)]
    pub rate: f64,
    /// Exposure time, ms [default: locked where it stands].
    #[arg(long, value_name = "MS", value_parser = milliseconds)]
    pub exposure: Option<f64>,
    /// Gain, in the camera's own steps [default: locked where it stands].
    #[arg(long)]
    pub gain: Option<i32>,
    /// Colour temperature of the white balance, K [default: locked where it stands].
    #[arg(long, value_name = "K")]
    pub white_balance: Option<i32>,
    /// End after so many frames.
    #[arg(long, value_name = "N")]
    pub frames: Option<u64>,
    #[command(flatten)]
    pub tracker: TrackerArguments,
}

/// Frames a second.
pub fn rate(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|v: &f64| (0.1..=1000.0).contains(v));
    number.ok_or_else(|| "a number of frames a second from 0.1 to 1000".into())
}

/// An exposure.
pub fn milliseconds(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|v: &f64| (0.1..=10_000.0).contains(v));
    number.ok_or_else(|| "a number of ms from 0.1 to 10000".into())
}

impl LiveArguments {
    /// What is wanted of the camera's controls.
    pub fn controls(&self) -> ControlRequest {
        ControlRequest { exposure_ms: self.exposure, gain: self.gain, white_balance_k: self.white_balance }
    }
}
