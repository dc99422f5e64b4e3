//! The readings on a terminal, in place.

use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::time::{Duration, Instant};

use domecast_runtime::track::{MarkState, Tracked};

/// From view to view: what can be read.
const STEP: Duration = Duration::from_millis(100);

/// What the view shows beside what is tracked.
pub struct ViewedReading<'a> {
    /// Device, size, format, controls, page, recording.
    pub head: &'a str,
    /// The device's status, or what is wrong with all frames.
    pub device: &'a str,
    pub rate_hz: f64,
    pub age_ms: f64,
    pub age_p50_ms: f64,
    pub age_p99_ms: f64,
    pub dropped: u64,
    /// What a model says of the hardness; `None` without a model.
    pub hardness: Option<String>,
}

/// Draws over its own last view.
#[derive(Default)]
pub struct TerminalView {
    lines: usize,
    last: Option<Instant>,
}

impl TerminalView {
    /// Shows a reading, if the last view has stood long enough.
    pub fn show(&mut self, tracked: &Tracked, around: &ViewedReading<'_>) -> io::Result<()> {
        if self.last.is_some_and(|last| last.elapsed() < STEP) {
            return Ok(());
        }
        self.last = Some(Instant::now());
        let text = view(tracked, around);
        let mut out = io::stdout().lock();
        if self.lines > 0 {
            write!(out, "\x1b[{}A", self.lines)?;
        }
        self.lines = text.lines().count();
        for line in text.lines() {
            writeln!(out, "\x1b[2K{line}")?;
        }
        out.flush()
    }

    /// What comes now stands below the view.
    pub fn leave(&mut self) {
        self.lines = 0;
    }
}

fn six(values: Option<[f64; 6]>, sds: Option<[f64; 6]>, from: usize, places: usize) -> String {
    let Some(values) = values else { return "not measured".into() };
    let mut text = String::new();
    for axis in from..from + 3 {
        let _ = write!(text, "{:>9.places$}", values[axis]);
        if let Some(sds) = sds {
            let _ = write!(text, " ± {:<7.places$}", sds[axis]);
        }
    }
    text.trim_end().to_owned()
}

fn view(tracked: &Tracked, around: &ViewedReading<'_>) -> String {
    let problems: Vec<&str> = tracked.problems.iter().map(|problem| problem.as_str()).collect();
    let status = if problems.is_empty() { "ok".to_owned() } else { problems.join(", ") };
    let (wrench, sd) = (tracked.wrench.map(|w| w.to_array()), tracked.wrench_sd.map(|w| w.to_array()));
    let markers = tracked.white_markers.iter().filter(|m| m.state == MarkState::Ok).count();
    let ViewedReading { head, device, rate_hz, age_ms, age_p50_ms, age_p99_ms, dropped, hardness } = around;
    let hardness = hardness.as_ref().map_or(String::new(), |said| format!("hardness {said}\n"));
    format!(
        "{head}\n\
         device  {device}\n\
         frame   {} {status}\n\
         force   {} N\n\
         torque  {} N mm\n\
         marks   {} of {} dots, {markers} of {} markers\n\
         rate    {rate_hz:.1} frames/s, {dropped} dropped\n\
         age     {age_ms:.2} ms, half of them to {age_p50_ms:.2}, 99 of 100 to {age_p99_ms:.2} ms\n{hardness}",
        tracked.frame,
        six(wrench, sd, 0, 4),
        six(wrench, sd, 3, 3),
        tracked.count(MarkState::Ok),
        tracked.black_dots.len(),
        tracked.white_markers.len(),
    )
}
