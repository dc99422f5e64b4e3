//! Double-double arithmetic: an unevaluated sum of two doubles, about 31 digits.
//!
//! The algorithms are Dekker's and Knuth's (T. J. Dekker, "A floating-point
//! technique for extending the available precision", 1971), with the product's
//! error from a fused multiply-add. Only what the reference needs is here.

use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dd {
    pub hi: f64,
    pub lo: f64,
}

fn two_sum(a: f64, b: f64) -> Dd {
    let hi = a + b;
    let v = hi - a;
    Dd { hi, lo: (a - (hi - v)) + (b - v) }
}

fn quick_two_sum(a: f64, b: f64) -> Dd {
    let hi = a + b;
    Dd { hi, lo: b - (hi - a) }
}

pub fn dd(x: f64) -> Dd {
    Dd { hi: x, lo: 0.0 }
}

impl Add for Dd {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        let s = two_sum(self.hi, o.hi);
        let t = two_sum(self.lo, o.lo);
        let s = quick_two_sum(s.hi, s.lo + t.hi);
        quick_two_sum(s.hi, s.lo + t.lo)
    }
}

impl Neg for Dd {
    type Output = Self;
    fn neg(self) -> Self {
        Dd { hi: -self.hi, lo: -self.lo }
    }
}

impl Sub for Dd {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul for Dd {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        let p = self.hi * o.hi;
        let e = self.hi.mul_add(o.hi, -p);
        quick_two_sum(p, e + (self.hi * o.lo + self.lo * o.hi))
    }
}

impl Div for Dd {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let q1 = self.hi / o.hi;
        let r = self - o * dd(q1);
        let q2 = r.hi / o.hi;
        let r = r - o * dd(q2);
        quick_two_sum(q1, q2) + dd(r.hi / o.hi)
    }
}

impl PartialOrd for Dd {
    fn partial_cmp(&self, o: &Self) -> Option<Ordering> {
        match self.hi.partial_cmp(&o.hi) {
            Some(Ordering::Equal) => self.lo.partial_cmp(&o.lo),
            other => other,
        }
    }
}

impl Dd {
    pub fn f64(self) -> f64 {
        self.hi + self.lo
    }

    pub fn sqrt(self) -> Self {
        if self.hi <= 0.0 {
            return dd(0.0);
        }
        let x = dd(self.hi.sqrt());
        // One Newton step doubles the digits; a second one settles the last.
        let x = (x + self / x) * dd(0.5);
        (x + self / x) * dd(0.5)
    }

    /// Sine and cosine of an angle of a few radians: a Taylor series of an
    /// eighth of it, and three doublings.
    pub fn sin_cos(self) -> (Self, Self) {
        let x = self * dd(0.125);
        let square = x * x;
        let (mut sin, mut cos) = (dd(0.0), dd(0.0));
        for k in (0..=12).rev() {
            let k = f64::from(k);
            // sin: 1 - x^2/((2k+2)(2k+3)) (...), cos: 1 - x^2/((2k+1)(2k+2)) (...).
            sin = dd(1.0) - square * sin_or(k, sin, (2.0 * k + 2.0) * (2.0 * k + 3.0));
            cos = dd(1.0) - square * sin_or(k, cos, (2.0 * k + 1.0) * (2.0 * k + 2.0));
        }
        let mut s = x * sin;
        let mut c = cos;
        for _ in 0..3 {
            (s, c) = (dd(2.0) * s * c, (c - s) * (c + s));
        }
        (s, c)
    }

    /// The angle of a vector, by one Newton step from the double's angle.
    pub fn atan2(y: Self, x: Self) -> Self {
        let start = y.hi.atan2(x.hi);
        let (sin, cos) = dd(start).sin_cos();
        let length = (x * x + y * y).sqrt();
        // sin(angle - start), itself its arc to 1e-48.
        dd(start) + (y * cos - x * sin) / length
    }
}

/// The next inner term of a series; the innermost is 1.
fn sin_or(k: f64, inner: Dd, divisor: f64) -> Dd {
    let inner = if k == 12.0 { dd(1.0) } else { inner };
    inner / dd(divisor)
}

#[test]
fn known_digits() {
    let two = dd(2.0).sqrt();
    // sqrt(2) = 1.41421356237309504880168872420969807...: hi is 2^.5 in doubles.
    assert_eq!(two.hi, 2f64.sqrt());
    assert!((two.lo - -9.667_293_313_452_913e-17).abs() < 1e-31);
    assert!((two * two - dd(2.0)).f64().abs() < 1e-31);
    let third = dd(1.0) / dd(3.0);
    assert!((third * dd(3.0) - dd(1.0)).f64().abs() < 1e-31);
    // sin(1) = 0.84147098480789650665250232163029899962...
    let (sin, cos) = dd(1.0).sin_cos();
    assert_eq!(sin.hi, 0.841_470_984_807_896_5);
    assert!((sin.lo - 1.776_845_092_935_536e-18).abs() < 1e-30, "{:e}", sin.lo);
    assert!((sin * sin + cos * cos - dd(1.0)).f64().abs() < 1e-30);
    for angle in [1e-12, 0.1, 1.3, 2.0, 3.1] {
        let (sin, cos) = dd(angle).sin_cos();
        assert!((Dd::atan2(sin, cos) - dd(angle)).f64().abs() < 1e-30);
    }
}
