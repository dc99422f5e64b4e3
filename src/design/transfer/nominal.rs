//! Maps in closed form. Each is the same for every azimuth; phi is the angle from the pole.

use std::f64::consts::{FRAC_PI_2, SQRT_2};

use glam::{DVec2, DVec3};

/// Slack for angles that rounding pushes past the rim, rad.
pub(super) const ANGLE_EPSILON_RAD: f64 = 1e-12;

/// Below this angle (rad) ratios over sin(phi) come from their series: the first term left out is below 1e-17.
const SMALL_ANGLE_RAD: f64 = 1e-4;

/// A transfer map in closed form, for a dome of radius R.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Nominal {
    /// r = R sin(phi): every particle of the pad moves straight down. A published stretch of a pad print on
    /// a ball (5.25 in to 6 in) agrees with it, and not with arc length.
    #[default]
    Orthographic,
    /// r = R phi: arc length along meridians is kept.
    Equidistant,
    /// r = 2 R sin(phi/2): area is kept (Lambert's azimuthal map).
    EqualArea,
}

impl Nominal {
    /// All of them, in a fixed order.
    pub const ALL: [Self; 3] = [Self::Orthographic, Self::Equidistant, Self::EqualArea];

    /// The name in a design file.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Orthographic => "orthographic",
            Self::Equidistant => "equidistant",
            Self::EqualArea => "equal_area",
        }
    }

    /// r / (R sin(phi)); 1 at the pole.
    pub(super) fn radius_over_sin(self, polar_rad: f64) -> f64 {
        match self {
            Self::Orthographic => 1.0,
            Self::Equidistant if polar_rad < SMALL_ANGLE_RAD => 1.0 + polar_rad * polar_rad / 6.0,
            Self::Equidistant => polar_rad / polar_rad.sin(),
            // 2 sin(phi/2) / sin(phi) = 1 / cos(phi/2)
            Self::EqualArea => 1.0 / (0.5 * polar_rad).cos(),
        }
    }

    /// d r / d phi over R.
    pub(super) fn slope(self, polar_rad: f64) -> f64 {
        match self {
            Self::Orthographic => polar_rad.cos(),
            Self::Equidistant => 1.0,
            Self::EqualArea => (0.5 * polar_rad).cos(),
        }
    }

    /// The direction that prints from this place of the unit dome's plate; `None` beyond the rim.
    ///
    /// Sine and cosine come straight from the radius where they can: an arc sine would lose half the digits
    /// near the rim of the orthographic map.
    pub(super) fn direction(self, plate: DVec2) -> Option<DVec3> {
        let radius = plate.length();
        let (sin_polar, cos_polar) = match self {
            Self::Orthographic if radius <= 1.0 => (radius, ((1.0 - radius) * (1.0 + radius)).sqrt()),
            Self::Orthographic if radius <= 1.0 + ANGLE_EPSILON_RAD => (1.0, 0.0),
            Self::Equidistant if radius <= FRAC_PI_2 + ANGLE_EPSILON_RAD => radius.sin_cos(),
            Self::EqualArea if radius <= SQRT_2 + ANGLE_EPSILON_RAD => {
                let half_sin = 0.5 * radius;
                let half_cos = ((1.0 - half_sin) * (1.0 + half_sin)).sqrt();
                (2.0 * half_sin * half_cos, half_cos * half_cos - half_sin * half_sin)
            }
            _ => return None,
        };
        let out = if radius > 0.0 { plate / radius } else { DVec2::X };
        Some((out * sin_polar).extend(cos_polar))
    }
}
