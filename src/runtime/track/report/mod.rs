//! Stage 6: one frame's result, and its files.
//!
//! In: [`FrameFindings`], what all stages found. Out: [`Tracked`], its JSON and CSV lines.

mod checks;
mod drift;
mod fields;
mod pace;
mod problem;
mod record;
mod reference;
mod reporter;
mod result;
mod smooth_motion;
mod tear;
mod touch;
mod write;

pub use fields::Field;
pub use problem::{Problem, Problems};
pub use record::{RECORD_BYTES, write_record};
pub(super) use reporter::{FrameFindings, Reporter};
pub use result::{DotReference, DotResult, MarkerResult, Tracked};
pub use write::{CSV_HEADER, DOTS_CSV_HEADER, write_csv, write_dots_csv, write_json, write_json_fields};
