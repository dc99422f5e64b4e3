//! A ladder: one dial from crude to far beyond need, and what every rung costs and leaves.

use serde::Serialize;

use super::clock::Timing;

/// One setting of a dial.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rung {
    /// The way that is taken, where a ladder compares several: `newton`; empty where there is one.
    pub way: &'static str,
    /// What this rung is, in a few words.
    pub label: String,
    /// The dial's value: a tolerance, a number of steps or of samples.
    pub dial: f64,
    /// Largest error over the work of the design.
    pub max_error: f64,
    /// Root mean square of the errors.
    pub rms_error: f64,
    /// Time for all the work.
    pub time: Timing,
    /// Time for one item, s.
    pub per_item_s: f64,
    /// What else there is to know, by name: triangles, bytes, failures.
    pub notes: Vec<(String, f64)>,
    /// Another rung is at least as exact and faster.
    pub dominated: bool,
}

impl Rung {
    /// A rung from the errors and the time of `items`; errors that are not finite are told as failures, in the words
    /// of `failure`.
    pub fn of(
        (way, label): (&'static str, String),
        dial: f64,
        errors: impl Iterator<Item = f64>,
        (time, items): (Timing, usize),
        failure: &str,
    ) -> Self {
        let (max_error, rms_error, failed) = sizes(errors);
        Self {
            way,
            label,
            dial,
            max_error,
            rms_error,
            time,
            per_item_s: time.median_s / items.max(1) as f64,
            notes: if failed > 0 { vec![(failure.into(), failed as f64)] } else { Vec::new() },
            dominated: false,
        }
    }
}

/// How an error follows the dial.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
pub enum Law {
    /// As a power of the dial: error ~ dial^exponent.
    Power {
        /// The exponent that theory gives.
        exponent: f64,
    },
    /// As a power of the dial, or better: a limit that is kept, not an error that is met.
    Within,
    /// Each step raises the error to this power.
    Steps {
        /// The power that theory gives: 2 for Newton's method.
        order: f64,
    },
    /// Nothing is known but that it falls.
    Falls,
}

/// A dial, measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ladder {
    /// Short name, also of its picture: `lens`.
    pub name: &'static str,
    /// What is worked out.
    pub title: String,
    /// What is turned, with its unit.
    pub dial: &'static str,
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
    /// Error of the reference itself; errors below a hundred times this are not told apart.
    pub floor: f64,
    /// How the error should follow the dial.
    pub law: Law,
    /// The exponent or order that was seen, median over neighbouring rungs above the floor.
    pub observed: Option<f64>,
    /// The rungs, from crude to exact (way by way).
    pub rungs: Vec<Rung>,
    /// The rung that builds of this design use.
    pub in_use: Option<usize>,
    /// What the design's `accuracy` asks for, in the error's unit.
    pub asked: Option<f64>,
    /// The cheapest rung that gives what is asked.
    pub meets: Option<usize>,
    /// What a person should take from it, in a sentence.
    pub says: String,
}

impl Ladder {
    /// Errors up to here are rounding of the reference.
    pub fn blind_below(&self) -> f64 {
        100.0 * self.floor
    }

    /// Works out what follows from the rungs: which are dominated, the observed order, the rung that meets what is
    /// asked.
    pub fn finish(mut self) -> Self {
        let blind = self.blind_below();
        let seen = |rung: &Rung| rung.max_error.max(blind);
        let all = self.rungs.clone();
        for rung in &mut self.rungs {
            let beaten = |other: &Rung| {
                let (exact, fast) =
                    (seen(other) <= seen(rung), other.time.median_s < 0.98 * rung.time.median_s);
                exact && fast
            };
            rung.dominated = all.iter().any(beaten);
        }
        self.observed = self.order();
        let cheapest = |asked: f64| {
            let fit = self.rungs.iter().enumerate().filter(|(_, rung)| rung.max_error <= asked);
            fit.min_by(|a, b| a.1.time.median_s.total_cmp(&b.1.time.median_s)).map(|(index, _)| index)
        };
        self.meets = self.asked.and_then(cheapest);
        self
    }

    /// The slope between neighbouring rungs of one way, above the floor: of log error over log dial, or of the log
    /// of errors that follow each other.
    fn order(&self) -> Option<f64> {
        let blind = self.blind_below();
        let clear = |rung: &Rung| rung.rms_error > blind && rung.rms_error.is_finite() && rung.dial > 0.0;
        let mut slopes: Vec<f64> = match self.law {
            Law::Power { .. } => self
                .rungs
                .windows(2)
                .filter(|two| two[0].way == two[1].way && two.iter().all(clear) && two[0].dial != two[1].dial)
                .map(|two| (two[0].rms_error / two[1].rms_error).ln() / (two[0].dial / two[1].dial).ln())
                .collect(),
            Law::Steps { .. } => {
                // e2 / e1 = (e1 / e0)^order needs three rungs of one way
                let way = self.rungs.iter().filter(|r| clear(r)).map(|r| r.way).next_back()?;
                let errors: Vec<f64> =
                    self.rungs.iter().filter(|r| r.way == way && clear(r)).map(|r| r.max_error).collect();
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
    let (mut most, mut squares, mut count, mut failed) = (0.0_f64, 0.0, 0_usize, 0_usize);
    for error in errors {
        if error.is_finite() {
            most = most.max(error);
            squares += error * error;
            count += 1;
        } else {
            failed += 1;
        }
    }
    (most, (squares / count.max(1) as f64).sqrt(), failed)
}
