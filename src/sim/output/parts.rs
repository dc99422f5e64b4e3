//! What a run is made of: names of its files, its summary, and where its frames are.

use std::sync::atomic::{AtomicBool, AtomicU32};

use serde::Serialize;

use crate::contact::record::ContactTruth;
use crate::electronics::deviation::CodingDeviation;
use crate::error::SimError;
use crate::output::coded::CodedFrame;
use crate::output::truth::FrameTruth;
use crate::work::Work;

/// Names of the files beside the frames.
pub const TRUTH_NAME: &str = "truth.jsonl";
/// The frames as one file.
pub const VIDEO_NAME: &str = "video.avi";
/// The plan and what it took.
pub const PLAN_NAME: &str = "plan.json";

/// What a run made.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Summary {
    /// Frames written.
    pub frames: u32,
    /// What could not be as asked, by frame: the platform is held.
    pub notes: Vec<(u32, String)>,
    /// Frames whose contact is not what the level asks for, by its status in the truth.
    pub contact: Vec<ContactFault>,
    /// What the camera's lossy code made of all pictures; `None` without one.
    pub coding: Option<CodingDeviation>,
    /// What it took in all.
    pub work: Work,
}

/// Frames whose contact ended in the same way, short of what the level asks for.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ContactFault {
    /// The contact's status in the truth.
    pub status: &'static str,
    /// How many frames.
    pub frames: u32,
    /// Number of the first one.
    pub first: u32,
    /// What the status means in that one.
    pub note: String,
}

impl Summary {
    /// Takes what a lossy code made of a frame.
    pub(super) fn add_coding(&mut self, coding: Option<CodingDeviation>) {
        match (&mut self.coding, coding) {
            (Some(sum), Some(coding)) => sum.merge(&coding),
            (sum @ None, coding) => *sum = coding,
            (Some(_), None) => {}
        }
    }

    /// Takes what a frame's truth says that is not as asked.
    pub(super) fn note(&mut self, truth: FrameTruth) {
        if let Some(note) = truth.note {
            self.notes.push((truth.frame, format!("{}: {note}", truth.status)));
        }
        let Some(ContactTruth { status, note: Some(note), .. }) = truth.contact else { return };
        match self.contact.iter_mut().find(|fault| fault.status == status) {
            Some(fault) => fault.frames += 1,
            None => self.contact.push(ContactFault { status, frames: 1, first: truth.frame, note }),
        }
    }
}

/// Where the frames are between those who solve, draw and write them.
#[derive(Default)]
pub(super) struct Pending {
    /// Frames that are solved, and those that are written.
    pub begun: AtomicU32,
    pub written: AtomicU32,
    /// No further frame is wanted.
    pub stopped: AtomicBool,
}

/// A frame's bytes, or why there are none.
pub(super) type Sent = (u32, Result<CodedFrame, SimError>);
