//! The dome's face as the charts take it: places of a sphere, on which a cylinder below the hemisphere is rolled up.
//!
//! A cap is a part of the sphere. On a cylinder a place lies at a length of the meridian, which over the radius is the angle
//! from the pole that the sphere's place has: so the chart of a sphere serves both, with tangents that are turned and drawn out.

use domecast_optics::DomeShape;
use glam::{DVec3, Vec2, Vec3A};

/// Smallest cosine of the angle below the equator: a cylinder is rolled up no further than to the sphere's lower pole.
const MIN_COSINE: f32 = 0.05;

/// Sphere, and whether a cylinder goes on below it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Face {
    pub dome: DomeShape,
    center: Vec3A,
    radius_mm: f32,
    has_wall: bool,
}

impl Face {
    pub fn new(dome: DomeShape) -> Self {
        Self {
            dome,
            center: dome.center_mm().as_vec3a(),
            radius_mm: dome.radius_mm() as f32,
            has_wall: dome.center_z_mm() > 0.0,
        }
    }

    /// The point of the dome, continued below its rim, for a place of the sphere about its centre, mm.
    pub fn point_of(&self, round_mm: DVec3) -> DVec3 {
        if self.has_wall && round_mm.z < 0.0 {
            let meridian_rad = round_mm.truncate().length().atan2(round_mm.z);
            return self.dome.point_mm(meridian_rad, round_mm.y.atan2(round_mm.x));
        }
        round_mm + self.dome.center_mm()
    }

    /// The same as short numbers.
    #[inline]
    pub fn point_near(&self, round_mm: Vec3A) -> Vec3A {
        if self.has_wall && round_mm.z < 0.0 {
            let below_rad = (-round_mm.z / self.radius_mm).min(1.0).asin();
            let flat = round_mm.truncate().normalize_or_zero() * self.radius_mm;
            return flat.extend(-below_rad * self.radius_mm).to_vec3a() + self.center;
        }
        round_mm + self.center
    }

    /// The place of the sphere for a point of the dome.
    #[inline]
    pub fn round(&self, point_mm: Vec3A) -> Vec3A {
        let from_center = point_mm - self.center;
        if self.has_wall && from_center.z < 0.0 {
            let below_rad = (-from_center.z / self.radius_mm).min(MIN_COSINE.acos());
            let (sine, cosine) = below_rad.sin_cos();
            return (from_center.truncate() * cosine).extend(-sine * self.radius_mm).to_vec3a();
        }
        from_center
    }

    /// A tangent of the sphere at a place, on the dome.
    #[inline]
    pub fn tangent(&self, round_mm: Vec3A, tangent: Vec3A) -> Vec3A {
        if !(self.has_wall && round_mm.z < 0.0) {
            return tangent;
        }
        let sine = (-round_mm.z / self.radius_mm).min(1.0);
        let cosine = (1.0 - sine * sine).max(0.0).sqrt().max(MIN_COSINE);
        let out = round_mm.truncate().normalize_or_zero();
        let east = Vec2::new(-out.y, out.x);
        // Down the meridian lengths are kept; the ring is drawn out to the sphere's equator.
        let down = -tangent.z * cosine - tangent.truncate().dot(out) * sine;
        (east * (tangent.truncate().dot(east) / cosine)).extend(-down).to_vec3a()
    }

    /// Where a ray moved back by a displacement meets the face that it met at `rest_mm`.
    pub fn meet_back(&self, rest_mm: Vec3A, inside: Vec3A, displacement_mm: Vec3A) -> Vec3A {
        let from_center = rest_mm - self.center;
        let base = from_center - displacement_mm;
        let on_sphere = back(from_center, inside, base);
        if !(self.has_wall && on_sphere.z < 0.0) {
            return on_sphere + self.center;
        }
        let flat = |v: Vec3A| Vec3A::new(v.x, v.y, 0.0);
        let out = if from_center.z < 0.0 { flat(from_center) } else { from_center };
        let slope = flat(inside).length();
        let on_wall = back(out, flat(inside) / slope.max(1e-6), flat(base));
        let way = (on_wall - flat(base)).dot(flat(inside)) / (slope * slope).max(1e-6);
        (base + inside * way) + self.center
    }
}

/// Where a line through `base` along a unit direction meets the sphere on which `on` lies, its root near zero.
fn back(on: Vec3A, along: Vec3A, base: Vec3A) -> Vec3A {
    let radius_mm = on.length();
    // |base + s along| = R; the root near zero.
    let b = base.dot(along);
    let c = radius_mm * radius_mm - base.length_squared();
    let root = (b * b + c).max(0.0).sqrt();
    let s = if b > 0.0 { c / (b + root) } else { root - b };
    let next = base + along * s;
    next * (radius_mm / next.length().max(1e-6))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cylinder_is_rolled_up_and_back() {
        let dome = DomeShape::on_cylinder(8.0, 5.0);
        let face = Face::new(dome);
        for (meridian_rad, azimuth) in [(0.4_f64, 0.3_f64), (1.5, 2.0), (1.7, -1.0), (2.1, 2.9)] {
            let at = dome.point_mm(meridian_rad, azimuth);
            let round = face.round(at.as_vec3a());
            assert!((round.length() - 8.0).abs() < 1e-5);
            assert!(face.point_near(round).distance(at.as_vec3a()) < 1e-4, "{at}");
            assert!(face.point_of(round.as_dvec3()).distance(at) < 1e-4, "{at}");
            // Tangents by differences.
            for by in [1e-3, -1e-3] {
                for (there, name) in [
                    (dome.point_mm(meridian_rad + by, azimuth), "down"),
                    (dome.point_mm(meridian_rad, azimuth + by), "around"),
                ] {
                    let moved = (there - at).as_vec3a();
                    let on_sphere = face.round(there.as_vec3a()) - round;
                    assert!(face.tangent(round, on_sphere).distance(moved) < 2e-4, "{name} at {at}");
                }
            }
            // A ray that is not moved meets the same place again.
            let inside = (at - DVec3::new(0.3, -0.2, -4.0)).normalize().as_vec3a();
            assert!(face.meet_back(at.as_vec3a(), inside, Vec3A::ZERO).distance(at.as_vec3a()) < 1e-4);
            let shift = Vec3A::new(0.02, 0.03, -0.01);
            let met = face.meet_back(at.as_vec3a(), inside, shift).as_dvec3();
            assert!(dome.distance_mm(met).abs() < 1e-4, "{met}");
            let aside = (met + shift.as_dvec3() - at).cross(inside.as_dvec3());
            assert!(aside.length() < 1e-4, "{met} is {aside} beside the ray");
        }
    }
}
