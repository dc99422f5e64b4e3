//! domecast: from a parameter file to a dome-shaped camera tactile sensor that can be printed, cast, assembled,
//! calibrated and run.
//!
//! # The map
//!
//! ```text
//! design file -> Design -+-> layout --> artwork     what to print
//!   camera, optics ------+     |
//!                        +-> parts ---> meshes      what to build
//!                        +-> constants ---> track   what the runtime must know, and what it feels
//!                        +-> sim                    what the sensor will see
//! ```
//!
//! | to | use |
//! |---|---|
//! | read a design | [`Design::load`], or [`Design`] from a string; [`design`] for its fields |
//! | turn pixels into points on the dome and back | [`Design::optics`]; [`optics`], over the lens models of [`camera`] |
//! | lay out dots, judge their evenness, project them to the plate | [`Design::layout`]; [`layout`], [`transfer`] |
//! | draw films | [`Films::film`] of a layout; [`artwork`] |
//! | make platforms, mould, jig | [`parts`], over the solids of [`mesh`] |
//! | know what the springs carry | [`springs`] |
//! | press an object against the dome | [`contact`] |
//! | find the platform's pose from its white markers | [`pose`] |
//! | find blobs in a camera's frames | [`frames`] |
//! | write and read what the runtime needs | [`Constants`]; [`constants`] |
//! | replace nominal numbers by measured ones | [`calibrate`] |
//! | turn frames into markers, pose, wrench and displacement | [`Tracker`]; [`track`] |
//! | read the skin's shape from their colours | [`ShapeFromColor`]; [`shape`] |
//! | say how hard what is touched is | [`hardness::ContactHardness`], [`hardness::HardnessModel`]; [`hardness`] |
//! | draw what was found over a frame | [`overlay`] |
//! | simulate what the sensor sees | [`Scene`]; [`sim`] |
//! | look at the lit sensor before it is made | [`light`] |
//! | do all of it | [`build`], and [`report`] for its page; [`compare`] two of them |
//!
//! Each module comes from a crate of its own (`domecast-optics`, `domecast-runtime`, ..): a robot that only tracks
//! depends on `domecast-runtime` and compiles none of the rest. Formulas and their sources stand with the functions;
//! [`guide`] has a page on each subject.
//!
//! # In five lines
//!
//! ```
//! use domecast::{Design, glam::DVec2};
//!
//! let design: Design = include_str!("../designs/thumb24.json").parse()?;
//! let seen = design.optics().trace(DVec2::new(400.0, 240.0)).expect("inside the lens's domain");
//! let back = design.optics().project(seen.surface_mm).expect("it was just seen");
//! assert!(back.distance(DVec2::new(400.0, 240.0)) < 1e-9);
//! # Ok::<(), domecast::Error>(())
//! ```
pub use glam;
pub use nalgebra;

pub use domecast_contact as contact;
pub use domecast_design as design;
pub use domecast_design::{layout, parts, transfer};
pub use domecast_fab::{artwork, build, compare, light, report};
pub use domecast_hardness as hardness;
pub use domecast_mesh as mesh;
pub use domecast_optics as optics;
pub use domecast_optics::{camera, numeric, pose};
pub use domecast_runtime::{calibrate, frames, overlay, shape, track, traction};
pub use domecast_sim as sim;
pub use domecast_springs as springs;

pub use artwork::{Film, Films};
pub use constants::Constants;
pub use design::Design;
pub use error::Error;
pub use layout::Layout;
pub use numeric::Rigid as Pose;
pub use shape::ShapeFromColor;
pub use sim::Scene;
pub use springs::Wrench;
pub use track::Tracker;

mod error;
pub mod guide;

/// What the runtime needs to know of one sensor, how it follows from a design, and the files that carry it.
pub mod constants {
    pub use domecast_fab::constants::*;
    pub use domecast_runtime::constants::*;
}
