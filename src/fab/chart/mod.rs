//! Charts: marks in px that become SVG or PNG, axes that place values, histograms.
//!
//! ```
//! use domecast_fab::chart::{Axis, Chart, INK};
//! use glam::DVec2;
//!
//! let (across, up) = (Axis::linear(0.0, 4.0, [40.0, 280.0]), Axis::linear(0.0, 16.0, [180.0, 20.0]));
//! let mut chart = Chart::new("squares", DVec2::new(320.0, 200.0));
//! let curve: Vec<DVec2> =
//!     (0..5).map(f64::from).map(|x| DVec2::new(across.px(x), up.px(x * x))).collect();
//! chart.line(&curve, INK, 2.0);
//! assert!(chart.to_svg().contains("M40.0 180.0L100.0 170.0"));
//! ```

mod axis;
mod drawing;
mod histogram;

pub use axis::{Axis, Tick};
pub use drawing::{Chart, ChartColor, INK, TextAlign};
pub use histogram::histogram;
