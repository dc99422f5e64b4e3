//! The dome's outer face: a spherical cap, a hemisphere, or a hemisphere on a short cylinder.
//!
//! # Example
//! ```
//! use domecast_optics::DomeShape;
//!
//! let cap = DomeShape::cap(10.0, 60_f64.to_radians());
//! assert!((cap.height_mm() - 5.0).abs() < 1e-12);
//! assert!((cap.rim_radius_mm() - 75_f64.sqrt()).abs() < 1e-12);
//! ```

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec2, DVec3};

/// A sphere about a point of the axis, above the plane z = 0 on which the dome stands.
///
/// A centre below that plane makes a cap, one on it a hemisphere; under a centre above it the sphere goes on as the
/// cylinder of its own radius. Sensor frame, millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DomeShape {
    radius_mm: f64,
    center_z_mm: f64,
}

impl DomeShape {
    /// A sphere by its radius and the height of its centre.
    pub const fn new(radius_mm: f64, center_z_mm: f64) -> Self {
        Self { radius_mm, center_z_mm }
    }

    /// Half a sphere.
    pub const fn hemisphere(radius_mm: f64) -> Self {
        Self { radius_mm, center_z_mm: 0.0 }
    }

    /// The part of a sphere within `rim_polar_rad` of the pole, seen from the sphere's centre; a right angle or more
    /// is the hemisphere.
    pub fn cap(radius_mm: f64, rim_polar_rad: f64) -> Self {
        let center_z_mm = if rim_polar_rad >= FRAC_PI_2 { 0.0 } else { -radius_mm * rim_polar_rad.cos() };
        Self { radius_mm, center_z_mm }
    }

    /// A hemisphere on a cylinder of its own radius and this height.
    pub const fn on_cylinder(radius_mm: f64, height_mm: f64) -> Self {
        Self { radius_mm, center_z_mm: height_mm }
    }

    /// Radius of the sphere, mm.
    pub fn radius_mm(&self) -> f64 {
        self.radius_mm
    }

    /// Height of the sphere's centre: negative for a cap, the cylinder's height above zero, mm.
    pub fn center_z_mm(&self) -> f64 {
        self.center_z_mm
    }

    /// The sphere's centre, mm.
    pub fn center_mm(&self) -> DVec3 {
        DVec3::new(0.0, 0.0, self.center_z_mm)
    }

    /// Whether the dome is neither a cap nor on a cylinder.
    pub fn is_hemisphere(&self) -> bool {
        self.center_z_mm == 0.0
    }

    /// What it is, for messages.
    pub fn kind(&self) -> &'static str {
        if self.center_z_mm < 0.0 {
            "a spherical cap"
        } else if self.center_z_mm > 0.0 {
            "a hemisphere on a cylinder"
        } else {
            "a hemisphere"
        }
    }

    /// The same with another radius of the sphere about the same centre: a coat on the dome, or its tolerance.
    pub fn with_radius_mm(&self, radius_mm: f64) -> Self {
        Self { radius_mm, ..*self }
    }

    /// The same shape in another size, by the radius of its sphere.
    pub fn scaled_to(&self, radius_mm: f64) -> Self {
        Self { radius_mm, center_z_mm: self.center_z_mm * (radius_mm / self.radius_mm) }
    }

    /// Radius of the circle in which the dome meets the sheet, mm.
    pub fn rim_radius_mm(&self) -> f64 {
        if self.center_z_mm < 0.0 {
            ((self.radius_mm - self.center_z_mm) * (self.radius_mm + self.center_z_mm)).max(0.0).sqrt()
        } else {
            self.radius_mm
        }
    }

    /// Height of the pole, mm.
    pub fn height_mm(&self) -> f64 {
        self.radius_mm + self.center_z_mm
    }

    /// The pole, mm.
    pub fn pole_mm(&self) -> DVec3 {
        DVec3::new(0.0, 0.0, self.height_mm())
    }

    /// Angle between the axis and the outward normal where the sphere ends: the rim of a cap, else a right angle.
    pub fn sphere_end_rad(&self) -> f64 {
        if self.center_z_mm < 0.0 { (-self.center_z_mm / self.radius_mm).min(1.0).acos() } else { FRAC_PI_2 }
    }

    /// Length of the meridian from pole to rim over the sphere's radius: for a cap and the hemisphere the polar angle
    /// of the rim, with a cylinder its height over the radius more.
    pub fn meridian_end_rad(&self) -> f64 {
        self.sphere_end_rad() + self.center_z_mm.max(0.0) / self.radius_mm
    }

    /// The point of the dome at a length of the meridian over the sphere's radius (on the sphere the polar angle seen
    /// from its centre) and an azimuth, mm.
    pub fn point_mm(&self, meridian_rad: f64, azimuth_rad: f64) -> DVec3 {
        if self.center_z_mm > 0.0 && meridian_rad > FRAC_PI_2 {
            let out = DVec2::from_angle(azimuth_rad) * self.radius_mm;
            return out.extend(self.center_z_mm - self.radius_mm * (meridian_rad - FRAC_PI_2));
        }
        let (sin, cos) = meridian_rad.sin_cos();
        let out = DVec2::from_angle(azimuth_rad) * sin;
        let sphere = out.extend(cos) * self.radius_mm;
        sphere.with_z(sphere.z + self.center_z_mm)
    }

    /// [`DomeShape::point_mm`]'s meridian for a point near the face; below the rim that of the rim.
    pub fn meridian_rad(&self, point_mm: DVec3) -> f64 {
        let up_mm = point_mm.z - self.center_z_mm;
        let meridian_rad = if self.center_z_mm > 0.0 && up_mm < 0.0 {
            FRAC_PI_2 - up_mm / self.radius_mm
        } else {
            point_mm.truncate().length().atan2(up_mm)
        };
        meridian_rad.clamp(0.0, self.meridian_end_rad())
    }

    /// Distance of the face from the axis at a length of the meridian over the sphere's radius, mm.
    pub fn ring_radius_mm(&self, meridian_rad: f64) -> f64 {
        let on_wall = self.center_z_mm > 0.0 && meridian_rad > FRAC_PI_2;
        if on_wall { self.radius_mm } else { self.radius_mm * meridian_rad.sin() }
    }

    /// Height above the sphere's centre over the radius at the rim: 1 is the pole. Equal steps of it bound equal areas,
    /// on the cylinder as on the sphere (Archimedes).
    pub fn rim_level(&self) -> f64 {
        -self.center_z_mm / self.radius_mm
    }

    /// [`DomeShape::point_mm`]'s meridian at a level between 1 and [`DomeShape::rim_level`].
    pub fn meridian_of_level(level: f64) -> f64 {
        if level >= 0.0 { level.min(1.0).acos() } else { FRAC_PI_2 - level }
    }

    /// The sphere's radius along the outward normal of a point of the dome: from its centre, on the cylinder from the
    /// axis.
    pub fn outward_mm(&self, point_mm: DVec3) -> DVec3 {
        let from_center = point_mm.with_z(point_mm.z - self.center_z_mm);
        if self.center_z_mm > 0.0 && from_center.z < 0.0 { from_center.with_z(0.0) } else { from_center }
    }

    /// Outward unit normal at a point of the dome.
    pub fn normal(&self, point_mm: DVec3) -> DVec3 {
        self.outward_mm(point_mm) / self.radius_mm
    }

    /// The point of the face nearest along the normal to a point near it, mm.
    pub fn onto(&self, point_mm: DVec3) -> DVec3 {
        let outward = self.outward_mm(point_mm);
        let length = outward.length();
        if length == 0.0 { self.pole_mm() } else { point_mm - outward + outward * (self.radius_mm / length) }
    }

    /// [`DomeShape::onto`], and the rim for what would lie below the sheet's top: the point of the dome nearest to a point.
    pub fn nearest_mm(&self, point_mm: DVec3) -> DVec3 {
        let at_mm = self.onto(point_mm);
        if at_mm.z >= 0.0 {
            return at_mm;
        }
        (point_mm.truncate().normalize_or(DVec2::X) * self.rim_radius_mm()).extend(0.0)
    }

    /// Distance of a point above the sheet from the face: negative within, mm.
    pub fn distance_mm(&self, point_mm: DVec3) -> f64 {
        self.outward_mm(point_mm).length() - self.radius_mm
    }

    /// Area of the outer face, mm^2.
    pub fn area_mm2(&self) -> f64 {
        TAU * self.radius_mm * self.height_mm()
    }

    /// Volume above the sheet, mm^3.
    pub fn volume_mm3(&self) -> f64 {
        let (radius, z) = (self.radius_mm, self.center_z_mm);
        if z < 0.0 {
            let height = self.height_mm();
            PI * height * height * (3.0 * radius - height) / 3.0
        } else {
            2.0 / 3.0 * PI * radius.powi(3) + PI * radius * radius * z
        }
    }

    /// Height of the centroid of the volume, mm.
    pub fn centroid_z_mm(&self) -> f64 {
        let (radius, z) = (self.radius_mm, self.center_z_mm);
        if z < 0.0 {
            let height = self.height_mm();
            // of a cap from the sphere's centre: 3 (2 R - h)^2 / (4 (3 R - h))
            z + 0.75 * (2.0 * radius - height).powi(2) / (3.0 * radius - height)
        } else {
            let (ball, pillar) = (2.0 / 3.0 * radius, z);
            (ball * (z + 0.375 * radius) + pillar * 0.5 * z) / (ball + pillar)
        }
    }
}
