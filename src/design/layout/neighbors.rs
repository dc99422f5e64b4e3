//! Neighbours of dots: the Delaunay triangulation in the image, without the edges that only close the hull.
//!
//! # Example
//! ```
//! use domecast_design::glam::DVec2;
//! use domecast_design::layout::neighbors::neighbors;
//!
//! // a square without its diagonals
//! let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(DVec2::from);
//! assert_eq!(neighbors(&corners, 1.2)[0], [1, 3]);
//! ```

use glam::DVec2;
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

/// A point that remembers its place in the list, since the triangulation may merge equal points.
struct Site {
    place: Point2<f64>,
    index: u32,
}

impl HasPosition for Site {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.place
    }
}

/// The edges of the Delaunay triangulation, each once as (lower index, higher index), in ascending order.
/// A point that equals an earlier one, or has a coordinate that cannot be triangulated, has no edge.
pub fn delaunay_edges(points: &[DVec2]) -> Vec<[u32; 2]> {
    let mut sites = Vec::with_capacity(points.len());
    for (index, point) in (0u32..).zip(points) {
        // Spade refuses coordinates below 1e-142 or so; such a distance is none.
        let tidy = |x: f64| if x.abs() < 1e-100 { 0.0 } else { x };
        let place = Point2::new(tidy(point.x), tidy(point.y));
        if spade::validate_vertex(&Site { place, index }).is_ok() {
            sites.push(Site { place, index });
        }
    }
    let Ok(triangulation) = DelaunayTriangulation::<Site>::bulk_load_stable(sites) else {
        return Vec::new();
    };
    let mut edges: Vec<[u32; 2]> = triangulation
        .undirected_edges()
        .map(|edge| edge.vertices().map(|vertex| vertex.data().index))
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges
}

/// For each point, its neighbours in ascending order: the Delaunay edges no longer than `longest` times the
/// shorter of the two ends' distances to their nearest points.
///
/// With 1.2 a square lattice keeps its four neighbours and loses the diagonals, a hexagonal one keeps six;
/// with 1.5 uneven patterns keep what surrounds a dot and lose what spans gaps.
pub fn neighbors(points: &[DVec2], longest: f64) -> Vec<Vec<u32>> {
    let edges = delaunay_edges(points);
    let length = |[a, b]: [u32; 2]| points[a as usize].distance(points[b as usize]);
    let mut nearest = vec![f64::INFINITY; points.len()];
    for edge in &edges {
        for end in edge {
            let nearest = &mut nearest[*end as usize];
            *nearest = nearest.min(length(*edge));
        }
    }
    let mut around = vec![Vec::new(); points.len()];
    for [a, b] in edges {
        let limit = longest * nearest[a as usize].min(nearest[b as usize]);
        if length([a, b]) <= limit {
            around[a as usize].push(b);
            around[b as usize].push(a);
        }
    }
    for list in &mut around {
        list.sort_unstable();
    }
    around
}
