//! Which parts of the light take part.

use crate::scene::Scene;

/// Which effects of light take part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LightUse {
    /// The lights themselves.
    pub direct: bool,
    /// Falloff with distance and the cosine at the membrane.
    pub falloff: bool,
    /// The tape before the lights.
    pub diffuser: bool,
    /// Losses at the sheet's faces.
    pub fresnel: bool,
    /// What the platform hides.
    pub platform_shadow: bool,
    /// The membrane lights itself.
    pub interreflection: bool,
}

impl LightUse {
    /// All of them.
    pub const ALL: Self = Self {
        direct: true,
        falloff: true,
        diffuser: true,
        fresnel: true,
        platform_shadow: true,
        interreflection: true,
    };
}

/// Whether a scene shows the membrane under the design's lights.
pub fn is_lit_by_leds(scene: &Scene) -> bool {
    scene.draws() && scene.file().light.leds.is_some() && !scene.design().sections().leds.list.is_empty()
}
