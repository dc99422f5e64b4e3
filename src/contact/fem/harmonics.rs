//! High harmonics of the dome's response, interpolated between few that are solved.
//!
//! The stiffness is a polynomial in the harmonic's number `m`, so the response is a rational function of it that has no
//! pole at a real `m`. Over the logarithm of `m` it is smooth on one scale, and polynomials through Chebyshev's places
//! converge geometrically (L. N. Trefethen, Approximation Theory and Approximation Practice, theorem 8.2).

use rayon::prelude::*;

use super::body::Body;
use super::grid::Grid;
use super::response::{AXES, Load, Solved, Spectrum, harmonic, respond};
use crate::error::ContactError;

/// The first harmonic that is interpolated.
const FIRST_BETWEEN: usize = 12;
/// Harmonics that are solved for each octave of the others; they leave nothing but rounding.
const PLACES_PER_OCTAVE: f64 = 12.0;

/// How many are solved up to a last one.
fn places(last: usize) -> usize {
    (PLACES_PER_OCTAVE * (last as f64 / FIRST_BETWEEN as f64).log2().max(1.0)).ceil() as usize
}

/// Responses at Chebyshev's places of the logarithm of the harmonic, for unit loads on the rings.
struct Between {
    first_ring: usize,
    places: Vec<f64>,
    weights: Vec<f64>,
    /// By place: amplitudes of the surface by column, and the rings' own.
    solved: Vec<(Vec<Vec<f64>>, Vec<f64>)>,
}

impl Between {
    /// Solves at the places between two harmonics.
    pub fn new(
        grid: &Grid,
        body: &Body,
        hats: &[Vec<(usize, f64)>],
        [first, last]: [usize; 2],
    ) -> Result<Self, ContactError> {
        let first_ring = (0..hats.len()).find(|ring| grid.harmonics(*ring) > first).unwrap_or(hats.len());
        let loads: Vec<Load> = hats
            .iter()
            .skip(first_ring)
            .flat_map(|hat| {
                (0..AXES).map(move |axis| hat.iter().map(|(p, part)| ((*p, axis), *part)).collect())
            })
            .collect();
        let [low, high] = [first, last].map(|m| (m as f64).ln());
        // Chebyshev's places of the first kind and their barycentric weights.
        let count = places(last);
        let angle = |k: usize| std::f64::consts::PI * (k as f64 + 0.5) / count as f64;
        let places: Vec<f64> =
            (0..count).map(|k| 0.5 * (low + high) + 0.5 * (high - low) * angle(k).cos()).collect();
        let sign = |k: usize| if k % 2 == 0 { 1.0 } else { -1.0 };
        let weights = (0..count).map(|k| sign(k) * angle(k).sin()).collect();
        let solved =
            places.par_iter().map(|x| respond(body, &loads, x.exp())).collect::<Result<Vec<_>, _>>()?;
        Ok(Self { first_ring, places, weights, solved })
    }

    /// The response of one harmonic.
    pub fn at(&self, grid: &Grid, m: usize) -> Solved {
        let x = (m as f64).ln();
        let shares: Vec<f64> = match self.places.iter().position(|place| *place == x) {
            Some(at) => (0..self.places.len()).map(|k| f64::from(u8::from(k == at))).collect(),
            None => {
                let raw: Vec<f64> =
                    self.places.iter().zip(&self.weights).map(|(place, w)| w / (x - place)).collect();
                let sum: f64 = raw.iter().sum();
                raw.iter().map(|share| share / sum).collect()
            }
        };
        let reaches = |ring: usize| grid.harmonics(ring) > m;
        let first_ring =
            (self.first_ring..grid.elements).find(|ring| reaches(*ring)).unwrap_or(grid.elements);
        let all = AXES * (grid.elements - self.first_ring);
        let skipped = AXES * (first_ring - self.first_ring);
        let factor = |column: usize| {
            let ring = self.first_ring + column / AXES;
            if reaches(ring) { grid.hat_harmonic(ring, m) } else { 0.0 }
        };
        let factors: Vec<f64> = (0..all).map(factor).collect();
        let mut columns = Vec::with_capacity(all - skipped);
        let mut own = Vec::with_capacity((all - skipped).pow(2));
        for by in skipped..all {
            let mut values = vec![0.0; self.solved.first().map_or(0, |(columns, _)| columns[by].len())];
            let mut seen = vec![0.0; all - skipped];
            for ((columns, own), share) in self.solved.iter().zip(&shares) {
                let share = share * factors[by];
                values.iter_mut().zip(&columns[by]).for_each(|(sum, value)| *sum += share * value);
                let own = &own[by * all + skipped..(by + 1) * all];
                seen.iter_mut().zip(own).for_each(|(sum, value)| *sum += share * value);
            }
            columns.push(values);
            own.extend(seen.iter().zip(&factors[skipped..]).map(|(value, factor)| value * factor));
        }
        (Spectrum { first_ring, columns }, own)
    }
}

/// All harmonics: the low ones and those of a small mesh solved, the others interpolated.
pub(super) fn harmonics(
    grid: &Grid,
    body: &Body,
    hats: &[Vec<(usize, f64)>],
    last: usize,
) -> Result<Vec<Solved>, ContactError> {
    let first = if last > FIRST_BETWEEN + places(last) { FIRST_BETWEEN } else { last };
    let mut solved: Vec<Solved> =
        (0..first).into_par_iter().map(|m| harmonic(grid, body, hats, m)).collect::<Result<_, _>>()?;
    if first < last {
        let between = Between::new(grid, body, hats, [first, last - 1])?;
        let others: Vec<Solved> = (first..last).into_par_iter().map(|m| between.at(grid, m)).collect();
        solved.extend(others);
    }
    Ok(solved)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elastomer::Elastomer;

    #[test]
    fn interpolated_harmonics_are_those_that_a_solve_gives() {
        for (elements, poisson) in [(16, 0.49), (32, 0.3), (32, 0.499)] {
            let elastomer = Elastomer { dome_radius_mm: 10.0, young_mpa: 0.56, poisson, friction: 0.6 };
            let grid = Grid::new(10.0, elements);
            let body = Body::new(&elastomer, elements).unwrap();
            let hats: Vec<_> = (0..elements).map(|ring| grid.hat(ring)).collect();
            let last = (0..elements).map(|ring| grid.harmonics(ring)).max().unwrap() - 1;
            let between = Between::new(&grid, &body, &hats, [FIRST_BETWEEN, last]).unwrap();
            let scale = |own: &[f64]| own.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            let largest = scale(&between.at(&grid, FIRST_BETWEEN).1);
            for m in [FIRST_BETWEEN, FIRST_BETWEEN + 1, 17, 29, last / 2, last - 1, last] {
                let (found, own) = between.at(&grid, m);
                let (spectrum, exact) = harmonic(&grid, &body, &hats, m).unwrap();
                assert_eq!(found.first_ring, spectrum.first_ring);
                let columns = found.columns.iter().flatten().zip(spectrum.columns.iter().flatten());
                let off = own.iter().zip(&exact).chain(columns);
                let off = off.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest;
                println!("{elements} {poisson} harmonic {m}: {off:.1e} of {largest:.1e}");
                assert!(off < 1e-13, "{elements} {poisson} harmonic {m}: {off:.1e}");
            }
        }
    }
}
