//! One table of the displaced membrane: a spline over a chart of a cap of the dome.

use glam::{DVec3, Vec2, Vec3A, Vec4};

use super::face::Face;
use crate::contact::between::Between;
use domecast_light::splines::{cubic_slopes, cubics};
use domecast_optics::DomeShape;

/// Fewest and most nodes along a side.
const NODES: [usize; 2] = [12, 160];

/// Widest chart, rad: about the other side of the sphere there is none.
const MAX_ANGLE_RAD: f64 = 3.0;

/// So many nodes below the rim the table still goes on; deeper no ray looks.
const BELOW_STEPS: f64 = 8.0;

/// Towards its edge a chart becomes the one around it, over so many mm, and is it over the last nodes, on which the spline
/// leans at the edge.
const EDGE_MM: f64 = 1.0;
const EDGE_STEPS: f64 = 2.5;

/// The membrane at a place of a chart.
pub(super) struct Moved {
    pub displacement_mm: Vec3A,
    /// Tangents of the moved membrane: its derivatives by the chart's coordinates.
    pub along_x: Vec3A,
    pub along_y: Vec3A,
}

/// What a look-up asks of a chart, as short numbers: the directions of its middle, its x and its y, and lengths in mm.
/// Rounding leaves some nanometres.
#[derive(Debug, Clone, Copy)]
struct Rough {
    middle: Vec3A,
    side: Vec3A,
    up: Vec3A,
    radius_mm: f32,
    per_radius: f32,
    half_mm: f32,
    per_step: f32,
    /// The first cell that lacks nodes.
    last: f32,
}

/// One table.
#[derive(Debug, Clone)]
pub(super) struct Chart {
    middle: DVec3,
    side: DVec3,
    up: DVec3,
    face: Face,
    radius_mm: f64,
    /// Half the chart's width, mm.
    half_mm: f64,
    nodes: usize,
    per_step: f64,
    rough: Rough,
    /// The spline's coefficients, mm; the fourth number is nothing.
    moved: Vec<Vec4>,
    /// The largest slope of the displacement along a side of a cell.
    steepest: f32,
}

impl Chart {
    /// The empty chart of a cap.
    pub fn new(dome: DomeShape, middle: DVec3, angle: f64, step_mm: f64) -> Self {
        let (radius_mm, angle) = (dome.radius_mm(), angle.min(MAX_ANGLE_RAD));
        let side = middle.any_orthonormal_vector();
        let up = middle.cross(side);
        let reach_mm = 2.0 * radius_mm * (0.5 * angle).sin();
        let nodes = ((2.0 * reach_mm / step_mm).ceil() as usize).clamp(NODES[0], NODES[1]);
        // Two nodes beyond the edge on each side, for the cubics.
        let half_mm = reach_mm * (nodes as f64 + 4.0) / nodes as f64;
        let per_step = (nodes as f64 - 1.0) / (2.0 * half_mm);
        let rough = Rough {
            middle: middle.as_vec3a(),
            side: side.as_vec3a(),
            up: up.as_vec3a(),
            radius_mm: radius_mm as f32,
            per_radius: (1.0 / radius_mm) as f32,
            half_mm: half_mm as f32,
            per_step: per_step as f32,
            last: nodes as f32 - 2.0,
        };
        Self {
            middle,
            side,
            up,
            face: Face::new(dome),
            radius_mm,
            half_mm,
            nodes,
            per_step,
            rough,
            moved: Vec::new(),
            steepest: 0.0,
        }
    }

    /// The chart with its displacements. Below the rim, where there is no dome, they go on as they came: what the rim has
    /// twice, less what the dome has as far above it. So the spline has no crease there; nor has it one at the chart's edge,
    /// towards which it becomes that of the chart `around`.
    pub fn filled(&self, between: &Between, around: Option<&Self>) -> Self {
        let count = self.nodes * self.nodes;
        let place = |i: usize| i as f64 / self.per_step - self.half_mm;
        let dome = self.face.dome;
        let (end_rad, below_rad) = (dome.meridian_end_rad(), BELOW_STEPS / (self.per_step * self.radius_mm));
        let mut at_mm: Vec<DVec3> = Vec::with_capacity(count + count / 4);
        let mut below = Vec::new();
        let round = |i: usize| self.round(place(i % self.nodes), place(i / self.nodes));
        at_mm.extend((0..count).map(|i| self.face.point_of(round(i))));
        for i in 0..count {
            let Some(at) = at_mm.get_mut(i).filter(|at| at.z < 0.0) else { continue };
            let round_mm = round(i);
            let over_rad = round_mm.truncate().length().atan2(round_mm.z) - end_rad;
            if over_rad < below_rad.min(end_rad) {
                let azimuth_rad = round_mm.y.atan2(round_mm.x);
                *at = dome.point_mm(end_rad - over_rad, azimuth_rad);
                below.push((i, at_mm.len()));
                at_mm.push(dome.point_mm(end_rad, azimuth_rad));
            } else {
                below.push((i, usize::MAX));
            }
        }
        let found = between.displacements_mm(&at_mm);
        let mut moved: Vec<Vec4> = found.iter().take(count).map(|u| u.as_vec3().extend(0.0)).collect();
        for (i, rim) in below {
            let rim = found.get(rim).map(|u| u.as_vec3().extend(0.0));
            if let Some(moved) = moved.get_mut(i) {
                *moved = rim.map_or(Vec4::ZERO, |rim| rim * 2.0 - *moved);
            }
        }
        if let Some(around) = around {
            for (i, (moved, at)) in moved.iter_mut().zip(&at_mm).enumerate() {
                let out_mm = place(i % self.nodes).abs().max(place(i / self.nodes).abs());
                let part = 1.0 - (self.half_mm - out_mm - EDGE_STEPS / self.per_step) / EDGE_MM;
                let part = part.clamp(0.0, 1.0) as f32;
                if part > 0.0
                    && at.z >= 0.0
                    && let Some(theirs) = around.at(around.place(at.as_vec3a()))
                {
                    let theirs = theirs.displacement_mm.extend(0.0);
                    *moved = moved.lerp(theirs, part * part * (3.0 - 2.0 * part));
                }
            }
        }
        for i in 0..self.nodes {
            to_coefficients(&mut moved, self.nodes, (i * self.nodes, 1));
        }
        for i in 0..self.nodes {
            to_coefficients(&mut moved, self.nodes, (i, self.nodes));
        }
        let steepest = steepest(&moved, self.nodes) * self.per_step as f32;
        Self { moved, steepest, ..*self }
    }

    /// The chart a part of the way to another one of the same layout.
    pub fn towards(&self, to: &Self, part: f32) -> Self {
        let moved = self.moved.iter().zip(&to.moved).map(|(a, b)| a.lerp(*b, part)).collect();
        Self { moved, steepest: self.steepest.max(to.steepest), ..*self }
    }

    /// Nodes.
    pub fn node_count(&self) -> u64 {
        self.moved.len() as u64
    }

    /// Steepest slope of the displacement.
    pub fn steepest(&self) -> f32 {
        self.steepest
    }

    /// The place of the sphere at a place of the chart, about its centre.
    fn round(&self, x: f64, y: f64) -> DVec3 {
        let s = ((x * x + y * y) / (self.radius_mm * self.radius_mm)).min(4.0);
        let k = (1.0 - 0.25 * s).max(0.0).sqrt();
        self.middle * (self.radius_mm * (1.0 - 0.5 * s)) + (self.side * x + self.up * y) * k
    }

    /// The point of the undeformed dome at a place, as short numbers.
    #[inline]
    pub fn point_near(&self, at: Vec2) -> Vec3A {
        self.face.point_near(self.round_near(at))
    }

    #[inline]
    fn round_near(&self, at: Vec2) -> Vec3A {
        let Rough { middle, side, up, radius_mm, per_radius, .. } = self.rough;
        let s = (at.length_squared() * (per_radius * per_radius)).min(4.0);
        let k = (1.0 - 0.25 * s).max(0.0).sqrt();
        middle * (radius_mm * (1.0 - 0.5 * s)) + (side * at.x + up * at.y) * k
    }

    /// Coordinates of a point of the undeformed dome, mm.
    #[inline]
    pub fn place(&self, rest_mm: Vec3A) -> Vec2 {
        let Rough { middle, side, up, per_radius, .. } = self.rough;
        let rest_mm = self.face.round(rest_mm);
        let along = rest_mm.dot(middle) * per_radius;
        let stretch = (2.0 / (1.0 + along).max(1e-6)).sqrt();
        Vec2::new(rest_mm.dot(side), rest_mm.dot(up)) * stretch
    }

    /// Tangents of the undeformed dome at a place: its derivatives by the chart's coordinates.
    #[inline]
    pub fn tangents(&self, place: Vec2) -> [Vec3A; 2] {
        let Rough { middle, side, up, per_radius, .. } = self.rough;
        let (x, y) = (place.x, place.y);
        let quarter = 0.25 * per_radius * per_radius;
        let k = (1.0 - place.length_squared() * quarter).max(1e-6).sqrt();
        let bend = quarter / k;
        let tangent_x = side * (k - x * x * bend) - up * (x * y * bend) - middle * (x * per_radius);
        let tangent_y = up * (k - y * y * bend) - side * (x * y * bend) - middle * (y * per_radius);
        let round_mm = self.round_near(place);
        [tangent_x, tangent_y].map(|t| self.face.tangent(round_mm, t))
    }

    /// The membrane at a place; `None` outside the chart.
    #[inline]
    pub fn at(&self, place: Vec2) -> Option<Moved> {
        let Rough { half_mm, per_step, last, .. } = self.rough;
        let (gx, gy) = ((place.x + half_mm) * per_step, (place.y + half_mm) * per_step);
        if !(gx >= 1.0 && gy >= 1.0 && gx < last && gy < last) {
            return None;
        }
        // Numbers of one size with signs are what machines turn into each other at once.
        let (i, j) = (gx as i32, gy as i32);
        let part = Vec2::new(gx - i as f32, gy - j as f32);
        let (wx, wy) = cubics(part);
        let (dx, dy) = (cubic_slopes(part.x), cubic_slopes(part.y));
        let (i, j) = (i as usize, j as usize);
        let start = (j - 1) * self.nodes + i - 1;
        let corner = self.moved.get(start..start + 3 * self.nodes + 4)?;
        let (mut u, mut by_x, mut by_y) = (Vec4::ZERO, Vec4::ZERO, Vec4::ZERO);
        for row in 0..4 {
            let nodes = &corner[row * self.nodes..row * self.nodes + 4];
            let across = (nodes[0] * wx[0] + nodes[1] * wx[1]) + (nodes[2] * wx[2] + nodes[3] * wx[3]);
            let slope = (nodes[0] * dx[0] + nodes[1] * dx[1]) + (nodes[2] * dx[2] + nodes[3] * dx[3]);
            u += across * wy[row];
            by_x += slope * wy[row];
            by_y += across * dy[row];
        }
        // Tangents of the chart, then of the moved surface.
        let [tangent_x, tangent_y] = self.tangents(place);
        Some(Moved {
            displacement_mm: Vec3A::from_vec4(u),
            along_x: tangent_x + Vec3A::from_vec4(by_x) * per_step,
            along_y: tangent_y + Vec3A::from_vec4(by_y) * per_step,
        })
    }
}

/// The largest difference of neighbours in a square table.
fn steepest(table: &[Vec4], nodes: usize) -> f32 {
    let across = table.chunks_exact(nodes.max(1)).flat_map(|row| row.windows(2).map(|two| two[1] - two[0]));
    let down = table.iter().zip(table.iter().skip(nodes)).map(|(a, b)| *b - *a);
    across.chain(down).map(|way| way.length_squared()).fold(0.0, f32::max).sqrt()
}

/// Turns a row or column of values (its first place, and the way to the next) into a cubic spline's coefficients: each
/// value less a sixth of the second difference there, which is right for cubics and needs no more than the neighbours.
/// At the ends, where only what is next to the chart's edge looks, the second difference is the neighbour's.
fn to_coefficients(values: &mut [Vec4], count: usize, (start, stride): (usize, usize)) {
    let at = |values: &[Vec4], i: usize| values.get(start + i * stride).copied().unwrap_or(Vec4::ZERO);
    if count < 3 {
        return;
    }
    let second = |a: Vec4, b: Vec4, c: Vec4| (a - b * 2.0 + c) / 6.0;
    let (mut before, mut here) = (at(values, 0), at(values, 1));
    let mut bend = second(before, here, at(values, 2));
    let set = |values: &mut [Vec4], i: usize, value: Vec4| {
        values.get_mut(start + i * stride).into_iter().for_each(|place| *place = value);
    };
    set(values, 0, before - bend);
    for i in 1..count - 1 {
        let after = at(values, i + 1);
        bend = second(before, here, after);
        set(values, i, here - bend);
        (before, here) = (here, after);
    }
    set(values, count - 1, here - bend);
}
