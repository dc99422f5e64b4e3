//! The centroid of a dark spot, from the grey pixels around where it is expected.

use glam::DVec2;

use crate::track::frame::Plane;

/// Pixels beyond the outline that still carry its edge: blur and sampling reach so far.
const EDGE_PX: f64 = 1.75;
/// Width of the ring beyond that shows the ground, px.
const GROUND_PX: f64 = 2.25;
/// Steps of the window towards its own centroid.
const MOST_STEPS: u32 = 10;
/// A step below this ends the climb, px: a hundredth of what is aimed at.
const SETTLED_PX: f64 = 2e-3;
/// Part of the ground's level below which a pixel of the ring is another mark, not ground.
const GROUND_PART: f32 = 0.8;
/// Largest outline that is measured, px.
pub const MOST_RADIUS_PX: f64 = 28.0;

/// What the outline of a spot should be.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shape {
    /// Largest distance of the outline from the centroid, px.
    pub radius_px: f64,
    /// Area, px^2.
    pub area_px: f64,
    /// Mean square distance of its area from the centroid, px^2.
    pub spread_px2: f64,
}

/// A spot as it was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
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
}

/// Why there is no spot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoSpot {
    /// The window left the frame, or went too far from where it began.
    Strayed,
    /// Nothing darker than the ground stands out from the noise.
    Faint,
    /// Too little ground around it.
    NoGround,
    /// Its area or spread is that of more than one spot, or of something else.
    Misshapen,
}

/// A pixel of a stencil: place from its middle.
#[derive(Debug, Clone, Copy)]
struct Place {
    x: f32,
    y: f32,
    index: u32,
}

/// The pixels that are looked at for outlines of one radius.
#[derive(Debug, Clone)]
struct Stencil {
    half: i32,
    disc: Vec<Place>,
    ring: Vec<Place>,
    /// Radius of the soft window.
    reach_px: f32,
    /// Part of the disc that is surely inside of the outline: squared radius.
    core_px2: f32,
}

impl Stencil {
    fn new(radius_px: f64) -> Self {
        let reach = radius_px + EDGE_PX;
        let outer = reach + 0.5 + GROUND_PX;
        // Half a pixel for the middle's distance from the pixel's.
        let half = (outer + 0.5).ceil() as i32;
        let side = 2 * half + 1;
        let (mut disc, mut ring) = (Vec::new(), Vec::new());
        for y in -half..=half {
            for x in -half..=half {
                let place = Place { x: x as f32, y: y as f32, index: ((y + half) * side + x + half) as u32 };
                let distance = f64::from(x * x + y * y).sqrt();
                // The window may lie half a diagonal off the middle.
                if distance < reach + 0.5 + 0.75 {
                    disc.push(place);
                }
                if distance >= reach + 0.25 && distance <= outer {
                    ring.push(place);
                }
            }
        }
        let core = (0.5 * radius_px).max(0.8) as f32;
        Self { half, disc, ring, reach_px: reach as f32, core_px2: core * core }
    }
}

/// Measures spots; keeps its stencils and its window.
#[derive(Debug, Clone, Default)]
pub struct SpotMeter {
    stencils: Vec<Option<Stencil>>,
    window: Vec<f32>,
}

/// Radii share a stencil in steps of this, px.
const STEP_PX: f64 = 0.25;

fn class_of(radius_px: f64) -> usize {
    (radius_px.clamp(0.5, MOST_RADIUS_PX) / STEP_PX).ceil() as usize
}

/// The plane a + b x + c y through ground pixels, and the rms of what is left.
struct Ground {
    a: f32,
    b: f32,
    c: f32,
    noise: f32,
}

impl SpotMeter {
    /// Makes ready for outlines of this radius; others are not measured.
    pub fn prepare(&mut self, radius_px: f64) {
        let class = class_of(radius_px);
        if self.stencils.len() <= class {
            self.stencils.resize(class + 1, None);
        }
        let stencil = Stencil::new(class as f64 * STEP_PX);
        let side = (2 * stencil.half + 1) as usize;
        if self.window.len() < side * side {
            self.window.resize(side * side, 0.0);
        }
        self.stencils[class] = Some(stencil);
    }

    /// The spot near `start`, at most `stray_px` from it.
    ///
    /// The ground is a plane through the ring around, other marks left out; each pixel weighs by how much darker than
    /// the ground it is, as a part of the ground's level: light that changes across a dot then moves nothing. The
    /// window is round, soft-edged and centred on the answer (a fixed point), so what it cuts off, it cuts evenly.
    pub fn measure(
        &mut self,
        plane: &Plane<'_>,
        start: DVec2,
        shape: &Shape,
        stray_px: f64,
    ) -> Result<Spot, NoSpot> {
        let Some(Some(stencil)) = self.stencils.get(class_of(shape.radius_px)) else {
            return Err(NoSpot::NoGround);
        };
        let side = (2 * stencil.half + 1) as usize;
        let window = &mut self.window[..side * side];
        let mut at = start;
        let mut middle = (i32::MIN, i32::MIN);
        let mut ground = Ground { a: 0.0, b: 0.0, c: 0.0, noise: 0.0 };
        let mut sums = Sums::default();
        for _ in 0..MOST_STEPS {
            let inside = |v: f64, end: usize| v > 0.0 && v < end as f64 - 1.0;
            if !(inside(at.x, plane.width())
                && inside(at.y, plane.height())
                && at.distance(start) <= stray_px)
            {
                return Err(NoSpot::Strayed);
            }
            let next = (at.x.round() as i32, at.y.round() as i32);
            if next != middle {
                middle = next;
                plane.square_into(middle.0 - stencil.half, middle.1 - stencil.half, side, window);
                ground = ground_of(stencil, window).ok_or(NoSpot::NoGround)?;
            }
            let from = DVec2::new(at.x - f64::from(middle.0), at.y - f64::from(middle.1));
            sums = Sums::over(stencil, window, &ground, from);
            let noise = f64::from(ground.noise / ground.a.max(1.0));
            // Less than four times what noise leaves of such a sum is nothing.
            if sums.weight <= 4.0 * noise * sums.count.sqrt() || sums.weight < 0.02 * shape.area_px {
                return Err(NoSpot::Faint);
            }
            let step = DVec2::new(sums.x, sums.y) / sums.weight - from;
            // Half of the spot outside of the window halves the step; it never overshoots by more than the window.
            at += step.clamp_length_max(f64::from(stencil.reach_px));
            if step.length_squared() < SETTLED_PX * SETTLED_PX {
                break;
            }
        }
        if !(at.is_finite() && at.distance(start) <= stray_px) {
            return Err(NoSpot::Strayed);
        }
        finish(&sums, &ground, shape, at)
    }
}

/// Weighted sums over the window.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    weight: f64,
    x: f64,
    y: f64,
    square: f64,
    /// Sum of squared windows, and of those times x^2 + y^2 about the window's middle: what noise comes through.
    count: f64,
    lever: f64,
    core: f64,
    core_count: f64,
}

impl Sums {
    fn over(stencil: &Stencil, window: &[f32], ground: &Ground, from: DVec2) -> Self {
        let (cx, cy) = (from.x as f32, from.y as f32);
        let mut s = [0.0_f32; 8];
        // The ground's level over the few pixels of a window: its reciprocal to first order in the slope would do;
        // the quotient is exact and no slower than what else is done for the pixel.
        for place in &stencil.disc {
            let (dx, dy) = (place.x - cx, place.y - cy);
            let square = dx * dx + dy * dy;
            let part = (stencil.reach_px + 0.5 - square.sqrt()).clamp(0.0, 1.0);
            let level = ground.a + ground.b * place.x + ground.c * place.y;
            let weight = part * (1.0 - window[place.index as usize] / level.max(1.0));
            s[0] += weight;
            s[1] += weight * place.x;
            s[2] += weight * place.y;
            s[3] += weight * square;
            s[4] += part * part;
            s[5] += part * part * square;
            let core = if square < stencil.core_px2 { 1.0 } else { 0.0 };
            s[6] += core * weight;
            s[7] += core;
        }
        let [weight, x, y, square, count, lever, core, core_count] = s.map(f64::from);
        Self { weight, x, y, square, count, lever, core, core_count }
    }
}

fn finish(sums: &Sums, ground: &Ground, shape: &Shape, at_px: DVec2) -> Result<Spot, NoSpot> {
    let contrast = sums.core / sums.core_count.max(1.0);
    let level = f64::from(ground.a);
    let noise = f64::from(ground.noise) / level.max(1.0);
    if !(contrast > 0.06 && contrast > 3.0 * noise) {
        return Err(NoSpot::Faint);
    }
    let area_px = sums.weight / contrast;
    let spread_px2 = sums.square / sums.weight;
    // One spot alone, whole: blur widens the spread, not the area.
    let sound =
        area_px > 0.4 * shape.area_px && area_px < 2.2 * shape.area_px && spread_px2 > 0.3 * shape.spread_px2;
    if !sound {
        return Err(NoSpot::Misshapen);
    }
    // Each axis has half of the lever.
    let sd_px = noise * (0.5 * sums.lever).sqrt() / sums.weight;
    Ok(Spot { at_px, contrast, area_px, spread_px2, sd_px, ground: level })
}

/// Solves the symmetric 3x3 system of a plane fit; `None` where the pixels do not span it.
fn plane_through(s: &[f32; 9]) -> Option<[f32; 3]> {
    let [n, x, y, xx, xy, yy, v, vx, vy] = s.map(f64::from);
    // Centred: two unknowns and the mean.
    if n < 8.0 {
        return None;
    }
    let (mx, my, mv) = (x / n, y / n, v / n);
    let (cxx, cxy, cyy) = (xx - n * mx * mx, xy - n * mx * my, yy - n * my * my);
    let (cxv, cyv) = (vx - n * mx * mv, vy - n * my * mv);
    let det = cxx * cyy - cxy * cxy;
    if det <= 1e-3 * cxx * cyy {
        return None;
    }
    let b = (cxv * cyy - cyv * cxy) / det;
    let c = (cyv * cxx - cxv * cxy) / det;
    Some([(mv - b * mx - c * my) as f32, b as f32, c as f32])
}

fn ground_of(stencil: &Stencil, window: &[f32]) -> Option<Ground> {
    let ring = &stencil.ring;
    let mut sum = 0.0_f32;
    for place in ring {
        sum += window[place.index as usize];
    }
    let mut floor = GROUND_PART * sum / ring.len() as f32;
    // Another mark in the ring drags the mean down: once more without it.
    let (mut above, mut count) = (0.0_f32, 0.0_f32);
    for place in ring {
        let value = window[place.index as usize];
        let kept = if value >= floor { 1.0 } else { 0.0 };
        above += kept * value;
        count += kept;
    }
    if count < 0.35 * ring.len() as f32 {
        return None;
    }
    floor = GROUND_PART * above / count;
    let mut s = [0.0_f32; 9];
    let mut squares = 0.0_f32;
    for place in ring {
        let value = window[place.index as usize];
        let kept = if value >= floor { 1.0 } else { 0.0 };
        let (x, y, v) = (kept * place.x, kept * place.y, kept * value);
        s[0] += kept;
        s[1] += x;
        s[2] += y;
        s[3] += x * place.x;
        s[4] += x * place.y;
        s[5] += y * place.y;
        s[6] += v;
        s[7] += v * place.x;
        s[8] += v * place.y;
        squares += v * value;
    }
    let [a, b, c] = plane_through(&s)?;
    // Sum of squared residuals of a least-squares fit: what the fit explains is taken off.
    let left = f64::from(squares)
        - f64::from(a) * f64::from(s[6])
        - f64::from(b) * f64::from(s[7])
        - f64::from(c) * f64::from(s[8]);
    let freedom = (f64::from(s[0]) - 3.0).max(1.0);
    // Quantisation alone leaves a twelfth.
    let noise = (left / freedom).max(1.0 / 12.0).sqrt() as f32;
    (a > 0.5 && a.is_finite() && noise.is_finite()).then_some(Ground { a, b, c, noise })
}
