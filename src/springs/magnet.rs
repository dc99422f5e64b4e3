//! The pull between two coaxial disc magnets.
//!
//! Uniformly magnetised discs are pairs of charged faces. Two coaxial charged faces of radius R at distance x
//! act on each other through I(a) = integral of J1(q)^2 exp(-q a) / q over q from 0 to infinity, a = x/R
//! (D. Vokoun et al., *Magnetostatic interactions and forces between cylindrical permanent magnets*, J. Magn.
//! Magn. Mater. 321 (2009) 3758). Neumann's J1(q)^2 = (1/pi) integral of J0(2 q sin(phi/2)) cos(phi) turns it into
//!
//!   I(a) = -(1/pi) integral over 0..pi of ln(a + sqrt(a^2 + 4 sin^2(phi/2))) cos(phi) dphi,
//!
//! smooth and periodic, so the trapezoidal rule converges exponentially.

use std::sync::OnceLock;

use super::spec::SpecError;

/// Permeability of vacuum times 1e6: T^2 / MU_0 comes out in N/mm^2.
const MU_0: f64 = 1.256_637_062_12;

/// The trapezoidal rule with n nodes on (0, pi) errs by about exp(-2 n asinh(a/2)): n = this / asinh(a/2)
/// reaches rounding.
const NODES_PER_ASINH: f64 = 19.0;

/// Nearest faces for which the rule has converged to rounding, as a part of the radius.
const SMALLEST_GAP: f64 = 0.4;

/// A pair of equal discs that face each other on one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MagnetPair {
    radius_mm: f64,
    thickness_mm: f64,
    /// +1 attracts, -1 repels.
    sign: f64,
    remanence_t: f64,
}

impl MagnetPair {
    /// A pair from its disc; `attract` says whether unlike poles face.
    ///
    /// # Errors
    /// [`SpecError`] for a size that is not a positive number, or a remanence that is negative or not finite.
    pub fn new(
        diameter_mm: f64,
        thickness_mm: f64,
        remanence_t: f64,
        attract: bool,
    ) -> Result<Self, SpecError> {
        for (field, value) in [("diameter_mm", diameter_mm), ("thickness_mm", thickness_mm)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(SpecError { field, value, allowed: "a finite number above 0".into() });
            }
        }
        if !(remanence_t.is_finite() && remanence_t >= 0.0) {
            let allowed = "a finite number, 0 or more".into();
            return Err(SpecError { field: "remanence_t", value: remanence_t, allowed });
        }
        let sign = if attract { 1.0 } else { -1.0 };
        Ok(Self { radius_mm: 0.5 * diameter_mm, thickness_mm, sign, remanence_t })
    }

    /// Diameter of a disc, mm.
    pub fn diameter_mm(&self) -> f64 {
        2.0 * self.radius_mm
    }

    /// Thickness of a disc, mm.
    pub fn thickness_mm(&self) -> f64 {
        self.thickness_mm
    }

    /// Remanence, T.
    pub fn remanence_t(&self) -> f64 {
        self.remanence_t
    }

    /// Whether unlike poles face.
    pub fn is_attracting(&self) -> bool {
        self.sign > 0.0
    }

    /// Attraction at a gap between the facing faces (N, mm) and its slope by the gap (N/mm).
    ///
    /// Below 0.4 radii the force at 0.4 radii is continued along its tangent: springs keep magnets further
    /// apart, and the exact law has a logarithmic cusp at contact.
    pub fn attraction(&self, gap_mm: f64) -> [f64; 2] {
        let nearest = SMALLEST_GAP * self.radius_mm;
        let at = gap_mm.max(nearest);
        let r = self.radius_mm;
        let scale = self.sign * std::f64::consts::PI * self.remanence_t.powi(2) * r * r / MU_0;
        let mut force = 0.0;
        let mut slope = 0.0;
        for (weight, shift) in [(1.0, 0.0), (-2.0, self.thickness_mm), (1.0, 2.0 * self.thickness_mm)] {
            let [i, di] = faces((at + shift) / r);
            force += weight * i;
            slope += weight * di;
        }
        let [force, slope] = [scale * force, scale * slope / r];
        [force + slope * (gap_mm - at), slope]
    }
}

/// Numbers of nodes that the rule is kept ready for.
const READY: [usize; 5] = [16, 24, 32, 48, 96];

/// cos(phi) and 4 sin^2(phi/2) at the nodes of a rule, with the weights of its ends halved into the cosine.
fn nodes(a: f64) -> &'static [[f64; 2]] {
    static RULES: OnceLock<Vec<Vec<[f64; 2]>>> = OnceLock::new();
    let rules = RULES.get_or_init(|| {
        let rule = |count: &usize| {
            let node = |i: usize| {
                let phi = std::f64::consts::PI * i as f64 / *count as f64;
                let weight = if i == 0 || i == *count { 0.5 } else { 1.0 };
                [weight * phi.cos() / *count as f64, 4.0 * (0.5 * phi).sin().powi(2)]
            };
            (0..=*count).map(node).collect()
        };
        READY.iter().map(rule).collect()
    });
    // At most 96, where a = 0.4.
    let wanted = NODES_PER_ASINH / (0.5 * a).asinh();
    let at = READY.iter().position(|count| *count as f64 >= wanted).unwrap_or(READY.len() - 1);
    rules.get(at).map_or(&[], Vec::as_slice)
}

/// I(a) and its derivative.
fn faces(a: f64) -> [f64; 2] {
    let (mut value, mut slope) = (0.0, 0.0);
    for [weighted_cos, square] in nodes(a) {
        let root = (a * a + square).sqrt();
        value -= weighted_cos * (a + root).ln();
        slope -= weighted_cos / root;
    }
    [value, slope]
}
