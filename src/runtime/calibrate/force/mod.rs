//! The 6x6 from measured pairs of displacement and wrench.
//!
//! Each axis of the wrench is fitted by itself (its own readings may be missing) with Tukey's biweight, so that a
//! twentieth of wild readings does not bend it; the model (linear, with an offset, or with a stiffness that grows
//! with compression) is the simplest within one standard error of the best in five-fold cross-validation.

mod choice;
mod fit;
mod robust;
mod types;

pub use fit::fit;
pub use types::{AxisFit, ForceError, ForceFit, ForceModel, Pair};
