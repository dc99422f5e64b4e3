//! What is wrong with all frames for some while, and what cures it: wrong constants above all.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::commands::track::turned_hint;
use domecast_runtime::track::{Problem, Tracked};

/// From the first bad frame to the word of it, and how many are needed.
const PATIENCE: Duration = Duration::from_millis(500);
const MIN_FRAMES: u64 = 5;

/// What a run of bad frames has in common.
#[derive(Debug, Clone, PartialEq)]
pub struct Persistent {
    /// The status that most of them have.
    pub status: &'static str,
    /// What it means and what to do.
    pub message: String,
}

/// Watches for frames that say nothing, one after the other.
#[derive(Default)]
pub struct Health {
    since: Option<Instant>,
    counts: BTreeMap<&'static str, u64>,
    status: Option<&'static str>,
}

impl Health {
    /// The status of all lately frames, where it is a bad one that was named.
    pub fn status(&self) -> Option<&'static str> {
        self.status
    }

    /// Looks at a reading; says once what is wrong with all of them.
    pub fn watch(&mut self, tracked: &Tracked, now: Instant) -> Option<Persistent> {
        let gravest = tracked.problems.iter().next().filter(|problem| cure(*problem, tracked).is_some());
        let Some(problem) = gravest else {
            *self = Self::default();
            return None;
        };
        let since = *self.since.get_or_insert(now);
        *self.counts.entry(problem.as_str()).or_default() += 1;
        let count: u64 = self.counts.values().sum();
        if self.status.is_some() || count < MIN_FRAMES || now.duration_since(since) < PATIENCE {
            return None;
        }
        let (status, _) = self.counts.iter().max_by_key(|(_, count)| **count)?;
        // the cure of this frame's problem where it is the one that most have, else of that one in general
        let named = tracked.problems.iter().find(|problem| problem.as_str() == *status).unwrap_or(problem);
        self.status = Some(named.as_str());
        Some(Persistent { status: named.as_str(), message: cure(named, tracked)? })
    }
}

/// What a problem that stays means; `None` for those that numbers stand beside.
pub fn cure(problem: Problem, tracked: &Tracked) -> Option<String> {
    let other = "name the constants.json of the sensor that is before the camera";
    Some(match problem {
        Problem::Unreadable => "no frame can be read: look at the cable, or ask for another rate".into(),
        Problem::WrongSize => {
            format!(
                "the frames do not have the size of the constants' camera: {other}, or set the camera to that size"
            )
        }
        Problem::Dark => "the frames are dark: switch the sensor's light on, or give more --exposure".into(),
        Problem::Saturated => "the frames are white: give less --exposure or --gain".into(),
        Problem::Turned | Problem::Mirrored => match tracked.camera_turn {
            Some(turn) => turned_hint(turn),
            None => "the picture is turned or mirrored against the constants".into(),
        },
        Problem::NoMarks => {
            format!(
                "nothing in the frames is a mark of this sensor: {other}; or the lens is covered or far out of focus"
            )
        }
        Problem::MarkersMissing => {
            format!("too few white markers are seen: {other}; or something covers them")
        }
        Problem::MarkersDoNotFit | Problem::ForeignConstants => {
            format!(
                "the marks are not where the constants have them, they are another sensor's or camera's: {other}"
            )
        }
        Problem::BeyondSprings => {
            format!("the platform is where its springs cannot have it: {other}; or the sensor is damaged")
        }
        Problem::KeyUnsure => {
            "the gap that tells how the picture lies is not seen: clean the dome, or, if the camera is as \
            the constants say, read with --camera-turned 0"
                .into()
        }
        _ => return None,
    })
}
