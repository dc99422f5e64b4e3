//! What `track` says of all frames at its end.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use serde_json::json;

use crate::commands::output::{Failure, Output};
use domecast_runtime::track::Tracked;

/// A force that pulls the dome off its base is named from here on, N, and from so many standard deviations: a choice, more than what
/// sticks to silicone pulls with.
const MIN_PULL_N: f64 = 0.2;
const PULL_SDS: f64 = 5.0;

/// What happened to the frames.
#[derive(Default)]
pub(super) struct Tally {
    pub(super) counts: BTreeMap<&'static str, u64>,
    pub(super) times: Vec<Duration>,
    /// Frames in which something pulls the dome off its base, and the strongest, N.
    pulled: (u64, f64),
}

impl Tally {
    /// Counts a frame.
    pub(super) fn count(&mut self, tracked: &Tracked) {
        *self.counts.entry(tracked.status()).or_default() += 1;
        let (Some(wrench), Some(sd)) = (&tracked.wrench, &tracked.wrench_sd) else { return };
        let (pull_n, sd_n) = (wrench.force_n.z, sd.force_n.z);
        if pull_n > MIN_PULL_N.max(PULL_SDS * sd_n) {
            self.pulled = (self.pulled.0 + 1, self.pulled.1.max(pull_n));
        }
    }

    /// Says where frames that are taken off were not of the untouched sensor: nothing pulls a dome.
    pub(super) fn tell_pull(&self, output: &Output) {
        let (frames, pull_n) = self.pulled;
        if frames > 0 {
            output.warn(&format!(
                "frames in which something pulls the dome off its base: {frames}, with up to {pull_n:.2} N; if nothing does, the frames of \
                 --reference were not of the untouched sensor, and all forces are off by what touched it then"
            ));
        }
    }

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
