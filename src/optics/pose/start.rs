//! The planar start: a homography through four markers, and the two poses that it may mean.

use glam::{DMat3, DVec2, DVec3};

use crate::numeric::Rigid;

/// Smallest triangle among the four points, over the area of their spread, for which they span a plane.
const MIN_AREA: f64 = 1e-4;

/// The pose of the plane z = 0 of `platform` seen along unit rays, and its mirror about the line of sight, as
/// `camera_from_platform`; `None` where three of the four points, or of the rays, are on one line.
///
/// `points_mm[i]` is seen along `rays[i]`. Four correspondences fix the homography through projective bases
/// (two 3x3 inverses); its columns give rotation and translation. A plane seen from afar looks the same after
/// half a turn about the line of sight and half a turn in itself: the second pose.
pub(super) fn planar_poses(points_mm: &[DVec2; 4], rays: &[DVec3; 4]) -> Option<[Rigid; 2]> {
    let points = points_mm.map(|p| DVec3::new(p.x, p.y, 1.0));
    let plane = basis(&points)?;
    let view = basis(rays)?;
    let mut h = view * plane.inverse();
    // Points in front: the ray times a positive depth.
    let depth: f64 = points.iter().zip(rays).map(|(p, r)| (h * *p).dot(*r).signum()).sum();
    if depth < 0.0 {
        h *= -1.0;
    }
    let scale = 2.0 / (h.x_axis.length() + h.y_axis.length());
    if !scale.is_finite() {
        return None;
    }
    let (x, y, translation) = (h.x_axis * scale, h.y_axis * scale, h.z_axis * scale);
    // The nearest pair of orthonormal axes lies symmetric to the two columns.
    let (sum, difference) = (x + y, x - y);
    let (a, b) = (sum.normalize_or_zero(), difference.normalize_or_zero());
    let x = (a + b).normalize_or_zero();
    let normal = x.cross(a - b).normalize_or_zero();
    if normal == DVec3::ZERO {
        return None;
    }
    let rotation = DMat3::from_cols(x, normal.cross(x), normal);
    let first = Rigid::new(rotation, translation);
    // Half a turn about the sight line to the middle of the markers, and half a turn of the plane in itself
    // about that middle.
    let middle = 0.25 * (points_mm[0] + points_mm[1] + points_mm[2] + points_mm[3]);
    let middle = DVec3::new(middle.x, middle.y, 0.0);
    let sight = first.point(middle);
    let line = sight.normalize_or_zero();
    let about_line = |v: DVec3| line * (2.0 * line.dot(v)) - v;
    let mirrored = DMat3::from_cols(
        -about_line(rotation.x_axis),
        -about_line(rotation.y_axis),
        about_line(rotation.z_axis),
    );
    let second = Rigid::new(mirrored, sight - mirrored * middle);
    Some([first, second])
}

/// The matrix that takes the unit vectors to the first three points and (1, 1, 1) to the fourth, in the
/// projective sense.
fn basis(points: &[DVec3; 4]) -> Option<DMat3> {
    let m = DMat3::from_cols(points[0], points[1], points[2]);
    let size = points[0].length() * points[1].length() * points[2].length();
    let spread = |a: usize, b: usize, c: usize| points[a].dot(points[b].cross(points[c])).abs();
    // Rays of a narrow view have small determinants all round: compare them with each other.
    let volumes = [spread(0, 1, 2), spread(0, 1, 3), spread(0, 2, 3), spread(1, 2, 3)];
    let largest = volumes.iter().copied().fold(0.0, f64::max);
    let smallest = volumes.iter().copied().fold(f64::INFINITY, f64::min);
    if !(largest > 1e-12 * size && smallest > MIN_AREA * largest) {
        return None;
    }
    let weights = m.inverse() * points[3];
    Some(DMat3::from_cols(points[0] * weights.x, points[1] * weights.y, points[2] * weights.z))
}

/// Four of many points that span the plane best: the two farthest apart and the farthest on each side of, or
/// from, their line.
pub(super) fn widest_four(points: &[DVec2]) -> Option<[usize; 4]> {
    let mut best = (0.0, 0, 0);
    for i in 0..points.len() {
        for j in i + 1..points.len() {
            let d = points[i].distance_squared(points[j]);
            if d > best.0 {
                best = (d, i, j);
            }
        }
    }
    let (_, a, b) = best;
    let others = || (0..points.len()).filter(move |i| *i != a && *i != b);
    let side = |i: usize| (points[b] - points[a]).perp_dot(points[i] - points[a]);
    let c = others().max_by(|i, j| side(*i).abs().total_cmp(&side(*j).abs()))?;
    let area = |i: usize, j: usize, k: usize| (points[j] - points[i]).perp_dot(points[k] - points[i]).abs();
    let worst = |d: usize| area(a, b, d).min(area(a, c, d)).min(area(b, c, d));
    let d = others().filter(|i| *i != c).max_by(|i, j| worst(*i).total_cmp(&worst(*j)))?;
    Some([a, b, c, d])
}
