//! A camera's frames as they come, recordings for ROS 2 and its viewers, and a page that shows them live.

mod ages;
pub mod decode;
pub mod frame_files;
mod heights;
pub mod page;
mod reader;
mod reading;
pub mod record;
pub mod source;

pub use ages::AgeStatistics;
pub use heights::HeightReader;
pub use reader::{LiveEvent, LiveReader};
pub use reading::LiveReading;
