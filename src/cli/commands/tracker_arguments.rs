//! How frames are tracked: the options that `track` and `live` have alike.

use domecast_runtime::track::{Channel, Reference, TrackOptions};

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum ChannelName {
    Red,
    Green,
    Blue,
    /// The paper's grey.
    Luma,
}

/// How frames are tracked.
#[derive(Debug, clap::Args)]
pub struct TrackerArguments {
    /// The channel that marks are measured in: colour filters and JPEG leave luma whole, where they are not, green is
    /// free of dispersion.
    #[arg(long, value_enum, default_value = "luma")]
    channel: ChannelName,
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
    #[arg(long, value_name = "C", allow_negative_numbers = true, value_parser = super::calibrate_force::celsius)]
    temperature: Option<f64>,
}

fn degrees(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|v: &f64| v.abs() <= 360.0);
    number.ok_or_else(|| "a number of degrees from -360 to 360".into())
}

impl TrackerArguments {
    /// Whether the picture, mirrored back, is turned against the constants.
    pub fn is_turned(&self) -> bool {
        self.camera_turned.is_some_and(|deg| deg != 0.0)
    }

    /// Whether the first frames say what the untouched sensor shows.
    pub fn has_reference(&self) -> bool {
        self.reference.is_some_and(|frames| frames > 0)
    }

    /// A picture that is mirrored and then turned is, mirrored back, turned the other way.
    fn camera_turned_rad(&self) -> Option<f64> {
        let turned_rad = self.camera_turned.map(f64::to_radians);
        if self.camera_mirrored { Some(-turned_rad.unwrap_or(0.0)) } else { turned_rad }
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
            reference: self.reference.map_or(Reference::Constants, Reference::Frames),
            search_every: self.search_every,
            max_residual_px: self.max_residual_px,
            max_misplaced: self.max_misplaced,
            camera_turned_rad: self.camera_turned_rad(),
            temperature_c: self.temperature,
        }
    }
}
