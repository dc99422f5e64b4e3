//! From a pattern in the image to dots on the dome and on the plate.
//!
//! The pattern is laid out where it has to look even: in the raw image, or in the runtime's undistorted
//! frame. Each dot is projected along the camera's rays through the layers to the dome, and from there by
//! the pad's map to the plate. What cannot be seen or printed is left out with its reason, or refused, as the
//! design says.
//!
//! # Example
//! ```
//! use domecast_design::Design;
//!
//! # const THUMB24: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json");
//! let layout = Design::load(THUMB24.as_ref())?.layout()?;
//! let dot = &layout.dots[0];
//! println!("dot {} is seen at {} px and printed at {} mm", dot.id, dot.image_px, dot.plate_mm);
//! assert!((dot.surface_mm.length() - 10.0).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod boundary;
pub mod calibrate;
mod check;
pub mod coverage;
pub mod dot;
mod edge;
mod error;
pub mod evenness;
mod fill;
pub mod frame;
mod gaps;
pub mod key;
pub mod lost;
pub mod neighbors;
pub mod outline;
mod passes;
pub mod pattern;
mod places;
mod plan;
pub mod region;
pub mod report;
mod spec;
pub mod target;
#[cfg(test)]
mod tests;
pub mod tolerances;
pub mod window;
mod zones;

pub use dot::{Dot, DotSize};
pub use error::LayoutError;
pub use key::{KeyImage, PatternKey};
pub use lost::{LostDot, Reason, Rule, Zone};
pub use passes::PrintPass;
pub use plan::Layout;
pub use spec::{LayoutOrigin, LayoutSpec, Mask};
