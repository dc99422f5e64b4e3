//! Recordings that ROS 2, Foxglove and rerun open: MCAP files of ROS 2 messages.
//!
//! | topic | type | what |
//! |---|---|---|
//! | `/domecast/image/compressed` | `sensor_msgs/CompressedImage` | the frame as it came, PNG or JPEG; or |
//! | `/domecast/image` | `sensor_msgs/Image` | its pixels, where it came as pixels |
//! | `/domecast/wrench` | `geometry_msgs/WrenchStamped` | N and N m, about the origin of `domecast_wrench` |
//! | `/domecast/wrench/force_x_n` .. `/domecast/wrench/moment_z_nmm` | `std_msgs/Float64` | the same six, N and N mm, as `track` states them |
//! | `/domecast/pose` | `geometry_msgs/PoseStamped` | the platform in the frame `domecast_rest`, m |
//! | `/tf` | `tf2_msgs/TFMessage` | `domecast_sensor`, `domecast_camera` and `domecast_wrench` in `domecast_rest` |
//! | `/domecast/dots` | `sensor_msgs/PointCloud2` | each dot's place at rest, displacement, number, state |
//! | `/domecast/height` | `sensor_msgs/Image` | the skin's height where it is measured, m, 32FC1 |
//! | `/domecast/status` | `diagnostic_msgs/DiagnosticArray` | the frame's status and problems |
//!
//! What a frame does not say has no message: no wrench of a frame without a pose. Chunks are written whole, one after the
//! other, so that a recording that is cut off anywhere can be read to its last whole chunk.

mod behind;
mod cdr;
mod messages;
mod recorder;
mod schemas;

pub use behind::BehindWriter;
pub use recorder::{MCAP_CHUNK_BYTES, McapError, McapRecorder, RecordedPicture};
