//! What is cut out of a part, as the convex hollows that light passes through.

use glam::DVec2;

use domecast_light::cavity::{Cavities, Convex};
use domecast_mesh::{Construction, Piece, ProfileEdge, Shape};

/// Chords that stand for an arc in a turned hollow.
const ARC_CHORDS: usize = 16;

/// What is cut out of a part.
pub fn hollows_of(part: &Construction) -> Cavities {
    Cavities::new(part.cut.iter().flat_map(|Piece { shape, part_from_shape, .. }| {
        let own_from_part = part_from_shape.inverse();
        convex_parts(shape).into_iter().map(move |shape| (shape, own_from_part))
    }))
}

fn convex_parts(shape: &Shape) -> Vec<Convex> {
    match shape {
        Shape::Prism { outline_mm, bottom_z_mm, top_z_mm, .. } => {
            // Rounded corners are taken as sharp: no hollow near the lights has them.
            let n = outline_mm.len();
            let side = |(i, &corner): (usize, &DVec2)| {
                let along = outline_mm[(i + 1) % n] - corner;
                // Counter-clockwise: outside is to the right.
                let normal = DVec2::new(along.y, -along.x).normalize_or_zero();
                (normal.to_array(), normal.dot(corner))
            };
            let sides = outline_mm.iter().enumerate().map(side).collect();
            let reach = outline_mm.iter().fold(DVec2::ZERO, |max, corner| max.max(corner.abs()));
            vec![Convex::Faces {
                sides,
                bottom_mm: *bottom_z_mm,
                top_mm: *top_z_mm,
                reach_mm: reach.to_array(),
            }]
        }
        Shape::Turned { profile, .. } => {
            let mut points: Vec<DVec2> = Vec::new();
            for (ends, edge) in profile.points_mm.windows(2).zip(&profile.edges) {
                points.push(ends[0]);
                if let ProfileEdge::Arc { center_z_mm } = edge {
                    let angle = |p: DVec2| (p.y - center_z_mm).atan2(p.x);
                    let radius = (ends[0] - DVec2::new(0.0, *center_z_mm)).length();
                    let (first, last) = (angle(ends[0]), angle(ends[1]));
                    points.extend((1..ARC_CHORDS).map(|k| {
                        let at = first + (last - first) * k as f64 / ARC_CHORDS as f64;
                        DVec2::new(radius * at.cos(), center_z_mm + radius * at.sin())
                    }));
                }
            }
            points.extend(profile.points_mm.last());
            points
                .windows(2)
                .filter(|ends| ends[1].y > ends[0].y)
                .map(|ends| Convex::Frustum {
                    bottom_mm: ends[0].y,
                    top_mm: ends[1].y,
                    radius_mm: ends[0].x,
                    slope: (ends[1].x - ends[0].x) / (ends[1].y - ends[0].y),
                })
                .collect()
        }
    }
}
