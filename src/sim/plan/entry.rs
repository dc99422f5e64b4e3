//! What a plan says of an effect.

use serde::Serialize;

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::Cost;

/// What the plan says of one effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Entry {
    /// Which effect.
    #[serde(rename = "id")]
    pub effect: EffectName,
    /// Whether it is used.
    pub used: bool,
    /// Whether the scene calls for it.
    pub called_for: bool,
    /// Why the scene calls for it and why it is used or left out, in words.
    pub why: String,
    /// How large it can be; `None` where the scene does not call for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bound: Option<Bound>,
    /// What it costs; `None` where the scene does not call for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cost: Option<Cost>,
}
