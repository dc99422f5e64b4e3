//! White markers: candidates by contrast, then a fit of what a disc beside the dome looks like.
//!
//! A marker lies 0.2 mm beside the dome's rim, whose membrane is bright too: a centroid over a window would take some
//! of it in. So the picture of it is fitted: a disc on the sheet, the rim, three levels, the disc's place free.

mod candidates;
mod equations;
mod fit;
mod geometry;
mod shading;
mod still;
mod surroundings;
mod view;

pub(in crate::track) use candidates::Candidate;
pub(in crate::track) use fit::{FIT_REACH_PX, FittedDisc};
pub(in crate::track) use shading::ShadingSlope;
pub(crate) use still::marker_in_still;
pub(in crate::track) use view::{MAX_HALF_PX, MarkerView};
