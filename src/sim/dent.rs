//! The deformed membrane as a smooth table: displacement and normal of any point, in some tens of nanoseconds.
//!
//! The chart is Lambert's equal-area map about the middle of the touched region: `p = R (1 - s/2) e + k (x t1 + y t2)`
//! with `s = (x^2 + y^2) / R^2`, `k = sqrt(1 - s/4)`; it is smooth over the whole dome. Between the nodes the
//! displacement is Catmull and Rom's cubic in each direction, whose derivative is continuous: the normals have no
//! steps.

use glam::DVec3;

use super::touch::Between;

/// Fewest and most nodes along a side.
const NODES: [usize; 2] = [12, 160];

/// Displacements of less than this bend nothing that a picture shows, mm.
const STILL_MM: f64 = 1e-4;

/// A table of the displaced membrane.
#[derive(Debug, Clone)]
pub struct Dent {
    middle: DVec3,
    side: DVec3,
    up: DVec3,
    radius_mm: f64,
    /// Half the chart's width, mm.
    half_mm: f64,
    nodes: usize,
    per_step: f64,
    moved: Vec<DVec3>,
}

/// A point of the deformed membrane.
#[derive(Debug, Clone, Copy)]
pub struct Dented {
    /// Its displacement, mm.
    pub displacement_mm: DVec3,
    /// Outward unit normal of the deformed membrane there.
    pub normal: DVec3,
}

impl Dent {
    /// The table of a touched dome, with nodes no further apart than `step_mm` where their number allows; `None`
    /// where nothing moves. The second value is the number of nodes.
    pub fn new(between: &Between, radius_mm: f64, step_mm: f64) -> Option<(Self, u64)> {
        let extents = between.extents();
        let middle = extents.iter().map(|e| e.direction).sum::<DVec3>().normalize_or_zero();
        // Each extent, seen from the common middle.
        let angle_of = |e: &crate::mechanics::contact::Extent| {
            e.angle_rad + middle.dot(e.direction.normalize_or(middle)).clamp(-1.0, 1.0).acos()
        };
        let angle = extents.iter().map(angle_of).fold(0.0, f64::max);
        if middle == DVec3::ZERO || angle.is_nan() || angle <= 0.0 {
            return None;
        }
        // Where the rest of the dome moves as well, the chart reaches the farthest point of the rim.
        let whole = middle.z.clamp(-1.0, 1.0).acos() + std::f64::consts::FRAC_PI_2;
        let far = extents.iter().any(|e| e.beyond_mm > STILL_MM);
        let angle = if far { whole } else { angle.min(whole) };
        let side = middle.any_orthonormal_vector();
        let up = middle.cross(side);
        let reach_mm = 2.0 * radius_mm * (0.5 * angle).sin();
        let nodes = ((2.0 * reach_mm / step_mm).ceil() as usize).clamp(NODES[0], NODES[1]);
        // Two nodes beyond the edge on each side, for the cubics.
        let half_mm = reach_mm * (nodes as f64 + 4.0) / nodes as f64;
        let per_step = (nodes as f64 - 1.0) / (2.0 * half_mm);
        let mut dent = Self { middle, side, up, radius_mm, half_mm, nodes, per_step, moved: Vec::new() };
        let mut at_mm = Vec::with_capacity(nodes * nodes);
        for row in 0..nodes {
            for column in 0..nodes {
                let place = |i: usize| i as f64 / per_step - half_mm;
                at_mm.push(dent.point(place(column), place(row)));
            }
        }
        dent.moved = between.displacements_mm(&at_mm);
        Some((dent, (nodes * nodes) as u64))
    }

    /// Directions from the middle of the base to the edge of the table's region, for its image.
    pub fn outline(&self, count: usize) -> impl Iterator<Item = DVec3> + '_ {
        (0..count).map(move |k| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / count as f64).sin_cos();
            self.point(self.half_mm * cos, self.half_mm * sin)
        })
    }

    fn point(&self, x: f64, y: f64) -> DVec3 {
        let s = ((x * x + y * y) / (self.radius_mm * self.radius_mm)).min(4.0);
        let k = (1.0 - 0.25 * s).max(0.0).sqrt();
        self.middle * (self.radius_mm * (1.0 - 0.5 * s)) + (self.side * x + self.up * y) * k
    }

    /// The deformed membrane at a point of the undeformed dome; `None` outside the chart, where it does not move.
    pub fn at(&self, rest_mm: DVec3) -> Option<Dented> {
        let along = rest_mm.dot(self.middle) / self.radius_mm;
        let stretch = (2.0 / (1.0 + along).max(1e-9)).sqrt();
        let (x, y) = (rest_mm.dot(self.side) * stretch, rest_mm.dot(self.up) * stretch);
        let (gx, gy) = ((x + self.half_mm) * self.per_step, (y + self.half_mm) * self.per_step);
        let last = self.nodes as f64 - 2.0;
        if !(gx >= 1.0 && gy >= 1.0 && gx < last && gy < last) {
            return None;
        }
        let (i, j) = (gx as usize, gy as usize);
        let (wx, dx) = cubic(gx - i as f64);
        let (wy, dy) = cubic(gy - j as f64);
        let (mut u, mut by_x, mut by_y) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        for (row, (wy, dy)) in wy.into_iter().zip(dy).enumerate() {
            let start = (j - 1 + row) * self.nodes + i - 1;
            let four = self.moved.get(start..start + 4)?;
            let (mut across, mut slope) = (DVec3::ZERO, DVec3::ZERO);
            for (node, (wx, dx)) in four.iter().zip(wx.into_iter().zip(dx)) {
                across += *node * wx;
                slope += *node * dx;
            }
            u += across * wy;
            by_x += slope * wy;
            by_y += across * dy;
        }
        // Tangents of the chart, then of the moved surface.
        let r2 = self.radius_mm * self.radius_mm;
        let k = (1.0 - (x * x + y * y) / (4.0 * r2)).max(1e-12).sqrt();
        let bend = 1.0 / (4.0 * r2 * k);
        let (side, up) = (self.side, self.up);
        let tangent_x = side * (k - x * x * bend) - up * (x * y * bend) - self.middle * (x / self.radius_mm);
        let tangent_y = up * (k - y * y * bend) - side * (x * y * bend) - self.middle * (y / self.radius_mm);
        let normal = (tangent_x + by_x * self.per_step).cross(tangent_y + by_y * self.per_step);
        let rest_normal = rest_mm / self.radius_mm;
        Some(Dented { displacement_mm: u, normal: normal.try_normalize().unwrap_or(rest_normal) })
    }

    /// Where a ray that meets the undeformed dome at `rest_mm` along the unit direction `inside` meets the deformed
    /// one: the undeformed place of that point, and how it moved. `None` where the membrane does not move.
    ///
    /// The point sought is `p` with `p + u(p)` on the ray: `p` is where the ray, moved back by `u`, meets the
    /// sphere. Repeating that shrinks the error by the slope of `u`, which is below 1 for a membrane that does
    /// not fold.
    pub fn meet(&self, rest_mm: DVec3, inside: DVec3) -> Option<(DVec3, Dented)> {
        let mut place = rest_mm;
        let mut dented = self.at(place)?;
        for _ in 0..MOST_STEPS {
            let base = rest_mm - dented.displacement_mm;
            // |base + s inside| = R; the root near zero.
            let b = base.dot(inside);
            let c = self.radius_mm * self.radius_mm - base.length_squared();
            let root = (b * b + c).max(0.0).sqrt();
            let s = if b > 0.0 { c / (b + root) } else { root - b };
            let next = base + inside * s;
            let step = (next - place).length_squared();
            place = next * (self.radius_mm / next.length().max(1e-12));
            dented = self.at(place)?;
            if step < CLOSE_MM * CLOSE_MM {
                break;
            }
        }
        Some((place, dented))
    }
}

/// Repetitions of [`Dent::meet`]; a slope of 0.5 leaves a thousandth after ten.
const MOST_STEPS: u32 = 10;
/// A step this short ends it, mm: a hundredth of a pixel.
const CLOSE_MM: f64 = 1e-3;

/// Weights of the four nodes around a place between the middle two, and their derivatives.
fn cubic(t: f64) -> ([f64; 4], [f64; 4]) {
    let (t2, t3) = (t * t, t * t * t);
    let weights = [
        0.5 * (2.0 * t2 - t - t3),
        0.5 * (2.0 - 5.0 * t2 + 3.0 * t3),
        0.5 * (t + 4.0 * t2 - 3.0 * t3),
        0.5 * (t3 - t2),
    ];
    let slopes = [
        0.5 * (4.0 * t - 1.0 - 3.0 * t2),
        0.5 * (9.0 * t2 - 10.0 * t),
        0.5 * (1.0 + 8.0 * t - 9.0 * t2),
        0.5 * (3.0 * t2 - 2.0 * t),
    ];
    (weights, slopes)
}
