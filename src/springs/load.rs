//! Loads and wrenches.

use glam::DVec3;
use nalgebra::Vector6;

/// Standard gravity, m/s^2 (CGPM 1901).
pub const STANDARD_GRAVITY_MPS2: f64 = 9.806_65;
/// N from g and m/s^2.
pub const N_PER_G_MPS2: f64 = 1e-3;

/// What the world puts on the dome and the platform, in the rest frame, about one point fixed there.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wrench {
    /// Force, N; a push on the pole has z < 0.
    pub force_n: DVec3,
    /// Moment about the point, N*mm.
    pub moment_nmm: DVec3,
}

impl Wrench {
    /// From (Fx, Fy, Fz, Mx, My, Mz) in N and N*mm.
    pub fn from_array(v: [f64; 6]) -> Self {
        Self { force_n: DVec3::new(v[0], v[1], v[2]), moment_nmm: DVec3::new(v[3], v[4], v[5]) }
    }

    /// (Fx, Fy, Fz, Mx, My, Mz) in N and N*mm.
    pub fn to_array(self) -> [f64; 6] {
        let (f, m) = (self.force_n, self.moment_nmm);
        [f.x, f.y, f.z, m.x, m.y, m.z]
    }

    /// As a column for linear algebra.
    pub fn to_vector(self) -> Vector6<f64> {
        Vector6::from(self.to_array())
    }

    /// The wrench about `about_mm` of a force that acts at a point, and a moment besides.
    pub fn of_load(force_n: DVec3, moment_nmm: DVec3, point_mm: DVec3, about_mm: DVec3) -> Self {
        Self { force_n, moment_nmm: moment_nmm + (point_mm - about_mm).cross(force_n) }
    }

    /// The same wrench about another point.
    pub fn moved(self, from_mm: DVec3, to_mm: DVec3) -> Self {
        Self { force_n: self.force_n, moment_nmm: self.moment_nmm + (from_mm - to_mm).cross(self.force_n) }
    }

    /// This many times the wrench.
    pub fn scaled(self, factor: f64) -> Self {
        Self { force_n: self.force_n * factor, moment_nmm: self.moment_nmm * factor }
    }

    /// Whether all six are finite.
    pub fn is_finite(self) -> bool {
        self.force_n.is_finite() && self.moment_nmm.is_finite()
    }
}

impl std::ops::Add for Wrench {
    type Output = Self;

    /// Of two wrenches about the same point.
    fn add(self, other: Self) -> Self {
        Self { force_n: self.force_n + other.force_n, moment_nmm: self.moment_nmm + other.moment_nmm }
    }
}

impl std::ops::Sub for Wrench {
    type Output = Self;

    /// Of two wrenches about the same point.
    fn sub(self, other: Self) -> Self {
        Self { force_n: self.force_n - other.force_n, moment_nmm: self.moment_nmm - other.moment_nmm }
    }
}
