//! Exact solids, on truck's topology, for parts that are a plate with upright features.
//!
//! What can be built: one extruded plate; pockets with upright walls that open
//! at its top or bottom; turned holes and pins whose axes are upright. Features
//! may stand on each other's floors but not cross each other's walls. Anything
//! else is left to facets.
//!
//! Walls are swept, turned features revolved, flat faces attached with the
//! loops of all that opens in them. truck's own booleans are not used: they
//! fail on coplanar and tangent faces.

use std::f64::consts::TAU;

use glam::{DAffine3, DVec2, DVec3};
use truck_modeling::{
    BoundedCurve, Curve, Edge, Face, Line, Matrix4, Plane, Point3, Processor, Rad, RevolutedCurve, Shell,
    Surface, Sweep, Transformed, Vector3, Wire, builder,
};

use crate::step::Circle;
use crate::{Construction, Piece, Profile, ProfileEdge, Shape};

/// A flat horizontal face under construction.
struct Level {
    z: f64,
    up: bool,
    outline: Vec<DVec2>,
    loops: Vec<Wire>,
}

impl Construction {
    /// The part with exact faces; `None` if it is not a plate with upright, separate features. What is handed out
    /// is closed, connected and consistently oriented.
    ///
    /// ```
    /// use domecast_mesh::{Construction, Fit, Piece, Shape};
    /// use glam::DVec2;
    /// let plate = Shape::rounded_plate(DVec2::splat(20.0), 2.0, 0.0, 4.0);
    /// let bore = Shape::cylinder(3.0, -1.0, 5.0, Fit::Area);
    /// let part = Construction { added: vec![Piece::new("plate", plate)], cut: vec![Piece::new("bore", bore)] };
    /// let solid = part.exact_solid().expect("a plate with a bore");
    /// // Eight walls, top, bottom, and the bore in thirds.
    /// assert_eq!(solid.face_iter().count(), 8 + 2 + 3);
    /// ```
    pub fn exact_solid(&self) -> Option<truck_modeling::Solid> {
        let mut out = Faces::default();
        let (plate, pins) = self.added.split_first()?;
        let (outline, radius, z0, z1) = upright_prism(plate)?;
        out.walls(&outline, radius, (z0, z1), true)?;

        let turned: Vec<&Piece> =
            self.cut.iter().filter(|p| matches!(p.shape, Shape::Turned { .. })).collect();
        for pocket in self.cut.iter().filter(|p| matches!(p.shape, Shape::Prism { .. })) {
            let (outline, radius, low, high) = upright_prism(pocket)?;
            // It must open at exactly one face of the plate and lie inside it.
            let (from_below, from_above) = (low < z0 && high < z1, high > z1 && low > z0);
            if from_below == from_above || !out.levels.iter().take(2).all(|l| inside(&l.outline, &outline)) {
                return None;
            }
            let span = if from_below { (z0, high) } else { (low, z1) };
            out.walls(&outline, radius, span, false)?;
        }
        let mut done: Vec<DVec2> = Vec::new();
        for piece in &turned {
            let at = upright_axis(piece)?;
            if done.contains(&at) {
                continue;
            }
            done.push(at);
            let same_axis: Option<Vec<&Profile>> = turned
                .iter()
                .filter(|p| upright_axis(p) == Some(at))
                .map(|p| if let Shape::Turned { profile, .. } = &p.shape { Some(profile) } else { None })
                .collect();
            let profile = merged(&same_axis?)?;
            out.turned(at, &profile, false)?;
        }
        for pin in pins {
            let Shape::Turned { profile, .. } = &pin.shape else { return None };
            out.turned(upright_axis(pin)?, profile, true)?;
        }
        for level in std::mem::take(&mut out.levels) {
            out.flat(level.z, level.up, level.loops)?;
        }
        truck_modeling::Solid::try_new(vec![out.shell]).ok()
    }
}

pub(super) fn point(p: DVec3) -> Point3 {
    Point3::new(p.x, p.y, p.z)
}

/// Faces made so far, and the flat ones that still collect loops.
#[derive(Default)]
struct Faces {
    shell: Shell,
    levels: Vec<Level>,
}

impl Faces {
    /// Upright walls of an outline between two heights, and the flat faces at
    /// both: of a plate (`solid`), or of a pocket, whose open end becomes a
    /// hole in the plate's face there.
    fn walls(&mut self, outline: &[DVec2], radius: f64, (low, high): (f64, f64), solid: bool) -> Option<()> {
        let bottom = wire_of_outline(&fillets(outline, radius), radius, low);
        let rise = Vector3::unit_z() * (high - low);
        let mut sides: Shell = bottom.sweep(
            &|p| Point3::new(p.x, p.y, high),
            &|curve| curve.transformed(Matrix4::from_translation(rise)),
            &Surface::clone,
            &|from, to| Curve::Line(Line(*from, *to)),
            &|curve, _| wall_surface(curve, rise),
        );
        // The third edge of a swept face lies at the top, run backward.
        let top: Wire = sides.iter().map(|face| face.boundaries()[0][2].inverse()).collect();
        let outline = outline.to_vec();
        if solid {
            self.levels.push(Level {
                z: low,
                up: false,
                outline: outline.clone(),
                loops: vec![bottom.inverse()],
            });
            self.levels.push(Level { z: high, up: true, outline, loops: vec![top] });
        } else {
            sides.face_iter_mut().for_each(|face| {
                face.invert();
            });
            // The open end of a pocket is the level of the plate at that height.
            if let Some(level) = self.levels.iter_mut().find(|l| l.z == low && !l.up) {
                // Seen from below, a hole runs clockwise: counter-clockwise from above.
                level.loops.push(bottom);
                self.levels.push(Level { z: high, up: false, outline, loops: vec![top.inverse()] });
            } else {
                let level = self.levels.iter_mut().find(|l| l.z == high && l.up)?;
                level.loops.push(top.inverse());
                self.levels.push(Level { z: low, up: true, outline, loops: vec![bottom] });
            }
        }
        self.shell.append(&mut sides);
        Some(())
    }

    /// Faces of a hole (or a pin), clipped to the material (or to what stands
    /// out of it).
    fn turned(&mut self, at: DVec2, profile: &Profile, pin: bool) -> Option<()> {
        // The flat faces of the plate above and below this place.
        let reach = profile.max_radius_mm();
        let here = |l: &&Level| covers(&l.outline, at, reach);
        let heights = |up: bool| self.levels.iter().filter(here).filter(move |l| l.up == up).map(|l| l.z);
        let floor = heights(false).fold(f64::NEG_INFINITY, f64::max);
        let ceiling = heights(true).fold(f64::INFINITY, f64::min);
        let (first, last) = (profile.points_mm.first()?, profile.points_mm.last()?);
        let clipped = if pin {
            if first.y < floor && last.y > floor && last.y < ceiling {
                clip(profile, f64::NEG_INFINITY, floor)?
            } else if last.y > ceiling && first.y > floor && first.y < ceiling {
                clip(profile, ceiling, f64::INFINITY)?
            } else {
                return None;
            }
        } else {
            clip(profile, floor, ceiling)?
        };
        let (mut sides, low, high) = revolved(at, &clipped)?;
        if pin {
            sides.face_iter_mut().for_each(|face| {
                face.invert();
            });
        }
        self.shell.append(&mut sides);
        let (first, last) = (clipped.points_mm.first()?, clipped.points_mm.last()?);
        for (ring, z, is_low) in [(low, first.y, true), (high, last.y, false)] {
            let Some(ring) = ring else { continue };
            match self.levels.iter_mut().find(|l| l.z == z && covers(&l.outline, at, reach)) {
                // A hole in that face, seen from its outside.
                Some(level) => level.loops.push(if level.up { ring.inverse() } else { ring }),
                // The end of a blind hole faces into the hole, of a pin away.
                None => {
                    let up = is_low != pin;
                    self.flat(z, up, vec![if up { ring } else { ring.inverse() }])?;
                }
            }
        }
        Some(())
    }

    /// A horizontal face; loops run counter-clockwise seen from outside, the outer one first.
    fn flat(&mut self, z: f64, up: bool, loops: Vec<Wire>) -> Option<()> {
        let (x, y) = (Point3::new(1.0, 0.0, z), Point3::new(0.0, 1.0, z));
        let (one, other) = if up { (x, y) } else { (y, x) };
        let plane = Plane::new(Point3::new(0.0, 0.0, z), one, other);
        self.shell.push(Face::try_new(loops, plane.into()).ok()?);
        Some(())
    }
}

/// The closed path of a filleted outline at a height, counter-clockwise seen from above.
fn wire_of_outline(path: &[(DVec2, Option<DVec2>)], radius: f64, z: f64) -> Wire {
    let vertices: Vec<_> = path.iter().map(|(p, _)| builder::vertex(point(p.extend(z)))).collect();
    let next = |i: usize| (i + 1) % path.len();
    let edge = |i: usize| match path[i].1 {
        None => builder::line(&vertices[i], &vertices[next(i)]),
        Some(center) => {
            let outward = (path[i].0 - center + path[next(i)].0 - center).normalize_or_zero();
            let middle = center + outward * radius;
            builder::circle_arc(&vertices[i], &vertices[next(i)], point(middle.extend(z)))
        }
    };
    (0..path.len()).map(edge).collect()
}

/// The upright surface over a piece of an outline, its normal to the right of the piece's direction.
fn wall_surface(curve: &Curve, rise: Vector3) -> Surface {
    let (start, end) = (curve.front(), curve.back());
    let arc = if matches!(curve, Curve::Line(_)) { None } else { Circle::of(curve) };
    match arc {
        None => Plane::new(start, end, start + rise).into(),
        Some(circle) => {
            // Run downward, so that the normal points away from the axis.
            let ruling = Curve::Line(Line(start + rise, start));
            let surface = RevolutedCurve::by_revolution(ruling, circle.center, Vector3::unit_z());
            Surface::RevolutedCurve(Processor::new(surface))
        }
    }
}

/// A profile revolved about an upright axis: its faces, their normals towards the axis, and the rings at its lower
/// and upper end, counter-clockwise seen from above; `None` for an end on the axis.
fn revolved(at: DVec2, profile: &Profile) -> Option<(Shell, Option<Wire>, Option<Wire>)> {
    let place = |p: DVec2| Point3::new(at.x + p.x, at.y, p.y);
    let vertices: Vec<_> = profile.points_mm.iter().map(|p| builder::vertex(place(*p))).collect();
    let edge = |i: usize, edge: &ProfileEdge| match *edge {
        ProfileEdge::Line => builder::line(&vertices[i], &vertices[i + 1]),
        ProfileEdge::Arc { center_z_mm } => {
            let center = DVec2::new(0.0, center_z_mm);
            let (low, high) = (profile.points_mm[i] - center, profile.points_mm[i + 1] - center);
            let middle = center + (low + high).normalize_or(DVec2::X) * low.length();
            builder::circle_arc(&vertices[i], &vertices[i + 1], place(middle))
        }
    };
    let wire: Wire = profile.edges.iter().enumerate().map(|(i, e)| edge(i, e)).collect();
    let on_axis = |p: Option<&DVec2>| p.is_some_and(|p| p.x == 0.0);
    let poles = (on_axis(profile.points_mm.first()), on_axis(profile.points_mm.last()));
    let (axis, turn) = (Vector3::unit_z(), Rad(TAU));
    // truck wants the pole first.
    let is_reversed = poles == (false, true);
    let mut shell = match poles {
        (false, false) => builder::rsweep(&wire, point(at.extend(0.0)), axis, turn),
        (true, _) => builder::cone(&wire, axis, turn),
        (false, true) => builder::cone(&wire.inverse(), axis, turn),
    };
    let count = profile.edges.len();
    let third = |face: usize, edge: usize| -> Option<Wire> {
        shell.iter().skip(face).step_by(count).map(|f| f.boundaries().first()?.get(edge).cloned()).collect()
    };
    let (low, high) = match poles {
        (false, false) => {
            (Some(third(0, 3)?.iter().map(Edge::inverse).collect()), Some(third(count - 1, 1)?))
        }
        (true, false) => (None, Some(third(count - 1, 1)?)),
        (false, true) => (Some(third(count - 1, 1)?), None),
        (true, true) => (None, None),
    };
    if is_reversed {
        shell.face_iter_mut().for_each(|face| {
            face.invert();
        });
    }
    Some((shell, low, high))
}

/// Outline, corner radius and heights of an upright, unturned prism.
fn upright_prism(piece: &Piece) -> Option<(Vec<DVec2>, f64, f64, f64)> {
    let Shape::Prism { outline_mm, corner_radius_mm, bottom_z_mm, top_z_mm } = &piece.shape else {
        return None;
    };
    let shift = translation(&piece.part_from_shape)?;
    let outline = outline_mm.iter().map(|p| *p + shift).collect();
    Some((outline, *corner_radius_mm, *bottom_z_mm, *top_z_mm))
}

fn upright_axis(piece: &Piece) -> Option<DVec2> {
    translation(&piece.part_from_shape)
}

fn translation(map: &DAffine3) -> Option<DVec2> {
    let plain = map.matrix3 == glam::DMat3::IDENTITY && map.translation.z == 0.0;
    plain.then(|| map.translation.truncate())
}

/// Whether a convex polygon covers a disc, with a margin.
fn covers(outline: &[DVec2], center: DVec2, radius: f64) -> bool {
    (0..outline.len()).all(|i| {
        let (a, b) = (outline[i], outline[(i + 1) % outline.len()]);
        (b - a).normalize_or_zero().perp_dot(center - a) > radius
    })
}

fn inside(outer: &[DVec2], inner: &[DVec2]) -> bool {
    inner.iter().all(|&p| covers(outer, p, 0.0))
}

/// Corners of a polygon with its fillets: each point with the centre of the arc
/// that leads to the next point, if it is one.
fn fillets(outline: &[DVec2], radius: f64) -> Vec<(DVec2, Option<DVec2>)> {
    if radius == 0.0 {
        return outline.iter().map(|&p| (p, None)).collect();
    }
    let n = outline.len();
    let mut out = Vec::with_capacity(2 * n);
    for i in 0..n {
        let (before, here, after) = (outline[(i + n - 1) % n], outline[i], outline[(i + 1) % n]);
        let (u, v) = ((here - before).normalize_or_zero(), (after - here).normalize_or_zero());
        let turn: f64 = u.angle_to(v);
        let along = radius * (0.5 * turn).tan();
        let start = here - u * along;
        out.push((start, Some(start + u.perp() * radius)));
        out.push((here + v * along, None));
    }
    out
}

/// One profile for several on one axis: at each height the widest counts. Only
/// cylinders can be merged.
fn merged(profiles: &[&Profile]) -> Option<Profile> {
    if let [only] = profiles {
        return Some((*only).clone());
    }
    let spans: Option<Vec<(f64, f64, f64)>> = profiles
        .iter()
        .map(|p| match p.points_mm.as_slice() {
            [a, b] if a.x == b.x => Some((a.x, a.y, b.y)),
            _ => None,
        })
        .collect();
    let spans = spans?;
    let mut heights: Vec<f64> = spans.iter().flat_map(|s| [s.1, s.2]).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup();
    let mut points: Vec<(f64, f64)> = Vec::new();
    for pair in heights.windows(2) {
        let middle = 0.5 * (pair[0] + pair[1]);
        let radius = spans.iter().filter(|s| s.1 < middle && middle < s.2).map(|s| s.0).fold(0.0, f64::max);
        if radius == 0.0 {
            return None;
        }
        match points.last_mut() {
            Some(last) if last.0 == radius => last.1 = pair[1],
            _ => points.extend([(radius, pair[0]), (radius, pair[1])]),
        }
    }
    Some(Profile::lines(&points))
}

/// The part of a profile between two heights. Arcs must lie wholly inside.
fn clip(profile: &Profile, low: f64, high: f64) -> Option<Profile> {
    let mut out = Profile { points_mm: Vec::new(), edges: Vec::new() };
    for (ends, edge) in profile.points_mm.windows(2).zip(&profile.edges) {
        let (a, b) = (ends[0], ends[1]);
        if b.y <= low && !(a.y == b.y && a.y == low)
            || a.y >= high
            || a.y == b.y && (a.y <= low || a.y >= high)
        {
            continue;
        }
        let cut = |z: f64| {
            let t = (z - a.y) / (b.y - a.y);
            DVec2::new(if a.x == b.x { a.x } else { a.x + t * (b.x - a.x) }, z)
        };
        let crosses = a.y < low || b.y > high;
        if crosses && matches!(edge, ProfileEdge::Arc { .. }) {
            return None;
        }
        let from = if a.y < low { cut(low) } else { a };
        let to = if b.y > high { cut(high) } else { b };
        if out.points_mm.is_empty() {
            out.points_mm.push(from);
        }
        out.points_mm.push(to);
        out.edges.push(*edge);
    }
    (out.points_mm.len() >= 2).then_some(out)
}
