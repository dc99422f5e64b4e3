//! Light straight from the emitters: through the sheet into the silicone, to a point.
//!
//! Between a place of the emitter and a point there is one refracted way ([`domecast_optics::LightTube`]). What a
//! small area `dA` of the emitter of intensity `I` gives a surface there is
//! `I dA/A * transmitted * sr_per_mm2 * (arriving . normal)`, so the sum over the emitter is a vector, the
//! *vector irradiance*, whose product with the normal is the irradiance of any surface that faces the light.

use glam::{DAffine3, DVec2, DVec3, DVec4, Vec3Swizzles, Vec4Swizzles};

use super::cavity::Cavities;
use super::fresnel;
use super::lobe::Lobe;
use super::quadrature::GaussRule;
use domecast_optics::SensorOptics;

/// Places across the emitter, each way. The emitter is small against its distance from the dome: with four,
/// the rule's error is below 1e-5 (tested against 64).
pub const PLACES: usize = 4;

/// Lines that a shadow's edge is cut along, for each place across.
const LINES: usize = 2;

/// Looks along the whole of the emitter at which pieces of a diagonal in sight are distinguished from pieces in the shadow.
const LOOKS: f64 = 5.0;

/// Halvings between two looks of which one is in sight: the edge is then known to 1/2560 of the emitter.
const HALVINGS: u32 = 9;

/// A square that emits, everywhere alike.
#[derive(Debug, Clone, PartialEq)]
pub struct Emitter {
    /// Its pose: origin at the centre, z out of the face; sensor frame, mm.
    pub platform_from_emitter: DAffine3,
    /// Half of its side, mm.
    pub half_side_mm: f64,
    /// Flux of the bare light, mW.
    pub flux_mw: f64,
    /// Intensity by direction, for a flux of one.
    pub lobe: Lobe,
}

/// Where the light of emitters goes.
#[derive(Debug, Clone, Copy)]
pub struct DirectLight<'a> {
    /// Layers and dome, for the light's colour.
    pub optics: &'a SensorOptics,
    /// What the platform leaves open; `None` where nothing stands in the way.
    pub cavities: Option<&'a Cavities>,
    /// Share of the light that gets through the platform where it stands in the way.
    pub through_platform: f64,
    /// Half sides of the sheet, whose edge ends the way in, mm.
    pub sheet_half_mm: glam::DVec2,
    /// Whether interfaces take their share (Fresnel).
    pub fresnel: bool,
}

/// The rule across the emitter, made once: Gauss's places each way, what interpolates between them, and the lines that shadows are
/// cut along.
///
/// The lines are diagonals that go on at the other side of the square, `u = begin + v` modulo 1, evenly spaced: what they see is
/// periodic in `begin`, with kinks, for which no rule is better. A shadow's edge that lies along a side of the emitter cuts each of
/// them in its own part, and so it moves through the light without a step; lines along a side would be taken one by one.
#[derive(Debug, Clone)]
pub struct EmitterRule {
    rule: GaussRule,
    /// Barycentric weights of the polynomial through the places.
    weights: Vec<f64>,
    /// Every other one first: where those see all of the light or nothing of it, the others are not asked.
    diagonals: Vec<Diagonal>,
}

/// A diagonal between two sides of the emitter's unit square: `u = v + shift` for `v` in a range.
#[derive(Debug, Clone)]
struct Diagonal {
    shift: f64,
    weight: f64,
    /// The range of `v`.
    ends: [f64; 2],
    /// Where along it is looked first, its ends among them, evenly spaced.
    looks: Vec<f64>,
    /// Along it the polynomial through the places is one in `v`, of Chebyshev's series over the range: for each of its terms, how
    /// much of it each place gives.
    series: Vec<Vec<f64>>,
}

impl Default for EmitterRule {
    fn default() -> Self {
        Self::with_places(PLACES)
    }
}

impl EmitterRule {
    /// A rule with another number of places each way, to see how much the number matters.
    pub fn with_places(count: usize) -> Self {
        let rule = GaussRule::new(count);
        let nodes = rule.nodes();
        let product = |i: usize| -> f64 {
            let others = nodes.iter().enumerate().filter(|(j, _)| *j != i);
            // Four times the distance keeps the product near 1 for any number of places.
            others.map(|(_, (v, _))| 4.0 * (nodes[i].0 - v)).product()
        };
        let weights = (0..nodes.len()).map(|i| 1.0 / product(i)).collect();
        let mut made = Self { rule, weights, diagonals: Vec::new() };
        let lines = LINES * made.nodes().len();
        let pair = |line: usize| {
            let (begin, weight) = ((line as f64 + 0.5) / lines as f64, 1.0 / lines as f64);
            let turn = 1.0 - begin;
            [(begin, 0.0, turn, weight), (begin - 1.0, turn, 1.0, weight)]
        };
        let diagonal = |(shift, from, to, weight): (f64, f64, f64, f64)| {
            let count = ((to - from) * LOOKS).ceil().max(1.0);
            let look = |k: usize| {
                if k as f64 == count { to } else { from + (to - from) * k as f64 / count }
            };
            let looks = (0..=count as usize).map(look).collect();
            Diagonal { shift, weight, ends: [from, to], looks, series: made.series(shift, [from, to]) }
        };
        let order = (0..lines).step_by(2).chain((1..lines).step_by(2));
        made.diagonals = order.flat_map(pair).map(diagonal).collect();
        made
    }

    fn nodes(&self) -> &[(f64, f64)] {
        self.rule.nodes()
    }

    /// Chebyshev's series of the places' weights along `u = v + shift`, from their values at as many places as it has terms
    /// (L. N. Trefethen, Approximation Theory and Approximation Practice, ch. 3 and 4).
    fn series(&self, shift: f64, [from, to]: [f64; 2]) -> Vec<Vec<f64>> {
        let terms = 2 * self.nodes().len() - 1;
        let turn = |p: usize| (p as f64 + 0.5) * std::f64::consts::PI / terms as f64;
        let mut lines = [Vec::new(), Vec::new()];
        let mut series = vec![vec![0.0; self.nodes().len().pow(2)]; terms];
        for p in 0..terms {
            let v = 0.5 * (from + to) + 0.5 * (to - from) * turn(p).cos();
            self.weigh(v + shift, &mut lines[0]);
            self.weigh(v, &mut lines[1]);
            let [across, along] = &lines;
            for (k, term) in series.iter_mut().enumerate() {
                let part = if k == 0 { 1.0 } else { 2.0 * (k as f64 * turn(p)).cos() } / terms as f64;
                let weights = across.iter().flat_map(|across| along.iter().map(move |along| across * along));
                term.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += part * weight);
            }
        }
        series
    }

    /// Weights of the values at the places in the polynomial through them, at `v` (J.-P. Berrut and L. N. Trefethen, Barycentric
    /// Lagrange interpolation, SIAM Review 46, 2004).
    fn weigh(&self, v: f64, weights: &mut Vec<f64>) {
        weights.clear();
        if let Some(own) = self.nodes().iter().position(|(place, _)| *place == v) {
            weights.extend((0..self.weights.len()).map(|i| f64::from(u8::from(i == own))));
            return;
        }
        weights
            .extend(self.weights.iter().zip(self.nodes()).map(|(weight, (place, _))| weight / (v - place)));
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= sum);
    }
}

/// What one place of the emitter gives.
#[derive(Debug, Clone, Copy, Default)]
struct Share {
    /// Where its ray meets the sheet's underside and, to a point of the dome, its top, x and y of each, mm; the origin for a
    /// point of the top itself.
    crossings_mm: DVec4,
    flux: DVec3,
}

impl Share {
    /// Itself and a part of another.
    fn and(&self, other: &Self, part: f64) -> Self {
        Self {
            crossings_mm: self.crossings_mm + other.crossings_mm * part,
            flux: self.flux + other.flux * part,
        }
    }
}

impl Diagonal {
    /// The terms of what the places' shares are along it.
    fn terms<'a>(&'a self, all: &'a [Share]) -> impl Iterator<Item = Share> + 'a {
        let sum = move |term: &Vec<f64>| {
            term.iter().zip(all).fold(Share::default(), |sum, (part, share)| sum.and(share, *part))
        };
        self.series.iter().map(sum)
    }

    /// What the terms sum to at a place (C. W. Clenshaw's recurrence).
    fn at(&self, terms: &[Share], v: f64) -> Share {
        let [from, to] = self.ends;
        let x = (2.0 * v - from - to) / (to - from);
        let Some((first, others)) = terms.split_first() else { return Share::default() };
        let (mut next, mut after) = (Share::default(), Share::default());
        for term in others.iter().rev() {
            (next, after) = (term.and(&next, 2.0 * x).and(&after, -1.0), next);
        }
        first.and(&next, x).and(&after, -1.0)
    }
}

/// The flux of the whole square.
fn whole(rule: &EmitterRule, all: &[Share]) -> DVec3 {
    let nodes = rule.nodes();
    let weights = nodes.iter().flat_map(|(_, across)| nodes.iter().map(move |(_, along)| across * along));
    all.iter().zip(weights).map(|(share, weight)| share.flux * weight).sum()
}

/// The flux of what is in sight of the square, of its places' shares; `is_free` is given a place of it and its ray's crossings.
fn in_sight(rule: &EmitterRule, all: &[Share], is_free: &mut dyn FnMut(f64, f64, DVec4) -> bool) -> DVec3 {
    let (mut terms, mut looked) = (Vec::new(), Vec::new());
    let mut sum = DVec3::ZERO;
    let (mut any_free, mut any_blocked) = (false, false);
    for (number, diagonal) in rule.diagonals.iter().enumerate() {
        if number == rule.diagonals.len() / 2 && !(any_free && any_blocked) {
            break;
        }
        terms.clear();
        terms.extend(diagonal.terms(all));
        let mut free = |v: f64| is_free(v + diagonal.shift, v, diagonal.at(&terms, v).crossings_mm);
        looked.clear();
        looked.extend(diagonal.looks.iter().map(|v| (*v, free(*v))));
        any_free |= looked.iter().any(|(_, free)| *free);
        any_blocked |= looked.iter().any(|(_, free)| !*free);
        pieces_in_sight(&looked, free, |low, high| {
            for (v, up) in rule.rule.over(low, high) {
                sum += diagonal.at(&terms, v).flux * (diagonal.weight * up);
            }
        });
    }
    if any_blocked { sum } else { whole(rule, all) }
}

impl DirectLight<'_> {
    /// Vector irradiance at a point of the dome or the sheet's top, mW/mm^2, sensor frame. Its product with the
    /// unit normal *away from* the light is the irradiance.
    ///
    /// The rays from the rule's places are solved. Between them, flux and way are smooth, and the polynomial through the places
    /// interpolates both: so the platform's shadow is cut without another solve.
    pub fn vector_irradiance(&self, emitter: &Emitter, point_mm: DVec3, rule: &EmitterRule) -> DVec3 {
        let side = 2.0 * emitter.half_side_mm;
        let pose = &emitter.platform_from_emitter;
        let place =
            |u: f64, v: f64| pose.transform_point3(DVec3::new((u - 0.5) * side, (v - 0.5) * side, 0.0));
        let indices = self.indices(point_mm.z);
        let mut all = Vec::with_capacity(rule.nodes().len() * rule.nodes().len());
        let (mut near, mut low, mut high) = (0.0, DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &(u, _) in rule.nodes() {
            for &(v, _) in rule.nodes() {
                let source = place(u, v);
                let Some((share, underside_mm)) = self.share(emitter, source, point_mm, &indices, &mut near)
                else {
                    return DVec3::ZERO;
                };
                all.push(share);
                for end in [source, underside_mm] {
                    (low, high) = (low.min(end), high.max(end));
                }
            }
        }
        let open = if self.cavities.is_some() { self.through_platform } else { 1.0 };
        let mut sum = DVec3::ZERO;
        // The sheet's underside lies over all emitters.
        let underside_z_mm = high.z;
        let mut gather = |part: f64, is_free: &mut dyn FnMut(DVec3, DVec3) -> bool| {
            let mut reaches = |u: f64, v: f64, at_mm: DVec4| {
                self.enters(at_mm.xy())
                    && self.is_in_foot(at_mm.zw())
                    && is_free(place(u, v), at_mm.xy().extend(underside_z_mm))
            };
            sum += part * in_sight(rule, &all, &mut reaches);
        };
        if open > 0.0 {
            gather(open, &mut |_, _| true);
        }
        if let Some(cavities) = self.cavities.filter(|_| open < 1.0) {
            // The emitter's corners lie a little beyond the rule's places.
            let beyond = DVec3::splat(emitter.half_side_mm);
            let mut hollows = cavities.near(low - beyond, high + beyond);
            gather(1.0 - open, &mut |source, end| hollows.is_free(source, end));
        }
        sum * emitter.flux_mw
    }

    /// The media from the air to the point.
    fn indices(&self, z_mm: f64) -> Vec<f64> {
        let layers = self.optics.layers();
        let channel = self.optics.channel();
        let count = if z_mm > 0.0 { layers.len() } else { layers.len().saturating_sub(1).max(1) };
        layers[..count].iter().map(|layer| layer.index_for(channel)).collect()
    }

    /// Whether a place of the plane of the sheet's underside is the sheet's.
    fn enters(&self, underside_mm: DVec2) -> bool {
        underside_mm.abs().cmple(self.sheet_half_mm).all()
    }

    /// Whether a place of the plane of the sheet's top lies under the dome: only there light goes on into the silicone.
    fn is_in_foot(&self, top_mm: DVec2) -> bool {
        top_mm.length() <= self.optics.dome().rim_radius_mm()
    }

    /// What a place of the emitter sends to a point, and where its ray meets the sheet's underside; `None` where no ray leads
    /// there. `near` is a neighbour's tangent.
    fn share(
        &self,
        emitter: &Emitter,
        source: DVec3,
        point_mm: DVec3,
        indices: &[f64],
        near: &mut f64,
    ) -> Option<(Share, DVec3)> {
        let tube = self.optics.light_tube(source, point_mm, *near).ok()?;
        *near = tube.tangent;
        let per_sr = emitter.lobe.per_sr(tube.leaving.dot(emitter.platform_from_emitter.matrix3.z_axis));
        let passed = if self.fresnel { fresnel::through(indices, tube.snell_invariant) } else { 1.0 };
        let flux = tube.arriving * (per_sr * passed * tube.sr_per_mm2);
        let top_mm = if point_mm.z > 0.0 {
            point_mm - tube.arriving * (point_mm.z / tube.arriving.z)
        } else {
            DVec3::ZERO
        };
        let crossings_mm = tube.underside_mm.xy().extend(top_mm.x).extend(top_mm.y);
        Some((Share { crossings_mm, flux }, tube.underside_mm))
    }
}

/// The pieces of a range that are in sight, from looks in order at places of it, their ends found by halving.
fn pieces_in_sight(
    looks: &[(f64, bool)],
    mut free: impl FnMut(f64) -> bool,
    mut found: impl FnMut(f64, f64),
) {
    let mut begun = looks.first().filter(|(_, free)| *free).map(|(from, _)| *from);
    for two in looks.windows(2) {
        let (before, here) = (two[0], two[1]);
        if here.1 != before.1 {
            let (mut low, mut high) = (before.0, here.0);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if free(middle) == before.1 { low = middle } else { high = middle }
            }
            let edge = 0.5 * (low + high);
            match begun.take() {
                Some(start) => found(start, edge),
                None => begun = Some(edge),
            }
        }
    }
    if let (Some(start), Some((to, _))) = (begun, looks.last()) {
        found(start, *to);
    }
}
