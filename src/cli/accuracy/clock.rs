//! How long a piece of work takes.

use std::hint::black_box;
use std::time::{Duration, Instant};

use serde::Serialize;

/// Time of one piece of work over repeated runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Timing {
    /// Median, s.
    pub median_s: f64,
    /// A quarter of the runs took less, s.
    pub lower_quartile_s: f64,
    /// A quarter of the runs took more, s.
    pub upper_quartile_s: f64,
    /// Runs that were timed, after one that was not.
    pub runs: usize,
}

/// How much time a measurement may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patience {
    /// For all runs of one rung together.
    pub per_rung: Duration,
    /// Fewest runs, however long they take.
    pub least_runs: usize,
    /// Most runs.
    pub most_runs: usize,
}

impl Patience {
    /// For curves that are to be trusted.
    pub const FULL: Self = Self { per_rung: Duration::from_millis(120), least_runs: 5, most_runs: 101 };
    /// For a first look.
    pub const QUICK: Self = Self { per_rung: Duration::from_millis(12), least_runs: 3, most_runs: 31 };
}

/// A run shorter than this is repeated within one reading of the clock.
const SHORTEST: Duration = Duration::from_micros(200);

/// Times `work`: once to warm up, then until the patience ends; work too short for the clock is timed in batches.
pub fn time<T>(patience: Patience, mut work: impl FnMut() -> T) -> Timing {
    black_box(work());
    time_again(patience, work)
}

/// [`time`] of work that has just been done.
pub fn time_again<T>(patience: Patience, mut work: impl FnMut() -> T) -> Timing {
    let first = Instant::now();
    black_box(work());
    let once = first.elapsed().max(Duration::from_nanos(20));
    let batch = (SHORTEST.as_secs_f64() / once.as_secs_f64()).ceil().clamp(1.0, 1e6) as u32;
    let began = Instant::now();
    // A run that is long enough for the clock counts.
    let mut seconds = if batch == 1 { vec![once.as_secs_f64()] } else { Vec::new() };
    while seconds.len() < patience.least_runs
        || (began.elapsed() < patience.per_rung && seconds.len() < patience.most_runs)
    {
        let start = Instant::now();
        for _ in 0..batch {
            black_box(work());
        }
        seconds.push(start.elapsed().as_secs_f64() / f64::from(batch));
    }
    of(seconds)
}

/// The timing that single runs make.
pub fn of(mut seconds: Vec<f64>) -> Timing {
    seconds.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let index = (share * seconds.len().saturating_sub(1) as f64).round() as usize;
        seconds.get(index).copied().unwrap_or_default()
    };
    Timing { median_s: at(0.5), lower_quartile_s: at(0.25), upper_quartile_s: at(0.75), runs: seconds.len() }
}
