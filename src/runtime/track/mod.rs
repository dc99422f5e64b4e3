//! From frames and constants to markers, pose, wrench and local displacement.
//!
//! [`Tracker`] is the one state object: a [`CameraFrame`] in, a [`Tracked`] out, and nothing is allocated once it runs. It
//! sees only the constants of a sensor, as a runtime on a robot does.
//!
//! ```no_run
//! use domecast_runtime::constants::Constants;
//! use domecast_runtime::track::{CameraFrame, TrackOptions, Tracker};
//!
//! let constants = Constants::load("constants.json".as_ref())?;
//! let mut tracker = Tracker::new(&constants, TrackOptions::default())?;
//! let bytes = std::fs::read("frame.gray")?;
//! let tracked = tracker.track(0, &CameraFrame::new(640, 480, 1, &bytes)?);
//! if let Some(wrench) = tracked.wrench {
//!     println!("{} N", wrench.force_n.z);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The stages
//!
//! ```text
//! frame -> marks -> identities -> pose -> wrench -> report
//! ```
//!
//! | stage | from | to |
//! |---|---|---|
//! | `frame` | the camera's bytes | one channel of them, and their exposure |
//! | `marks` | pixels around a place, or all | dark spots, dark blobs, fitted discs: nothing of which mark they are |
//! | `identities` | marks, and optics at a pose to look from | a disc for each white marker, a track for each dot |
//! | `pose` | the white markers | the platform's pose with its covariance |
//! | `wrench` | the pose, and the dots at it | displacement and wrench with deviations, displacement of each dot |
//! | `report` | what all of them found | [`Tracked`], its JSON and CSV lines |
//!
//! A stage knows only the types of the ones before it. The white markers are looked for where the last frame's pose
//! puts them, the dots where this frame's does.
//!
//! Constants with neither springs nor white markers are those of a rigid mount: its platform is at rest in every frame.
//! The stages `pose` and `wrench` say nothing then, and the dots' displacements are those of the dome alone.
//!
//! # The steps, and what each buys
//!
//! The paper (arXiv 2303.03093) undistorts, blurs, masks, sharpens and greys every frame as a whole, thresholds it
//! twice, follows the black markers by optical flow and solves PnP on the white ones. Its steps are here where they pay:
//!
//! | paper | here | why |
//! |---|---|---|
//! | undistort the frame | lens and layers on *points* (`optics`); the frame only if asked for ([`Undistorted`]) | a remapped frame is interpolated, which costs time for every pixel and blurs; points are exact |
//! | Gaussian blur | only before the search of the whole frame | a centroid over a hundred grey pixels is the better filter, and a blur moves none |
//! | circular mask | its pixels found once, as row spans of the raw frame | the same pixels, without touching a frame |
//! | sharpen | none | it lifts thresholded edges, but white noise five times (the root of 29); half-height levels need none |
//! | grey | luma unless asked otherwise ([`Channel`]) | colour filters and JPEG blur single channels: with everything on, dots are 0.025 px off in luma, 0.061 px in green. Green alone is free of dispersion, which shifts luma by 0.006 px on average |
//! | low / high threshold | half way between local ground and mark | an edge at half height is where the outline is, whatever the light |
//! | morphology | none: blobs are judged by area and fullness | opening eats at the edge of dots that are seven pixels wide |
//! | components, centroids | the same in the search; then grey-weighted centroids against the local ground | a binary centroid has whole pixels to count; a grey one of a 7 px dot is good to 0.02 px |
//! | pyramidal Lucas-Kanade | where the pose and the last frame put each dot, then its centroid | flow drifts, centroids do not; the platform's part of the motion is known exactly from the white markers. Flow doubled the time of a frame and found one dot of 20,000 more |
//! | solvePnP | least squares on raw pixels through lens, layers and disc | plain PnP is biased by millimetres behind a sheet |
//! | wrench linear in the pose | the springs' law by compression ([`Springs`]) | springs between magnets are not linear over their travel |

mod error;
mod frame;
mod identities;
mod marks;
mod meter;
mod model;
mod options;
mod pose;
mod report;
mod tracker;
mod wrench;

pub use error::TrackError;
pub use frame::{CameraFrame, FrameFault, Undistorted};
pub use identities::{CameraTurn, MAX_FALSE_DOTS};
pub use marks::MarkState;
pub(crate) use marks::marker_in_still;
pub use meter::{MarkerCentroid, MeasuredWrench, WrenchMeter};
pub use options::{Channel, MIN_MARKER_RISE_LEVELS, Reference, TrackOptions};
pub use report::{
    CSV_HEADER, DOTS_CSV_HEADER, DotReference, DotResult, Field, MarkerResult, Problem, Problems,
    RECORD_BYTES, Tracked, write_csv, write_dots_csv, write_json, write_json_fields, write_record,
};
pub use tracker::Tracker;
pub use wrench::Springs;
