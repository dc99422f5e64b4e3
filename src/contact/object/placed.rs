//! An object at its place on the dome.

use glam::DVec3;

use super::solid::ContactSolid;
use domecast_optics::numeric::Rigid;

/// Steps of a walk to the surface.
const MAX_STEPS: usize = 64;

/// An object at its place, seen from the dome.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Placed {
    pub solid: ContactSolid,
    sensor_from_object: Rigid,
    object_from_sensor: Rigid,
}

impl Placed {
    pub fn new(solid: ContactSolid, sensor_from_object: Rigid) -> Self {
        Self { solid, sensor_from_object, object_from_sensor: sensor_from_object.inverse() }
    }

    /// Puts the object to another pose.
    pub fn move_to(&mut self, sensor_from_object: Rigid) {
        self.sensor_from_object = sensor_from_object;
        self.object_from_sensor = sensor_from_object.inverse();
    }

    pub fn sensor_from_object(&self) -> Rigid {
        self.sensor_from_object
    }

    pub fn object_from_sensor(&self) -> Rigid {
        self.object_from_sensor
    }

    /// Centre and radius, if the object is a ball.
    pub fn ball(&self) -> Option<(DVec3, f64)> {
        self.solid.is_ball().then(|| {
            let (center, radius_mm) = self.solid.bounding_sphere();
            (self.sensor_from_object.point(center), radius_mm)
        })
    }

    /// Signed distance and outward direction, sensor frame.
    pub fn distance(&self, at_mm: DVec3) -> (f64, DVec3) {
        let found = self.solid.distance(self.object_from_sensor.point(at_mm));
        (found.value_mm, self.sensor_from_object.vector(found.outward))
    }

    /// Where a walk from inside the object along a direction leaves it: the way walked (mm), and the object's
    /// outward direction there; `None` if it does not within `max_mm`. Zero for a point outside.
    ///
    /// Newton's steps along the way; where the surface turns away, the distance itself is a safe step, since no
    /// point of the surface is nearer than that.
    pub fn walk_out(&self, from_mm: DVec3, along: DVec3, max_mm: f64) -> Option<(f64, DVec3)> {
        self.walk_on(self.distance(from_mm), from_mm, along, max_mm)
    }

    /// [`Self::walk_out`] from where the distance is known.
    pub fn walk_on(
        &self,
        (mut value, mut outward): (f64, DVec3),
        from_mm: DVec3,
        along: DVec3,
        max_mm: f64,
    ) -> Option<(f64, DVec3)> {
        if value >= 0.0 {
            return Some((0.0, outward));
        }
        if let Some((center, radius_mm)) = self.ball() {
            let from_center = from_mm - center;
            let b = from_center.dot(along);
            let way = (b * b + radius_mm * radius_mm - from_center.length_squared()).max(0.0).sqrt() - b;
            let outward = (from_center + along * way) / radius_mm;
            return (way <= max_mm).then_some((way, outward));
        }
        let tiny = 1e-10 * max_mm;
        let (mut inside, mut way) = (0.0, 0.0_f64);
        for _ in 0..MAX_STEPS {
            let slope = outward.dot(along);
            let step = if value < 0.0 {
                inside = f64::max(inside, way);
                -value / slope.clamp(0.25, 1.0)
            } else if slope > 0.25 {
                -value / slope
            } else {
                -value
            };
            let next = (way + step).max(0.5 * (inside + way));
            way = next;
            if way > max_mm {
                return None;
            }
            (value, outward) = self.distance(from_mm + along * way);
            if value.abs() <= tiny {
                return Some((way, outward));
            }
        }
        // A crease met at a grazing angle: the point is as near as the last steps brought it.
        (value.abs() <= 1e-4 * max_mm).then_some((way, outward))
    }
}
