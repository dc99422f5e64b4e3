//! The 6x6 from measured pairs of displacement and wrench.
//!
//! Each axis of the wrench is fitted by itself (its own readings may be missing) with Tukey's biweight, so that a
//! twentieth of wild readings does not bend it; the model (linear, with an offset, or with a stiffness that grows
//! with compression) is the simplest within one standard error of the best in five-fold cross-validation. Noise of the
//! displacements is taken out of the coefficients.
//!
//! Of a few known loads, [`SpringKnowledge`] says what they leave open beside the springs' geometry, and what another would say.
//!
//! [`examine_pairs`] and [`examine_fit`] ask whether table and fit can be this sensor's, and name the mistake if not.

mod apply;
mod choice;
mod fit;
mod knowledge;
mod lag;
mod motion;
mod plausibility;
mod reference;
mod robust;
mod rows;
mod statistics;
mod stiffness_check;
mod transformations;
mod types;

pub use fit::fit;
pub use knowledge::{KnownLoad, SpringKnowledge};
pub use plausibility::examine_pairs;
pub use stiffness_check::examine_fit;
pub use types::{AxisFit, ForceError, ForceFit, ForceModel, MotionNoise, Pair};
