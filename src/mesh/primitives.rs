//! Triangulation of exact shapes, in `f64`.

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use glam::{DVec2, DVec3};

use super::{Chord, Fit, MeshError, Profile, ProfileEdge, Shape, TriMesh};

impl Shape {
    /// The shape's surface within `chord` of the exact one, wound outwards.
    ///
    /// # Errors
    /// [`MeshError::Dimension`], naming `name`, for a shape that is none.
    pub fn triangulate(&self, name: &str, chord: Chord) -> Result<TriMesh, MeshError> {
        match self {
            Self::Turned { profile, fit } => turned(name, profile, *fit, chord),
            Self::Prism { outline_mm, corner_radius_mm, bottom_z_mm, top_z_mm } => {
                let outline = rounded_outline(name, outline_mm, *corner_radius_mm, chord)?;
                prism(name, &outline, *bottom_z_mm, *top_z_mm)
            }
        }
    }
}

fn bad(shape: &str, dimension: &'static str, value: f64, allowed: &'static str) -> MeshError {
    MeshError::Dimension { shape: shape.to_owned(), dimension, value, allowed }
}

/// Corners of the unit `n`-gon, `n` a multiple of 4, computed on one octant
/// and mirrored: the extreme points are exact and opposite corners agree to
/// the last bit.
fn unit_circle(n: u32) -> Vec<DVec2> {
    let quarter = n / 4;
    let first_quarter: Vec<DVec2> = (0..quarter)
        .map(|j| {
            let from_start = |k: u32| (TAU * f64::from(k) / f64::from(n)).sin_cos();
            if j == 0 {
                DVec2::X
            } else if 2 * j == quarter {
                DVec2::splat(FRAC_1_SQRT_2)
            } else if 2 * j < quarter {
                let (s, c) = from_start(j);
                DVec2::new(c, s)
            } else {
                let (s, c) = from_start(quarter - j);
                DVec2::new(s, c)
            }
        })
        .collect();
    let turned = |f: fn(DVec2) -> DVec2| first_quarter.iter().copied().map(f);
    turned(|p| p)
        .chain(turned(|p| DVec2::new(-p.y, p.x)))
        .chain(turned(|p| -p))
        .chain(turned(|p| DVec2::new(p.y, -p.x)))
        .collect()
}

/// A profile whose arcs have become chords.
fn chorded_profile(name: &str, profile: &Profile, fit: Fit, chord: Chord) -> Result<Vec<DVec2>, MeshError> {
    let Some(&first) = profile.points_mm.first() else {
        return Err(bad(name, "number of profile points", 0.0, "at least 2"));
    };
    let mut out = vec![first];
    for (ends, edge) in profile.points_mm.windows(2).zip(&profile.edges) {
        let (low, high) = (ends[0], ends[1]);
        if let ProfileEdge::Arc { center_z_mm } = *edge {
            let center = DVec2::new(0.0, center_z_mm);
            let radius = (low - center).length();
            if ((high - center).length() - radius).abs() > 1e-9 * radius.max(1.0) {
                return Err(bad(
                    name,
                    "distance of an arc's end from its centre",
                    (high - center).length(),
                    "the arc's radius",
                ));
            }
            let angle = |p: DVec2| (p.y - center_z_mm).atan2(p.x);
            let (start, sweep) = (angle(low), angle(high) - angle(low));
            let n = chord.arc_segments(radius, sweep, fit)?;
            let step = sweep / f64::from(n);
            let corner = fit.corner_radius_mm(radius, 0.5 * step.abs());
            let at = |turns: f64| center + corner * DVec2::from_angle(start + step * turns);
            if fit == Fit::Outside {
                // Corners half a step in, so that the first and last side
                // touch the arc in its end points.
                out.extend((0..n).map(|i| at(f64::from(i) + 0.5)));
            } else {
                out.extend((1..n).map(|i| at(f64::from(i))));
            }
        }
        out.push(high);
    }
    // The tangent polygon of an arc that ends at a pole or starts at the
    // equator may come within rounding of its neighbour's height: make flat
    // rings exactly flat.
    for i in 1..out.len() {
        if (out[i].y - out[i - 1].y).abs() < 1e-9 * out[i].abs().max_element().max(1.0) {
            out[i].y = out[i - 1].y;
        }
    }
    out.dedup();
    Ok(out)
}

fn turned(name: &str, profile: &Profile, fit: Fit, chord: Chord) -> Result<TriMesh, MeshError> {
    if profile.points_mm.len() < 2 || profile.edges.len() + 1 != profile.points_mm.len() {
        return Err(bad(name, "number of profile points", profile.points_mm.len() as f64, "at least 2"));
    }
    let last = profile.points_mm.len() - 1;
    for (i, p) in profile.points_mm.iter().enumerate() {
        let at_end = i == 0 || i == last;
        if !p.is_finite() || p.x < 0.0 || (p.x == 0.0 && !at_end) {
            return Err(bad(name, "radius", p.x, "finite and positive"));
        }
        if i > 0 && p.y < profile.points_mm[i - 1].y {
            return Err(bad(name, "height", p.y - profile.points_mm[i - 1].y, "not negative"));
        }
    }
    if profile.points_mm[last].y <= profile.points_mm[0].y {
        return Err(bad(name, "height", profile.points_mm[last].y - profile.points_mm[0].y, "more than 0"));
    }
    let curved_twice = profile.edges.iter().any(|e| matches!(e, ProfileEdge::Arc { .. }));
    let chord = if curved_twice { chord.halved() } else { chord };
    let outline = chorded_profile(name, profile, fit, chord)?;
    let n = chord.circle_segments(profile.max_radius_mm(), fit)?;
    let circle = unit_circle(n);
    let scale = fit.corner_radius_mm(1.0, PI / f64::from(n));

    let mut mesh = TriMesh::default();
    let rings: Vec<(u32, bool)> = outline
        .iter()
        .map(|p| {
            let first = mesh.vertices_mm.len() as u32;
            if p.x == 0.0 {
                mesh.vertices_mm.push(DVec3::new(0.0, 0.0, p.y));
            } else {
                let ring = circle.iter().map(|&c| (c * (p.x * scale)).extend(p.y));
                mesh.vertices_mm.extend(ring);
            }
            (first, p.x == 0.0)
        })
        .collect();
    for pair in rings.windows(2) {
        let ((low, low_is_point), (high, high_is_point)) = (pair[0], pair[1]);
        for i in 0..n {
            let j = (i + 1) % n;
            if low_is_point {
                mesh.triangles.push([low, high + j, high + i]);
            } else if high_is_point {
                mesh.triangles.push([low + i, low + j, high]);
            } else {
                mesh.triangles.push([low + i, low + j, high + j]);
                mesh.triangles.push([low + i, high + j, high + i]);
            }
        }
    }
    if let Some(&(first, false)) = rings.first() {
        cap(&mut mesh, first, n, false);
    }
    if let Some(&(first, false)) = rings.last() {
        cap(&mut mesh, first, n, true);
    }
    Ok(mesh)
}

/// Closes a convex ring of `n` vertices from `first` on by a strip that
/// zigzags across it: better shaped than a fan, and no extra vertex.
fn cap(mesh: &mut TriMesh, first: u32, n: u32, upwards: bool) {
    let (mut left, mut right) = (0, n - 1);
    let mut from_left = true;
    while right - left >= 2 {
        let third = if from_left { left + 1 } else { right - 1 };
        let [a, b, c] = [left, third, right].map(|i| first + i);
        mesh.triangles.push(if upwards { [a, b, c] } else { [a, c, b] });
        if from_left {
            left = third
        } else {
            right = third
        }
        from_left = !from_left;
    }
}

/// Replaces the corners of a convex polygon by chords of their fillets, corners
/// on the arc.
fn rounded_outline(
    name: &str,
    outline_mm: &[DVec2],
    corner_radius_mm: f64,
    chord: Chord,
) -> Result<Vec<DVec2>, MeshError> {
    let n = outline_mm.len();
    if n < 3 {
        return Err(bad(name, "number of corners", n as f64, "at least 3"));
    }
    if !corner_radius_mm.is_finite() || corner_radius_mm < 0.0 {
        return Err(bad(name, "corner radius", corner_radius_mm, "0 or more"));
    }
    let mut out = Vec::with_capacity(n);
    for i in 0..n {
        let (before, here, after) = (outline_mm[(i + n - 1) % n], outline_mm[i], outline_mm[(i + 1) % n]);
        let (arriving, leaving) = (here - before, after - here);
        let turn: f64 = arriving.angle_to(leaving);
        if !here.is_finite() || turn.is_nan() || turn <= 0.0 || arriving.length() == 0.0 {
            return Err(bad(name, "turn at a corner", turn, "to the left (convex, counter-clockwise)"));
        }
        if corner_radius_mm == 0.0 {
            out.push(here);
            continue;
        }
        let along = corner_radius_mm * (0.5 * turn).tan();
        if 2.0 * along > arriving.length().min(leaving.length()) {
            return Err(bad(name, "corner radius", corner_radius_mm, "small enough for its sides"));
        }
        let arc_start = here - arriving.normalize() * along;
        let inward = arriving.normalize().perp();
        let center = arc_start + inward * corner_radius_mm;
        let segments = chord.arc_segments(corner_radius_mm, turn, Fit::Inside)?;
        let step = turn / f64::from(segments);
        let radial = arc_start - center;
        out.push(arc_start);
        out.extend((1..segments).map(|k| center + DVec2::from_angle(step * f64::from(k)).rotate(radial)));
        out.push(here + leaving.normalize() * along);
    }
    Ok(out)
}

fn prism(name: &str, outline: &[DVec2], bottom_z_mm: f64, top_z_mm: f64) -> Result<TriMesh, MeshError> {
    let height = top_z_mm - bottom_z_mm;
    if !height.is_finite() || height <= 0.0 {
        return Err(bad(name, "height", height, "more than 0"));
    }
    let n = outline.len() as u32;
    let mut mesh = TriMesh::default();
    for z in [bottom_z_mm, top_z_mm] {
        mesh.vertices_mm.extend(outline.iter().map(|p| p.extend(z)));
    }
    for i in 0..n {
        let j = (i + 1) % n;
        mesh.triangles.push([i, j, n + j]);
        mesh.triangles.push([i, n + j, n + i]);
    }
    cap(&mut mesh, 0, n, false);
    cap(&mut mesh, n, n, true);
    Ok(mesh)
}
