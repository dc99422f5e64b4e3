//! The result of a measurement, and why there may be none.

use std::fmt;

use serde::Serialize;

use super::budget::ErrorBudget;
use super::sweep::Sweep;
use domecast_design::DesignError;
use domecast_design::parts::PartError;

/// What the measurement was made on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Machine {
    /// The processor's own name, where the system tells it.
    pub processor: String,
    /// Threads that run at once.
    pub threads: usize,
    /// Operating system and architecture.
    pub system: String,
}

impl Machine {
    pub fn here() -> Self {
        let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let name =
            info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':').map(|p| p.1));
        Self {
            processor: name.unwrap_or("unknown").trim().to_owned(),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        }
    }
}

/// One setting of the design, and why it is what it is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SettingRecord {
    /// Its field.
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// Whether it was chosen from the design's `accuracy`.
    pub chosen: bool,
    /// Why.
    pub because: String,
}

/// Everything that was measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Accuracy {
    /// Name of the design.
    pub design: String,
    /// Version of domecast.
    pub version: &'static str,
    /// Where it was measured.
    pub machine: Machine,
    /// A first look: fewer runs, and no samples that take long.
    pub quick: bool,
    /// The settings in use.
    pub settings: Vec<SettingRecord>,
    /// The sweeps.
    pub sweeps: Vec<Sweep>,
    /// What the errors come to.
    pub budgets: Vec<ErrorBudget>,
    /// Frames that have to be averaged for the design's `accuracy.force_n`, where it gives one: at rest and under every
    /// claimed load, twice over.
    pub frames_to_average: Option<u32>,
    /// Sweeps that this design does not have, with the reason.
    pub left_out: Vec<String>,
}

/// Why nothing could be measured.
#[derive(Debug, Clone, PartialEq)]
pub enum AccuracyError {
    /// The design is at fault.
    Design(Box<DesignError>),
    /// A part of the design cannot be made.
    Part(PartError),
}

impl From<DesignError> for AccuracyError {
    fn from(error: DesignError) -> Self {
        Self::Design(Box::new(error))
    }
}

impl From<PartError> for AccuracyError {
    fn from(error: PartError) -> Self {
        Self::Part(error)
    }
}

impl fmt::Display for AccuracyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Design(error) => error.fmt(f),
            Self::Part(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for AccuracyError {}
