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

/// Numbers that the inner loops take at a time: two vectors of the smallest x86-64.
const LANES: usize = 8;

/// The pixels that are looked at for outlines of one radius.
#[derive(Debug, Clone)]
struct Stencil {
    /// Half of the square around all of them, and of the square around the soft window.
    half: i32,
    disc_half: i32,
    /// Places of the columns of the soft window from its middle, a whole number of lanes.
    columns: Vec<f32>,
    /// The ring that shows the ground: places in the square, from its middle, and there.
    ring: Vec<u32>,
    ring_x: Vec<f32>,
    ring_y: Vec<f32>,
    /// Radius of the soft window.
    reach_px: f32,
    /// Part of the disc that is surely inside of the outline: squared radius.
    core_px2: f32,
    /// Sum of squared windows, and of those times x^2 + y^2: what noise comes through.
    count: f64,
    lever: f64,
}

impl Stencil {
    fn new(radius_px: f64) -> Self {
        let reach = radius_px + EDGE_PX;
        let outer = reach + 0.5 + GROUND_PX;
        // Half a pixel for the middle's distance from the pixel's.
        let half = (outer + 0.5).ceil() as i32;
        // The window may lie half a diagonal off the middle.
        let disc_half = ((reach + 0.5 + 0.75).ceil() as i32).min(half);
        let side = 2 * half + 1;
        let (mut ring, mut ring_x, mut ring_y) = (Vec::new(), Vec::new(), Vec::new());
        let (mut count, mut lever) = (0.0, 0.0);
        let core = (0.5 * radius_px).max(0.8) as f32;
        let reach_px = reach as f32;
        for y in -half..=half {
            for x in -half..=half {
                let square = f64::from(x * x + y * y);
                let distance = square.sqrt();
                let part = f64::from(window_at(square as f32, reach_px));
                count += part * part;
                lever += part * part * square;
                if distance >= reach + 0.25 && distance <= outer {
                    ring.push(((y + half) * side + x + half) as u32);
                    ring_x.push(x as f32);
                    ring_y.push(y as f32);
                }
            }
        }
        let width = (2 * disc_half + 1) as usize;
        let columns =
            (0..width.next_multiple_of(LANES)).map(|column| column as f32 - disc_half as f32).collect();
        Self { half, disc_half, columns, ring, ring_x, ring_y, reach_px, core_px2: core * core, count, lever }
    }

    fn side(&self) -> usize {
        (2 * self.half + 1) as usize
    }
}

/// The soft round window at a squared distance: 1 within half a pixel of its radius, 0 beyond it.
fn window_at(square: f32, reach_px: f32) -> f32 {
    let end = reach_px + 0.5;
    // Linear in the square: a root less, and no different over one pixel.
    ((end * end - square) / (2.0 * reach_px)).clamp(0.0, 1.0)
}

/// Measures spots; keeps its stencils and its buffers.
#[derive(Debug, Clone, Default)]
pub struct SpotMeter {
    stencils: Vec<Option<Stencil>>,
    /// The square of levels, how much darker than the ground the soft window's pixels are, the ring's levels.
    levels: Vec<f32>,
    dark: Vec<f32>,
    ring: Vec<f32>,
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
        if self.stencils[class].is_some() {
            return;
        }
        let stencil = Stencil::new(class as f64 * STEP_PX);
        let grow = |buffer: &mut Vec<f32>, size: usize| buffer.resize(buffer.len().max(size), 0.0);
        grow(&mut self.levels, stencil.side() * stencil.side());
        grow(&mut self.dark, stencil.columns.len() * (2 * stencil.disc_half + 1) as usize);
        grow(&mut self.ring, stencil.ring.len());
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
        let side = stencil.side();
        let levels = &mut self.levels[..side * side];
        let dark = &mut self.dark[..stencil.columns.len() * (2 * stencil.disc_half + 1) as usize];
        let mut at = start;
        let mut middle = (i32::MIN, i32::MIN);
        let mut ground = Ground { a: 0.0, b: 0.0, c: 0.0, noise: 0.0 };
        let mut sums = Sums::default();
        let mut from = DVec2::ZERO;
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
                plane.square_into(middle.0 - stencil.half, middle.1 - stencil.half, side, levels);
                ground = ground_of(stencil, levels, &mut self.ring).ok_or(NoSpot::NoGround)?;
                darken(stencil, levels, &ground, dark);
            }
            from = DVec2::new(at.x - f64::from(middle.0), at.y - f64::from(middle.1));
            sums = Sums::over(stencil, dark, from);
            let noise = f64::from(ground.noise / ground.a.max(1.0));
            // Less than four times what noise leaves of such a sum is nothing.
            if sums.weight <= 4.0 * noise * stencil.count.sqrt() || sums.weight < 0.02 * shape.area_px {
                return Err(NoSpot::Faint);
            }
            let step = DVec2::new(sums.x, sums.y) / sums.weight;
            // Half of the spot outside of the window halves the step; it never overshoots by more than the window.
            at += step.clamp_length_max(f64::from(stencil.reach_px));
            if step.length_squared() < SETTLED_PX * SETTLED_PX {
                break;
            }
        }
        if !(at.is_finite() && at.distance(start) <= stray_px) {
            return Err(NoSpot::Strayed);
        }
        finish(stencil, dark, from, &sums, &ground, shape, at)
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
        for ((to, value), x) in out.iter_mut().zip(&levels[start..start + width]).zip(&stencil.columns) {
            let level = (ground.a + ground.b * x + ground.c * y).max(1.0);
            *to = 1.0 - value / level;
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
        let (cx, cy) = (from.x as f32, from.y as f32);
        let end = stencil.reach_px + 0.5;
        let (end, per) = (end * end, 1.0 / (2.0 * stencil.reach_px));
        // Sums in lanes of their own: the order of the additions is fixed, and the loop goes in vectors.
        let [mut weights, mut xs, mut ys, mut squares] = [[0.0_f32; LANES]; 4];
        let (columns, _) = stencil.columns.as_chunks::<LANES>();
        for (row, values) in dark.chunks_exact(stencil.columns.len()).enumerate() {
            let dy = row as f32 - stencil.disc_half as f32 - cy;
            let (values, _) = values.as_chunks::<LANES>();
            for (values, columns) in values.iter().zip(columns) {
                for k in 0..LANES {
                    let dx = columns[k] - cx;
                    let square = dx * dx + dy * dy;
                    let weight = ((end - square) * per).clamp(0.0, 1.0) * values[k];
                    weights[k] += weight;
                    xs[k] += weight * dx;
                    ys[k] += weight * dy;
                    squares[k] += weight * square;
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

fn finish(
    stencil: &Stencil,
    dark: &[f32],
    from: DVec2,
    sums: &Sums,
    ground: &Ground,
    shape: &Shape,
    at_px: DVec2,
) -> Result<Spot, NoSpot> {
    let contrast = core_of(stencil, dark, from);
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
    let sd_px = noise * (0.5 * stencil.lever).sqrt() / sums.weight;
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

/// Sums over the ring: `of(x, y, level)` gives what is added of a pixel.
fn ring_sums<const N: usize>(
    stencil: &Stencil,
    levels: &[f32],
    of: impl Fn(f32, f32, f32) -> [f32; N],
) -> [f32; N] {
    const HALF: usize = LANES / 2;
    let mut lanes = [[0.0_f32; HALF]; N];
    let ((xs, last_x), (ys, last_y)) =
        (stencil.ring_x.as_chunks::<HALF>(), stencil.ring_y.as_chunks::<HALF>());
    let (values, last) = levels.as_chunks::<HALF>();
    for ((x, y), v) in xs.iter().zip(ys).zip(values) {
        for k in 0..HALF {
            let add = of(x[k], y[k], v[k]);
            for i in 0..N {
                lanes[i][k] += add[i];
            }
        }
    }
    let mut sums = lanes.map(|lane| lane.iter().sum::<f32>());
    for ((x, y), v) in last_x.iter().zip(last_y).zip(last) {
        for (sum, add) in sums.iter_mut().zip(of(*x, *y, *v)) {
            *sum += add;
        }
    }
    sums
}

fn ground_of(stencil: &Stencil, levels: &[f32], ring: &mut [f32]) -> Option<Ground> {
    let count = stencil.ring.len() as f32;
    let ring = &mut ring[..stencil.ring.len()];
    for (to, index) in ring.iter_mut().zip(&stencil.ring) {
        *to = levels[*index as usize];
    }
    let kept = |v: f32, floor: f32| if v >= floor { 1.0 } else { 0.0 };
    let [sum] = ring_sums(stencil, ring, |_, _, v| [v]);
    let floor = GROUND_PART * sum / count;
    // Another mark in the ring drags the mean down: once more without it.
    let [above, light] = ring_sums(stencil, ring, |_, _, v| [kept(v, floor) * v, kept(v, floor)]);
    if light < 0.35 * count {
        return None;
    }
    let floor = GROUND_PART * above / light;
    let s = ring_sums(stencil, ring, |x, y, v| {
        let k = kept(v, floor);
        let (kx, ky, kv) = (k * x, k * y, k * v);
        [k, kx, ky, kx * x, kx * y, ky * y, kv, kv * x, kv * y, kv * v]
    });
    let [n, x, y, xx, xy, yy, v, vx, vy, squares] = s;
    let [a, b, c] = plane_through(&[n, x, y, xx, xy, yy, v, vx, vy])?;
    // Sum of squared residuals of a least-squares fit: what the fit explains is taken off.
    let left = f64::from(squares)
        - f64::from(a) * f64::from(v)
        - f64::from(b) * f64::from(vx)
        - f64::from(c) * f64::from(vy);
    let freedom = (f64::from(n) - 3.0).max(1.0);
    // Quantisation alone leaves a twelfth.
    let noise = (left / freedom).max(1.0 / 12.0).sqrt() as f32;
    (a > 0.5 && a.is_finite() && noise.is_finite()).then_some(Ground { a, b, c, noise })
}
