//! The formula of Brown-Conrady, its Jacobian, and where it folds; see
//! [`super::brown_conrady`].

use glam::DVec2;

use crate::numeric::Polynomial;

/// Relative distance that the domain keeps from a pole of the rational form.
pub(super) const POLE_MARGIN: f64 = 1e-9;

/// `L`, and its derivative by `u`.
#[inline(always)]
pub(super) fn factor_of<const RATIONAL: bool>(n: &[f64; 3], d: &[f64; 3], u: f64) -> (f64, f64) {
    let top = 1.0 + u * (n[0] + u * (n[1] + u * n[2]));
    let top_slope = n[0] + u * (2.0 * n[1] + u * (3.0 * n[2]));
    if !RATIONAL {
        return (top, top_slope);
    }
    let inverse = 1.0 / (1.0 + u * (d[0] + u * (d[1] + u * d[2])));
    let bottom_slope = d[0] + u * (2.0 * d[1] + u * (3.0 * d[2]));
    let value = top * inverse;
    (value, (top_slope - value * bottom_slope) * inverse)
}

/// [`factor_of`] for any denominator.
#[inline]
pub(super) fn factor(n: &[f64; 3], d: &[f64; 3], u: f64) -> (f64, f64) {
    if *d == [0.0; 3] { factor_of::<false>(n, d, u) } else { factor_of::<true>(n, d, u) }
}

/// `rho = r L` and its derivative by `r`.
#[inline]
pub(super) fn radius(n: &[f64; 3], d: &[f64; 3], r: f64) -> (f64, f64) {
    let u = r * r;
    let (value, slope) = factor(n, d, u);
    (r * value, value + 2.0 * u * slope)
}

/// `f`.
#[inline(always)]
pub(super) fn image_of<const RATIONAL: bool>(n: &[f64; 3], d: &[f64; 3], q: DVec2, x: DVec2) -> DVec2 {
    let u = x.length_squared();
    let (l, _) = factor_of::<RATIONAL>(n, d, u);
    x * (l + 2.0 * q.dot(x)) + q * u
}

/// `f` and its Jacobian.
#[inline(always)]
pub(super) fn image_with_slope<const RATIONAL: bool>(
    n: &[f64; 3],
    d: &[f64; 3],
    q: DVec2,
    x: DVec2,
) -> (DVec2, Symmetric) {
    let u = x.length_squared();
    let (l, slope) = factor_of::<RATIONAL>(n, d, u);
    let on_axis = l + 2.0 * q.dot(x);
    let s = 2.0 * slope;
    let xx = on_axis + s * x.x * x.x + 4.0 * q.x * x.x;
    let xy = s * x.x * x.y + 2.0 * (q.x * x.y + q.y * x.x);
    let yy = on_axis + s * x.y * x.y + 4.0 * q.y * x.y;
    (x * on_axis + q * u, Symmetric { xx, xy, yy })
}

/// A symmetric matrix.
#[derive(Clone, Copy)]
pub(super) struct Symmetric {
    pub xx: f64,
    pub xy: f64,
    pub yy: f64,
}

impl Symmetric {
    #[inline(always)]
    pub fn trace(self) -> f64 {
        self.xx + self.yy
    }

    #[inline(always)]
    pub fn determinant(self) -> f64 {
        self.xx * self.yy - self.xy * self.xy
    }

    #[inline(always)]
    pub fn times(self, v: DVec2) -> DVec2 {
        DVec2::new(self.xx * v.x + self.xy * v.y, self.xy * v.x + self.yy * v.y)
    }

    #[inline(always)]
    pub fn inverse(self) -> Self {
        let scale = 1.0 / self.determinant();
        Self { xx: self.yy * scale, xy: -self.xy * scale, yy: self.xx * scale }
    }
}

/// Radius on the plane `z = 1` at which the domain of the formula ends, searched
/// up to `last`; the outer `None` says that the polynomials overflow.
pub(super) fn first_fold(n: &[f64; 3], d: &[f64; 3], q: f64, last: f64) -> Option<Option<f64>> {
    let top = Polynomial::new(&[1.0, n[0], n[1], n[2]]);
    let bottom = Polynomial::new(&[1.0, d[0], d[1], d[2]]);
    // rho' = F / D^2 with F = (N + 2u N') D - 2u N D'.
    let f = top
        .plus(2.0, &top.derivative().shifted())
        .times(&bottom)
        .plus(-2.0, &top.times(&bottom.derivative()).shifted());
    let mut end: Option<f64> = None;
    let mut meet = |root: Option<f64>| {
        if let Some(root) = root {
            end = Some(end.map_or(root, |end| end.min(root)));
        }
        end.unwrap_or(last)
    };
    meet(f.first_root_after(0.0, last * last).map(f64::sqrt));
    let pole = bottom.first_root_after(0.0, last * last);
    let mut reach = meet(pole.map(|u| u.sqrt() * (1.0 - POLE_MARGIN)));
    let mut finite = f.is_finite();
    if q > 0.0 {
        let (f, top, bottom) = (f.of_square(), top.of_square(), bottom.of_square());
        let square = bottom.times(&bottom);
        // Opposite to q: rho' = 6 q r, or L = 2 q r.
        let radial = f.plus(-6.0 * q, &square.shifted());
        let around = top.plus(-2.0 * q, &bottom.shifted());
        for p in [&radial, &around] {
            finite &= p.is_finite();
            reach = meet(p.first_root_after(0.0, reach));
        }
        // At an azimuth between, cos = -(rho' + 3L) / (16 q r): the determinant
        // is zero where (rho' - L)(9L - rho') = 64 q^2 r^2.
        let l = top.times(&bottom);
        let between = f
            .plus(-1.0, &l)
            .times(&l.plus(8.0, &l).plus(-1.0, &f))
            .plus(-64.0 * q * q, &square.times(&square).shifted().shifted());
        finite &= between.is_finite();
        let inside = |&r: &f64| {
            let (rho, slope) = radius(n, d, r);
            r > 0.0 && slope + 3.0 * rho / r < 16.0 * q * r
        };
        let root = between.roots_in(0.0, reach).into_iter().find(inside);
        meet(root);
    }
    finite.then_some(end)
}
