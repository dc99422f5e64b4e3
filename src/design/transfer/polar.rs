//! Directions in polar form, and the plate as it follows from them.

use glam::{DVec2, DVec3};

/// A direction in polar form. At the pole, where no azimuth exists, `out` is +x.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Polar {
    pub(super) polar_rad: f64,
    pub(super) sin_polar: f64,
    pub(super) cos_polar: f64,
    /// Unit vector in the base plane: (cos azimuth, sin azimuth).
    pub(super) out: DVec2,
}

impl Polar {
    pub(super) fn of_direction(direction: DVec3) -> Self {
        let out = direction.truncate();
        let sin_polar = out.length();
        Self {
            polar_rad: sin_polar.atan2(direction.z),
            sin_polar,
            cos_polar: direction.z,
            out: if sin_polar > 0.0 { out / sin_polar } else { DVec2::X },
        }
    }

    pub(super) fn new(polar_rad: f64, azimuth_rad: f64) -> Self {
        let (sin_polar, cos_polar) = polar_rad.sin_cos();
        Self { polar_rad, sin_polar, cos_polar, out: DVec2::from_angle(azimuth_rad) }
    }

    pub(super) fn direction(&self) -> DVec3 {
        (self.out * self.sin_polar).extend(self.cos_polar)
    }
}

/// A place on the plate of a unit dome as it follows from a direction: radially and sideways, each divided by
/// sin(polar angle) so that the pole is an ordinary point, with the slopes. `turn` is the plate's rotation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct UnitPlate {
    pub(super) radial_over_sin: f64,
    pub(super) sideways_over_sin: f64,
    pub(super) d_radial_d_polar: f64,
    pub(super) d_sideways_d_polar: f64,
    /// d radial / d azimuth, over sin.
    pub(super) d_radial_around: f64,
    /// d sideways / d azimuth, over sin.
    pub(super) d_sideways_around: f64,
    pub(super) turn: DVec2,
}

impl UnitPlate {
    /// A map that is the same for every azimuth.
    pub(super) fn round(radial_over_sin: f64, slope: f64) -> Self {
        Self {
            radial_over_sin,
            sideways_over_sin: 0.0,
            d_radial_d_polar: slope,
            d_sideways_d_polar: 0.0,
            d_radial_around: 0.0,
            d_sideways_around: 0.0,
            turn: DVec2::X,
        }
    }

    pub(super) fn place(&self, at: &Polar) -> DVec2 {
        self.on_plate(at, self.radial_over_sin, self.sideways_over_sin) * at.sin_polar
    }

    /// Slope along a step towards the rim, per rad.
    pub(super) fn d_polar(&self, at: &Polar) -> DVec2 {
        self.on_plate(at, self.d_radial_d_polar, self.d_sideways_d_polar)
    }

    /// Slope along a step around the axis, per rad of arc (already divided by sin(polar angle)).
    pub(super) fn d_around(&self, at: &Polar) -> DVec2 {
        self.on_plate(
            at,
            self.d_radial_around - self.sideways_over_sin,
            self.radial_over_sin + self.d_sideways_around,
        )
    }

    pub(super) fn on_plate(&self, at: &Polar, radial: f64, sideways: f64) -> DVec2 {
        self.turn.rotate(at.out * radial + at.out.perp() * sideways)
    }

    /// Area of the plate over area of the dome, with its sign: not positive means that the map folds.
    pub(super) fn area_ratio(&self) -> f64 {
        self.d_radial_d_polar * (self.radial_over_sin + self.d_sideways_around)
            - self.d_sideways_d_polar * (self.d_radial_around - self.sideways_over_sin)
    }
}
