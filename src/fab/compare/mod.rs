//! Two designs or two builds side by side: what changed in fields, dots, parts, loads and resolution.
//!
//! ```
//! use domecast_fab::compare::{CompareSide, compare};
//! use serde_json::json;
//!
//! let side = |radius_mm: f64| CompareSide {
//!     design: json!({ "name": "a", "dome": { "radius_mm": radius_mm } }),
//!     constants: json!({}),
//!     manifest: json!({}),
//!     forces: json!({}),
//! };
//! let found = compare(&side(10.0), &side(12.0));
//! assert_eq!(found.fields[0].name, "dome.radius_mm");
//! assert!(found.to_string().contains("10.0 -> 12.0"));
//! ```

mod difference;
mod dots;
mod side;
mod sides;
mod text;

pub use difference::{Comparison, Difference, DotDifference, PartDifference};
pub use side::CompareSide;
pub use sides::compare;
