//! An elastomer that yields slowly, as it is written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use domecast_contact::{ContactError, Relaxation, RelaxationTerm};
use domecast_design::sections::Why;

/// A modulus that relaxes after a step, as a Prony series: after the time t, of the instant modulus
/// `1 - sum part (1 - exp(-t / time_s))` is left. Poisson's ratio stays. Needs the linear contact level.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SlowGelSection {
    /// The exponentials; their parts leave a hundredth of the instant modulus or more.
    #[schemars(length(min = 1, max = 16))]
    pub terms: Vec<SlowGelTerm>,
    /// Which modulus the design's `elastomer.young_modulus_mpa` is.
    #[serde(default)]
    pub modulus: ModulusName,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// One exponential of a slow gel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SlowGelTerm {
    /// Part of the instant modulus that goes.
    #[schemars(range(min = 0.0, max = 0.99))]
    pub part: f64,
    /// Its time, s.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e6))]
    pub time_s: f64,
}

/// A modulus of a slow gel.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ModulusName {
    /// That of a press much faster than every term.
    #[default]
    Instant,
    /// That of a press much slower than every term.
    Relaxed,
}

impl SlowGelSection {
    /// The relaxation, and the instant modulus for the design's, MPa.
    ///
    /// # Errors
    /// Terms that are no relaxation.
    pub fn resolved(&self, young_mpa: f64) -> Result<(Relaxation, f64), ContactError> {
        let terms = self.terms.iter().map(|term| RelaxationTerm { part: term.part, time_s: term.time_s });
        let relaxation = Relaxation::new(terms.collect())?;
        let instant_mpa = match self.modulus {
            ModulusName::Instant => young_mpa,
            ModulusName::Relaxed => young_mpa / relaxation.relaxed(),
        };
        Ok((relaxation, instant_mpa))
    }
}
