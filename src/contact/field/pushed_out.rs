//! The geometric level's field: what lies inside the object is pushed out of it.

use glam::DVec3;

use crate::object::Placed;

/// What the geometric level moves.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PushedOut {
    pub placed: Placed,
    pub dome_radius_mm: f64,
    pub axis: DVec3,
    pub angle_rad: f64,
    /// Sideways drag of the touched region.
    pub shift_mm: DVec3,
    pub turn_rad: f64,
}

impl PushedOut {
    pub fn at(&self, at_mm: DVec3) -> DVec3 {
        let push = pushed_out(&self.placed, self.dome_radius_mm, at_mm);
        if push == DVec3::ZERO {
            return push;
        }
        push + self.shift_mm + (self.axis * self.turn_rad).cross(at_mm - self.axis * self.axis.dot(at_mm))
    }
}

/// Displacement of one point of the dome under the rule.
fn pushed_out(placed: &Placed, dome_radius_mm: f64, at_mm: DVec3) -> DVec3 {
    let inward = -at_mm.normalize_or_zero();
    placed.walk_out(at_mm, inward, dome_radius_mm).map_or(DVec3::ZERO, |(way, _)| inward * way)
}
