//! Signed distance to exact shapes: the yardstick for meshes and walls.

use glam::{DVec2, DVec3};

use super::{Piece, Profile, ProfileEdge, Shape};

impl Shape {
    /// Distance of a point (the shape's frame, mm) from the exact surface,
    /// negative inside.
    pub fn signed_distance_mm(&self, point_mm: DVec3) -> f64 {
        match self {
            Self::Turned { profile, .. } => {
                turned(profile, DVec2::new(point_mm.truncate().length(), point_mm.z))
            }
            Self::Prism { outline_mm, corner_radius_mm, bottom_z_mm, top_z_mm } => {
                let flat = rounded_polygon(outline_mm, *corner_radius_mm, point_mm.truncate());
                let height = (bottom_z_mm - point_mm.z).max(point_mm.z - top_z_mm);
                let outside = DVec2::new(flat, height).max(DVec2::ZERO).length();
                outside + flat.max(height).min(0.0)
            }
        }
    }
}

impl Piece {
    /// Distance of a point of the part's frame from the piece's exact surface,
    /// negative inside, mm.
    pub fn signed_distance_mm(&self, point_mm: DVec3) -> f64 {
        self.shape.signed_distance_mm(self.part_from_shape.inverse().transform_point3(point_mm))
    }

    /// The point of the piece's exact surface that is nearest to a point, mm:
    /// down the gradient of the distance, which is 1 off the edges.
    pub fn nearest_mm(&self, point_mm: DVec3) -> DVec3 {
        let mut at = point_mm;
        for _ in 0..4 {
            let distance = self.signed_distance_mm(at);
            let h = 1e-4 * distance.abs().max(1e-6);
            let slope =
                |axis: DVec3| self.signed_distance_mm(at + axis * h) - self.signed_distance_mm(at - axis * h);
            let gradient = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)) / (2.0 * h);
            // A sheared piece measures along its own axes: its slope is not 1.
            let steepness = gradient.length_squared();
            if !steepness.is_normal() {
                break;
            }
            at -= gradient * (distance / steepness);
            if distance.abs() < 1e-9 {
                break;
            }
        }
        at
    }
}

/// Distance in the half plane of (distance from the axis, height).
fn turned(profile: &Profile, p: DVec2) -> f64 {
    let (Some(&first), Some(&last)) = (profile.points_mm.first(), profile.points_mm.last()) else {
        return f64::INFINITY;
    };
    // The flat discs at the ends belong to the outline; the axis does not.
    let mut nearest = to_segment(p, DVec2::new(0.0, first.y), first);
    nearest = nearest.min(to_segment(p, last, DVec2::new(0.0, last.y)));
    let mut inside = false;
    for (ends, edge) in profile.points_mm.windows(2).zip(&profile.edges) {
        let (low, high) = (ends[0], ends[1]);
        let radius_here = match *edge {
            ProfileEdge::Line => {
                nearest = nearest.min(to_segment(p, low, high));
                let t = if high.y > low.y { (p.y - low.y) / (high.y - low.y) } else { 0.0 };
                low.x + t * (high.x - low.x)
            }
            ProfileEdge::Arc { center_z_mm } => {
                let center = DVec2::new(0.0, center_z_mm);
                let radius = (low - center).length();
                let q = p - center;
                // On the arc if the direction points between its ends.
                let angle = |v: DVec2| v.y.atan2(v.x);
                if (angle(low - center)..=angle(high - center)).contains(&angle(q)) {
                    nearest = nearest.min((q.length() - radius).abs());
                }
                nearest = nearest.min(p.distance(low)).min(p.distance(high));
                let dz = p.y - center_z_mm;
                (radius * radius - dz * dz).max(0.0).sqrt()
            }
        };
        // A profile has one radius at each height: inside is below it.
        if p.y >= low.y && p.y <= high.y && high.y > low.y {
            inside |= p.x <= radius_here;
        }
    }
    if inside { -nearest } else { nearest }
}

fn to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let length2 = along.length_squared();
    let t = if length2 > 0.0 { ((p - a).dot(along) / length2).clamp(0.0, 1.0) } else { 0.0 };
    p.distance(a + along * t)
}

/// Distance to a convex polygon whose corners are rounded: the polygon moved
/// inwards by the radius, moved outwards again.
fn rounded_polygon(outline: &[DVec2], radius: f64, p: DVec2) -> f64 {
    let n = outline.len();
    let inner: Vec<DVec2> = (0..n)
        .map(|i| {
            let (before, here, after) = (outline[(i + n - 1) % n], outline[i], outline[(i + 1) % n]);
            let (u, v) = ((here - before).normalize_or_zero(), (after - here).normalize_or_zero());
            let bisector = u.perp() + v.perp();
            here + bisector * (radius / (1.0 + u.dot(v)))
        })
        .collect();
    let mut nearest = f64::INFINITY;
    let mut inside = true;
    for i in 0..n {
        let (a, b) = (inner[i], inner[(i + 1) % n]);
        nearest = nearest.min(to_segment(p, a, b));
        inside &= (b - a).perp_dot(p - a) >= 0.0;
    }
    (if inside { -nearest } else { nearest }) - radius
}
