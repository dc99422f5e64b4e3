//! What a user may choose.

/// By how many levels of 255 the middle of a white marker must be brighter than what is around it to be a candidate: what
/// quantisation and a small camera's noise leave of the mean of nine pixels is a tenth of it. Markers that only the dome's
/// own light reaches rise by little more than ten.
pub const MIN_MARKER_RISE_LEVELS: f64 = 4.0;

/// The channel that marks are measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Channel {
    /// Red alone.
    Red,
    /// Green: the one that the constants' indices are for.
    #[default]
    Green,
    /// Blue alone.
    Blue,
    /// The paper's grey, 0.30 R + 0.59 G + 0.11 B.
    Luma,
}

/// Where displacements and wrenches are counted from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reference {
    /// The constants' rest: nothing needs to be unloaded, not even in the first frame.
    #[default]
    Constants,
    /// The mean of the first so many good frames, which must be without load: takes out what the constants are off.
    Frames(u32),
}

/// Settings of a tracker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackOptions {
    /// The channel that marks are measured in.
    pub channel: Channel,
    /// Where displacements and wrenches are counted from.
    pub reference: Reference,
    /// Largest rms of the white markers' residuals that is still a pose, px. Above what the constants' own tolerances
    /// allow, they are reported as another camera's.
    pub max_residual_px: f64,
    /// Largest distance, in parts of the dots' spacing, at which a quarter of the dots may lie from where the pose
    /// puts them, with which constants still pass for the camera's.
    pub max_misplaced: f64,
    /// The whole frame is searched for lost and false dots at least every so many frames; 0: only when needed.
    pub search_every: u32,
    /// By how much the picture is known to be turned against the constants' camera, from image x towards image y, rad:
    /// the camera was mounted so. With a number, 0 too, the key is not asked whether it is sure.
    pub camera_turned_rad: Option<f64>,
    /// Temperature of the springs, degrees C, where it is known; `None`: that of the constants' stiffness.
    pub temperature_c: Option<f64>,
}

impl Default for TrackOptions {
    fn default() -> Self {
        Self {
            channel: Channel::Luma,
            reference: Reference::Constants,
            max_residual_px: 2.0,
            max_misplaced: 0.5,
            search_every: 30,
            camera_turned_rad: None,
            temperature_c: None,
        }
    }
}
