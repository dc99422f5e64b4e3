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
    /// Whether what the untouched sensor shows is taken off already; else what it bears along its axis, N, where a frame says so.
    has_reference: bool,
    rest_n: Option<f64>,
    /// Frames in which something pulls the dome off its base, and the strongest, N.
    pulled: (u64, f64),
}

impl Tally {
    /// Begins, with the frame at rest where there is one.
    pub(super) fn new(has_reference: bool, rest: Option<&Tracked>) -> Self {
        let rest_n = rest.and_then(|tracked| Some(tracked.wrench.as_ref()?.force_n.z));
        Self { has_reference, rest_n, ..Self::default() }
    }

    /// Counts a frame.
    pub(super) fn count(&mut self, tracked: &Tracked) {
        *self.counts.entry(tracked.status()).or_default() += 1;
        let Some(pull_n) = self.pull_n(tracked).filter(|pull_n| *pull_n > MIN_PULL_N) else { return };
        self.pulled = (self.pulled.0 + 1, self.pulled.1.max(pull_n));
    }

    /// What pulls the dome off its base, more than the untouched sensor shows and than the deviation of that allows.
    fn pull_n(&self, tracked: &Tracked) -> Option<f64> {
        let force_n = tracked.wrench.as_ref()?.force_n.z;
        let (pull_n, sd_n) = if self.has_reference {
            (force_n, tracked.wrench_sd.as_ref()?.force_n.z)
        } else {
            // What stays from frame to frame is in both.
            (force_n - self.rest_n?, std::f64::consts::SQRT_2 * tracked.wrench_sd_random.as_ref()?.force_n.z)
        };
        (pull_n > PULL_SDS * sd_n).then_some(pull_n)
    }

    /// Warns where frames that were given as untouched were not: nothing pulls a dome.
    pub(super) fn warn_of_pull(&self, output: &Output) {
        let (frames, pull_n) = self.pulled;
        if frames > 0 {
            output.warn(&format!(
                "frames in which something pulls the dome off its base: {frames}, with up to {pull_n:.2} N; if nothing does, the frames of \
                 --reference or --rest were not of the untouched sensor, and what is counted from them is wrong"
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

#[cfg(test)]
mod tests {
    use super::*;
    use domecast_springs::Wrench;

    fn bears(force_n: f64) -> Tracked {
        let along = |force_n: f64| Some(Wrench::from_array([0.0, 0.0, force_n, 0.0, 0.0, 0.0]));
        Tracked {
            wrench: along(force_n),
            wrench_sd: along(0.05),
            wrench_sd_random: along(0.001),
            ..Tracked::default()
        }
    }

    fn pulled(has_reference: bool, rest_n: Option<f64>, force_n: f64) -> u64 {
        let mut tally = Tally::new(has_reference, rest_n.map(bears).as_ref());
        tally.count(&bears(force_n));
        tally.pulled.0
    }

    #[test]
    fn a_load_upside_down_is_counted() {
        assert_eq!(pulled(true, None, 0.26), 1);
        // within five deviations; a push; nothing is said of the untouched sensor
        assert_eq!(pulled(true, None, 0.24), 0);
        assert_eq!(pulled(true, None, -3.0), 0);
        assert_eq!(pulled(false, None, 0.9), 0);
        // beside a frame at rest what both have in common does not count
        assert_eq!(pulled(false, Some(-2.4), 0.0), 1);
        assert_eq!(pulled(false, Some(0.9), 1.0), 0);
    }
}
