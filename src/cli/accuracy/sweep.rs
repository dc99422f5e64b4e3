//! A sweep: one setting from crude to far finer than needed, with the time and the error of every sample.

use serde::Serialize;

use super::clock::RunTime;

/// One value of a setting.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SweepSample {
    /// The method, where a sweep compares several: `newton`; empty where there is one.
    pub method: &'static str,
    /// What this sample is, in a few words.
    pub label: String,
    /// The setting's value: a tolerance, a number of steps, a count.
    pub setting: f64,
    /// Largest error over the work of the design.
    pub max_error: f64,
    /// Root mean square of the errors.
    pub rms_error: f64,
    /// Time for all the work.
    pub time: RunTime,
    /// Time for one item, s.
    pub per_item_s: f64,
    /// What else there is to know, by name: triangles, bytes, failures.
    pub notes: Vec<(String, f64)>,
    /// Another sample is at least as exact and faster (Pareto).
    pub dominated: bool,
}

impl SweepSample {
    /// A sample from the errors and the time of `items`; errors that are not finite count as failures, under the name
    /// `failure`.
    pub fn of(
        (method, label): (&'static str, String),
        setting: f64,
        errors: impl Iterator<Item = f64>,
        (time, items): (RunTime, usize),
        failure: &str,
    ) -> Self {
        let (max_error, rms_error, failed) = sizes(errors);
        Self {
            method,
            label,
            setting,
            max_error,
            rms_error,
            time,
            per_item_s: time.median_s / items.max(1) as f64,
            notes: if failed > 0 { vec![(failure.into(), failed as f64)] } else { Vec::new() },
            dominated: false,
        }
    }
}

/// How the error depends on the setting.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
pub enum Law {
    /// As a power of the setting: error ~ setting^exponent.
    Power {
        /// The exponent that theory gives.
        exponent: f64,
    },
    /// The setting is a bound of the error.
    Within,
    /// Each step raises the error to this power.
    Steps {
        /// The power that theory gives: 2 for Newton's method.
        order: f64,
    },
    /// Only known to fall.
    Falls,
}

/// The sweep of one setting.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sweep {
    /// Short name, also of its picture: `lens`.
    pub name: &'static str,
    /// What is computed.
    pub title: String,
    /// The setting, with its unit.
    pub setting: &'static str,
    /// What the error is.
    pub error: &'static str,
    /// Unit of the error.
    pub unit: &'static str,
    /// What the time per item is per.
    pub item: &'static str,
    /// Items of work.
    pub items: usize,
    /// What errors are measured against.
    pub reference: String,
    /// Error of the reference itself; errors below a hundred times this are not distinguished.
    pub floor: f64,
    /// How the error should follow the setting.
    pub law: Law,
    /// The measured exponent or order, median over neighbouring samples above the floor.
    pub observed: Option<f64>,
    /// The samples, from crude to exact, method by method.
    pub samples: Vec<SweepSample>,
    /// The sample that builds of this design use.
    pub in_use: Option<usize>,
    /// What the design's `accuracy` asks for, in the error's unit.
    pub asked: Option<f64>,
    /// The cheapest sample that gives what is asked.
    pub meets: Option<usize>,
    /// The conclusion, in a sentence.
    pub conclusion: String,
}

impl Sweep {
    /// Errors up to here are rounding of the reference.
    pub fn noise_floor(&self) -> f64 {
        100.0 * self.floor
    }

    /// Computes what follows from the samples: which are dominated, the observed order, the sample that meets what is
    /// asked.
    pub fn finish(mut self) -> Self {
        let noise_floor = self.noise_floor();
        let seen = |sample: &SweepSample| sample.max_error.max(noise_floor);
        let all = self.samples.clone();
        for sample in &mut self.samples {
            let dominates = |other: &SweepSample| {
                let (exact, fast) =
                    (seen(other) <= seen(sample), other.time.median_s < 0.98 * sample.time.median_s);
                exact && fast
            };
            sample.dominated = all.iter().any(dominates);
        }
        self.observed = self.order();
        let cheapest = |asked: f64| {
            let fit = self.samples.iter().enumerate().filter(|(_, sample)| sample.max_error <= asked);
            fit.min_by(|a, b| a.1.time.median_s.total_cmp(&b.1.time.median_s)).map(|(index, _)| index)
        };
        self.meets = self.asked.and_then(cheapest);
        self
    }

    /// The slope between neighbouring samples of one method, above the floor: of log error over log setting, or of the log
    /// of errors that follow each other.
    fn order(&self) -> Option<f64> {
        let noise_floor = self.noise_floor();
        let clear = |sample: &SweepSample| {
            sample.rms_error > noise_floor && sample.rms_error.is_finite() && sample.setting > 0.0
        };
        let mut slopes: Vec<f64> = match self.law {
            Law::Power { .. } => self
                .samples
                .windows(2)
                .filter(|two| {
                    two[0].method == two[1].method
                        && two.iter().all(clear)
                        && two[0].setting != two[1].setting
                })
                .map(|two| {
                    (two[0].rms_error / two[1].rms_error).ln() / (two[0].setting / two[1].setting).ln()
                })
                .collect(),
            Law::Steps { .. } => {
                // e2 / e1 = (e1 / e0)^order needs three samples of one method
                let method = self.samples.iter().filter(|r| clear(r)).map(|r| r.method).next_back()?;
                let errors: Vec<f64> = self
                    .samples
                    .iter()
                    .filter(|r| r.method == method && clear(r))
                    .map(|r| r.max_error)
                    .collect();
                // far from the root a step promises nothing
                errors
                    .windows(3)
                    .filter(|three| three[1] < 0.3 * three[0])
                    .map(|three| (three[2] / three[1]).ln() / (three[1] / three[0]).ln())
                    .collect()
            }
            Law::Within | Law::Falls => Vec::new(),
        };
        slopes.sort_by(f64::total_cmp);
        slopes.get(slopes.len() / 2).copied().filter(|slope| slope.is_finite())
    }
}

/// Largest and root mean square of errors; values that are not finite count as failures and are left out.
pub fn sizes(errors: impl Iterator<Item = f64>) -> (f64, f64, usize) {
    let (mut max, mut squares, mut count, mut failed) = (0.0_f64, 0.0, 0_usize, 0_usize);
    for error in errors {
        if error.is_finite() {
            max = max.max(error);
            squares += error * error;
            count += 1;
        } else {
            failed += 1;
        }
    }
    (max, (squares / count.max(1) as f64).sqrt(), failed)
}
