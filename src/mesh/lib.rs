//! Solids as triangle meshes: exact shapes, their triangulation to a chord
//! tolerance, booleans, checks, and writers.
//!
//! The road of a part:
//!
//! 1. it is described by exact [`Shape`]s (turned bodies and prisms) that are
//!    added and cut ([`Construction`]);
//! 2. every shape is triangulated in `f64` so that no triangle is farther from
//!    the exact surface than the user's [`Chord`] tolerance;
//! 3. the shapes are joined by [`Solid`], the only place that knows the boolean
//!    kernel: tools are united in a balanced tree and subtracted once;
//! 4. the result becomes a [`TriMesh`] whose vertices are rounded to `f32` and
//!    welded, because that is what a reader of an STL gets; [`inspect`] tells
//!    whether *that* mesh is closed, consistently wound and in one piece.
//!
//! Two lengths must not be mixed. The *chord tolerance* is the user's and
//! decides how many triangles a circle gets. The *rounding epsilon*
//! ([`TriMesh::rounding_mm`]) follows from the size of the numbers and decides
//! what counts as equal. Neither ever stands in for the other.
//!
//! ```
//! use domecast_mesh::{Chord, Fit, Shape, inspect};
//!
//! let peg = Shape::cylinder(2.0, 0.0, 5.0, Fit::Area).triangulate("peg", Chord::new(0.01)?)?;
//! let found = inspect(&peg.welded_f32());
//! assert!(found.is_one_solid());
//! assert!((found.volume_mm3 / (20.0 * std::f64::consts::PI) - 1.0).abs() < 1e-6);
//! # Ok::<(), domecast_mesh::MeshError>(())
//! ```

mod check;
mod chord;
mod distance;
mod dxf;
mod error;
mod exact;
mod faceted;
mod glb;
mod meets;
pub mod number;
mod picture;
mod primitives;
mod rays;
mod shape;
mod slice;
mod solid;
mod step;
mod stl;
mod threemf;
mod tree;
mod triangles;

#[cfg(test)]
mod tests;

pub use check::{Inspection, inspect};
pub use chord::{Chord, Fit};
pub use dxf::{DxfFile, DxfText, DxfVertex};
pub use error::MeshError;
pub use glb::{GlbItem, GlbScene, write_glb};
pub use picture::{PictureItem, View, shade};
pub use rays::RayTarget;
pub use shape::{Construction, Piece, Profile, ProfileEdge, Shape};
pub use slice::CuttingPlane;
pub use solid::Solid;
pub use step::{StepError, write_step};
pub use stl::{read_stl, write_stl};
pub use threemf::write_3mf;
pub use tree::{BoxTree, Cornered};
pub use triangles::{BoundingBox, TriMesh};
pub use truck_modeling;
