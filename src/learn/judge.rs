//! What a network is worth on videos that it was not trained with. It runs as `track` will run it.

use std::collections::BTreeMap;

use domecast_hardness::{Graph, Metadata, Network};
use serde_json::{Value, json};

use crate::data::{DataSet, LEVEL_PARTS, Video};
use crate::tar::Problem;

/// The network's numbers for one video.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    /// Of each class.
    pub probability: Vec<f32>,
    /// Mean and ln deviation of log10 of the modulus.
    pub log10_e: [f32; 2],
    /// The output `state` or `novelty`.
    pub third: Vec<f32>,
}

impl Row {
    fn class(&self) -> usize {
        let best = self.probability.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        best.map_or(0, |(at, _)| at)
    }
}

/// Runs a graph on videos, on all cores.
///
/// # Errors
/// The graph is none that the runtime takes: a fault of this program.
pub fn outputs(graph: &Graph, set: &DataSet, videos: &[&Video]) -> Result<Vec<Row>, Problem> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let parts = videos.chunks(videos.len().div_ceil(threads).max(1));
    std::thread::scope(|scope| {
        let parts: Vec<_> = parts.map(|part| scope.spawn(|| outputs_of_part(graph, set, part))).collect();
        let parts = parts.into_iter().map(|part| part.join().unwrap_or_else(|e| std::panic::resume_unwind(e)));
        parts.collect::<Result<Vec<_>, _>>().map(|parts| parts.concat())
    })
}

fn outputs_of_part(graph: &Graph, set: &DataSet, videos: &[&Video]) -> Result<Vec<Row>, Problem> {
    let mut network = Network::new(graph).map_err(|e| e.to_string())?;
    let (pixels, count) = (set.pixels(), set.readings.len());
    let mut picture = vec![0.0; pixels];
    let mut rows = Vec::new();
    for video in videos {
        network.restart();
        for frame in 0..set.frames {
            if pixels > 0 {
                let levels = &video.picture[frame * pixels..][..pixels];
                picture
                    .iter_mut()
                    .zip(levels)
                    .for_each(|(to, level)| *to = f32::from(*level) / (LEVEL_PARTS * 255.0));
            }
            network.push(&picture, &video.readings[frame * count..][..count]);
        }
        network.run();
        let numbers = |name: &str| network.output(name).unwrap_or(&[]).to_vec();
        let log10_e = numbers("log10_e");
        rows.push(Row {
            probability: numbers("probability"),
            log10_e: [log10_e[0], log10_e[1]],
            third: [numbers("state"), numbers("novelty")].concat(),
        });
    }
    Ok(rows)
}

/// Means over videos.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Score {
    /// Part of the classes that are right.
    pub accuracy: f64,
    /// Cross entropy.
    pub log_loss: f64,
    /// Of log10 of the modulus.
    pub rmse_log10: f64,
}

/// The means.
pub fn score(rows: &[Row], videos: &[&Video]) -> Score {
    let count = rows.len().max(1) as f64;
    let mut score = Score::default();
    for (row, video) in rows.iter().zip(videos) {
        score.accuracy += f64::from(row.class() == video.label) / count;
        score.log_loss -= f64::from(row.probability[video.label].max(1e-12)).ln() / count;
        score.rmse_log10 += f64::from(row.log10_e[0] - video.log10_e).powi(2) / count;
    }
    Score { rmse_log10: score.rmse_log10.sqrt(), ..score }
}

/// Wilson's 95 % interval of a part.
pub fn wilson(right: usize, count: usize) -> [f64; 2] {
    if count == 0 {
        return [0.0, 1.0];
    }
    let (n, z) = (count as f64, 1.959_964);
    let part = right as f64 / n;
    let middle = (part + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z / (1.0 + z * z / n) * (part * (1.0 - part) / n + z * z / (4.0 * n * n)).sqrt();
    [(middle - half).max(0.0), (middle + half).min(1.0)]
}

fn share(right: usize, count: usize) -> Value {
    json!({ "right": right, "of": count, "part": right as f64 / count.max(1) as f64, "wilson_95": wilson(right, count) })
}

/// Whether `track` would state the video's hardness, by the model's own limits.
pub fn is_stated(row: &Row, video: &Video, metadata: &Metadata) -> bool {
    let rest_fits = metadata.foreign_rest(&video.rest).is_none();
    let near =
        row.third.iter().zip(&metadata.novelty_limits).all(|(value, limit)| f64::from(*value) <= *limit);
    let first = video.readings.len() - metadata.readings.len();
    let readings = video.readings[first..].iter().zip(&metadata.readings);
    let decided = !metadata.is_undecided(f64::from(row.probability[row.class()]));
    rest_fits
        && near
        && decided
        && readings.into_iter().all(|(value, reading)| reading.allows(f64::from(*value)))
}

fn reliability(rows: &[Row], videos: &[&Video]) -> (Vec<Value>, f64) {
    let mut bins = vec![(0_usize, 0_usize, 0.0_f64); 10];
    for (row, video) in rows.iter().zip(videos) {
        let probability = f64::from(row.probability[row.class()]);
        let bin = &mut bins[((probability * 10.0) as usize).min(9)];
        bin.0 += 1;
        bin.1 += usize::from(row.class() == video.label);
        bin.2 += probability;
    }
    let error: f64 = bins.iter().map(|(_, right, sum)| (*right as f64 - sum).abs()).sum();
    let lines = bins.iter().filter(|bin| bin.0 > 0).map(|(count, right, sum)| {
        json!({ "stated": sum / *count as f64, "right": *right as f64 / *count as f64, "videos": count })
    });
    (lines.collect(), error / rows.len().max(1) as f64)
}

fn modulus(rows: &[Row], videos: &[&Video], quantile: f64) -> Value {
    let count = videos.len().max(1) as f64;
    let mean = videos.iter().map(|video| f64::from(video.log10_e)).sum::<f64>() / count;
    let spread: f64 = videos.iter().map(|video| (f64::from(video.log10_e) - mean).powi(2)).sum();
    let errors: Vec<f64> =
        rows.iter().zip(videos).map(|(row, v)| f64::from(row.log10_e[0] - v.log10_e)).collect();
    let squares: f64 = errors.iter().map(|e| e * e).sum();
    let halves = rows.iter().map(|row| quantile * f64::from(row.log10_e[1]).exp());
    let inside = errors.iter().zip(halves.clone()).filter(|(e, half)| e.abs() <= *half).count();
    json!({
        "r2": 1.0 - squares / spread.max(1e-12),
        "rmse_log10": (squares / count).sqrt(),
        "interval_90_holds": share(inside, rows.len()),
        "mean_half_width_log10": halves.sum::<f64>() / count,
    })
}

/// The judgement of videos, as it stands in `metrics.json`.
pub fn judgement(rows: &[Row], videos: &[&Video], set: &DataSet, metadata: &Metadata) -> Value {
    let right = |row: &Row, video: &Video| row.class() == video.label;
    let pairs = || rows.iter().zip(videos);
    let stated: Vec<_> = pairs().filter(|(row, video)| is_stated(row, video, metadata)).collect();
    let mut confusion = vec![vec![0_usize; set.classes.len()]; set.classes.len()];
    let mut shapes: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for (row, video) in pairs() {
        confusion[video.label][row.class()] += 1;
        let shape = shapes.entry(&video.shape).or_default();
        shape.0 += usize::from(right(row, video));
        shape.1 += 1;
    }
    let (reliability, calibration_error) = reliability(rows, videos);
    let score = score(rows, videos);
    let shapes: serde_json::Map<String, Value> =
        shapes.into_iter().map(|(name, (right, count))| (name.to_string(), share(right, count))).collect();
    json!({
        "accuracy": share(pairs().filter(|(row, video)| right(row, video)).count(), rows.len()),
        "accuracy_where_stated": share(stated.iter().filter(|(row, video)| right(row, video)).count(), stated.len()),
        "unsure": rows.len() - stated.len(),
        "log_loss": score.log_loss,
        "calibration_error": calibration_error,
        "reliability": reliability,
        "confusion": confusion,
        "by_shape": shapes,
        "modulus": if set.own_classes { Value::Null } else { modulus(rows, videos, metadata.interval_quantile) },
    })
}

#[cfg(test)]
mod tests {
    use super::wilson;

    #[test]
    fn wilsons_interval_is_the_published_one() {
        // 99 of 100: Brown, Cai and DasGupta's formula gives 94.55 % to 99.82 %
        let [low, high] = wilson(99, 100);
        assert!((low - 0.9455).abs() < 1e-4 && (high - 0.9982).abs() < 1e-4, "{low} {high}");
        assert_eq!(wilson(0, 0), [0.0, 1.0]);
    }
}
