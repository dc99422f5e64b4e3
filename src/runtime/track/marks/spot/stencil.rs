//! The pixels that are looked at for outlines of one radius: a soft round window, and a ring of ground around.

/// Pixels beyond the outline that still carry its edge: blur and sampling reach so far.
const EDGE_PX: f64 = 1.75;
/// Width of the ring beyond that shows the ground, px.
const GROUND_PX: f64 = 2.25;
/// Largest outline that is measured, px.
pub const MAX_RADIUS_PX: f64 = 28.0;

/// Radii share a stencil in steps of this, px.
const STEP_PX: f64 = 0.25;

/// Number of the stencil for a radius.
pub(super) fn class_of(radius_px: f64) -> usize {
    (radius_px.clamp(0.5, MAX_RADIUS_PX) / STEP_PX).ceil() as usize
}

/// Radius of the outlines that a stencil is for, px.
pub(super) fn class_radius_px(class: usize) -> f64 {
    class as f64 * STEP_PX
}

/// Numbers that the inner loops take at a time: two vectors of the smallest x86-64.
pub(super) const LANES: usize = 8;

/// The pixels that are looked at for outlines of one radius.
#[derive(Debug, Clone)]
pub(super) struct Stencil {
    /// Half of the square around all of them, and of the square around the soft window.
    pub half: i32,
    pub disc_half: i32,
    /// Places of the columns of the soft window from its middle, a whole number of lanes.
    pub columns: Vec<f32>,
    /// The ring that shows the ground: places in the square, from its middle, and there.
    pub ring: Vec<u32>,
    pub ring_x: Vec<f32>,
    pub ring_y: Vec<f32>,
    /// Radius of the soft window.
    pub reach_px: f32,
    /// Part of the disc that is surely inside of the outline: squared radius.
    pub core_px2: f32,
    /// Sum of squared windows, and of those times x^2 + y^2: what noise comes through.
    pub count: f64,
    pub lever: f64,
}

impl Stencil {
    pub fn new(radius_px: f64) -> Self {
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

    pub fn side(&self) -> usize {
        (2 * self.half + 1) as usize
    }
}

/// The soft round window at a squared distance: 1 within half a pixel of its radius, 0 beyond it.
fn window_at(square: f32, reach_px: f32) -> f32 {
    let end = reach_px + 0.5;
    // Linear in the square: a root less, and no different over one pixel.
    ((end * end - square) / (2.0 * reach_px)).clamp(0.0, 1.0)
}
