//! Hardness from touch: by contact mechanics ([`physics`]), and by a small network that sees the picture's difference from rest and what `track` measures beside it,
//! over a window of frames, and states class and Young's modulus, or that it is unsure.
//!
//! [`HardnessReader`] is the one state object. A model is an ONNX file ([`read_onnx`], [`write_onnx`]) of the few kinds of
//! nodes that [`Network`] knows, with [`Metadata`] beside the graph; `domecast-learn` writes such files, and ONNX Runtime
//! runs them as well. Inputs are `picture` `[window, 3, height, width]` (levels less those at rest, in parts of 255) and
//! `readings` `[window, count]`; outputs are `probability` `[1, classes]`, `log10_e` `[1, 2]` (mean, and ln of the deviation, of
//! log10 of the modulus in MPa) and `novelty` `[1, n]` (squared distances from what was trained with).

mod approach;
mod columns;
mod compile;
mod error;
mod graph;
mod kernels;
mod metadata;
mod network;
mod nodes;
mod onnx_read;
mod onnx_write;
pub mod physics;
mod picture;
mod press;
mod protobuf;
mod reader;
mod settings;
#[cfg(test)]
mod tests;
pub mod touch;
#[cfg(feature = "track")]
mod tracked;

pub use columns::{COLUMNS, DOT_COLUMNS, PRESS_COLUMNS, RIGID_COLUMNS, SeenDot, dots_features};
pub use error::ModelError;
pub use graph::{Attribute, Constant, Graph, GraphNode, Port, Values};
pub use metadata::{Class, METADATA_KEY, Metadata, ModelReading};
pub use network::Network;
pub use onnx_read::read_onnx;
pub use onnx_write::write_onnx;
pub use picture::{FrameView, REST_NUMBERS, Shrinker, rest_profile};
pub use reader::{HardnessEstimate, HardnessReader, Unsure};
#[cfg(feature = "track")]
pub use tracked::{ContactHardness, HardnessModel, TrackedRest};
