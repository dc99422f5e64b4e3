//! The shape of the skin from the colours of a frame.
//!
//! [`ShapeFromColor`] stands beside [`Tracker`](crate::track::Tracker): a frame and what the tracker says of it in, a [`ShapeMap`] out.
//!
//! ```no_run
//! use domecast_runtime::constants::Constants;
//! use domecast_runtime::shape::{ShapeOptions, ShapeFromColor};
//! use domecast_runtime::track::{CameraFrame, TrackOptions, Tracker};
//!
//! let constants = Constants::load("constants.json".as_ref())?;
//! let mut tracker = Tracker::new(&constants, TrackOptions::default())?;
//! let mut shape = ShapeFromColor::new(&constants, &tracker, ShapeOptions::default())?;
//! let (rest, bytes) = (std::fs::read("rest.rgb")?, std::fs::read("frame.rgb")?);
//! let rest = CameraFrame::new(640, 480, 3, &rest)?;
//! shape.set_rest(&rest, tracker.track(0, &rest))?;
//! let frame = CameraFrame::new(640, 480, 3, &bytes)?;
//! let map = shape.measure(&frame, tracker.track(1, &frame))?;
//! println!("{} mm at the middle", map.height_mm[240 * 640 + 320]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! ```text
//! frame ─> light of cells of 2 x 2 px (levels), less dots and markers (marks), over the frame at rest (rest)
//!     ─> irradiance ─> a normal from three colours under the constants' light (light, normals)
//!     ─> how far each point moved along its refracted ray (system) ─> the light there, once more ─> map
//! ```
//!
//! Rows of cells are shared out among rayon's threads (as many as cores, or `RAYON_NUM_THREADS`); what comes out has the same bytes for any
//! number. While a frame is measured a second thread stays awake for it. Called on a thread of rayon's, or where there is one, nothing is
//! allocated once each kind of frame was seen; from another thread rayon's own queue takes a block every 63 frames.
//!
//! After M. K. Johnson and E. H. Adelson, Retrographic sensing for the measurement of surface texture and shape (CVPR 2009);
//! where they look colours up in a table, here stands the physics that the simulator draws with. The membrane is Lambertian, so
//! the irradiance of a channel is `A + v . n`: `v` is the vector irradiance of the lights at the point, through sheet and
//! silicone and past the platform, `A` what the dome gives itself. Three channels say two slopes and a brightness; what is
//! left of the brightness says how far to trust them. Depths follow from `n . X_u = 0` and `n . X_v = 0` with
//! `X = X0 + d w` along the refracted ray, which is linear in `d` and its slopes.

mod blocks;
mod cells;
mod colours;
mod contact;
mod curvature;
mod deviation;
mod error;
mod estimator;
mod fill;
mod fourier;
mod grid;
mod holes;
mod lattice;
mod levels;
mod light;
mod lights;
mod look;
mod map;
mod marks;
mod normals;
mod options;
mod outline;
mod reading;
mod rest;
pub(crate) mod rows;
mod seen;
mod system;
mod volume;

pub use colours::are_colours_judged;
pub use contact::SkinContact;
pub use curvature::ContactEdge;
pub use domecast_light::tables::Numbers;
pub use error::ShapeError;
pub use estimator::ShapeFromColor;
pub(crate) use light::ShapeLight;
pub use map::{ShapeMap, SkinSurface};
pub use options::ShapeOptions;
pub(crate) use seen::{ChannelRay, SeenCell};
pub use system::SolveStatus;
