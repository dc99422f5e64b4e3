//! How long a piece of work takes.

use std::hint::black_box;
use std::time::{Duration, Instant};

use serde::Serialize;

/// Time of one piece of work over repeated runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RunTime {
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
pub struct TimeLimit {
    /// For all runs of one sample together.
    pub per_sample: Duration,
    /// Fewest runs, however long they take.
    pub min_runs: usize,
    /// Most runs.
    pub max_runs: usize,
}

impl TimeLimit {
    /// For curves that are to be trusted.
    pub const FULL: Self = Self { per_sample: Duration::from_millis(120), min_runs: 3, max_runs: 101 };
    /// For a first look.
    pub const QUICK: Self = Self { per_sample: Duration::from_millis(12), min_runs: 3, max_runs: 31 };
}

/// A run shorter than this is repeated within one reading of the clock.
const SHORTEST: Duration = Duration::from_micros(200);

/// Times `work`: once to warm up, then until the time_limit ends; work too short for the clock is timed in batches.
pub fn time<T>(time_limit: TimeLimit, mut work: impl FnMut() -> T) -> RunTime {
    black_box(work());
    time_again(time_limit, work)
}

/// [`time`] of work that has just been done.
pub fn time_again<T>(time_limit: TimeLimit, mut work: impl FnMut() -> T) -> RunTime {
    let first = Instant::now();
    black_box(work());
    let once = first.elapsed().max(Duration::from_nanos(20));
    let batch = (SHORTEST.as_secs_f64() / once.as_secs_f64()).ceil().clamp(1.0, 1e6) as u32;
    let began = Instant::now();
    // A run that is long enough for the clock counts.
    let mut seconds = if batch == 1 { vec![once.as_secs_f64()] } else { Vec::new() };
    while seconds.len() < time_limit.min_runs
        || (began.elapsed() < time_limit.per_sample && seconds.len() < time_limit.max_runs)
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
pub fn of(mut seconds: Vec<f64>) -> RunTime {
    seconds.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let index = (share * seconds.len().saturating_sub(1) as f64).round() as usize;
        seconds.get(index).copied().unwrap_or_default()
    };
    RunTime { median_s: at(0.5), lower_quartile_s: at(0.25), upper_quartile_s: at(0.75), runs: seconds.len() }
}
