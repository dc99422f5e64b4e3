//! From frames and constants to markers, pose, wrench and local displacement.
//!
//! [`Tracker`] is the one state object: a [`Frame`] in, a [`Tracked`] out, and nothing is allocated once it runs. It
//! sees only the constants of a sensor, as a runtime on a robot does.
//!
//! # The steps, and what each buys
//!
//! The paper (arXiv 2303.03093) undistorts, blurs, masks, sharpens and greys every frame as a whole, thresholds it
//! twice, follows the black markers by optical flow and solves PnP on the white ones. The same steps are here, each
//! where it pays:
//!
//! | paper | here | why |
//! |---|---|---|
//! | undistort the frame | lens and layers on *points* (`optics`); the frame only if asked for ([`Undistorted`]) | a remapped frame is interpolated, which costs time for every pixel and blurs; points are exact |
//! | Gaussian blur | only before the search of the whole frame | a centroid over a hundred grey pixels is the better filter, and a blur moves none |
//! | circular mask | its pixels found once, as row spans of the raw frame | the same pixels, without touching a frame |
//! | sharpen | on request ([`Steps::sharpen`]) | it lifts thresholded edges, but white noise five times (the root of 29); half-height levels need none |
//! | grey | luma unless asked otherwise ([`Channel`]) | colour filters and JPEG blur single channels: with everything on, dots are 0.025 px off in luma, 0.061 px in green. Green alone is free of dispersion, which shifts luma by 0.006 px on average |
//! | low / high threshold | half way between local ground and mark ([`Thresholds`]); the paper's fixed ones on request | an edge at half height is where the outline is, whatever the light |
//! | morphology | on request; else blobs are judged by area and fullness | opening eats at the edge of dots that are seven pixels wide |
//! | components, centroids | the same in the search; then grey-weighted centroids against the local ground | a binary centroid has whole pixels to count; a grey one of a 7 px dot is good to 0.02 px |
//! | pyramidal Lucas-Kanade | where the pose and the last frame put each dot, then its centroid; flow on request ([`Motion`]) | flow drifts, centroids do not; the platform's part of the motion is known exactly from the white markers |
//! | solvePnP | least squares on raw pixels through lens, layers and disc | plain PnP is biased by millimetres behind a sheet |
//! | wrench linear in the pose | the springs' law by compression ([`Springs`]) | springs between magnets are not linear over their travel |

mod dots;
mod error;
mod frame;
mod identify;
pub mod image;
mod light;
mod mask;
mod model;
mod options;
mod overlay;
mod refine;
mod report;
mod result;
mod springs;
mod status;
mod surplus;
mod tilt;
mod tracker;
mod undistort;
mod whites;

pub use error::TrackError;
pub use frame::{Frame, FrameFault};
pub use options::{Channel, Motion, Reference, Steps, Thresholds, TrackOptions};
pub use overlay::{OverlayError, overlay_png};
pub use report::{CSV_HEADER, DOTS_CSV_HEADER, write_csv, write_dots_csv, write_json};
pub use result::{DotResult, MOST_FALSE_DOTS, MarkerResult, Tracked};
pub use springs::Springs;
pub use status::{MarkState, Problem, Problems};
pub use tracker::Tracker;
pub use undistort::Undistorted;
