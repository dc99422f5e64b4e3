//! Gauss's rule for integrals over an interval.

/// A rule on [0, 1]: `(place, weight)`, places ascending, weights adding up to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct GaussRule {
    nodes: Vec<(f64, f64)>,
}

impl GaussRule {
    /// Gauss and Legendre's rule with `count` places: exact for polynomials of degree `2 count - 1`.
    ///
    /// The places are the roots of the Legendre polynomial, by Newton's method from Tricomi's estimate
    /// `cos(pi (i + 3/4) / (n + 1/2))`, which is close enough for quadratic convergence at every degree.
    pub fn new(count: usize) -> Self {
        let n = count.max(1);
        let nodes = (0..n).map(|i| {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            // Three steps reach rounding from an estimate good to 1/n^2; the rest is reserve.
            for _ in 0..6 {
                let (value, by_x) = legendre(n, x);
                slope = by_x;
                x -= value / slope;
            }
            (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
        });
        Self { nodes: nodes.collect() }
    }

    /// Places and weights on [0, 1].
    pub fn nodes(&self) -> &[(f64, f64)] {
        &self.nodes
    }

    /// Places and weights on `[low, high]`.
    pub fn over(&self, low: f64, high: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.nodes.iter().map(move |&(x, w)| (low + (high - low) * x, w * (high - low)))
    }
}

/// Legendre's polynomial of degree `n` and its derivative inside (-1, 1).
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut here) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (before, here) = (here, ((2.0 * k - 1.0) * x * here - (k - 1.0) * before) / k);
    }
    (here, n as f64 * (x * here - before) / (x * x - 1.0))
}
