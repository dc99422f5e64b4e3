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
/// A cubic table over `s`, about `sqrt(1 - image / f(end))`, gives the start. At a
/// fold `x` behaves like a square root of the distance to `f(end)`; in `s` it
/// is smooth there, so the table serves the whole domain.
#[derive(Debug, Clone)]
pub(super) struct RadialInverse {
    end: f64,
    end_image: f64,
    spread: Spread,
    /// Each piece as a cubic in the way through it, 0 to 1.
    pieces: Vec<[f64; 4]>,
    /// Largest |f''| over each piece and its neighbours, for the estimate of
    /// what a Newton step leaves.
    bends: Vec<f64>,
}

/// How the table is laid over the image radius: `s^2` is 1 at the centre and 0
/// at the end.
#[derive(Debug, Clone, Copy)]
struct Spread {
    end: f64,
    per_end: f64,
    /// Radius up to which the pieces are fine; zero for even pieces.
    knee: f64,
}

impl Spread {
    /// A model that runs off to large radii (a pincushion, or coefficients
    /// beyond their fit) spends its pieces on the inner part: `s^2 =
    /// knee (end - image) / (end (knee + image))` instead of `1 - image / end`.
    fn new(end: f64, knee: f64) -> Self {
        let knee = if end > 3.0 * knee && knee > 0.0 { knee } else { 0.0 };
        Self { end, per_end: 1.0 / end, knee }
    }

    /// `s^2` and its derivative by the image radius.
    #[inline]
    fn square(&self, image: f64) -> (f64, f64) {
        if self.knee == 0.0 {
            return (1.0 - image * self.per_end, -self.per_end);
        }
        let inverse = 1.0 / (self.knee + image);
        let scale = self.knee * self.per_end * inverse;
        ((self.end - image) * scale, -scale * inverse * (self.knee + self.end))
    }

    /// The image radius for a value of `s^2`.
    fn image(&self, square: f64) -> f64 {
        if self.knee == 0.0 {
            return self.end * (1.0 - square);
        }
        self.end * (self.knee * (1.0 - square) / (self.knee + square * self.end))
    }
}

/// A first guess.
pub(super) struct Start {
    /// The guess.
    pub x: f64,
    /// Its derivative by the image radius, infinite or far off only at the
    /// domain's very end.
    pub slope: f64,
    /// f'' there, roughly.
    pub bend_value: f64,
    /// Largest |f''| around.
    pub bend: f64,
}

impl RadialInverse {
    /// `f` returns the image radius and its derivative. `None` when the radius
    /// does not grow over `[0, end]`.
    pub fn new(f: impl Fn(f64) -> (f64, f64), end: f64) -> Option<Self> {
        let (end_image, _) = f(end);
        if !(end > 0.0 && end.is_finite() && end_image > 0.0 && end_image.is_finite()) {
            return None;
        }
        let spread = Spread::new(end_image, f((0.5 * end).min(1.0)).0);
        let step = 1.0 / PIECES as f64;
        let mut nodes = Vec::with_capacity(PIECES + 1);
        nodes.push([end, 0.0]);
        for i in 1..PIECES {
            let s = i as f64 * step;
            let image = spread.image(s * s);
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
            let slope = 2.0 * s / (spread.square(image).1 * f(x).1);
            nodes.push([x, slope * step]);
        }
        nodes.push([0.0, 2.0 / (spread.square(0.0).1 * f(0.0).1) * step]);
        // At s = 0 the slope is 0/0 for a fold: take it from the neighbours.
        nodes[0][1] = -1.5 * nodes[0][0] + 2.0 * nodes[1][0] - 0.5 * nodes[2][0];
        let pieces: Vec<[f64; 4]> = nodes
            .windows(2)
            .map(|pair| {
                let ([x0, d0], [x1, d1]) = (pair[0], pair[1]);
                let rise = x1 - x0;
                [x0, d0, 3.0 * rise - 2.0 * d0 - d1, d0 + d1 - 2.0 * rise]
            })
            .collect();
        let bend_of = |pair: &[[f64; 2]]| {
            let (low, high) = (pair[1][0], pair[0][0]);
            let slopes = (0..=8).map(|k| f(low + (high - low) * f64::from(k) / 8.0).1);
            let slopes: Vec<f64> = slopes.collect();
            let rise = slopes.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
            rise * 8.0 / (high - low)
        };
        let bends: Vec<f64> = nodes.windows(2).map(bend_of).collect();
        let near =
            |i: usize| bends[i.saturating_sub(1)..(i + 2).min(PIECES)].iter().copied().fold(0.0, f64::max);
        let bends: Vec<f64> = (0..PIECES).map(near).collect();
        let finite = pieces.iter().flatten().chain(&bends).all(|v| v.is_finite());
        finite.then_some(Self { end, end_image, spread, pieces, bends })
    }

    /// `f(end)`.
    pub fn end_image(&self) -> f64 {
        self.end_image
    }

    /// A first guess for `image` in `[0, f(end)]`.
    #[inline]
    pub fn start(&self, image: f64) -> Start {
        let (square, square_slope) = self.spread.square(image);
        let s = square.max(0.0).sqrt() * PIECES as f64;
        let i = (s as usize).min(PIECES - 1);
        let t = s - i as f64;
        let [x0, c1, c2, c3] = self.pieces[i];
        let by_s = c1 + t * (2.0 * c2 + t * (3.0 * c3));
        let by_s_twice = 2.0 * c2 + t * (6.0 * c3);
        // s^2 = PIECES^2 square, so s' = PIECES^2 square' / (2 s) and
        // s'' = -s'^2 / s + PIECES^2 square'' / (2 s); the last is zero or
        // small enough to leave out of a guess.
        let s_slope = (0.5 * (PIECES * PIECES) as f64) * square_slope / s;
        let slope = by_s * s_slope;
        let twice = s_slope * s_slope * (by_s_twice - by_s / s);
        Start {
            x: x0 + t * (c1 + t * (c2 + t * c3)),
            slope,
            // f'' of the inverse function: -x'' / x'^3.
            bend_value: -twice / (slope * slope * slope),
            bend: self.bends[i],
        }
    }

    /// The `x` in `[0, end]` with `f(x) = image`; `f` as in [`Self::new`].
    /// `None` past the end. Bounded by `QUICK_STEPS` Newton steps plus
    /// [`crate::numeric::MAX_ITERATIONS`] in a bracket.
    #[inline]
    pub fn solve(&self, image: f64, f: impl Fn(f64) -> (f64, f64)) -> Option<f64> {
        if image > self.end_image {
            let rounding = self.end_image * super::limit::END_ROUNDING;
            return (image - self.end_image <= rounding).then_some(self.end);
        }
        let Start { mut x, bend, .. } = self.start(image);
        for _ in 0..QUICK_STEPS {
            let (value, slope) = f(x);
            let step = (value - image) / slope;
            x -= step;
            if !(x >= 0.0 && x <= self.end) {
                break;
            }
            // Newton's next error is f'' step^2 / (2 f').
            if step * step * bend <= 1e-17 * slope * x {
                return Some(x);
            }
        }
        let shifted = |x: f64| {
            let (value, slope) = f(x);
            (value - image, slope)
        };
        bracketed_newton(shifted, 0.0, self.end, self.start(image).x).ok().map(|root| root.value)
    }
}
