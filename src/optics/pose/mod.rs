//! The platform's pose from its white markers, through lens and layers.
//!
//! [`Marker`] says where a disc's centroid appears; [`PoseSolver`] inverts that, with covariance, both poses where
//! two fit, and a named [`PoseError`] where none does. Where the pixels come from is not known here.
//!
//! # Example
//! ```
//! use domecast_optics::camera::{LensSpec, LensModel};
//! use domecast_optics::glam::{DMat3, DVec3};
//! use domecast_optics::numeric::Rigid;
//! use domecast_optics::pose::{Marker, PoseOptions, PoseSolver, Sighting};
//! use domecast_optics::{FlatLayer, OpticsSpec, SensorOptics};
//!
//! # let optics = SensorOptics::new(&OpticsSpec {
//! #     lens: LensSpec {
//! #         model: LensModel::Pinhole,
//! #         width: 640,
//! #         height: 480,
//! #         matrix: [[230.0, 0.0, 319.5], [0.0, 230.0, 239.5], [0.0, 0.0, 1.0]],
//! #         distortion: vec![],
//! #         field_of_view_rad: 2.5,
//! #         pupil_shift_mm: vec![],
//! #     },
//! #     sensor_from_camera: Rigid::from_translation(DVec3::new(0.0, 0.0, -10.0)),
//! #     layers: vec![
//! #         FlatLayer { name: "acrylic".into(), index: [1.49; 3], thickness_mm: Some(1.0) },
//! #         FlatLayer { name: "silicone".into(), index: [1.41; 3], thickness_mm: None },
//! #     ],
//! #     dome: domecast_optics::DomeShape::hemisphere(10.0),
//! # })?;
//! // four discs on the sheet, seen from a platform that has moved by 1 mm and turned by 0.05 rad
//! let corners = [(11.0, 10.0), (-11.0, 10.0), (-11.0, -10.0), (11.0, -9.0)];
//! let markers: Vec<Marker> = (0..)
//!     .zip(corners)
//!     .map(|(id, (x, y))| Marker { id, position_mm: DVec3::new(x, y, 0.0), diameter_mm: 1.0 })
//!     .collect();
//! let pose = Rigid::new(DMat3::from_rotation_x(0.05), DVec3::new(0.0, 0.0, -1.0));
//! let moved = optics.at_pose(&pose)?;
//! let mut seen = Vec::new();
//! for marker in &markers {
//!     seen.push(Sighting { id: marker.id, centroid_px: marker.image(&moved)?.centroid_px });
//! }
//! let found = PoseSolver::new(&optics, &markers, PoseOptions::new(0.1, 5.0))?.solve(&seen)?;
//! assert!((found.pose.translation_mm - pose.translation_mm).length() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod disc;
mod error;
mod estimate;
mod refine;
mod sheet;
mod solver;
mod start;

pub use disc::{DiscImage, Marker, outline_centroid_offset};
pub use error::PoseError;
pub use estimate::{PoseEstimate, PoseOptions, Sighting, displacement_from_motion};
pub use refine::refine_pose;
pub use solver::{MAX_MARKERS, PoseSolver};

#[cfg(test)]
mod tests;
