//! Real polynomials and their real roots in an interval.

use super::roots::bracketed_newton;

/// A polynomial with real coefficients, lowest power first.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial {
    coefficients: Vec<f64>,
}

impl Polynomial {
    /// From coefficients, lowest power first; zeros at the end are dropped.
    pub fn new(coefficients: &[f64]) -> Self {
        let mut coefficients = coefficients.to_vec();
        while coefficients.last() == Some(&0.0) {
            coefficients.pop();
        }
        Self { coefficients }
    }

    /// Coefficients, lowest power first.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Whether every coefficient is finite.
    pub fn is_finite(&self) -> bool {
        self.coefficients.iter().all(|c| c.is_finite())
    }

    /// The value at `x`, by Horner's rule.
    pub fn at(&self, x: f64) -> f64 {
        self.coefficients.iter().rev().fold(0.0, |s, c| s * x + c)
    }

    /// A bound on the rounding error of [`Polynomial::at`].
    ///
    /// Horner's rule errs by at most `2 n u sum |c_i x^i|` (N. J. Higham,
    /// *Accuracy and Stability of Numerical Algorithms*, section 5.1).
    pub fn rounding_at(&self, x: f64) -> f64 {
        let size = self.coefficients.iter().rev().fold(0.0, |s, c| s * x.abs() + c.abs());
        self.coefficients.len() as f64 * f64::EPSILON * size
    }

    /// The derivative.
    pub fn derivative(&self) -> Self {
        let coefficients: Vec<f64> =
            self.coefficients.iter().enumerate().skip(1).map(|(i, c)| i as f64 * c).collect();
        Self::new(&coefficients)
    }

    /// The product with another polynomial.
    pub fn times(&self, other: &Self) -> Self {
        if self.coefficients.is_empty() || other.coefficients.is_empty() {
            return Self::new(&[]);
        }
        let mut product = vec![0.0; self.coefficients.len() + other.coefficients.len() - 1];
        for (i, a) in self.coefficients.iter().enumerate() {
            for (j, b) in other.coefficients.iter().enumerate() {
                product[i + j] += a * b;
            }
        }
        Self::new(&product)
    }

    /// `self + factor * other`.
    pub fn plus(&self, factor: f64, other: &Self) -> Self {
        let len = self.coefficients.len().max(other.coefficients.len());
        let at = |p: &Self, i: usize| p.coefficients.get(i).copied().unwrap_or(0.0);
        let sum: Vec<f64> = (0..len).map(|i| at(self, i) + factor * at(other, i)).collect();
        Self::new(&sum)
    }

    /// `x * self`.
    pub fn shifted(&self) -> Self {
        let mut coefficients = vec![0.0];
        coefficients.extend_from_slice(&self.coefficients);
        Self::new(&coefficients)
    }

    /// `self(x^2)`.
    pub fn of_square(&self) -> Self {
        let mut coefficients = vec![0.0; (2 * self.coefficients.len()).max(1) - 1];
        for (i, c) in self.coefficients.iter().enumerate() {
            coefficients[2 * i] = *c;
        }
        Self::new(&coefficients)
    }

    /// All real roots in `[low, high]`, rising, each once.
    ///
    /// Between neighbouring roots of the derivative the polynomial is monotone,
    /// so one bracketed solve per gap finds every root, whatever the degree. A
    /// place where it touches zero to within its own rounding counts as a root.
    /// Polynomials with coefficients that are not finite have no roots here:
    /// ask [`Polynomial::is_finite`] first. The zero polynomial has none either.
    pub fn roots_in(&self, low: f64, high: f64) -> Vec<f64> {
        if self.coefficients.len() < 2 || !self.is_finite() || low.is_nan() || high.is_nan() || low > high {
            return Vec::new();
        }
        let slope = self.derivative();
        let mut ends = vec![low];
        ends.extend(slope.roots_in(low, high));
        ends.push(high);
        let mut roots: Vec<f64> = Vec::new();
        for (i, &end) in ends.iter().enumerate() {
            if i > 0 {
                let start = ends[i - 1];
                if let Ok(root) =
                    bracketed_newton(|x| (self.at(x), slope.at(x)), start, end, 0.5 * start + 0.5 * end)
                {
                    roots.push(root.value);
                }
            }
            if self.at(end).abs() <= self.rounding_at(end) {
                roots.push(end);
            }
        }
        roots.sort_by(f64::total_cmp);
        roots.dedup();
        roots
    }

    /// The smallest root in `(low, high]`, if there is one.
    pub fn first_root_after(&self, low: f64, high: f64) -> Option<f64> {
        self.roots_in(low, high).into_iter().find(|&root| root > low)
    }
}
