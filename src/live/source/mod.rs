//! Where live frames come from: a camera, a player of recorded frames, a stream. All stand behind [`LiveSource`].
//!
//! ```
//! use domecast_live::source::PlayerOptions;
//!
//! let (folder, options) = PlayerOptions::parse("frames?rate=60&drop=0.01&unplug=100&unplug_s=0.5")?;
//! assert_eq!((folder.to_str(), options.rate_hz, options.unplug), (Some("frames"), 60.0, vec![100]));
//! # Ok::<(), String>(())
//! ```

mod camera;
mod controls;
mod device;
mod player;
mod player_options;
mod stream;

use std::fmt;
use std::sync::Arc;
use std::time::Instant;

use crate::decode::{Picture, picture, with_huffman_tables, yuyv};

pub use camera::{CameraRequest, open_camera};
pub use controls::{CameraControls, ControlId, ControlRange, ControlReading, ControlRequest, lock_controls};
pub use device::open_device;
pub use player::Player;
pub use player_options::PlayerOptions;
pub use stream::PictureStream;

/// The pixels of a frame, in whatever form they came.
#[derive(Debug, Clone)]
pub enum FrameData {
    /// Grey or red, green, blue.
    Pixels(Arc<Picture>),
    /// A JPEG, its Huffman tables left out or not.
    Jpeg(Arc<[u8]>),
    /// Two pixels in four bytes.
    Yuyv {
        /// Pixels across.
        width: usize,
        /// Pixels down.
        height: usize,
        /// Bytes from row to row.
        line_bytes: usize,
        /// The rows.
        bytes: Arc<[u8]>,
    },
    /// The camera says that it is damaged, and how.
    Damaged(String),
}

impl FrameData {
    /// The pixels.
    ///
    /// # Errors
    /// What is wrong with the frame.
    pub fn decode(&self) -> Result<Arc<Picture>, String> {
        match self {
            Self::Pixels(picture) => Ok(Arc::clone(picture)),
            Self::Jpeg(bytes) => picture(&with_huffman_tables(bytes)).map(Arc::new),
            Self::Yuyv { width, height, line_bytes, bytes } => {
                yuyv(*width, *height, *line_bytes, bytes).map(Arc::new)
            }
            Self::Damaged(problem) => Err(problem.clone()),
        }
    }
}

/// A frame that has arrived.
#[derive(Debug, Clone)]
pub struct ArrivedFrame {
    /// Its number; one that is left out is a frame that never came.
    pub number: u64,
    /// When it was taken, s since the source was opened.
    pub time_s: f64,
    /// When all of it was there: ages are counted from here.
    pub complete: Instant,
    /// What it shows.
    pub data: FrameData,
    /// The bytes of its file, where it has one that a recording may hold as it is.
    pub file: Option<Arc<[u8]>>,
}

/// What a source says of itself.
#[derive(Debug, Clone, Default)]
pub struct SourceInfo {
    /// The device or folder.
    pub name: String,
    /// Pixels across and down; `None` where only its frames tell.
    pub size: Option<[usize; 2]>,
    /// How frames come: `yuyv`, `mjpeg`, `files`, `stream`.
    pub format: &'static str,
    /// Frames a second, where it is known.
    pub rate_hz: Option<f64>,
    /// Controls as they were read back.
    pub controls: Vec<ControlReading>,
    /// What its user must know, such as a control that the camera does not have.
    pub warnings: Vec<String>,
}

/// Why there are no frames for now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceLost(pub String);

impl fmt::Display for SourceLost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for SourceLost {}

/// Something that gives frames as they come.
pub trait LiveSource: Send {
    /// What it is.
    fn info(&self) -> &SourceInfo;

    /// Waits for the next frame; `None` at the end of a source that has one.
    ///
    /// # Errors
    /// [`SourceLost`]: the device is gone; [`LiveSource::reopen`] may bring it back.
    fn next_frame(&mut self) -> Result<Option<ArrivedFrame>, SourceLost>;

    /// Whether a source that is lost may come back.
    fn comes_back(&self) -> bool {
        true
    }

    /// Tries once to open it again, with the same settings.
    ///
    /// # Errors
    /// [`SourceLost`]: it is still gone.
    fn reopen(&mut self) -> Result<(), SourceLost>;
}
