//! The area that a disc and a polygon share, exactly.

use glam::DVec2;

/// Area of a polygon, positive where it turns from x to y.
pub(crate) fn area(polygon: &[DVec2]) -> f64 {
    let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
    0.5 * edges.map(|(a, b)| a.perp_dot(*b)).sum::<f64>()
}

/// Area that a simple polygon and a disc share.
///
/// Each edge spans a triangle with the disc's centre; what the disc has in common with it is a triangle where the edge
/// runs inside and a sector where it runs outside. The signs of the triangles add up to the polygon.
pub(crate) fn disc_overlap(polygon: &[DVec2], center: DVec2, radius: f64) -> f64 {
    let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
    edges.map(|(a, b)| edge_part(*a - center, *b - center, radius)).sum::<f64>().abs()
}

/// Signed area of a disc about the origin within the triangle from there to an edge.
fn edge_part(a: DVec2, b: DVec2, radius: f64) -> f64 {
    let sector = |p: DVec2, q: DVec2| 0.5 * radius * radius * p.perp_dot(q).atan2(p.dot(q));
    let along = b - a;
    let (square, half, gap) = (along.dot(along), a.dot(along), a.dot(a) - radius * radius);
    let inside = half * half - square * gap;
    if square <= 0.0 || inside <= 0.0 {
        return sector(a, b);
    }
    let root = inside.sqrt();
    let (enter, leave) = ((-half - root) / square, (-half + root) / square);
    if leave <= 0.0 || enter >= 1.0 {
        return sector(a, b);
    }
    let from = if enter > 0.0 { a + along * enter } else { a };
    let to = if leave < 1.0 { a + along * leave } else { b };
    let before = if enter > 0.0 { sector(a, from) } else { 0.0 };
    let after = if leave < 1.0 { sector(to, b) } else { 0.0 };
    before + 0.5 * from.perp_dot(to) + after
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn square(half: f64) -> [DVec2; 4] {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec2::new(x, y) * half)
    }

    #[test]
    fn a_disc_within_around_and_beside_a_square() {
        assert!((disc_overlap(&square(3.0), DVec2::ZERO, 1.0) - PI).abs() < 1e-12);
        assert!((disc_overlap(&square(0.5), DVec2::ZERO, 3.0) - 1.0).abs() < 1e-12);
        assert!(disc_overlap(&square(1.0), DVec2::new(5.0, 1.0), 2.0).abs() < 1e-12);
        // Half and a quarter of it, on the square's side and corner.
        assert!((disc_overlap(&square(3.0), DVec2::new(3.0, 0.0), 1.0) - 0.5 * PI).abs() < 1e-12);
        assert!((disc_overlap(&square(3.0), DVec2::new(3.0, 3.0), 1.0) - 0.25 * PI).abs() < 1e-12);
    }

    #[test]
    fn counted_on_a_fine_grid() {
        let polygon = [(-0.3, -1.0), (1.2, -0.4), (0.9, 0.8), (-0.8, 0.5)].map(|(x, y)| DVec2::new(x, y));
        for (center, radius) in
            [(DVec2::new(0.4, 0.2), 0.7), (DVec2::new(-0.6, -0.6), 0.5), (DVec2::new(1.0, 0.9), 1.4)]
        {
            let inside = |p: DVec2| {
                (0..4).all(|k| (polygon[(k + 1) % 4] - polygon[k]).perp_dot(p - polygon[k]) >= 0.0)
                    && p.distance(center) <= radius
            };
            let step = 1.0 / 400.0;
            let cells = (-800..800)
                .flat_map(|i| (-800..800).map(move |j| DVec2::new(f64::from(i), f64::from(j)) * step));
            let counted = cells.filter(|p| inside(*p)).count() as f64 * step * step;
            let found = disc_overlap(&polygon, center, radius);
            assert!((found - counted).abs() < 4e-3, "{found} {counted}");
        }
    }
}
