//! From pixels to points of the dome and back: lens models, flat refracting layers, the dome, and the platform's pose
//! from its white markers.
//!
//! The sensor's optics stand at the top; [`camera`] has the lenses, [`pose`] the pose, [`numeric`] what they share.
//!
//! ```
//! use domecast_optics::camera::{LensSpec, LensModel};
//! use domecast_optics::glam::{DVec2, DVec3};
//! use domecast_optics::numeric::Rigid;
//! use domecast_optics::{DomeShape, FlatLayer, OpticsSpec, SensorOptics};
//!
//! let optics = SensorOptics::new(&OpticsSpec {
//!     lens: LensSpec {
//!         model: LensModel::Pinhole,
//!         width: 640,
//!         height: 480,
//!         matrix: [[230.0, 0.0, 319.5], [0.0, 230.0, 239.5], [0.0, 0.0, 1.0]],
//!         distortion: vec![],
//!         field_of_view_rad: 2.5,
//!         pupil_shift_mm: vec![],
//!     },
//!     sensor_from_camera: Rigid::from_translation(DVec3::new(0.0, 0.0, -10.0)),
//!     layers: vec![
//!         FlatLayer { name: "acrylic".into(), index: [1.49; 3], thickness_mm: Some(1.0) },
//!         FlatLayer { name: "silicone".into(), index: [1.41; 3], thickness_mm: None },
//!     ],
//!     dome: DomeShape::hemisphere(10.0),
//! })?;
//! let pixel = DVec2::new(400.0, 200.0);
//! let point = optics.trace(pixel)?.surface_mm;
//! assert!((point.length() - 10.0).abs() < 1e-12);
//! assert!((optics.project(point)? - pixel).length() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod camera;
pub mod numeric;
pub mod pose;
mod refraction;

pub use refraction::*;
pub use {glam, nalgebra};
