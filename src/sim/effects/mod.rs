//! The effects, one file each.

mod lens_distortion;

use super::effect::Effect;

/// All effects, in the order of their names.
pub fn all() -> &'static [&'static dyn Effect] {
    &[&lens_distortion::LensDistortion]
}
