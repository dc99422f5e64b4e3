//! Stage 3: which mark is which.
//!
//! In: a [`Plane`](super::frame::Plane), the sensor's model, and optics at a pose to look from: the last frame's for
//! the white markers, this frame's for the dots. Out: [`MarkerIdentities::discs`], a fitted disc for each white marker,
//! and [`DotsFound`], a [`DotTrack`] for each dot.

mod blob_matching;
mod buckets;
mod choice;
mod dot_faults;
mod dot_prediction;
mod dot_search;
mod dot_track;
mod dots;
mod false_dots;
mod groups;
mod key_check;
mod marker_hypotheses;
mod markers;
mod shifted_rows;
mod skin;
mod vanished_dots;

pub(super) use dot_track::DotTrack;
pub(super) use dots::{DotFrame, DotIdentities, DotsFound};
pub use false_dots::MAX_FALSE_DOTS;
pub use key_check::{CameraTurn, Orientation};
pub(super) use marker_hypotheses::{Choice, DISCS, MarkerHypotheses};
pub(super) use markers::{MarkerFrame, MarkerIdentities};
