//! Light straight from the emitters: through the sheet into the silicone, to a point.
//!
//! Between a place of the emitter and a point there is one refracted way ([`domecast_optics::LightTube`]). What a
//! small area `dA` of the emitter of intensity `I` gives a surface there is
//! `I dA/A * transmitted * sr_per_mm2 * (arriving . normal)`, so the sum over the emitter is a vector, the
//! *vector irradiance*, whose product with the normal is the irradiance of any surface that faces the light.

use glam::{DAffine3, DVec2, DVec3, DVec4, Vec3Swizzles, Vec4Swizzles};

use super::cavity::{Cavities, NearHollows};
use super::fresnel;
use super::lobe::Lobe;
use super::quadrature::GaussRule;
use domecast_optics::SensorOptics;

/// Places across the emitter, each way. The emitter is small against its distance from the dome: on thumb24 with three, against 24,
/// the rule's error is below 1e-5 of the light's largest irradiance where nothing stands in the way. Half behind the lip it is 4e-4
/// (root mean square) and at most 0.0013, whether three or four.
pub const PLACES: usize = 3;

/// Looks along the whole of the emitter at which pieces of a diagonal in sight are distinguished from pieces in the shadow.
const LOOKS: f64 = 5.0;

/// Halvings between two looks of which one is in sight: the edge is then known to 1/1280 of the emitter.
const HALVINGS: u32 = 7;

/// Last terms of a series along a diagonal that are left out, parts of the largest: less than what the looks tell of edges.
const TERMS_END: f64 = 1e-5;

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
/// The lines are diagonals that go on at the other side of the square, `u = begin + v` modulo 1, with Gauss's rule over `begin`.
/// A shadow's edge that lies along a side of the emitter cuts each of them in its own part, and so it moves through the light
/// without a step; lines along a side would be taken one by one.
#[derive(Debug, Clone)]
pub struct EmitterRule {
    rule: GaussRule,
    /// Barycentric weights of the polynomial through the places.
    weights: Vec<f64>,
    /// The square's corners, with the weights of the values at all places there.
    corners: [(DVec2, Vec<f64>); 4],
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
        let mut made = Self { rule, weights, corners: Default::default(), diagonals: Vec::new() };
        made.corners = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)]
            .map(|(u, v)| (DVec2::new(u, v), made.weights_at(u, v).collect()));
        let pair = |&(begin, weight): &(f64, f64)| {
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
        made.diagonals = made.nodes().iter().flat_map(pair).map(diagonal).collect();
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
        let mut series = vec![vec![0.0; self.nodes().len().pow(2)]; terms];
        for p in 0..terms {
            let v = 0.5 * (from + to) + 0.5 * (to - from) * turn(p).cos();
            let weights: Vec<f64> = self.weights_at(v + shift, v).collect();
            for (k, term) in series.iter_mut().enumerate() {
                let part = if k == 0 { 1.0 } else { 2.0 * (k as f64 * turn(p)).cos() } / terms as f64;
                term.iter_mut().zip(&weights).for_each(|(sum, weight)| *sum += part * weight);
            }
        }
        series
    }

    /// Weights of the values at all places in the polynomial through them, at a place of the square.
    fn weights_at(&self, u: f64, v: f64) -> impl Iterator<Item = f64> + use<> {
        let along = self.weigh(v);
        self.weigh(u)
            .into_iter()
            .flat_map(move |across| along.clone().into_iter().map(move |along| across * along))
    }

    /// Weights of the values at the places of a line in the polynomial through them, at `v` (J.-P. Berrut and L. N. Trefethen,
    /// Barycentric Lagrange interpolation, SIAM Review 46, 2004).
    fn weigh(&self, v: f64) -> Vec<f64> {
        if let Some(own) = self.nodes().iter().position(|(place, _)| *place == v) {
            return (0..self.weights.len()).map(|i| f64::from(u8::from(i == own))).collect();
        }
        let weights = self.weights.iter().zip(self.nodes()).map(|(weight, (place, _))| weight / (v - place));
        let sum: f64 = weights.clone().sum();
        weights.map(|weight| weight / sum).collect()
    }
}

/// What the places of an emitter give a point.
#[derive(Debug, Default)]
struct Shares {
    /// Where each ray meets the sheet's underside and, to a point of the dome, its top, x and y of each, mm; the origin for a
    /// point of the top itself.
    crossings_mm: Vec<DVec4>,
    /// Vector irradiance without the interfaces' losses, and with them; the fourth numbers mean nothing.
    open: Vec<DVec4>,
    passed: Vec<DVec4>,
}

/// Vector irradiance at a point, in three steps; mW/mm^2, sensor frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Irradiance {
    /// Through the dome's foot and the sheet's underside, with no losses.
    pub open: DVec3,
    /// Less what the interfaces keep (Fresnel).
    pub passed: DVec3,
    /// Of that, what the platform leaves.
    pub left: DVec3,
}

impl Diagonal {
    /// The terms of what the places' values are along it, but for the last ones where they are next to nothing.
    fn terms(&self, values: &[DVec4], terms: &mut Vec<DVec4>) {
        terms.clear();
        terms.extend(self.series.iter().map(|term| weighted(term, values)));
        let size = |term: &DVec4| term.abs().max_element();
        let min = TERMS_END * terms.iter().map(size).fold(0.0, f64::max);
        terms.truncate(terms.iter().rposition(|term| size(term) > min).map_or(1, |last| last + 1));
    }

    /// What the terms sum to at a place (C. W. Clenshaw's recurrence).
    fn at(&self, terms: &[DVec4], v: f64) -> DVec4 {
        let [from, to] = self.ends;
        let x = (2.0 * v - from - to) / (to - from);
        let Some((first, others)) = terms.split_first() else { return DVec4::ZERO };
        let (mut next, mut after) = (DVec4::ZERO, DVec4::ZERO);
        for term in others.iter().rev() {
            (next, after) = (*term + next * (2.0 * x) - after, next);
        }
        *first + next * x - after
    }
}

fn weighted(weights: &[f64], values: &[DVec4]) -> DVec4 {
    weights.iter().zip(values).fold(DVec4::ZERO, |sum, (weight, value)| sum + *value * *weight)
}

/// The flux of the whole square.
fn whole(rule: &EmitterRule, fluxes: &[DVec4]) -> DVec3 {
    let nodes = rule.nodes();
    let weights = nodes.iter().flat_map(|(_, across)| nodes.iter().map(move |(_, along)| across * along));
    fluxes.iter().zip(weights).map(|(flux, weight)| flux.xyz() * weight).sum()
}

/// What lies between the places of an emitter and a point.
struct Sight<'a, P> {
    light: &'a DirectLight<'a>,
    /// Where a place of the unit square is.
    place: P,
    /// Height of the sheet's underside, mm.
    underside_z_mm: f64,
    hollows: Option<NearHollows<'a>>,
}

impl<P: Fn(DVec2) -> DVec3> Sight<'_, P> {
    /// The ends of a ray below the sheet.
    fn ray(&self, place: DVec2, crossings_mm: DVec4) -> (DVec3, DVec3) {
        ((self.place)(place), crossings_mm.xy().extend(self.underside_z_mm))
    }

    /// The flux of what is in sight of the square.
    fn flux(&mut self, rule: &EmitterRule, shares: &Shares) -> DVec3 {
        let crossings = shares.crossings_mm.as_slice();
        // Sheet, foot and hollows are convex: what lets the rays of the four corners pass together lets all others pass.
        let corners = rule.corners.each_ref().map(|(place, weights)| (*place, weighted(weights, crossings)));
        let enter = corners.iter().all(|(_, at_mm)| self.light.enters(*at_mm));
        let rays = corners.map(|(place, at_mm)| self.ray(place, at_mm));
        let together = self.hollows.as_mut().map_or(1.0, |hollows| hollows.free_to(&rays, 0.0));
        if enter && together >= 1.0 {
            return whole(rule, &shares.passed);
        }
        let mut is_free = |place: DVec2, at_mm: DVec4| {
            let ray = self.ray(place, at_mm);
            (enter || self.light.enters(at_mm))
                && self.hollows.as_mut().is_none_or(|hollows| hollows.free_to(&[ray], together) >= 1.0)
        };
        let (mut terms, mut fluxes, mut looked) = (Vec::new(), Vec::new(), Vec::new());
        let mut sum = DVec3::ZERO;
        let mut is_whole = true;
        for diagonal in &rule.diagonals {
            diagonal.terms(crossings, &mut terms);
            let mut free = |v: f64| is_free(DVec2::new(v + diagonal.shift, v), diagonal.at(&terms, v));
            looked.clear();
            looked.extend(diagonal.looks.iter().map(|v| (*v, free(*v))));
            is_whole &= looked.iter().all(|(_, free)| *free);
            fluxes.clear();
            pieces_in_sight(&looked, free, |low, high| {
                if fluxes.is_empty() {
                    diagonal.terms(&shares.passed, &mut fluxes);
                }
                for (v, up) in rule.rule.over(low, high) {
                    sum += diagonal.at(&fluxes, v).xyz() * (diagonal.weight * up);
                }
            });
        }
        if is_whole { whole(rule, &shares.passed) } else { sum }
    }
}

impl DirectLight<'_> {
    /// Vector irradiance at a point of the dome or the sheet's top, mW/mm^2, sensor frame. Its product with the
    /// unit normal *away from* the light is the irradiance.
    pub fn vector_irradiance(&self, emitter: &Emitter, point_mm: DVec3, rule: &EmitterRule) -> DVec3 {
        self.irradiance(emitter, point_mm, rule).left
    }

    /// [`DirectLight::vector_irradiance`] with the steps that lead to it.
    ///
    /// The rays from the rule's places are solved. Between them, flux and way are smooth, and the polynomial through the places
    /// interpolates both: so the platform's shadow is cut without another solve. Hollows, sheet and foot are convex: where they
    /// let the rays of the square's corners pass together, they let all others pass.
    pub fn irradiance(&self, emitter: &Emitter, point_mm: DVec3, rule: &EmitterRule) -> Irradiance {
        let side = 2.0 * emitter.half_side_mm;
        let pose = &emitter.platform_from_emitter;
        let place = |at: DVec2| pose.transform_point3(((at - 0.5) * side).extend(0.0));
        let indices = self.indices(point_mm.z);
        let mut shares = Shares::default();
        let (mut near, mut low, mut high) = (0.0, DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &(u, _) in rule.nodes() {
            for &(v, _) in rule.nodes() {
                let source = place(DVec2::new(u, v));
                let share = self.share(emitter, (source, point_mm), &indices, &mut near, &mut shares);
                let Some(underside_mm) = share else { return Irradiance::default() };
                for end in [source, underside_mm] {
                    (low, high) = (low.min(end), high.max(end));
                }
            }
        }
        // The sheet's underside lies over all emitters.
        let mut sight = Sight { light: self, place, underside_z_mm: high.z, hollows: None };
        let passed = sight.flux(rule, &shares);
        let mut left = passed;
        if let Some(cavities) = self.cavities.filter(|_| self.through_platform < 1.0) {
            // The emitter's corners lie a little beyond the rule's places.
            let beyond = DVec3::splat(emitter.half_side_mm);
            sight.hollows = Some(cavities.near(low - beyond, high + beyond));
            left = sight.flux(rule, &shares).lerp(passed, self.through_platform);
        }
        // Without the interfaces' losses as much is hidden.
        let all = whole(rule, &shares.passed).length();
        let seen = if all > 0.0 { passed.length() / all } else { 0.0 };
        let open = whole(rule, &shares.open) * seen;
        Irradiance {
            open: open * emitter.flux_mw,
            passed: passed * emitter.flux_mw,
            left: left * emitter.flux_mw,
        }
    }

    /// The media from the air to the point.
    fn indices(&self, z_mm: f64) -> Vec<f64> {
        let layers = self.optics.layers();
        let channel = self.optics.channel();
        let count = if z_mm > 0.0 { layers.len() } else { layers.len().saturating_sub(1).max(1) };
        layers[..count].iter().map(|layer| layer.index_for(channel)).collect()
    }

    /// Whether a ray with these crossings comes in through the sheet and, on its way to the silicone, the dome's foot.
    fn enters(&self, crossings_mm: DVec4) -> bool {
        crossings_mm.xy().abs().cmple(self.sheet_half_mm).all()
            && crossings_mm.zw().length() <= self.optics.dome().rim_radius_mm()
    }

    /// Adds what a place of the emitter sends to a point, and says where its ray meets the sheet's underside; `None` where no ray
    /// leads there. `near` is a neighbour's tangent.
    fn share(
        &self,
        emitter: &Emitter,
        (source, point_mm): (DVec3, DVec3),
        indices: &[f64],
        near: &mut f64,
        shares: &mut Shares,
    ) -> Option<DVec3> {
        let tube = self.optics.light_tube(source, point_mm, *near).ok()?;
        *near = tube.tangent;
        let per_sr = emitter.lobe.per_sr(tube.leaving.dot(emitter.platform_from_emitter.matrix3.z_axis));
        let passed = if self.fresnel { fresnel::through(indices, tube.snell_invariant) } else { 1.0 };
        let open = (tube.arriving * (per_sr * tube.sr_per_mm2)).extend(0.0);
        let top_mm = if point_mm.z > 0.0 {
            point_mm - tube.arriving * (point_mm.z / tube.arriving.z)
        } else {
            DVec3::ZERO
        };
        shares.crossings_mm.push(tube.underside_mm.xy().extend(top_mm.x).extend(top_mm.y));
        shares.open.push(open);
        shares.passed.push(open * passed);
        Some(tube.underside_mm)
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
