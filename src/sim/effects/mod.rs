//! The effects, one file each.

mod dispersion;
mod dots;
mod gap_change;
mod lens_distortion;
mod pupil_shift;
mod refraction;
mod sheet_motion;

use super::effect::Effect;

/// All effects, in the order of their names.
pub fn all() -> &'static [&'static dyn Effect] {
    &[
        &lens_distortion::LensDistortion,
        &pupil_shift::PupilShift,
        &refraction::Refraction,
        &dispersion::Dispersion,
        &sheet_motion::SheetMotion,
        &gap_change::GapChange,
        &dots::Dots,
    ]
}
