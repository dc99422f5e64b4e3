//! The members of a JSON line that may be left out.

/// A member of a frame's JSON line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Field {
    /// The platform's pose, 4 x 4.
    Pose,
    /// Its standard deviations.
    PoseSd,
    /// The share of them that changes from frame to frame.
    PoseSdRandom,
    /// Root mean square of the markers' residuals, px.
    PoseRmsPx,
    /// The net wrench, N and N mm.
    Wrench,
    /// Its standard deviations.
    WrenchSd,
    /// The share of them that changes from frame to frame.
    WrenchSdRandom,
    /// The black dots.
    BlackDots,
    /// The white markers.
    WhiteMarkers,
    /// Dots that are none, in frames that were searched whole.
    FalseDots,
}

impl Field {
    /// All of them, in the order of the line.
    pub const ALL: [Self; 10] = [
        Self::Pose,
        Self::PoseSd,
        Self::PoseSdRandom,
        Self::PoseRmsPx,
        Self::Wrench,
        Self::WrenchSd,
        Self::WrenchSdRandom,
        Self::BlackDots,
        Self::WhiteMarkers,
        Self::FalseDots,
    ];

    /// Its name in the line.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Pose => "pose",
            Self::PoseSd => "pose_sd",
            Self::PoseSdRandom => "pose_sd_random",
            Self::PoseRmsPx => "pose_rms_px",
            Self::Wrench => "wrench",
            Self::WrenchSd => "wrench_sd",
            Self::WrenchSdRandom => "wrench_sd_random",
            Self::BlackDots => "black_dots",
            Self::WhiteMarkers => "white_markers",
            Self::FalseDots => "false_dots",
        }
    }

    /// The field of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|field| field.as_str() == name)
    }
}
