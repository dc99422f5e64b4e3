//! What a search is asked for.

use domecast_design::DesignError;

/// What is searched for, and how long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchOptions {
    /// Polar angle to which the error of normals counts, degrees.
    pub polar_angle_deg: f64,
    /// How many lights are looked at, at most.
    pub evaluations: usize,
    /// Seed of the search.
    pub seed: u64,
}

impl Default for SearchOptions {
    fn default() -> Self {
        Self { polar_angle_deg: 60.0, evaluations: 500, seed: 1 }
    }
}

impl SearchOptions {
    /// Whether these make a search.
    ///
    /// # Errors
    /// A search without a look, or of no part of a dome.
    pub fn check(&self) -> Result<(), DesignError> {
        let polar_deg = self.polar_angle_deg;
        if !(polar_deg > 0.0 && polar_deg <= 90.0) {
            let problem = "no part of the dome would count";
            return Err(DesignError::at("--polar-angle-deg", polar_deg, problem, "above 0, up to 90"));
        }
        if self.evaluations < MIN_EVALUATIONS {
            return Err(DesignError::at(
                "--evaluations",
                self.evaluations,
                "so few lights are no search",
                format!("at least {MIN_EVALUATIONS}; 500 take some half a minute"),
            ));
        }
        Ok(())
    }
}

/// Fewer looks than a generation and the diffusers take find nothing.
const MIN_EVALUATIONS: usize = 20;
