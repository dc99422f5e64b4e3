//! What all effects have in common.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::SimError;
use super::pipeline::Pipeline;
use super::scene::Scene;

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

        /// Effects that shall be used, or not, whatever the plan says.
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
    /// Objects dent the dome.
    Contact = contact,
    /// The dots, with the ink's soft edge.
    Dots = dots,
    /// The ink fades out at a dot's edge.
    InkEdge = ink_edge,
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
    /// Shot, read and quantisation noise.
    Noise = noise,
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

/// How large an effect can be in a scene: what its absence can do to a frame in which any of the others take part
/// or not. It may be too large, never too small.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Bound {
    /// Shift of any dot's or marker's centroid in any colour, px.
    pub px: f64,
    /// Change of any pixel, grey levels of 8 bits; for what is random, of the 99.9th percentile. What a shift of
    /// `px` does to the pixels at an edge is not counted here: the plan adds it.
    pub grey: f64,
}

impl Bound {
    /// An effect that the scene's tolerance can never spare.
    pub const UNBOUNDED: Self = Self { px: f64::INFINITY, grey: f64::INFINITY };

    /// A bound on the place alone.
    pub fn px(px: f64) -> Self {
        Self { px, grey: 0.0 }
    }

    /// A bound on the brightness alone.
    pub fn grey(grey: f64) -> Self {
        Self { px: 0.0, grey }
    }
}

/// Predicted work, in the units of [`super::Work`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Cost {
    /// Once for a scene: tables, factorisations.
    pub once: u64,
    /// For each frame.
    pub per_frame: u64,
}

impl Cost {
    /// For a whole sequence.
    pub fn total(&self, frames: u64) -> u64 {
        self.once.saturating_add(self.per_frame.saturating_mul(frames))
    }
}

/// One effect: one file.
pub trait Effect: Sync {
    /// Which one it is.
    fn name(&self) -> EffectName;

    /// Why the scene calls for it, with the numbers that say so; `None` where the scene does not.
    fn calls_for(&self, scene: &Scene) -> Option<String>;

    /// How large it can be in a scene that calls for it.
    ///
    /// # Errors
    /// A scene on which the bound cannot be computed (the fault is then the scene's).
    fn bound(&self, scene: &Scene) -> Result<Bound, SimError>;

    /// What it costs in a scene that calls for it.
    fn cost(&self, scene: &Scene) -> Cost;

    /// Other effects without which this one has nothing to act on: where one of them is left out, so is this.
    fn needs(&self) -> &'static [EffectName] {
        &[]
    }

    /// Puts its part into the pipeline: a flag of the geometry, a pass over the picture, a table. Called only
    /// for effects that the plan uses, in the order of [`EffectName`]; whatever memory it takes is taken here.
    ///
    /// # Errors
    /// A scene that the effect cannot be computed for.
    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError>;
}
