//! Light on the membrane, from the design's lights.
//!
//! ```text
//! emitter (lobe, diffuser) ─> pit and window (cavity) ─> sheet, silicone (optics::LightTube, fresnel)
//!     ─> vector irradiance on the membrane (direct) ─> tables over the dome (tables, field, dome_map)
//!     ─> the dome lighting itself (radiosity) ─> levels in the picture (shade)
//! ```

pub mod bounds;
pub mod cavity;
pub mod direct;
pub mod dome_map;
pub mod field;
pub mod fresnel;
pub mod lobe;
pub mod quadrature;
pub mod radiosity;
pub mod setup;
pub mod shade;
pub mod tables;
#[cfg(test)]
mod tests;

pub use cavity::Cavities;
pub use shade::LitDome;

use super::SimError;
use super::scene::Scene;
use super::shading::Shading;
use super::work::Work;

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
pub fn lit_by_leds(scene: &Scene) -> bool {
    scene.draws() && scene.file().light.leds.is_some() && !scene.design().sections().leds.list.is_empty()
}

/// The shading of a scene, `None` where the membrane is evenly lit.
///
/// # Errors
/// Lights that cannot be computed.
pub fn shading(
    scene: &Scene,
    used: &LightUse,
    work: &mut Work,
) -> Result<Option<Box<dyn Shading>>, SimError> {
    if !used.direct {
        return Ok(None);
    }
    Ok(LitDome::new(scene, used, work)?.map(|dome| Box::new(dome) as Box<dyn Shading>))
}
