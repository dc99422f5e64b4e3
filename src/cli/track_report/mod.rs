//! The page of `track --report`: curves over time and the skin in 3D, in one file that opens from a disk.
//!
//! [`page`] is the page of a [`TrackReport`], which takes the frames as they come and keeps a bounded number of them, so that a recording may be as long as it likes.

mod curves;
mod data;
mod page;
mod quantities;
mod record;
mod skin;
mod still;
mod thinned;

pub use page::page;
pub use record::TrackReport;
