//! The inverse of a radius that grows from the centre to the domain's end.

use super::limit::END_ROUNDING;
use crate::numeric::bracketed_newton;

/// Pieces of the table. 256 cubic pieces start Newton's method at about 1e-10
/// for ordinary lenses, so one step reaches rounding; 10 KiB stay in the first
/// cache.
const PIECES: usize = 256;

/// What a start from the table, or a Newton step, may leave: a tenth of an ulp.
pub(super) const NEWTON_TOLERANCE: f64 = 1e-17;

/// A piece of the table: the coefficients of a cubic in the way through it, 0
/// to 1, and the largest |f''| times image radius over it and its neighbours,
/// for the estimate of what a Newton step leaves.
type TablePiece = [f64; 5];

/// The inverse of `image = f(x)`, `f(0) = 0`, `f' > 0` inside `[0, end]`, `f`
/// odd.
///
/// The *stretch* `g = x / image` is an even function of the image radius, so a
/// table in `image^2` needs no root and no quotient to find it. The table is
/// cubic over `s`, about `sqrt(1 - image^2 / f(end)^2)`: at a fold `x` behaves
/// like a square root of the distance to `f(end)`; in `s` it is smooth there, so
/// the table serves the whole domain.
#[derive(Debug, Clone)]
pub(super) struct RadialInverse {
    end: f64,
    end_image: f64,
    spread: TableSpacing,
    pieces: Box<[TablePiece; PIECES]>,
}

/// How the table is laid over the square of the image radius: `s^2` is 1 at the
/// centre and 0 at the end.
#[derive(Debug, Clone, Copy)]
struct TableSpacing {
    end: f64,
    per_end: f64,
    /// Square up to which the pieces are fine; zero for even pieces.
    knee: f64,
}

impl TableSpacing {
    /// A model that runs off to large radii (a pincushion, or coefficients
    /// beyond their fit) spends its pieces on the inner part: `s^2 =
    /// knee (end - square) / (end (knee + square))` instead of `1 - square / end`.
    fn new(end_image: f64, knee_image: f64) -> Self {
        let knee = if end_image > 3.0 * knee_image && knee_image > 0.0 { knee_image } else { 0.0 };
        let end = end_image * end_image;
        Self { end, per_end: 1.0 / end, knee: knee * knee }
    }

    /// `s^2` for the square of an image radius.
    #[inline(always)]
    fn at(&self, square: f64) -> f64 {
        let even = (self.end - square) * self.per_end;
        if self.knee == 0.0 { even } else { even * self.knee / (self.knee + square) }
    }

    /// Derivative of [`TableSpacing::at`].
    fn slope(&self, square: f64) -> f64 {
        if self.knee == 0.0 {
            return -self.per_end;
        }
        let inverse = 1.0 / (self.knee + square);
        -self.knee * self.per_end * inverse * inverse * (self.knee + self.end)
    }

    /// The square of the image radius for a value of `s^2`.
    fn square(&self, at: f64) -> f64 {
        if self.knee == 0.0 {
            return self.end * (1.0 - at);
        }
        self.end * (self.knee * (1.0 - at) / (self.knee + at * self.end))
    }
}

impl RadialInverse {
    /// `f` returns the image radius and its derivative. `None` when the radius
    /// does not grow over `[0, end]`.
    pub fn new(f: impl Fn(f64) -> (f64, f64), end: f64) -> Option<Self> {
        let (end_image, _) = f(end);
        if !(end > 0.0 && end.is_finite() && end_image > 0.0 && end_image.is_finite()) {
            return None;
        }
        let spread = TableSpacing::new(end_image, f((0.5 * end).min(1.0)).0);
        let step = 1.0 / PIECES as f64;
        // Argument, stretch and its derivative by s times the step.
        let mut nodes = Vec::with_capacity(PIECES + 1);
        nodes.push([end, end / end_image, 0.0]);
        let stretch_by_square = |x: f64| {
            let (image, slope) = f(x);
            (1.0 / slope - x / image) / (2.0 * image * image)
        };
        for i in 1..PIECES {
            let s = i as f64 * step;
            let square = spread.square(s * s);
            let image = square.sqrt();
            let x = invert(&f, end, image, nodes[i - 1][0])?.0;
            let by_s = stretch_by_square(x) * 2.0 * s / spread.slope(square);
            nodes.push([x, x / image, by_s * step]);
        }
        // On the axis itself the derivative is 0/0: take it from a little beside.
        let beside = stretch_by_square(1e-3 * end);
        nodes.push([0.0, 1.0 / f(0.0).1, beside * 2.0 / spread.slope(0.0) * step]);
        // So it is at s = 0 for a fold: take it from the neighbours.
        nodes[0][2] = -1.5 * nodes[0][1] + 2.0 * nodes[1][1] - 0.5 * nodes[2][1];
        let curvature_of = |pair: &[[f64; 3]]| {
            let (low, high) = (pair[1][0], pair[0][0]);
            let slopes: Vec<f64> = (0..=8).map(|k| f(low + (high - low) * f64::from(k) / 8.0).1).collect();
            let rise = slopes.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
            rise * 8.0 / (high - low)
        };
        let curvatures: Vec<f64> = nodes.windows(2).map(curvature_of).collect();
        let mut pieces = Box::new([[0.0; 5]; PIECES]);
        for (i, (piece, pair)) in pieces.iter_mut().zip(nodes.windows(2)).enumerate() {
            let ([_, g0, d0], [_, g1, d1]) = (pair[0], pair[1]);
            let rise = g1 - g0;
            let near = &curvatures[i.saturating_sub(1)..(i + 2).min(PIECES)];
            let curvature = near.iter().copied().fold(0.0, f64::max);
            *piece = [g0, d0, 3.0 * rise - 2.0 * d0 - d1, d0 + d1 - 2.0 * rise, curvature];
        }
        let finite = pieces.iter().flatten().all(|v| v.is_finite());
        finite.then_some(Self { end, end_image, spread, pieces })
    }

    /// `f(end)`.
    pub fn end_image(&self) -> f64 {
        self.end_image
    }

    /// First guesses of the stretch for squares of image radii, and the curvatures
    /// around. Squares past the end start at the end.
    #[inline(always)]
    pub fn starts<const N: usize>(&self, squares: &[f64; N]) -> ([f64; N], [f64; N]) {
        let mut way = [0.0; N];
        for l in 0..N {
            way[l] = self.spread.at(squares[l]).max(0.0).sqrt() * PIECES as f64;
        }
        let mut pieces = [[0.0; N]; 5];
        for l in 0..N {
            let i = (way[l] as u32).min(PIECES as u32 - 1);
            way[l] -= f64::from(i);
            let piece = &self.pieces[i as usize];
            for k in 0..5 {
                pieces[k][l] = piece[k];
            }
        }
        let [c0, c1, c2, c3, curvatures] = pieces;
        let mut stretches = [0.0; N];
        for l in 0..N {
            let t = way[l];
            stretches[l] = c0[l] + t * (c1[l] + t * (c2[l] + t * c3[l]));
        }
        (stretches, curvatures)
    }

    /// The stretches of image radii, given by their squares; `factor` returns
    /// `f(x) / x` and `f'(x)` for the square of `x`. One Newton step from the
    /// table; where that may not be enough, or the radius is past the end,
    /// `false` stands beside it and [`Self::solve`] has to do the work.
    #[inline(always)]
    pub fn stretches<const N: usize>(
        &self,
        squares: &[f64; N],
        factor: impl Fn(f64) -> (f64, f64),
    ) -> ([f64; N], [bool; N]) {
        let (mut stretches, curvatures) = self.starts(squares);
        let mut converged = [false; N];
        for l in 0..N {
            let g = stretches[l];
            let (level, slope) = factor(g * g * squares[l]);
            let step = (g * level - 1.0) / slope;
            let next = g - step;
            // Newton's next error in x is f'' dx^2 / (2 f'), and dx is the step
            // times the image radius; squared, since only its square is known.
            let (left, room) = (step * step * curvatures[l], NEWTON_TOLERANCE * slope * next);
            converged[l] = (left * left * squares[l] <= room * room)
                & (squares[l] <= self.spread.end)
                & (slope > 0.0)
                & (next > 0.0);
            stretches[l] = next;
        }
        (stretches, converged)
    }

    /// The `x` in `[0, end]` with `f(x) = image`, in a bracket, and the evaluations
    /// of `f` that it took; `f` as in [`Self::new`]. An image past the end by no
    /// more than rounding and `slack` belongs to the end. `None` past that.
    pub fn solve(&self, image: f64, slack: f64, f: impl Fn(f64) -> (f64, f64)) -> Option<(f64, u32)> {
        if image > self.end_image {
            let rounding = self.end_image * END_ROUNDING + slack;
            return (image - self.end_image <= rounding).then_some((self.end, 0));
        }
        let ([stretch], _) = self.starts(&[image * image]);
        invert(&f, self.end, image, stretch * image)
    }
}

/// The root of `f(x) = image` in `[0, end]`, in a bracket.
fn invert(f: impl Fn(f64) -> (f64, f64), end: f64, image: f64, start: f64) -> Option<(f64, u32)> {
    let shifted = |x: f64| {
        let (value, slope) = f(x);
        (value - image, slope)
    };
    bracketed_newton(shifted, 0.0, end, start).ok().map(|root| (root.value, root.iterations))
}
