//! From a trained network to one that knows what it does not know: temperature, interval and limits, all from videos that
//! the weights were not fitted to.

use domecast_hardness::{Class, Metadata, ModelReading};
use nalgebra::{Cholesky, DMatrix, DVector};
use serde_json::Value;

use crate::data::{DataSet, Video};
use crate::export::Familiar;
use crate::judge::Row;

/// Share of the diagonal that a covariance is shrunk to, so that directions that the training never saw stay finite.
const SHRINKAGE: f64 = 0.1;
/// Part of the videos for calibration that is not `unsure`.
const FAMILIAR_PART: f64 = 0.995;
/// Part that an interval shall hold.
const COVERAGE: f64 = 0.9;

/// The temperature that makes the classes' log loss smallest, searched from 0.05 to 20 by golden sections of its logarithm.
pub fn temperature(rows: &[Row], videos: &[&Video]) -> f32 {
    let loss = |ln_temperature: f64| -> f64 {
        let scale = (-ln_temperature).exp();
        let one = |(row, video): (&Row, &&Video)| {
            let logits = row.probability.iter().map(|p| f64::from(p.max(1e-30)).ln() * scale);
            let largest = logits.clone().fold(f64::NEG_INFINITY, f64::max);
            let sum: f64 = logits.clone().map(|value| (value - largest).exp()).sum();
            largest + sum.ln() - logits.clone().nth(video.label).unwrap_or(0.0)
        };
        rows.iter().zip(videos).map(one).sum()
    };
    let golden = (5_f64.sqrt() - 1.0) / 2.0;
    let (mut low, mut high) = (0.05_f64.ln(), 20_f64.ln());
    for _ in 0..60 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if loss(a) < loss(b) { high = b } else { low = a }
    }
    // a set without an error would have no temperature: one or more keeps the network's own
    ((low + high) / 2.0).exp().max(1.0) as f32
}

/// The value that `part` of the list does not exceed, counted so that the next one does not either with that probability.
fn quantile(mut values: Vec<f64>, part: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let rank = ((values.len() + 1) as f64 * part).ceil() as usize;
    values.get(rank.clamp(1, values.len().max(1)) - 1).copied().unwrap_or(0.0)
}

/// What is like some rows of numbers.
pub fn familiar(rows: &[Vec<f32>]) -> Familiar {
    let width = rows.first().map_or(0, Vec::len);
    let count = rows.len().max(1) as f64;
    let mut mean = DVector::zeros(width);
    let vector = |row: &Vec<f32>| DVector::from_iterator(width, row.iter().map(|value| f64::from(*value)));
    rows.iter().for_each(|row| mean += vector(row) / count);
    let mut covariance = DMatrix::zeros(width, width);
    for row in rows {
        let off = vector(row) - &mean;
        covariance += &off * off.transpose() / count;
    }
    let floor = covariance.diagonal().mean().max(1e-12) * 1e-6;
    let shrunk = DMatrix::from_fn(width, width, |i, j| {
        if i == j { covariance[(i, i)] + floor } else { covariance[(i, j)] * (1.0 - SHRINKAGE) }
    });
    // a covariance with a floor on its diagonal is positive definite; else each number counts by its own deviation
    let inverse = Cholesky::new(shrunk.clone()).and_then(|factor| factor.l().try_inverse());
    let inverse = inverse
        .unwrap_or_else(|| DMatrix::from_diagonal(&shrunk.diagonal().map(|variance| 1.0 / variance.sqrt())));
    // a typical squared distance is then one
    let whiten = inverse / (width.max(1) as f64).sqrt();
    Familiar {
        mean: mean.iter().map(|value| *value as f32).collect(),
        whiten: whiten.transpose().iter().map(|value| *value as f32).collect(),
    }
}

/// The last frame's readings that the network sees.
pub fn last_readings(set: &DataSet, videos: &[&Video]) -> Vec<Vec<f32>> {
    let last =
        |video: &&Video| video.readings[video.readings.len() - set.readings.len()..][..set.seen].to_vec();
    videos.iter().map(last).collect()
}

/// The smallest and largest of each number of the pictures at rest.
fn rest_ranges<'a>(videos: impl Iterator<Item = &'a &'a Video>) -> Vec<[f64; 2]> {
    let mut ranges: Vec<[f64; 2]> = Vec::new();
    for video in videos {
        ranges.resize(video.rest.len(), [f64::INFINITY, f64::NEG_INFINITY]);
        for ([low, high], value) in ranges.iter_mut().zip(&video.rest) {
            (*low, *high) = (low.min(*value), high.max(*value));
        }
    }
    ranges
}

/// What the model says of itself; `rows` are those of `val` with the output `novelty`.
pub fn metadata(set: &DataSet, train: &[&Video], val: &[&Video], rows: &[Row], training: Value) -> Metadata {
    let known = || train.iter().chain(val);
    let class = |(at, name): (usize, &String)| {
        let values: Vec<f64> = known().filter(|v| v.label == at).map(|v| f64::from(v.log10_e)).collect();
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        Class { name: name.clone(), youngs_modulus_mpa: (!values.is_empty()).then(|| 10_f64.powf(mean)) }
    };
    let range = |values: &mut dyn Iterator<Item = f32>| {
        let (low, high) = values.fold((f32::MAX, f32::MIN), |(low, high), v| (low.min(v), high.max(v)));
        [f64::from(low), f64::from(high)]
    };
    let count = set.readings.len();
    let reading = |(at, name): (usize, &String)| ModelReading {
        name: name.clone(),
        range: range(&mut known().map(|video| video.readings[video.readings.len() - count + at])),
    };
    let score = |(row, video): (&Row, &&Video)| {
        f64::from((row.log10_e[0] - video.log10_e).abs()) / f64::from(row.log10_e[1]).exp()
    };
    let distances = rows.first().map_or(0, |row| row.third.len());
    let limit =
        |at: usize| quantile(rows.iter().map(|row| f64::from(row.third[at])).collect(), FAMILIAR_PART);
    Metadata {
        version: 1,
        classes: set.classes.iter().enumerate().map(class).collect(),
        readings: set.readings.iter().enumerate().map(reading).collect(),
        rest_ranges: rest_ranges(known()),
        log10_e_range: range(&mut known().map(|video| video.log10_e)),
        // two moduli alone do not tell what lies between them
        interval_quantile: if set.own_classes {
            0.0
        } else {
            quantile(rows.iter().zip(val).map(score).collect(), COVERAGE)
        },
        novelty_limits: (0..distances).map(limit).collect(),
        novelty_names: ["features", "readings"].into_iter().take(distances).map(str::to_string).collect(),
        training,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_one_on_average_and_grow_across_the_spread() {
        // two numbers that go together, and one that never changes
        let rows: Vec<Vec<f32>> = (0..200)
            .map(|i| ((i % 20) as f32 - 9.5, (i / 20) as f32))
            .map(|(a, b)| vec![a, a + 0.1 * b, 3.0])
            .collect();
        let near = familiar(&rows);
        let distance = |row: &[f32]| -> f32 {
            let off: Vec<f32> = row.iter().zip(&near.mean).map(|(a, b)| a - b).collect();
            let turned =
                near.whiten.chunks_exact(3).map(|w| w.iter().zip(&off).map(|(a, b)| a * b).sum::<f32>());
            turned.map(|value| value * value).sum()
        };
        let mean = rows.iter().map(|row| distance(row)).sum::<f32>() / 200.0;
        assert!((0.3..1.0).contains(&mean), "{mean}");
        assert!(distance(&[5.0, -5.0, 3.0]) > 10.0 * distance(&[5.0, 5.4, 3.0]));
        assert!(distance(&[0.0, 0.0, 4.0]) > 1000.0);
    }

    #[test]
    fn quantiles_hold_for_the_next_value() {
        assert_eq!(quantile((1..=9).map(f64::from).collect(), 0.9), 9.0);
        assert_eq!(quantile((1..=99).map(f64::from).collect(), 0.9), 90.0);
        assert_eq!(quantile(Vec::new(), 0.9), 0.0);
    }
}
