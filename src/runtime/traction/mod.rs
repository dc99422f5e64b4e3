//! Forces on the skin from the dots' motion: pressure and shear by the elastic model of the bonded dome.
//!
//! [`ForceDistribution`] stands beside [`Tracker`](crate::track::Tracker) and, where heights are measured,
//! [`ShapeFromColor`](crate::shape::ShapeFromColor).
//!
//! ```no_run
//! use domecast_runtime::constants::Constants;
//! use domecast_runtime::track::{CameraFrame, TrackOptions, Tracker};
//! use domecast_runtime::traction::ForceDistribution;
//!
//! let constants = Constants::load("constants.json".as_ref())?;
//! let mut tracker = Tracker::new(&constants, TrackOptions::default())?;
//! let mut forces = ForceDistribution::new(&constants, None)?;
//! let (rest, bytes) = (std::fs::read("rest.rgb")?, std::fs::read("frame.rgb")?);
//! // untouched: where the dots were printed
//! assert!(forces.set_rest(tracker.track(0, &CameraFrame::new(640, 480, 3, &rest)?)));
//! let tracked = tracker.track(1, &CameraFrame::new(640, 480, 3, &bytes)?);
//! for dot in &forces.update(tracked, None).dots {
//!     println!("{} N/mm2 at {}", dot.traction_n_mm2, dot.surface_mm);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | file | what |
//! |---|---|
//! | `model` | what a traction on each node moves, and which pressures are likely |
//! | `active_set` | least squares with pressures that are not negative |
//! | `seen_dots` | what a reading says: how far dots lie from their places at rest, and the load by the springs |
//! | `columns`, `wrench_rows` | rows of a turn: dots, wrench, heights |
//! | `forces` | the turns that make a frame consistent with the moved skin |
//! | `heights` | a height map as heights of nodes, and which of them are touched |
//! | `pressure` | pressures on a height map's grid |
//! | `posterior` | what is left open |
//! | `places` | dots in three dimensions |
//! | `contact` | area, point, normal, force |

mod active_set;
mod columns;
mod contact;
mod forces;
mod heights;
mod model;
mod places;
mod posterior;
mod pressure;
mod pressure_room;
mod result;
mod seen_dots;
mod wrench_rows;
mod write;

/// Over how far pressures are taken to be alike where the skin's heights are measured, mm: those tell pressures apart that dots do not.
pub const SHAPE_CORRELATION_MM: f64 = 1.0;

pub use forces::ForceDistribution;
pub use pressure::PressureMap;
pub use result::{ContactEstimate, DotTraction, LocalForces, TractionStatus};
pub use write::write_json_forces;
