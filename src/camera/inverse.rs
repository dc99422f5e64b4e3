//! The inverse of a radius that grows from the centre to the domain's end.

use crate::numeric::bracketed_newton;

/// Pieces of the table. 256 cubic pieces start Newton's method at about 1e-10
/// for ordinary lenses, so one step reaches rounding; 4 KiB stay in the first
/// cache.
const PIECES: usize = 256;

/// Newton steps from the table before the bracketed solve takes over.
const QUICK_STEPS: u32 = 6;

/// The inverse of `image = f(x)`, `f(0) = 0`, `f' > 0` inside `[0, end]`.
///
/// A cubic table over `s = sqrt(1 - image / f(end))` gives the start. At a
/// fold `x` behaves like a square root of the distance to `f(end)`; in `s` it
/// is smooth there, so the table serves the whole domain.
#[derive(Debug, Clone)]
pub(super) struct RadialInverse {
    end: f64,
    end_image: f64,
    /// Largest |f''| on a fine grid, for the estimate of Newton's error.
    bend: f64,
    /// Value and (slope times step) at each node.
    nodes: Vec<[f64; 2]>,
}

impl RadialInverse {
    /// `f` returns the image radius and its derivative. `None` when the radius
    /// does not grow over `[0, end]`.
    pub fn new(f: impl Fn(f64) -> (f64, f64), end: f64) -> Option<Self> {
        let (end_image, _) = f(end);
        if !(end > 0.0 && end.is_finite() && end_image > 0.0 && end_image.is_finite()) {
            return None;
        }
        let step = 1.0 / PIECES as f64;
        let mut nodes = Vec::with_capacity(PIECES + 1);
        nodes.push([end, 0.0]);
        for i in 1..PIECES {
            let s = i as f64 * step;
            let image = end_image * (1.0 - s * s);
            let start = nodes[i - 1][0];
            let x = bracketed_newton(
                |x| {
                    let (value, slope) = f(x);
                    (value - image, slope)
                },
                0.0,
                end,
                start,
            )
            .ok()?
            .value;
            let slope = -2.0 * s * end_image / f(x).1;
            nodes.push([x, slope * step]);
        }
        nodes.push([0.0, -2.0 * end_image / f(0.0).1 * step]);
        // At s = 0 the slope is 0/0 for a fold: take it from the neighbours.
        nodes[0][1] = -1.5 * nodes[0][0] + 2.0 * nodes[1][0] - 0.5 * nodes[2][0];
        let mut bend: f64 = 0.0;
        let grid = 4 * PIECES;
        let mut before = f(0.0).1;
        for i in 1..=grid {
            let slope = f(end * i as f64 / grid as f64).1;
            bend = bend.max((slope - before).abs() * grid as f64 / end);
            before = slope;
        }
        (bend.is_finite() && nodes.iter().flatten().all(|v| v.is_finite())).then_some(Self {
            end,
            end_image,
            bend,
            nodes,
        })
    }

    /// `f(end)`.
    pub fn end_image(&self) -> f64 {
        self.end_image
    }

    /// A first guess for `image` in `[0, f(end)]`.
    pub fn start(&self, image: f64) -> f64 {
        let s = (1.0 - image / self.end_image).max(0.0).sqrt() * PIECES as f64;
        let i = (s as usize).min(PIECES - 1);
        let t = s - i as f64;
        let [x0, d0] = self.nodes[i];
        let [x1, d1] = self.nodes[i + 1];
        let rise = x1 - x0;
        let c2 = 3.0 * rise - 2.0 * d0 - d1;
        let c3 = d0 + d1 - 2.0 * rise;
        x0 + t * (d0 + t * (c2 + t * c3))
    }

    /// The `x` in `[0, end]` with `f(x) = image`; `f` as in [`Self::new`].
    /// `None` past the end. Bounded by `QUICK_STEPS` Newton steps plus
    /// [`crate::numeric::MAX_ITERATIONS`] in a bracket.
    pub fn solve(&self, image: f64, f: impl Fn(f64) -> (f64, f64)) -> Option<f64> {
        if image > self.end_image {
            let rounding = self.end_image * super::limit::END_ROUNDING;
            return (image - self.end_image <= rounding).then_some(self.end);
        }
        let mut x = self.start(image);
        for _ in 0..QUICK_STEPS {
            let (value, slope) = f(x);
            let step = (value - image) / slope;
            x -= step;
            if !(x >= 0.0 && x <= self.end) {
                break;
            }
            // Newton's next error is f'' step^2 / (2 f').
            if step * step * self.bend <= 1e-17 * slope * x {
                return Some(x);
            }
        }
        let shifted = |x: f64| {
            let (value, slope) = f(x);
            (value - image, slope)
        };
        bracketed_newton(shifted, 0.0, self.end, self.start(image)).ok().map(|root| root.value)
    }
}
