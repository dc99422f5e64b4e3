//! Pyramidal Lucas-Kanade: where a patch of the last frame is in this one.
//!
//! J.-Y. Bouguet, "Pyramidal implementation of the Lucas Kanade feature tracker" (2000): on each level from the
//! coarsest on, Newton steps on the squared difference of two patches with the gradient matrix of the first.

use glam::DVec2;

use crate::track::frame::Plane;

/// Most levels of the pyramid: the coarsest then sees a sixteenth of the pixels in each direction.
pub const MAX_LEVELS: usize = 5;
/// Half of the patch, px: a dot and its ground.
const HALF: i32 = 7;
const SIDE: usize = (2 * HALF + 1) as usize;
/// Steps on each level.
const MAX_STEPS: u32 = 12;
/// A step below this ends a level, px.
const CONVERGED_PX: f32 = 0.01;

#[derive(Debug, Clone, Default)]
struct Level {
    width: usize,
    height: usize,
    bytes: Vec<u8>,
}

impl Level {
    fn at(&self, x: i32, y: i32) -> f32 {
        let x = (x.max(0) as usize).min(self.width.saturating_sub(1));
        let y = (y.max(0) as usize).min(self.height.saturating_sub(1));
        f32::from(self.bytes.get(y * self.width + x).copied().unwrap_or(0))
    }

    /// The patch around a place, bilinear.
    fn patch(&self, at: DVec2, out: &mut [f32; SIDE * SIDE]) {
        let (x, y) = (at.x.floor(), at.y.floor());
        let (fx, fy) = ((at.x - x) as f32, (at.y - y) as f32);
        let (x, y) = (x as i32, y as i32);
        let mut before = [0.0_f32; SIDE];
        for row in 0..=SIDE {
            let py = y + row as i32 - HALF;
            let mut here = [0.0_f32; SIDE];
            let mut left = self.at(x - HALF, py);
            for (column, to) in here.iter_mut().enumerate() {
                let right = self.at(x - HALF + column as i32 + 1, py);
                *to = left + fx * (right - left);
                left = right;
            }
            if row > 0 {
                let out = &mut out[(row - 1) * SIDE..row * SIDE];
                for ((to, a), b) in out.iter_mut().zip(&before).zip(&here) {
                    *to = a + fy * (b - a);
                }
            }
            before = here;
        }
    }
}

/// Two pyramids, of the last frame and of this one, which change places.
#[derive(Debug, Clone, Default)]
pub struct Flow {
    last: Vec<Level>,
    now: Vec<Level>,
    has_last: bool,
}

impl Flow {
    /// Ready for frames of one size; 1 to [`MAX_LEVELS`] levels, the finest the frame itself.
    pub fn new(width: usize, height: usize, levels: usize) -> Self {
        let level = |k: usize| {
            let (width, height) = (width.div_ceil(1 << k), height.div_ceil(1 << k));
            Level { width, height, bytes: vec![0; width * height] }
        };
        let pyramid = || (0..levels.clamp(1, MAX_LEVELS)).map(level).collect::<Vec<_>>();
        Self { last: pyramid(), now: pyramid(), has_last: false }
    }

    /// The frame that came before is forgotten.
    pub fn forget(&mut self) {
        self.has_last = false;
    }

    /// Takes the next frame in; of another size it is not taken.
    pub fn take(&mut self, plane: &Plane<'_>, has_last: bool) {
        std::mem::swap(&mut self.last, &mut self.now);
        self.has_last = has_last;
        if plane.width() != self.now[0].width || plane.height() != self.now[0].height {
            self.has_last = false;
            return;
        }
        let width = plane.width();
        for (y, row) in self.now[0].bytes.chunks_exact_mut(width).enumerate() {
            plane.row_into(0, y, row);
        }
        for k in 1..self.now.len() {
            let (fine, coarse) = self.now.split_at_mut(k);
            if let (Some(fine), Some(coarse)) = (fine.last(), coarse.first_mut()) {
                halve(fine, coarse);
            }
        }
    }

    /// Where the patch around `from` of the last frame is now; `None` without a last frame, without texture, or
    /// where the steps do not converge.
    pub fn follow(&self, from: DVec2) -> Option<DVec2> {
        if !self.has_last || !from.is_finite() {
            return None;
        }
        let mut shift = DVec2::ZERO;
        for k in (0..self.now.len()).rev() {
            let scale = f64::from(1_u32 << k);
            let (last, now) = (&self.last[k], &self.now[k]);
            let start = from / scale;
            shift = step_down(last, now, start, shift / scale)? * scale;
        }
        let to = from + shift;
        let inside =
            to.x >= 0.0 && to.y >= 0.0 && to.x < self.now[0].width as f64 && to.y < self.now[0].height as f64;
        inside.then_some(to)
    }
}

fn step_down(last: &Level, now: &Level, start: DVec2, mut shift: DVec2) -> Option<DVec2> {
    let mut first = [0.0; SIDE * SIDE];
    last.patch(start, &mut first);
    let at = |x: usize, y: usize| first[y * SIDE + x];
    let (mut xx, mut xy, mut yy) = (0.0_f32, 0.0_f32, 0.0_f32);
    for y in 1..SIDE - 1 {
        for x in 1..SIDE - 1 {
            let (gx, gy) = (0.5 * (at(x + 1, y) - at(x - 1, y)), 0.5 * (at(x, y + 1) - at(x, y - 1)));
            xx += gx * gx;
            xy += gx * gy;
            yy += gy * gy;
        }
    }
    let det = xx * yy - xy * xy;
    // OpenCV's bound on the smaller eigenvalue, over the patch: flat patches cannot be followed.
    if det <= 1e-2 * xx * yy || xx + yy < 50.0 {
        return None;
    }
    let mut second = [0.0; SIDE * SIDE];
    for _ in 0..MAX_STEPS {
        now.patch(start + shift, &mut second);
        let (mut bx, mut by) = (0.0_f32, 0.0_f32);
        for y in 1..SIDE - 1 {
            for x in 1..SIDE - 1 {
                let left = at(x, y) - second[y * SIDE + x];
                bx += left * 0.5 * (at(x + 1, y) - at(x - 1, y));
                by += left * 0.5 * (at(x, y + 1) - at(x, y - 1));
            }
        }
        let step = [(yy * bx - xy * by) / det, (xx * by - xy * bx) / det];
        shift += DVec2::new(f64::from(step[0]), f64::from(step[1]));
        if !(shift.is_finite() && shift.length() < 4.0 * SIDE as f64) {
            return None;
        }
        if step[0].abs().max(step[1].abs()) < CONVERGED_PX {
            break;
        }
    }
    Some(shift)
}

/// Half the size in each direction: the mean of the pixels 1 2 1 / 2 4 2 / 1 2 1 around every other one.
fn halve(fine: &Level, coarse: &mut Level) {
    for y in 0..coarse.height {
        for x in 0..coarse.width {
            let (cx, cy) = (2 * x as i32, 2 * y as i32);
            let row =
                |dy: i32| fine.at(cx - 1, cy + dy) + 2.0 * fine.at(cx, cy + dy) + fine.at(cx + 1, cy + dy);
            let sum = row(-1) + 2.0 * row(0) + row(1);
            coarse.bytes[y * coarse.width + x] = (sum / 16.0 + 0.5) as u8;
        }
    }
}
