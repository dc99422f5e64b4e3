//! What is kept of the frames.

use std::collections::BTreeMap;

use glam::DVec3;

use super::quantities::{QUANTITIES, Reading, readings};
use super::skin::Skins;
use super::thinned::Thinned;
use domecast_optics::SensorOptics;
use domecast_runtime::shape::ShapeMap;
use domecast_runtime::track::Tracked;

/// Frames at most that the curves are drawn from: more than there are pixels across them.
const MAX_DRAWN: usize = 800;

/// One frame's numbers.
#[derive(Debug, Clone)]
pub(super) struct FrameNumbers {
    pub frame: u64,
    pub time_s: Option<f64>,
    pub status: &'static str,
    /// By [`QUANTITIES`].
    pub readings: [Option<Reading>; QUANTITIES.len()],
}

/// How often a status was, and in how many of these frames there were numbers.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct StatusCount {
    pub frames: u64,
    pub with_numbers: u64,
}

/// The range of one component over all frames, in the page's unit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extremes {
    pub count: u64,
    pub sum: f64,
    /// The smallest value and its frame; the largest and its.
    pub low: (f64, u64),
    pub high: (f64, u64),
}

impl Extremes {
    fn with(before: Option<Self>, value: f64, frame: u64) -> Self {
        let this = (value, frame);
        match before {
            None => Self { count: 1, sum: value, low: this, high: this },
            Some(all) => Self {
                count: all.count + 1,
                sum: all.sum + value,
                low: if value < all.low.0 { this } else { all.low },
                high: if value > all.high.0 { this } else { all.high },
            },
        }
    }
}

/// The frames of a recording, for the page.
#[derive(Debug)]
pub struct TrackReport {
    /// The design's name.
    pub(super) design: String,
    /// Whether the skin's shape was asked for.
    pub(super) has_shape: bool,
    at_mm: DVec3,
    pub(super) frames: Thinned<FrameNumbers>,
    pub(super) statuses: BTreeMap<&'static str, StatusCount>,
    /// By quantity and component.
    pub(super) extremes: [Vec<Option<Extremes>>; QUANTITIES.len()],
    pub(super) skins: Skins,
}

impl TrackReport {
    /// Before the first frame: the sensor's name, its optics at rest, the point (mm) that its wrench and its displacement are about.
    pub fn new(design: &str, rest: &SensorOptics, at_mm: DVec3, has_shape: bool) -> Self {
        Self {
            design: design.to_owned(),
            has_shape,
            at_mm,
            frames: Thinned::new(MAX_DRAWN),
            statuses: BTreeMap::new(),
            extremes: QUANTITIES.map(|quantity| vec![None; quantity.names().len()]),
            skins: Skins::new(rest),
        }
    }

    /// Takes the next frame, with the skin where it was read.
    pub fn add(&mut self, tracked: &Tracked, skin: Option<&ShapeMap>) {
        let readings = readings(tracked, skin, self.at_mm);
        let status = self.statuses.entry(tracked.status()).or_default();
        status.frames += 1;
        status.with_numbers += u64::from(readings.iter().any(Option::is_some));
        for ((quantity, reading), extremes) in QUANTITIES.iter().zip(&readings).zip(&mut self.extremes) {
            let Some(reading) = reading else { continue };
            for (value, all) in quantity.shown(reading.value).into_iter().zip(extremes) {
                *all = Some(Extremes::with(*all, value, tracked.frame));
            }
        }
        let numbers = || FrameNumbers {
            frame: tracked.frame,
            time_s: tracked.time_s,
            status: tracked.status(),
            readings,
        };
        self.frames.offer(numbers);
        if let Some(map) = skin {
            self.skins.add(tracked, map);
        }
    }
}
