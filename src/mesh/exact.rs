//! Exact faces for parts that are a plate with upright features.
//!
//! What can be built: one extruded plate; pockets with upright walls that open
//! at its top or bottom; turned holes and pins whose axes are upright. Features
//! may stand on each other's floors but not cross each other's walls. Anything
//! else is left to facets.

use glam::{DAffine3, DVec2, DVec3};

use super::brep::{Brep, Curve, Surface, Turn};
use super::{Construction, Piece, Profile, ProfileEdge, Shape};

/// A flat horizontal face under construction.
struct Level {
    z: f64,
    up: bool,
    outline: Vec<DVec2>,
    loops: Vec<Vec<Turn>>,
}

impl Brep {
    /// The construction with exact faces; `None` if it is not a plate with
    /// upright, separate features.
    pub fn exact(construction: &Construction) -> Option<Self> {
        let mut out = Self::default();
        let (plate, pins) = construction.added.split_first()?;
        let (outline, radius, z0, z1) = upright_prism(plate)?;
        let mut levels = Vec::new();
        out.walls(&mut levels, &outline, radius, (z0, z1), true)?;

        let turned: Vec<&Piece> =
            construction.cut.iter().filter(|p| matches!(p.shape, Shape::Turned { .. })).collect();
        for pocket in construction.cut.iter().filter(|p| matches!(p.shape, Shape::Prism { .. })) {
            let (outline, radius, low, high) = upright_prism(pocket)?;
            // It must open at exactly one face of the plate and lie inside it.
            let (from_below, from_above) = (low < z0 && high < z1, high > z1 && low > z0);
            if from_below == from_above || !levels.iter().take(2).all(|l| inside(&l.outline, &outline)) {
                return None;
            }
            let span = if from_below { (z0, high) } else { (low, z1) };
            out.walls(&mut levels, &outline, radius, span, false)?;
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
            out.turned(&mut levels, at, &profile, false)?;
        }
        for pin in pins {
            let Shape::Turned { profile, .. } = &pin.shape else { return None };
            out.turned(&mut levels, upright_axis(pin)?, profile, true)?;
        }
        for level in levels {
            let normal = if level.up { DVec3::Z } else { DVec3::NEG_Z };
            out.face(Surface::Plane { origin: DVec3::Z * level.z, normal }, true, level.loops);
        }
        Some(out)
    }

    /// Upright walls of an outline between two heights, and the flat faces at
    /// both: of a plate (`solid`), or of a pocket, whose open end becomes a
    /// hole in the plate's face there.
    fn walls(
        &mut self,
        levels: &mut Vec<Level>,
        outline: &[DVec2],
        radius: f64,
        (low, high): (f64, f64),
        solid: bool,
    ) -> Option<()> {
        let path = fillets(outline, radius);
        let n = path.len();
        let mut rings = Vec::new();
        for z in [low, high] {
            let vertices: Vec<usize> = path.iter().map(|(p, _)| self.vertex(p.extend(z))).collect();
            let edges: Vec<usize> = (0..n)
                .map(|i| {
                    let curve = match path[i].1 {
                        None => Curve::Line,
                        Some(center) => Curve::Circle { center: center.extend(z), axis: DVec3::Z, radius },
                    };
                    self.edge(vertices[i], vertices[(i + 1) % n], curve)
                })
                .collect();
            rings.push((vertices, edges));
        }
        let posts: Vec<usize> =
            (0..n).map(|i| self.edge(rings[0].0[i], rings[1].0[i], Curve::Line)).collect();
        for i in 0..n {
            let j = (i + 1) % n;
            let mut path_round =
                vec![(rings[0].1[i], true), (posts[j], true), (rings[1].1[i], false), (posts[i], false)];
            let surface = match path[i].1 {
                None => {
                    let along = (path[j].0 - path[i].0).normalize_or_zero();
                    let out = -along.perp().extend(0.0);
                    let normal = if solid { out } else { -out };
                    Surface::Plane { origin: path[i].0.extend(low), normal }
                }
                Some(center) => Surface::Cylinder { origin: center.extend(low), axis: DVec3::Z, radius },
            };
            if !solid {
                reverse(&mut path_round);
            }
            let outward = solid || path[i].1.is_none();
            self.face(surface, outward, vec![path_round]);
        }
        let ring = |k: usize| rings[k].1.iter().map(|&e| (e, true)).collect::<Vec<Turn>>();
        let reversed = |mut turns: Vec<Turn>| {
            reverse(&mut turns);
            turns
        };
        if solid {
            levels.push(Level {
                z: low,
                up: false,
                outline: outline.to_vec(),
                loops: vec![reversed(ring(0))],
            });
            levels.push(Level { z: high, up: true, outline: outline.to_vec(), loops: vec![ring(1)] });
            return Some(());
        }
        // A pocket: its open end is the level of the plate at that height.
        let below = levels.iter_mut().find(|l| l.z == low && !l.up);
        if let Some(level) = below {
            // Seen from below, a hole runs clockwise: counter-clockwise from above.
            level.loops.push(ring(0));
            levels.push(Level {
                z: high,
                up: false,
                outline: outline.to_vec(),
                loops: vec![reversed(ring(1))],
            });
        } else {
            let level = levels.iter_mut().find(|l| l.z == high && l.up)?;
            level.loops.push(reversed(ring(1)));
            levels.push(Level { z: low, up: true, outline: outline.to_vec(), loops: vec![ring(0)] });
        }
        Some(())
    }

    /// Faces of a hole (or a pin), clipped to the material (or to what stands
    /// out of it).
    fn turned(&mut self, levels: &mut [Level], at: DVec2, profile: &Profile, pin: bool) -> Option<()> {
        // The flat faces of the plate above and below this place.
        let reach = profile.max_radius_mm();
        let here = |l: &Level| covers(&l.outline, at, reach);
        let floor = levels.iter().filter(|l| !l.up && here(l)).map(|l| l.z).fold(f64::NEG_INFINITY, f64::max);
        let ceiling = levels.iter().filter(|l| l.up && here(l)).map(|l| l.z).fold(f64::INFINITY, f64::min);
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
        let points = &clipped.points_mm;
        let rings: Vec<Ring> = points.iter().map(|p| self.ring(at, p.x, p.y)).collect();
        for ((ends, pair), edge) in points.windows(2).zip(rings.windows(2)).zip(&clipped.edges) {
            self.band(at, (ends[0], ends[1]), *edge, (&pair[0], &pair[1]), pin);
        }
        for (ring, p, is_low) in
            [(rings.first()?, points.first()?, true), (rings.last()?, points.last()?, false)]
        {
            let Some(circle) = &ring.circle else { continue };
            let forward: Vec<Turn> = circle.iter().map(|&e| (e, true)).collect();
            let mut backward = forward.clone();
            reverse(&mut backward);
            let opening = levels.iter_mut().find(|l| l.z == p.y && covers(&l.outline, at, reach));
            match opening {
                // A hole in that face, seen from its outside.
                Some(level) => level.loops.push(if level.up { backward } else { forward }),
                // The end of a blind hole faces into the hole, of a pin away.
                None => {
                    let up = is_low != pin;
                    let normal = if up { DVec3::Z } else { DVec3::NEG_Z };
                    let turns = if up { forward } else { backward };
                    self.face(Surface::Plane { origin: at.extend(p.y), normal }, true, vec![turns]);
                }
            }
        }
        Some(())
    }

    fn ring(&mut self, at: DVec2, radius: f64, z: f64) -> Ring {
        if radius == 0.0 {
            let pole = self.vertex(at.extend(z));
            return Ring { ends: [pole, pole], circle: None };
        }
        let ends = [1.0, -1.0].map(|s| self.vertex((at + DVec2::X * (s * radius)).extend(z)));
        let curve = Curve::Circle { center: at.extend(z), axis: DVec3::Z, radius };
        let circle = [self.edge(ends[0], ends[1], curve), self.edge(ends[1], ends[0], curve)];
        Ring { ends, circle: Some(circle) }
    }

    /// The two half faces between neighbouring rings.
    fn band(
        &mut self,
        at: DVec2,
        (low, high): (DVec2, DVec2),
        edge: ProfileEdge,
        (a, b): (&Ring, &Ring),
        pin: bool,
    ) {
        let surface = match edge {
            ProfileEdge::Arc { center_z_mm } => {
                let center = at.extend(center_z_mm);
                Surface::Sphere { center, radius: (low - DVec2::new(0.0, center_z_mm)).length() }
            }
            ProfileEdge::Line if low.y == high.y => {
                // A step: outside is up where the upper ring is narrower (of a pin).
                let up = (high.x < low.x) == pin;
                let normal = if up { DVec3::Z } else { DVec3::NEG_Z };
                Surface::Plane { origin: at.extend(low.y), normal }
            }
            ProfileEdge::Line if low.x == high.x => {
                Surface::Cylinder { origin: at.extend(low.y), axis: DVec3::Z, radius: low.x }
            }
            ProfileEdge::Line => {
                let grows = high.x > low.x;
                let axis = if grows { DVec3::Z } else { DVec3::NEG_Z };
                let half_angle = ((high.x - low.x).abs() / (high.y - low.y)).atan();
                let wide = if grows { low } else { high };
                Surface::Cone { origin: at.extend(wide.y), axis, radius: wide.x, half_angle }
            }
        };
        let flat = matches!(surface, Surface::Plane { .. });
        let meridian = |out: &mut Self, side: usize| {
            let curve = match edge {
                ProfileEdge::Line => Curve::Line,
                ProfileEdge::Arc { center_z_mm } => Curve::Circle {
                    center: at.extend(center_z_mm),
                    // From the lower to the upper end, on the +x or -x side.
                    axis: if side == 0 { DVec3::NEG_Y } else { DVec3::Y },
                    radius: (low - DVec2::new(0.0, center_z_mm)).length(),
                },
            };
            out.edge(a.ends[side], b.ends[side], curve)
        };
        let sides = [meridian(self, 0), meridian(self, 1)];
        for half in 0..2 {
            let (start, end) = (sides[half], sides[1 - half]);
            let mut turns = Vec::with_capacity(4);
            turns.extend(a.circle.map(|c| (c[half], true)));
            turns.push((end, true));
            turns.extend(b.circle.map(|c| (c[half], false)));
            turns.push((start, false));
            if !pin {
                reverse(&mut turns);
            }
            self.face(surface, pin || flat, vec![turns]);
        }
    }
}

struct Ring {
    /// Vertices on the +x and the -x side.
    ends: [usize; 2],
    /// Half circles from +x over +y to -x, and back; `None` for a pole.
    circle: Option<[usize; 2]>,
}

/// Runs a loop the other way.
fn reverse(turns: &mut [Turn]) {
    turns.reverse();
    turns.iter_mut().for_each(|t| t.1 = !t.1);
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

/// Whether a convex polygon covers a disc, with room to spare.
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
