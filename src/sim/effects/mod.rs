//! The effects, one file each.

mod auto_exposure;
mod bayer;
mod compression;
pub(crate) mod contact;
mod defects;
mod defocus;
mod diffuser;
mod direct_light;
mod dispersion;
mod dots;
mod dust;
pub(crate) mod effect;
mod falloff;
mod fresnel;
mod gap_change;
pub(crate) mod geometry_bound;
mod gloss;
mod ink_edge;
mod interreflection;
mod lens_distortion;
pub(crate) mod light_bound;
mod motion_blur;
mod noise;
pub mod pipeline;
mod platform_shadow;
mod pupil_shift;
#[cfg(test)]
mod real_frames_tests;
mod refraction;
mod rolling_shutter;
mod sharpening;
mod sheet_motion;
mod slow_gel;
pub mod speed;
#[cfg(test)]
mod tests;
mod uneven_ink;
mod uneven_membrane;
mod vignetting;
mod white_balance;

use self::effect::Effect;

/// All effects, in the order of their names.
pub fn all() -> &'static [&'static dyn Effect] {
    &[
        &lens_distortion::LensDistortion,
        &pupil_shift::PupilShift,
        &refraction::Refraction,
        &dispersion::Dispersion,
        &sheet_motion::SheetMotion,
        &gap_change::GapChange,
        &contact::ContactEffect,
        &slow_gel::SlowGel,
        &dots::Dots,
        &ink_edge::InkEdge,
        &uneven_ink::UnevenInk,
        &uneven_membrane::UnevenMembrane,
        &direct_light::DirectLightEffect,
        &falloff::Falloff,
        &diffuser::DiffuserEffect,
        &fresnel::Fresnel,
        &platform_shadow::PlatformShadow,
        &interreflection::Interreflection,
        &gloss::GlossEffect,
        &dust::Dust,
        &vignetting::Vignetting,
        &defocus::Defocus,
        &motion_blur::MotionBlur,
        &rolling_shutter::RollingShutter,
        &bayer::Bayer,
        &auto_exposure::AutoExposure,
        &defects::DefectsEffect,
        &noise::Noise,
        &white_balance::WhiteBalance,
        &sharpening::Sharpening,
        &compression::Compression,
    ]
}
