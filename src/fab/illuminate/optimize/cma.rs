//! CMA-ES: a search without derivatives that learns the shape of what it searches.
//!
//! Points are drawn from a normal distribution; the better half of them moves its mean, and the ways that led there shape
//! its covariance and its width. As in N. Hansen, The CMA Evolution Strategy: A Tutorial (arXiv 1604.00772), with the
//! constants given there and positive weights. Only the order of the points counts, so that what is not allowed needs no
//! number, just a place behind what is.

use nalgebra::{DMatrix, DVector};

use domecast_optics::numeric::{SeededRandom, symmetric_eigen};

/// A point of the space that is searched.
pub type SearchPoint = DVector<f64>;

/// The distribution, and how it got there.
#[derive(Debug, Clone)]
pub struct Cma {
    mean: SearchPoint,
    sigma: f64,
    covariance: DMatrix<f64>,
    /// Columns: the axes of the covariance, as long as its standard deviations.
    axes: DMatrix<f64>,
    /// Its inverse root.
    whitening: DMatrix<f64>,
    path_sigma: SearchPoint,
    path_covariance: SearchPoint,
    weights: Vec<f64>,
    generations: u32,
    population: usize,
    random: SeededRandom,
}

impl Cma {
    /// A search about `mean` with standard deviations of `sigma` along every axis, and so many points in a generation.
    pub fn new(mean: SearchPoint, sigma: f64, population: usize, random: SeededRandom) -> Self {
        let n = mean.len();
        let parents = population / 2;
        let raw: Vec<f64> =
            (1..=parents).map(|i| (0.5 * (population as f64 + 1.0)).ln() - (i as f64).ln()).collect();
        let sum: f64 = raw.iter().sum();
        Self {
            sigma,
            covariance: DMatrix::identity(n, n),
            axes: DMatrix::identity(n, n),
            whitening: DMatrix::identity(n, n),
            path_sigma: DVector::zeros(n),
            path_covariance: DVector::zeros(n),
            weights: raw.into_iter().map(|weight| weight / sum).collect(),
            generations: 0,
            population,
            random,
            mean,
        }
    }

    /// The points to look at next.
    pub fn ask(&mut self) -> Vec<SearchPoint> {
        (0..self.population)
            .map(|_| {
                let normal = DVector::from_fn(self.mean.len(), |_, _| self.random.normal());
                &self.mean + self.sigma * (&self.axes * normal)
            })
            .collect()
    }

    /// Learns from the points, the best first.
    pub fn tell(&mut self, ordered: &[&SearchPoint]) {
        let n = self.mean.len() as f64;
        let effective = 1.0 / self.weights.iter().map(|weight| weight * weight).sum::<f64>();
        let c_sigma = (effective + 2.0) / (n + effective + 5.0);
        let damping = 1.0 + c_sigma + 2.0 * (((effective - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0);
        let c_path = (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n);
        let c_one = 2.0 / ((n + 1.3).powi(2) + effective);
        let c_mu =
            (2.0 * (effective - 2.0 + 1.0 / effective) / ((n + 2.0).powi(2) + effective)).min(1.0 - c_one);
        let steps: Vec<SearchPoint> =
            ordered.iter().take(self.weights.len()).map(|point| (*point - &self.mean) / self.sigma).collect();
        let step = steps
            .iter()
            .zip(&self.weights)
            .fold(DVector::zeros(self.mean.len()), |sum, (step, weight)| sum + step * *weight);
        self.mean += self.sigma * &step;
        self.generations += 1;

        let turn = (c_sigma * (2.0 - c_sigma) * effective).sqrt();
        self.path_sigma = (1.0 - c_sigma) * &self.path_sigma + turn * (&self.whitening * &step);
        // Length of a normal vector, on average.
        let usual = n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));
        let length = self.path_sigma.norm();
        let faded = (1.0 - (1.0 - c_sigma).powi(2 * self.generations as i32)).sqrt();
        let is_usual = length / faded < (1.4 + 2.0 / (n + 1.0)) * usual;
        let along = if is_usual { (c_path * (2.0 - c_path) * effective).sqrt() } else { 0.0 };
        self.path_covariance = (1.0 - c_path) * &self.path_covariance + along * &step;
        let lost = if is_usual { 0.0 } else { c_one * c_path * (2.0 - c_path) };
        let mut next = (1.0 - c_one - c_mu + lost) * &self.covariance
            + c_one * (&self.path_covariance * self.path_covariance.transpose());
        for (step, weight) in steps.iter().zip(&self.weights) {
            next += c_mu * *weight * (step * step.transpose());
        }
        self.sigma *= (c_sigma / damping * (length / usual - 1.0)).min(1.0).exp();
        self.reshape(&next);
    }

    /// Takes a covariance, with its axes.
    fn reshape(&mut self, covariance: &DMatrix<f64>) {
        let symmetric = 0.5 * (covariance + covariance.transpose());
        // Where it has no axes, the last ones stay.
        let Some(eigen) = symmetric_eigen(symmetric.clone()) else { return };
        self.covariance = symmetric;
        let lengths = eigen.eigenvalues.map(|value| value.max(1e-20).sqrt());
        self.axes = &eigen.eigenvectors * DMatrix::from_diagonal(&lengths);
        let inverse = DMatrix::from_diagonal(&lengths.map(f64::recip));
        self.whitening = &eigen.eigenvectors * inverse * eigen.eigenvectors.transpose();
    }

    /// The largest standard deviation along any direction.
    pub fn width(&self) -> f64 {
        let longest = self.axes.column_iter().map(|axis| axis.norm()).fold(0.0, f64::max);
        self.sigma * longest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn search(seed: u64, start: &[f64], of: impl Fn(&SearchPoint) -> f64) -> (f64, usize) {
        let mut cma = Cma::new(DVector::from_column_slice(start), 0.5, 10, SeededRandom::new(seed));
        let (mut best, mut looks) = (f64::INFINITY, 0);
        while cma.width() > 1e-9 && looks < 20_000 {
            let points = cma.ask();
            looks += points.len();
            let mut valued: Vec<(f64, &SearchPoint)> =
                points.iter().map(|point| (of(point), point)).collect();
            valued.sort_by(|a, b| a.0.total_cmp(&b.0));
            best = best.min(valued[0].0);
            cma.tell(&valued.iter().map(|(_, point)| *point).collect::<Vec<_>>());
        }
        (best, looks)
    }

    #[test]
    fn it_finds_the_bottom_of_a_bent_valley_and_of_a_long_bowl() {
        // In three unknowns Rosenbrock's valley has one bottom; in four it has another at 3.70.
        let valley = |x: &SearchPoint| {
            (0..2).map(|i| 100.0 * (x[i + 1] - x[i] * x[i]).powi(2) + (1.0 - x[i]).powi(2)).sum::<f64>()
        };
        // a bowl a thousand times longer than wide, turned
        let bowl = |x: &SearchPoint| {
            let (a, b) = (x[0] + x[1] - 3.0, x[0] - x[1] + 1.0);
            1e6 * a * a + b * b + x[2] * x[2]
        };
        for seed in 1..6 {
            let (value, looks) = search(seed, &[-0.5, 0.5, 1.5], valley);
            assert!(value < 1e-12 && looks < 8000, "{seed}: {value} after {looks}");
            let (value, looks) = search(seed, &[0.0, 0.0, 2.0], bowl);
            assert!(value < 1e-10 && looks < 4000, "{seed}: {value} after {looks}");
        }
    }

    #[test]
    fn one_seed_gives_one_search() {
        let sphere = |x: &SearchPoint| x.norm_squared();
        assert_eq!(search(4, &[1.0, 2.0], sphere), search(4, &[1.0, 2.0], sphere));
        assert_ne!(search(4, &[1.0, 2.0], sphere), search(5, &[1.0, 2.0], sphere));
    }
}
