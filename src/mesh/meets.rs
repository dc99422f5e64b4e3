//! Do two surfaces touch? A first look that spares a boolean.

use glam::{DAffine3, DVec3};

use super::BoundingBox;
use super::rays::RayTarget;
use super::tree::Node;

/// Room that counts as touching, in parts of the coordinates: rounding.
const ROUNDING: f64 = 1e-12;

impl RayTarget {
    /// Whether this surface, each of one shell, and another may share a point, or one holds the other; `false` is
    /// sure, `true` may be owed to rounding.
    pub fn may_meet(&self, other: &Self, self_from_other: &DAffine3) -> bool {
        let first = |target: &Self| target.triangles.first().map(|triangle| triangle[0]);
        let (Some(mine), Some(others)) = (first(self), first(other)) else { return false };
        self.touches(other, self_from_other)
            || self.holds(self_from_other.transform_point3(others))
            || other.holds(self_from_other.inverse().transform_point3(mine))
    }

    /// Whether a point is within a closed surface.
    pub fn holds(&self, point_mm: DVec3) -> bool {
        let Some(root) = self.tree.nodes().first() else { return false };
        if (root.low - point_mm).max(point_mm - root.high).max_element() > 0.0 {
            return false;
        }
        // Askew: no ray along the walls, edges and axes that parts are full of.
        let way = DVec3::new(0.237, 0.148, 0.960) * (2.0 * (root.high - root.low).length());
        // The first face on the way out of a solid is left through its back.
        self.first_hit(point_mm, point_mm + way).is_some_and(|(_, normal)| normal.dot(way) > 0.0)
    }

    /// Whether any two triangles share a point: down both trees of boxes at once.
    fn touches(&self, other: &Self, self_from_other: &DAffine3) -> bool {
        let mut pairs = vec![(0_u32, 0_u32)];
        while let Some((mine, others)) = pairs.pop() {
            let (Some(a), Some(b)) =
                (self.tree.nodes().get(mine as usize), other.tree.nodes().get(others as usize))
            else {
                continue;
            };
            let moved = BoundingBox { min_mm: b.low, max_mm: b.high }.transformed(self_from_other);
            if moved.is_apart_from(&BoundingBox { min_mm: a.low, max_mm: a.high }) {
                continue;
            }
            let extent = |node: &Node| (node.high - node.low).max_element();
            match (a.count, b.count) {
                (0, 0) if extent(a) >= extent(b) => pairs.extend([(mine + 1, others), (a.first, others)]),
                (0, 1..) => pairs.extend([(mine + 1, others), (a.first, others)]),
                (_, 0) => pairs.extend([(mine, others + 1), (mine, b.first)]),
                _ => {
                    for there in other.leaf(b) {
                        let there = there.map(|corner| self_from_other.transform_point3(corner));
                        if self.leaf(a).iter().any(|here| !are_apart(here, &there)) {
                            return true;
                        }
                    }
                }
            }
        }
        false
    }

    fn leaf(&self, node: &Node) -> &[[DVec3; 3]] {
        self.triangles.get(node.first as usize..(node.first + node.count) as usize).unwrap_or_default()
    }
}

/// Whether a plane parts two triangles: across a normal, or along an edge of each. (Two convex bodies are apart
/// only if such a plane is; in one plane none of these is, and they count as touching.)
fn are_apart(p: &[DVec3; 3], q: &[DVec3; 3]) -> bool {
    let size = p.iter().chain(q).fold(0.0_f64, |max, corner| max.max(corner.abs().max_element()));
    let parted = |axis: DVec3| {
        let range = |t: &[DVec3; 3]| {
            let [a, b, c] = t.map(|corner| corner.dot(axis));
            (a.min(b).min(c), a.max(b).max(c))
        };
        let ((low, high), (other_low, other_high)) = (range(p), range(q));
        f64::max(other_low - high, low - other_high) > ROUNDING * size * axis.length()
    };
    let edges = |t: &[DVec3; 3]| [t[1] - t[0], t[2] - t[1], t[0] - t[2]];
    let (mine, others) = (edges(p), edges(q));
    // The axes first: most pairs that come this far are separated by their boxes.
    DVec3::AXES.into_iter().any(parted)
        || parted(mine[0].cross(mine[1]))
        || parted(others[0].cross(others[1]))
        || mine.into_iter().any(|one| others.into_iter().any(|other| parted(one.cross(other))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Chord, Piece, Shape};

    fn target(low: f64, high: f64) -> RayTarget {
        let shape = Shape::cuboid(DVec3::splat(low), DVec3::splat(high));
        let chord = Chord::new(0.1).unwrap();
        RayTarget::new(&Piece::new("box", shape).shape.triangulate("box", chord).unwrap())
    }

    #[test]
    fn boxes_meet_as_boxes_do() {
        let (one, small) = (target(-1.0, 1.0), target(-0.1, 0.1));
        let at = |x: f64, y: f64, z: f64| DAffine3::from_translation(DVec3::new(x, y, z));
        // Within, across the wall, bearing on it, and a hair away from it.
        assert!(one.may_meet(&small, &at(0.3, 0.2, 0.1)));
        assert!(small.may_meet(&one, &at(-0.3, -0.2, -0.1)));
        assert!(one.may_meet(&small, &at(1.0, 0.2, 0.1)));
        assert!(one.may_meet(&small, &at(1.1, 0.2, 0.1)));
        assert!(!one.may_meet(&small, &at(1.1 + 1e-9, 0.2, 0.1)));
        assert!(!one.may_meet(&small, &at(5.0, 0.0, 0.0)));
    }

    #[test]
    fn turned_boxes_meet_edge_on() {
        // A cube on its edge beside a face: its corner is the root of two times its half side away.
        let (one, small) = (target(-1.0, 1.0), target(-0.1, 0.1));
        let beside = |gap: f64| {
            DAffine3::from_translation(DVec3::new(1.0 + 0.1 * 2.0_f64.sqrt() + gap, 0.4, 0.3))
                * DAffine3::from_rotation_z(std::f64::consts::FRAC_PI_4)
        };
        assert!(one.may_meet(&small, &beside(-1e-9)));
        assert!(!one.may_meet(&small, &beside(1e-9)));
        // Edge against edge, where no face of either parts them.
        let crossed = |gap: f64| {
            DAffine3::from_translation(DVec3::new(1.0 + gap, 1.0 + gap, 0.0))
                * DAffine3::from_rotation_z(std::f64::consts::FRAC_PI_4)
                * DAffine3::from_rotation_x(0.3)
        };
        assert!(one.may_meet(&small, &crossed(0.0)));
        assert!(!one.may_meet(&small, &crossed(0.2)));
    }
}
