//! What a bonded hemisphere adds to the half-space of the closed forms.
//!
//! A half-space's depth is counted from infinity, the dome's from its bonded base: the base holds part of the
//! sink back. Under a force F at the dome's polar angle theta the approach is that of the half-space less
//! `held(theta, nu) F / (E* R)`, which is 2 to 12 % of it for a/R from 0.05 to 0.25.

use crate::elastomer::Elastomer;

/// The part held back, in units of F / (E* R).
///
/// Fitted to the linear level (elements of R/20, balls of R/2 and 4 R, depths of R/50 to R/10, without friction):
/// there 0.31 to 0.38 for nu = 0.49 and 0.36 to 0.43 for nu = 0.3 with contact radii up to R/4, rising by 0.12
/// towards the bonded rim, at 63 degrees. A test holds it to the elements.
pub(crate) fn held(elastomer: &Elastomer, polar_rad: f64) -> f64 {
    0.33 + 0.2 * (0.49 - elastomer.poisson) + 0.8 * (polar_rad - 0.95).max(0.0)
}
