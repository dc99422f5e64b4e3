//! The closed form's field: Hertz' displacement of a half-space, carried to the dome.

use glam::DVec3;

use crate::half_space::Patch;
use crate::outcome::Extent;

/// Hertz' displacement with the finite body's correction.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sunk {
    pub patch: Patch,
    /// Contact normal of the dome (outwards), the patch's axes.
    pub normal: DVec3,
    pub first: DVec3,
    pub second: DVec3,
    pub dome_radius_mm: f64,
    pub modulus_mpa: f64,
    /// The dome's part of the approach: 1 over 1 + the object's yield ratio.
    pub share: f64,
    /// Displacement that the dome's base takes back at the contact, mm: of the dome alone.
    pub held_mm: f64,
    pub shift_mm: DVec3,
    pub turn_rad: f64,
}

impl Sunk {
    pub fn at(&self, at_mm: DVec3) -> DVec3 {
        let (x, y) = (at_mm.dot(self.first), at_mm.dot(self.second));
        let cosine = (at_mm.dot(self.normal) / self.dome_radius_mm).clamp(-1.0, 1.0);
        // Chord lengths from the contact keep their bearing: the half-space's plane, wrapped on the dome.
        let flat = x.hypot(y);
        let chord = self.dome_radius_mm * (2.0 * (1.0 - cosine)).sqrt();
        let scale = if cosine < 0.0 && flat > 0.0 { chord / flat } else { 1.0 };
        let (x, y) = (x * scale, y * scale);
        let q = (x / self.patch.a_mm).powi(2) + (y / self.patch.b_mm).powi(2);
        let sink = self.patch.sink_mm(x, y, self.modulus_mpa) * self.share;
        let fade = rim_fade(at_mm.z / self.dome_radius_mm);
        let held = self.held_mm * profile(cosine);
        let sideways = if q <= 1.0 { 1.0 } else { std::f64::consts::FRAC_2_PI * q.sqrt().recip().asin() };
        let mut u = self.normal * -((sink - held) * fade);
        u += self.shift_mm * (sideways * fade);
        let turn = if q <= 1.0 { 1.0 } else { 1.0 / (q * q.sqrt()) };
        u += (self.normal * (self.turn_rad * turn * fade)).cross(at_mm);
        u
    }

    pub fn extent(&self) -> Extent {
        // At right angles from the contact what is left of the sink is bounded by its half-space value there.
        let far = std::f64::consts::FRAC_PI_2;
        let reach = self.dome_radius_mm * std::f64::consts::SQRT_2;
        let sink = self.patch.force_n / (std::f64::consts::PI * self.modulus_mpa * reach) * 2.0;
        let drag = self.shift_mm.length() * self.patch.a_mm / reach
            + self.turn_rad.abs() * self.dome_radius_mm * (self.patch.a_mm / reach).powi(3);
        Extent { direction: self.normal, angle_rad: far, beyond_mm: sink + drag + self.held_mm.abs() }
    }
}

/// How the finite body's hold falls off with the angle from the contact.
fn profile(cosine: f64) -> f64 {
    cosine.max(0.0)
}

/// Falls to zero at the bonded rim.
fn rim_fade(height: f64) -> f64 {
    let t = (height / 0.3).clamp(0.0, 1.0);
    t * (2.0 - t)
}
