//! The part of a square emitter that is visible from a point, and what that part sends there.
//!
//! What a place of the emitter sends, and where its ray goes, change smoothly over the emitter: both are interpolated between few
//! places. The edge of what is visible is found where it crosses the lines of a grid, and is straight between two of them: the
//! marching squares of contour lines (W. E. Lorensen and H. E. Cline, Marching cubes, SIGGRAPH 1987, in the plane). A straight edge
//! is so cut exactly, whichever way it lies.

use glam::{DVec2, DVec3, DVec4};

use super::quadrature::GaussRule;

/// Places across the emitter, each way. With three the error is below 1e-5 of the light's largest irradiance where the whole emitter
/// is visible, and below 1e-2 at the worst place of a shadow's edge (the shipped designs, against 24).
pub const PLACES: usize = 3;

/// Cells of the grid for each place across.
const CELLS: usize = 2;

/// Halvings of a cell's side that the edge crosses: with three places it is then known to 1/3000 of the emitter.
const HALVINGS: u32 = 8;

/// The rule across the emitter, made once: Gauss's places each way, and what interpolates between them.
#[derive(Debug, Clone)]
pub struct EmitterRule {
    rule: GaussRule,
    /// Barycentric weights of the polynomial through the places.
    barycentric: Vec<f64>,
    /// What each place weighs on each line of the grid, and midway between two lines; the same each way.
    lines: Vec<Vec<f64>>,
    middles: Vec<Vec<f64>>,
}

/// What one place of the emitter gives.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Share {
    /// Where its ray meets the sheet's underside and, to a point of the dome, its top, x and y of each, mm; the origin for a
    /// point of the top itself.
    pub crossings_mm: DVec4,
    pub flux: DVec3,
}

/// A corner of the grid's cells: a place of the unit square, and the way from there to the point.
#[derive(Debug, Clone, Copy)]
struct Corner {
    at: DVec2,
    from_mm: DVec3,
    crossings_mm: DVec4,
    is_free: bool,
}

impl Default for EmitterRule {
    fn default() -> Self {
        Self::with_places(PLACES)
    }
}

impl EmitterRule {
    /// A rule with another number of places each way, and as many times the cells, to see how much the number matters.
    pub fn with_places(count: usize) -> Self {
        let rule = GaussRule::new(count);
        let nodes = rule.nodes();
        let product = |i: usize| -> f64 {
            let others = nodes.iter().enumerate().filter(|(j, _)| *j != i);
            // Four times the distance keeps the product near 1 for any number of places.
            others.map(|(_, (v, _))| 4.0 * (nodes[i].0 - v)).product()
        };
        let barycentric = (0..nodes.len()).map(|i| 1.0 / product(i)).collect();
        let cells = CELLS * nodes.len();
        let mut made = Self { rule, barycentric, lines: Vec::new(), middles: Vec::new() };
        let at = |line: f64| {
            let mut weights = Vec::new();
            made.weigh(line / cells as f64, &mut weights);
            weights
        };
        let lines = (0..=cells).map(|line| at(line as f64)).collect();
        let middles = (0..cells).map(|line| at(line as f64 + 0.5)).collect();
        (made.lines, made.middles) = (lines, middles);
        made
    }

    /// Gauss's places on [0, 1], each with its weight.
    pub(super) fn places(&self) -> &[(f64, f64)] {
        self.rule.nodes()
    }

    /// Weights of the values at the places in the polynomial through them, at `v` (J.-P. Berrut and L. N. Trefethen, Barycentric
    /// Lagrange interpolation, SIAM Review 46, 2004).
    fn weigh(&self, v: f64, weights: &mut Vec<f64>) {
        weights.clear();
        if let Some(own) = self.places().iter().position(|(place, _)| *place == v) {
            weights.extend((0..self.barycentric.len()).map(|i| f64::from(u8::from(i == own))));
            return;
        }
        weights.extend(
            self.barycentric.iter().zip(self.places()).map(|(weight, (place, _))| weight / (v - place)),
        );
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= sum);
    }

    /// The flux of the whole square, of its places' shares.
    fn whole(&self, all: &[Share]) -> DVec3 {
        let places = self.places();
        let weights =
            places.iter().flat_map(|(_, across)| places.iter().map(move |(_, along)| across * along));
        all.iter().zip(weights).map(|(share, weight)| share.flux * weight).sum()
    }

    /// The flux of what is visible of the square, of its places' shares, along the second of its sides first. `from_mm` gives a
    /// place of the square, which `is_free` is asked of together with its ray's crossings.
    pub(super) fn visible_flux(
        &self,
        all: &[Share],
        from_mm: impl Fn(f64, f64) -> DVec3,
        mut is_free: impl FnMut(DVec3, DVec4) -> bool,
    ) -> DVec3 {
        let side = self.lines.len();
        let cell = 1.0 / (side - 1) as f64;
        let on_lines = between(all, &self.lines);
        let mut corners = Vec::with_capacity(side * side);
        for (line, row) in on_lines.chunks_exact(self.places().len()).enumerate() {
            corners.extend(self.lines.iter().enumerate().map(|(along, weights)| {
                let at = DVec2::new(line as f64, along as f64) * cell;
                let from_mm = from_mm(at.x, at.y);
                let crossings_mm = weighed(row, weights, |share| share.crossings_mm);
                Corner { at, from_mm, crossings_mm, is_free: is_free(from_mm, crossings_mm) }
            }));
        }
        if corners.iter().all(|corner| corner.is_free) {
            return self.whole(all);
        }
        if !corners.iter().any(|corner| corner.is_free) {
            return DVec3::ZERO;
        }
        // From each corner to the next line, and to the next along its line.
        let edges = |k: usize| {
            let mut to = |other: usize| edge(&corners[k], corners.get(other)?, &mut is_free);
            [to(k + side), if (k + 1).is_multiple_of(side) { None } else { to(k + 1) }]
        };
        let edges: Vec<[Option<DVec2>; 2]> = (0..corners.len()).map(edges).collect();
        let middles = between(all, &self.middles);
        let (mut outline, mut weights) = (Vec::with_capacity(8), [Vec::new(), Vec::new()]);
        let mut sum = DVec3::ZERO;
        for (line, row) in middles.chunks_exact(self.places().len()).enumerate() {
            for (along, middle) in self.middles.iter().enumerate() {
                let k = line * side + along;
                let around = [k, k + side, k + side + 1, k + 1].map(|k| corners[k]);
                if around.iter().all(|corner| corner.is_free) {
                    sum += weighed(row, middle, |share| share.flux) * (cell * cell);
                    continue;
                }
                let sides = [edges[k][0], edges[k + side][1], edges[k + 1][0], edges[k][1]];
                outline.clear();
                for (corner, edge) in around.iter().zip(sides) {
                    outline.extend(corner.is_free.then_some(corner.at).into_iter().chain(edge));
                }
                if let Some((area, centroid)) = area_and_centroid(&outline) {
                    sum += self.flux_at(centroid, all, &mut weights) * area;
                }
            }
        }
        sum
    }

    /// The flux of a place of the square.
    fn flux_at(&self, at: DVec2, all: &[Share], [line, along]: &mut [Vec<f64>; 2]) -> DVec3 {
        self.weigh(at.x, line);
        self.weigh(at.y, along);
        let rows = all.chunks_exact(along.len()).zip(&*line);
        rows.map(|(row, part)| weighed(row, along, |share| share.flux) * *part).sum()
    }
}

/// The places' shares between them, each list of weights taken along the square's first side: for each, as many as there are places
/// along the second.
fn between(all: &[Share], lines: &[Vec<f64>]) -> Vec<Share> {
    let at = |weights: &[f64], along: usize| {
        let column = all.iter().skip(along).step_by(weights.len()).zip(weights);
        column.fold(Share::default(), |sum, (share, weight)| Share {
            crossings_mm: sum.crossings_mm + share.crossings_mm * *weight,
            flux: sum.flux + share.flux * *weight,
        })
    };
    lines.iter().flat_map(|weights| (0..weights.len()).map(move |along| at(weights, along))).collect()
}

/// A part of a row's shares, weighed.
fn weighed<T: std::iter::Sum + std::ops::Mul<f64, Output = T>>(
    row: &[Share],
    weights: &[f64],
    part: impl Fn(&Share) -> T,
) -> T {
    row.iter().zip(weights).map(|(share, weight)| part(share) * *weight).sum()
}

/// Where the edge lies between two corners of which one alone is visible; the way between them is straight enough.
fn edge(a: &Corner, b: &Corner, is_free: &mut impl FnMut(DVec3, DVec4) -> bool) -> Option<DVec2> {
    let (lit, dark) = match (a.is_free, b.is_free) {
        (true, false) => (a, b),
        (false, true) => (b, a),
        _ => return None,
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        let from_mm = lit.from_mm.lerp(dark.from_mm, middle);
        let crossings_mm = lit.crossings_mm.lerp(dark.crossings_mm, middle);
        if is_free(from_mm, crossings_mm) { low = middle } else { high = middle }
    }
    Some(lit.at.lerp(dark.at, 0.5 * (low + high)))
}

/// Area and centroid of a polygon; `None` where there is none. Two opposite corners of a cell, both visible, are taken as joined.
fn area_and_centroid(outline: &[DVec2]) -> Option<(f64, DVec2)> {
    let (first, others) = outline.split_first()?;
    let (mut area, mut moment) = (0.0, DVec2::ZERO);
    for two in others.windows(2) {
        let part = 0.5 * (two[0] - first).perp_dot(two[1] - first);
        area += part;
        moment += (first + two[0] + two[1]) * (part / 3.0);
    }
    (area > 0.0).then(|| (area, moment / area))
}
