//! What `track` says of all frames at its end.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use serde_json::json;

use crate::commands::output::{Failure, Output};

/// What happened to the frames.
#[derive(Default)]
pub(super) struct Tally {
    pub(super) counts: BTreeMap<&'static str, u64>,
    pub(super) times: Vec<Duration>,
}

impl Tally {
    /// The time, ms, that a share of the frames took at most.
    fn quantile_ms(&self, share: f64) -> f64 {
        let index = ((self.times.len() as f64 * share) as usize).min(self.times.len().saturating_sub(1));
        self.times.get(index).map_or(0.0, |t| 1e3 * t.as_secs_f64())
    }

    pub(super) fn summarize(&mut self, output: &Output, out: Option<&Path>) -> Result<(), Failure> {
        let Some(path) = out else { return Ok(()) };
        self.times.sort_unstable();
        let (median, p99) = (self.quantile_ms(0.5), self.quantile_ms(0.99));
        let frames: u64 = self.counts.values().sum();
        let statuses: Vec<String> = self.counts.iter().map(|(status, n)| format!("{n} {status}")).collect();
        output.say(&format!("{}: {frames} frames, {}", path.display(), statuses.join(", ")))?;
        output.say(&format!("{median:.2} ms a frame (median), {p99:.2} ms (99 of 100)"))?;
        output.result(&json!({
            "ok": true,
            "out": path.display().to_string(),
            "frames": frames,
            "status": self.counts,
            "median_ms": median,
            "p99_ms": p99,
        }))
    }
}
