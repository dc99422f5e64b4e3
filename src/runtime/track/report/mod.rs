//! Stage 6: one frame's result, and its files.
//!
//! In: [`FrameFindings`], what all stages found. Out: [`Tracked`], its JSON and CSV lines, and with the feature `overlay` a picture.

mod checks;
#[cfg(feature = "overlay")]
mod overlay;
mod problem;
mod reference;
mod reporter;
mod result;
mod write;

#[cfg(feature = "overlay")]
pub use overlay::{OverlayError, overlay_png};
pub use problem::{Problem, Problems};
pub(super) use reporter::{FrameFindings, Reporter};
pub use result::{DotResult, MarkerResult, Tracked};
pub use write::{CSV_HEADER, DOTS_CSV_HEADER, write_csv, write_dots_csv, write_json};
