//! The ground around a spot: a plane through the levels of a ring.

use super::light_edge::LightEdge;
use super::stencil::{LANES, Stencil};

/// Part of the ground's level below which a pixel of the ring is another mark, not ground.
const GROUND_PART: f32 = 0.8;

/// The plane a + b x + c y through ground pixels, the edge of a shadow on it, and the rms of what is left.
pub(super) struct Ground {
    pub a: f32,
    pub b: f32,
    pub c: f32,
    pub noise: f32,
    pub edge: Option<LightEdge>,
}

impl Ground {
    /// Its level at the middle of the window.
    pub fn middle(&self) -> f32 {
        self.a + self.edge.map_or(0.0, |edge| edge.level(0.0, 0.0))
    }
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

pub(super) fn ground_of(stencil: &Stencil, levels: &[f32], ring: &mut [f32]) -> Option<Ground> {
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
    (a > 0.5 && a.is_finite() && noise.is_finite()).then_some(Ground { a, b, c, noise, edge: None })
}
