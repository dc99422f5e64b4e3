//! The centroid of a dark spot, from the grey pixels around where it is expected.

use glam::DVec2;

use super::ground::{Ground, ground_of};
use super::shape::{SpotShape, shape_of};
use super::stencil::{LANES, Stencil, class_of, class_radius_px};
use super::two_sided::two_sided_ground;
use super::window::SoftWindow;
use crate::track::frame::Plane;

/// Steps of the window towards its own centroid.
const MAX_STEPS: u32 = 10;
/// A step below this ends the climb, px: a hundredth of what is aimed at.
const CONVERGED_PX: f64 = 2e-3;
/// A spot of which an ellipse leaves more than this part unexplained is measured again on ground that is lit on one side
/// of a line; that counts where it leaves less than this part of what the plane did.
const RETRY_MISFIT: f64 = 0.2;
/// A spot whose area, spread and contrast are what is known of it but for this part still looks as it did.
const SAME_PART: f64 = 0.02;
const BETTER: f64 = 0.75;

/// What the outline of a spot should be.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpotOutline {
    /// Largest distance of the outline from the centroid, px.
    pub radius_px: f64,
    /// Area, px^2.
    pub area_px: f64,
    /// Mean square distance of its area from the centroid, px^2.
    pub spread_px2: f64,
    /// Difference of the second moments along and across, over their sum, as a vector of twice the direction's angle.
    pub elongation: DVec2,
}

/// A spot as it was found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DarkSpot {
    /// Its centroid, px.
    pub at_px: DVec2,
    /// How much darker than the ground its middle is, in parts of the ground's level.
    pub contrast: f64,
    /// Area that the grey values mean, px^2.
    pub area_px: f64,
    /// Mean square distance of it from the centroid, px^2.
    pub spread_px2: f64,
    /// Standard deviation of the centroid on each axis that the ground's noise means, px.
    pub sd_px: f64,
    /// Level of the ground at the centroid.
    pub ground: f64,
    /// What it looks like.
    pub shape: SpotShape,
    /// Whether that was looked at in this frame; else it is what was known, for a spot of the same size.
    pub is_shape_new: bool,
}

impl DarkSpot {
    /// Its elongation beside that of an outline as blurred as it is.
    pub fn elongation_beside(&self, outline: &SpotOutline) -> DVec2 {
        // Blur makes a spot rounder.
        let blur = 2.0 * self.shape.edge_px * self.shape.edge_px;
        self.shape.elongation - outline.elongation * (outline.spread_px2 / (outline.spread_px2 + blur))
    }
}

/// Why there is no spot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpotFault {
    /// The window left the frame, or went too far from where it began.
    Strayed,
    /// Nothing darker than the ground stands out from the noise.
    Faint,
    /// Too little ground around it.
    NoGround,
    /// Its area or spread is that of more than one spot, or of something else.
    Misshapen,
}

/// Measures spots; keeps its stencils and its buffers.
#[derive(Debug, Clone, Default)]
pub struct SpotMeter {
    stencils: Vec<Option<Stencil>>,
    /// The square of levels, how much darker than the ground the soft window's pixels are, the ring's levels.
    levels: Vec<f32>,
    dark: Vec<f32>,
    ring: Vec<f32>,
    /// The ring's pixels, where two levels are fitted through them.
    pixels: Vec<[f32; 3]>,
}

/// What the ground around a spot is taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum GroundKind {
    Plane,
    TwoSided,
}

impl SpotMeter {
    /// Makes ready for outlines of this radius; others are not measured.
    pub fn prepare(&mut self, radius_px: f64) {
        let class = class_of(radius_px);
        if self.stencils.len() <= class {
            self.stencils.resize(class + 1, None);
        }
        if self.stencils[class].is_some() {
            return;
        }
        let stencil = Stencil::new(class_radius_px(class));
        let grow = |buffer: &mut Vec<f32>, size: usize| buffer.resize(buffer.len().max(size), 0.0);
        grow(&mut self.levels, stencil.side() * stencil.side());
        grow(&mut self.dark, stencil.columns.len() * (2 * stencil.disc_half + 1) as usize);
        grow(&mut self.ring, stencil.ring.len());
        self.pixels.reserve(stencil.ring.len());
        self.stencils[class] = Some(stencil);
    }

    /// The spot near `start`, at most `stray_px` from it.
    ///
    /// The ground is a plane through the ring around, other marks left out; each pixel weighs by how much darker than
    /// the ground it is, as a part of the ground's level: light that changes across a dot then moves nothing. The
    /// window is round, soft-edged and centred on the answer (a fixed point), so what it cuts off, it cuts evenly. What
    /// does not look like a spot then is tried on ground that is two planes, lit and in shadow. `known`: the spot as it was
    /// last; one of the same size is not looked at again.
    pub fn measure(
        &mut self,
        plane: &Plane<'_>,
        start: DVec2,
        shape: &SpotOutline,
        stray_px: f64,
        known: Option<&DarkSpot>,
    ) -> Result<DarkSpot, SpotFault> {
        let plain = self.measure_on(GroundKind::Plane, plane, start, shape, (stray_px, known));
        let misfit = match plain {
            Ok(spot) => spot.shape.misfit(),
            Err(SpotFault::NoGround | SpotFault::Misshapen) => f64::INFINITY,
            Err(_) => 0.0,
        };
        if misfit <= RETRY_MISFIT {
            return plain;
        }
        match self.measure_on(GroundKind::TwoSided, plane, start, shape, (stray_px, None)) {
            Ok(spot) if spot.shape.misfit() < (BETTER * misfit).min(RETRY_MISFIT) => Ok(spot),
            _ => plain,
        }
    }

    fn measure_on(
        &mut self,
        kind: GroundKind,
        plane: &Plane<'_>,
        start: DVec2,
        shape: &SpotOutline,
        (stray_px, known): (f64, Option<&DarkSpot>),
    ) -> Result<DarkSpot, SpotFault> {
        let Some(Some(stencil)) = self.stencils.get(class_of(shape.radius_px)) else {
            return Err(SpotFault::NoGround);
        };
        let side = stencil.side();
        let levels = &mut self.levels[..side * side];
        let dark = &mut self.dark[..stencil.columns.len() * (2 * stencil.disc_half + 1) as usize];
        let mut at = start;
        let mut middle = (i32::MIN, i32::MIN);
        let mut ground = Ground { a: 0.0, b: 0.0, c: 0.0, noise: 0.0, edge: None };
        let mut sums = Sums::default();
        let mut from = DVec2::ZERO;
        for _ in 0..MAX_STEPS {
            let inside = |v: f64, end: usize| v > 0.0 && v < end as f64 - 1.0;
            if !(inside(at.x, plane.width())
                && inside(at.y, plane.height())
                && at.distance(start) <= stray_px)
            {
                return Err(SpotFault::Strayed);
            }
            let next = (at.x.round() as i32, at.y.round() as i32);
            if next != middle {
                middle = next;
                plane.square_into(middle.0 - stencil.half, middle.1 - stencil.half, side, levels);
                let found = match kind {
                    GroundKind::Plane => ground_of(stencil, levels, &mut self.ring),
                    GroundKind::TwoSided => two_sided_ground(stencil, levels, &mut self.pixels),
                };
                ground = found.ok_or(SpotFault::NoGround)?;
                darken(stencil, levels, &ground, dark);
            }
            from = DVec2::new(at.x - f64::from(middle.0), at.y - f64::from(middle.1));
            sums = Sums::over(stencil, dark, from);
            let noise = f64::from(ground.noise / ground.middle().max(1.0));
            // Less than four times what noise leaves of such a sum is nothing.
            if sums.weight <= 4.0 * noise * stencil.count.sqrt() || sums.weight < 0.02 * shape.area_px {
                return Err(SpotFault::Faint);
            }
            let step = DVec2::new(sums.x, sums.y) / sums.weight;
            // Half of the spot outside of the window halves the step; it never overshoots by more than the window.
            at += step.clamp_length_max(f64::from(stencil.reach_px));
            if step.length_squared() < CONVERGED_PX * CONVERGED_PX {
                break;
            }
        }
        if !(at.is_finite() && at.distance(start) <= stray_px) {
            return Err(SpotFault::Strayed);
        }
        let is_first_odd = (middle.1 - stencil.disc_half) & 1 != 0;
        let found_spot = FoundSpot { stencil, dark, from, at_px: at, is_first_odd };
        found_spot.finish(&sums, &ground, shape, known)
    }
}

/// How much darker than the ground each pixel of the soft window is, as a part of the ground's level; the columns that
/// only fill the lanes are 0.
fn darken(stencil: &Stencil, levels: &[f32], ground: &Ground, dark: &mut [f32]) {
    let (side, stride) = (stencil.side(), stencil.columns.len());
    let offset = (stencil.half - stencil.disc_half) as usize;
    let width = (2 * stencil.disc_half + 1) as usize;
    for (row, out) in dark.chunks_exact_mut(stride).enumerate() {
        let start = (row + offset) * side + offset;
        let y = row as f32 - stencil.disc_half as f32;
        let (out, rest) = out.split_at_mut(width);
        let pixels = out.iter_mut().zip(&levels[start..start + width]).zip(&stencil.columns);
        match &ground.edge {
            None => pixels.for_each(|((to, value), x)| {
                *to = 1.0 - value / (ground.a + ground.b * x + ground.c * y).max(1.0);
            }),
            Some(edge) => pixels.for_each(|((to, value), x)| {
                *to = 1.0 - value / (ground.a + edge.level(*x, y)).max(1.0);
            }),
        }
        rest.fill(0.0);
    }
}

/// Weighted sums over the window, about its middle.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    weight: f64,
    x: f64,
    y: f64,
    square: f64,
}

impl Sums {
    fn over(stencil: &Stencil, dark: &[f32], from: DVec2) -> Self {
        let window = SoftWindow::new(stencil, dark, from);
        let [mut weights, mut xs, mut ys, mut squares] = [[0.0_f32; LANES]; 4];
        for row in window.rows() {
            for (values, columns) in row.lanes() {
                for k in 0..LANES {
                    let dx = columns[k] - row.center_x;
                    let weight = row.weight(dx) * values[k];
                    weights[k] += weight;
                    xs[k] += weight * dx;
                    ys[k] += weight * row.dy;
                    squares[k] += weight * (dx * dx + row.dy * row.dy);
                }
            }
        }
        let sum = |lanes: [f32; LANES]| f64::from(lanes.iter().sum::<f32>());
        Self { weight: sum(weights), x: sum(xs), y: sum(ys), square: sum(squares) }
    }
}

/// Mean darkness of the pixels that are surely inside of the outline.
fn core_of(stencil: &Stencil, dark: &[f32], from: DVec2) -> f64 {
    let (cx, cy) = (from.x as f32, from.y as f32);
    let reach = stencil.core_px2.sqrt().ceil() as i32 + 1;
    let (mut sum, mut count) = (0.0, 0.0);
    for y in -reach..=reach {
        for x in -reach..=reach {
            let (dx, dy) = (x as f32 - cx, y as f32 - cy);
            if dx * dx + dy * dy < stencil.core_px2 {
                let at = (y + stencil.disc_half) as usize * stencil.columns.len();
                sum += dark.get(at + (x + stencil.disc_half) as usize).copied().unwrap_or(0.0);
                count += 1.0;
            }
        }
    }
    f64::from(sum / f32::max(count, 1.0))
}

/// A window that has come to rest.
struct FoundSpot<'a> {
    stencil: &'a Stencil,
    dark: &'a [f32],
    /// Its middle from the middle pixel, and in the frame, px.
    from: DVec2,
    at_px: DVec2,
    /// Whether its first row is an odd one of the frame.
    is_first_odd: bool,
}

impl FoundSpot<'_> {
    /// What is in it, if that is one spot.
    fn finish(
        &self,
        sums: &Sums,
        ground: &Ground,
        outline: &SpotOutline,
        known: Option<&DarkSpot>,
    ) -> Result<DarkSpot, SpotFault> {
        let &Self { stencil, dark, from, at_px, is_first_odd } = self;
        let contrast = core_of(stencil, dark, from);
        let level = f64::from(ground.middle());
        let noise = f64::from(ground.noise) / level.max(1.0);
        if !(contrast > 0.06 && contrast > 3.0 * noise) {
            return Err(SpotFault::Faint);
        }
        let area_px = sums.weight / contrast;
        let spread_px2 = sums.square / sums.weight;
        // One spot alone, whole: blur widens the spread, not the area.
        let sound = area_px > 0.4 * outline.area_px
            && area_px < 2.2 * outline.area_px
            && spread_px2 > 0.3 * outline.spread_px2;
        if !sound {
            return Err(SpotFault::Misshapen);
        }
        let same = |now: f64, before: f64| (now - before).abs() < SAME_PART * before;
        let known = known.filter(|known| {
            same(area_px, known.area_px)
                && same(spread_px2, known.spread_px2)
                && same(contrast, known.contrast)
        });
        let looked_at = || shape_of(&SoftWindow::new(stencil, dark, from), contrast, is_first_odd);
        let (is_shape_new, shape) = (known.is_none(), known.map(|known| known.shape).or_else(looked_at));
        let Some(shape) = shape else { return Err(SpotFault::Misshapen) };
        // Each axis has half of the lever.
        let sd_px = noise * (0.5 * stencil.lever).sqrt() / sums.weight;
        Ok(DarkSpot { at_px, contrast, area_px, spread_px2, sd_px, ground: level, shape, is_shape_new })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::frame::CameraFrame;
    use crate::track::options::Channel;

    #[test]
    fn a_dark_spot_is_measured_and_nothing_is_named() {
        let center = DVec2::new(20.4, 17.8);
        let dark = |at: DVec2| if at.distance(center) < 3.5 { 40.0 } else { 160.0 };
        let level = |i: usize| {
            let corner = DVec2::new((i % 40) as f64, (i / 40) as f64) - 0.5;
            let sample = |k: usize| corner + (DVec2::new((k % 8) as f64, (k / 8) as f64) + 0.5) / 8.0;
            ((0..64).map(|k| dark(sample(k))).sum::<f64>() / 64.0).round() as u8
        };
        let bytes: Vec<u8> = (0..40 * 36).map(level).collect();
        let frame = CameraFrame::new(40, 36, 1, &bytes).unwrap();
        let plane = Plane::new(&frame, Channel::Luma);
        let area_px = std::f64::consts::PI * 3.5 * 3.5;
        let spread_px2 = 0.5 * 3.5 * 3.5;
        let outline = SpotOutline { radius_px: 3.5, area_px, spread_px2, elongation: DVec2::ZERO };
        let mut meter = SpotMeter::default();
        assert_eq!(meter.measure(&plane, center, &outline, 4.0, None), Err(SpotFault::NoGround));
        meter.prepare(outline.radius_px);
        let spot = meter.measure(&plane, center + DVec2::new(1.0, -1.2), &outline, 4.0, None).unwrap();
        assert!(spot.at_px.distance(center) < 0.02, "{}", spot.at_px);
        assert!((spot.area_px / area_px - 1.0).abs() < 0.05, "{}", spot.area_px);
        let far = meter.measure(&plane, DVec2::new(8.0, 8.0), &outline, 2.0, None);
        assert_eq!(far, Err(SpotFault::Faint));
        let outside = meter.measure(&plane, DVec2::new(-3.0, 8.0), &outline, 2.0, None);
        assert_eq!(outside, Err(SpotFault::Strayed));
    }
}
