//! Numbers that carry their derivatives, so that every stiffness is the exact derivative of its force.

use std::ops::{Add, Mul, Neg, Sub};

use nalgebra::Matrix6;

/// A value with its first and second derivative by one variable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Jet {
    /// The value.
    pub v: f64,
    /// First derivative.
    pub d: f64,
    /// Second derivative.
    pub dd: f64,
}

impl Jet {
    pub fn constant(v: f64) -> Self {
        Self { v, d: 0.0, dd: 0.0 }
    }

    pub fn variable(v: f64) -> Self {
        Self { v, d: 1.0, dd: 0.0 }
    }

    /// A function of this value, from its value and two derivatives there.
    pub fn chain(self, f: f64, df: f64, ddf: f64) -> Self {
        Self { v: f, d: df * self.d, dd: ddf * self.d * self.d + df * self.dd }
    }

    pub fn recip(self) -> Self {
        let r = 1.0 / self.v;
        self.chain(r, -r * r, 2.0 * r * r * r)
    }

    /// The k-th of Stumpff's functions of this value, k up to 3; `c` are those of its value.
    pub fn stumpff(self, k: usize, c: &Stumpff) -> Self {
        self.chain(c.value(k), c.slope(k), c.bend(k))
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { v: self.v + o.v, d: self.d + o.d, dd: self.dd + o.dd }
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { v: self.v - o.v, d: self.d - o.d, dd: self.dd - o.dd }
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self {
            v: self.v * o.v,
            d: self.d * o.v + self.v * o.d,
            dd: self.dd * o.v + 2.0 * self.d * o.d + self.v * o.dd,
        }
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, k: f64) -> Self {
        Self { v: self.v * k, d: self.d * k, dd: self.dd * k }
    }
}

/// Stumpff's entire functions at one place: `c_k(z) = sum_j (-z)^j / (2 j + k)!`, k from 0 to 7.
///
/// With `z = x^2`: c_0 = cos x, c_1 = sin x / x, c_2 = (1 - cos x) / x^2, c_3 = (x - sin x) / x^3;
/// for negative z the hyperbolic ones. They have no removable singularity at zero. The last two are summed, the
/// others follow by `c_k = 1/k! - z c_(k+2)`; both lose about `e^sqrt|z|` of relative precision, so callers keep
/// |z| below some tens.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stumpff([f64; 8]);

impl Stumpff {
    pub fn at(z: f64) -> Self {
        const ONE_BY_FACTORIAL: [f64; 8] =
            [1.0, 1.0, 0.5, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 720.0, 1.0 / 5040.0];
        let mut c = ONE_BY_FACTORIAL;
        for k in [6_u32, 7] {
            let mut term = ONE_BY_FACTORIAL[k as usize];
            let mut sum = term;
            // 40 terms reach 80!, far below rounding for every |z| that is let in (see `Column`).
            for j in 1..=40_u32 {
                let n = f64::from(2 * j + k);
                term *= -z / (n * (n - 1.0));
                sum += term;
                if term.abs() <= 1e-18 * sum.abs() {
                    break;
                }
            }
            c[k as usize] = sum;
        }
        for k in (0..6).rev() {
            c[k] = ONE_BY_FACTORIAL[k] - z * c[k + 2];
        }
        Self(c)
    }

    /// c_k.
    pub fn value(&self, k: usize) -> f64 {
        self.0[k]
    }

    /// Derivative of c_k by z, k up to 5: `(k c_(k+2) - c_(k+1)) / 2`.
    pub fn slope(&self, k: usize) -> f64 {
        0.5 * (k as f64 * self.0[k + 2] - self.0[k + 1])
    }

    /// Second derivative of c_k by z, k up to 3.
    pub fn bend(&self, k: usize) -> f64 {
        0.5 * (k as f64 * self.slope(k + 2) - self.slope(k + 1))
    }
}

/// A value with its gradient by the six coordinates of a displacement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Dual {
    pub v: f64,
    pub d: [f64; 6],
}

impl Dual {
    pub fn constant(v: f64) -> Self {
        Self { v, d: [0.0; 6] }
    }

    pub fn variable(v: f64, index: usize) -> Self {
        let mut d = [0.0; 6];
        d[index] = 1.0;
        Self { v, d }
    }

    /// A function of this value, from its value and slope there.
    pub fn chain(self, f: f64, slope: f64) -> Self {
        Self { v: f, d: self.d.map(|d| slope * d) }
    }

    pub fn recip(self) -> Self {
        let r = 1.0 / self.v;
        self.chain(r, -r * r)
    }

    /// The k-th of Stumpff's functions of this value, k up to 5; `c` are those of its value.
    pub fn stumpff(self, k: usize, c: &Stumpff) -> Self {
        self.chain(c.value(k), c.slope(k))
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { v: self.v + o.v, d: std::array::from_fn(|i| self.d[i] + o.d[i]) }
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { v: self.v - o.v, d: std::array::from_fn(|i| self.d[i] - o.d[i]) }
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        self.chain(-self.v, -1.0)
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        let (left, right) = (self.chain(self.v * o.v, o.v), o.chain(0.0, self.v));
        left + right
    }
}

impl Mul<f64> for Dual {
    type Output = Self;
    fn mul(self, k: f64) -> Self {
        self.chain(self.v * k, k)
    }
}

/// A vector of [`Dual`]s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct DualVec(pub [Dual; 3]);

impl DualVec {
    pub fn constant(v: glam::DVec3) -> Self {
        Self([Dual::constant(v.x), Dual::constant(v.y), Dual::constant(v.z)])
    }

    pub fn cross(self, o: Self) -> Self {
        let ([ax, ay, az], [bx, by, bz]) = (self.0, o.0);
        Self([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
    }

    pub fn scaled(self, k: Dual) -> Self {
        Self(self.0.map(|v| v * k))
    }

    pub fn value(self) -> glam::DVec3 {
        glam::DVec3::new(self.0[0].v, self.0[1].v, self.0[2].v)
    }
}

/// A rotation vector with what its rotation and its gradients need, computed once for all springs.
pub(super) struct Turn {
    vector: DualVec,
    /// sin a / a and (1 - cos a) / a^2.
    once: Dual,
    twice: Dual,
    /// (1 - (a/2) cot(a/2)) / a^2, written without a singularity at zero.
    back: Dual,
}

impl Turn {
    pub fn new(vector: DualVec) -> Self {
        let [x, y, z] = vector.0;
        let square = x * x + y * y + z * z;
        let c = Stumpff::at(square.v);
        let twice = square.stumpff(2, &c);
        let back = (square.stumpff(3, &c) - square.stumpff(4, &c) * 2.0) * (twice * 2.0).recip();
        Self { vector, once: square.stumpff(1, &c), twice, back }
    }

    /// The rotation applied to a vector.
    pub fn rotate(&self, v: DualVec) -> DualVec {
        let once = self.vector.cross(v);
        let twice = self.vector.cross(once);
        v + once.scaled(self.once) + twice.scaled(self.twice)
    }

    /// Turns a gradient by the rotation vector into the moment that does the same work: `J_l^-T g`, with `J_l`
    /// the left Jacobian of the rotation group.
    pub fn moment_of_gradient(&self, gradient: DualVec) -> DualVec {
        let once = self.vector.cross(gradient);
        let twice = self.vector.cross(once);
        gradient + once.scaled(Dual::constant(0.5)) + twice.scaled(self.back)
    }
}

impl Add for DualVec {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + o.0[i]))
    }
}

impl Sub for DualVec {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] - o.0[i]))
    }
}

/// The derivative matrix of two stacked vectors: row i is the gradient of the i-th component.
pub(super) fn jacobian(upper: DualVec, lower: DualVec) -> Matrix6<f64> {
    Matrix6::from_fn(|row, col| if row < 3 { upper.0[row].d[col] } else { lower.0[row - 3].d[col] })
}
