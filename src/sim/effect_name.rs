//! The names of the effects, and what a scene may say of them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a scene may say of an effect.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EffectChoice {
    /// The plan decides: the default.
    #[default]
    Plan,
    /// Used wherever the scene calls for it, however small it is.
    Always,
    /// Never used, however large: the scene is simulated as if the effect did not exist.
    Never,
}

macro_rules! effect_names {
    ($($(#[$doc:meta])* $variant:ident = $name:ident,)*) => {
        /// The effects, in the order in which they are applied.
        #[derive(
            Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
        )]
        #[serde(rename_all = "snake_case")]
        pub enum EffectName { $($(#[$doc])* $variant,)* }

        impl EffectName {
            /// All of them, in order.
            pub const ALL: [Self; Self::COUNT] = [$(Self::$variant,)*];

            /// The name that files carry.
            pub fn as_str(self) -> &'static str {
                match self { $(Self::$variant => stringify!($name),)* }
            }
        }

        /// Number of effects.
        const EFFECT_COUNT: usize = [$(stringify!($name),)*].len();

        /// Effects that must be used, or not, whatever the plan says.
        #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields, default)]
        pub struct EffectChoices { $($(#[$doc])* pub $name: EffectChoice,)* }

        impl EffectChoices {
            /// What is said of an effect.
            pub fn of(&self, effect: EffectName) -> EffectChoice {
                match effect { $(EffectName::$variant => self.$name,)* }
            }
        }
    };
}

effect_names! {
    /// The lens bends the image: without it, a pinhole.
    LensDistortion = lens_distortion,
    /// The entrance pupil moves with the field angle.
    PupilShift = pupil_shift,
    /// Sheet and silicone bend the rays.
    Refraction = refraction,
    /// Each colour is bent by its own index.
    Dispersion = dispersion,
    /// The platform moves on its springs.
    SheetMotion = sheet_motion,
    /// The air gap changes with the platform, and the bend with it.
    GapChange = gap_change,
    /// Objects deform the dome.
    Contact = contact,
    /// The elastomer yields slowly, and recovers slowly.
    SlowGel = slow_gel,
    /// The dots, with the ink's soft edge.
    Dots = dots,
    /// The ink fades out at a dot's edge.
    InkEdge = ink_edge,
    /// No two dots are quite alike.
    UnevenInk = uneven_ink,
    /// The membrane's reflectance varies from place to place.
    UnevenMembrane = uneven_membrane,
    /// The lights, their colours and lobes, through the sheet.
    DirectLight = direct_light,
    /// Falloff with distance and the cosine at the membrane.
    Falloff = falloff,
    /// The tape before the lights.
    Diffuser = diffuser,
    /// Light lost and thrown back at the sheet's faces.
    Fresnel = fresnel,
    /// The platform stands in the light's way.
    PlatformShadow = platform_shadow,
    /// The membrane lights itself.
    Interreflection = interreflection,
    /// The lights mirrored in the sheet's faces.
    Gloss = gloss,
    /// Dust and scratches on sheet and lens.
    Dust = dust,
    /// The lens darkens towards the edge.
    Vignetting = vignetting,
    /// What is not in focus is blurred.
    Defocus = defocus,
    /// The exposure takes time.
    MotionBlur = motion_blur,
    /// The rows are exposed one after the other.
    RollingShutter = rolling_shutter,
    /// Each pixel sees one colour.
    Bayer = bayer,
    /// The camera sets its exposure by the frames before.
    AutoExposure = auto_exposure,
    /// Hot and dead pixels.
    Defects = defects,
    /// Shot, read and quantisation noise.
    Noise = noise,
    /// The camera sets its colours by the frames before.
    WhiteBalance = white_balance,
    /// The camera sharpens.
    Sharpening = sharpening,
    /// The camera's lossy code.
    Compression = compression,
}

impl EffectName {
    /// Number of effects.
    pub const COUNT: usize = EFFECT_COUNT;

    /// The effects that move where things appear, without contact.
    pub const GEOMETRIC: [Self; 6] = [
        Self::LensDistortion,
        Self::PupilShift,
        Self::Refraction,
        Self::Dispersion,
        Self::SheetMotion,
        Self::GapChange,
    ];

    /// The effects of the design's lights, but for the lights themselves.
    pub const OF_LIGHT: [Self; 5] =
        [Self::Falloff, Self::Diffuser, Self::Fresnel, Self::PlatformShadow, Self::Interreflection];

    /// The effect of that name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|effect| effect.as_str() == name)
    }
}

impl std::fmt::Display for EffectName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}
