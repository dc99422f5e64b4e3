//! What a run is made of: names of its files, its summary, and where its frames are.

use std::sync::atomic::{AtomicBool, AtomicU32};

use serde::Serialize;

use crate::contact::record::{ContactErrorTruth, ContactTruth};
use crate::electronics::deviation::CodingDeviation;
use crate::error::SimError;
use crate::output::coded::CodedFrame;
use crate::output::truth::FrameTruth;
use crate::scene::file::ToleranceSection;
use crate::work::{FollowedRays, Work};

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
    /// The frame whose contact may be furthest off; `None` without a contact.
    pub worst_contact: Option<WorstContact>,
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
    pub(super) fn note(&mut self, truth: FrameTruth, tolerance: &ToleranceSection) {
        self.note_error(&truth, tolerance);
        if let Some(note) = truth.note {
            self.notes.push((truth.frame, format!("{}: {note}", truth.status)));
        }
        let Some(ContactTruth { status, note, rays_beside, .. }) = truth.contact else { return };
        if let Some(FollowedRays { followed, beside }) = rays_beside {
            let rays = format!(
                "{beside} of {followed} rays end beside the membrane, which is too steep there: they show the nearest place found"
            );
            self.fault(RAYS_BESIDE, truth.frame, rays);
        }
        if let Some(note) = note {
            self.fault(status, truth.frame, note);
        }
    }

    /// A frame whose contact is not as asked.
    fn fault(&mut self, status: &'static str, frame: u32, note: String) {
        match self.contact.iter_mut().find(|fault| fault.status == status) {
            Some(fault) => fault.frames += 1,
            None => self.contact.push(ContactFault { status, frames: 1, first: frame, note }),
        }
    }
}

impl Summary {
    /// Takes how far a frame's contact may be off, where that is more than the tolerance.
    fn note_error(&mut self, truth: &FrameTruth, tolerance: &ToleranceSection) {
        let Some(error) = truth.contact.as_ref().and_then(|contact| contact.estimated_error) else { return };
        let over =
            (error.px / tolerance.px).max(tolerance.force_n.map_or(0.0, |max_n| error.force_n / max_n));
        if self.worst_contact.is_none_or(|worst| over > worst.over) {
            self.worst_contact = Some(WorstContact { frame: truth.frame, over, error });
        }
        if over <= 1.0 {
            return;
        }
        self.fault(BEYOND, truth.frame, String::new());
        let Some(worst) = self.worst_contact else { return };
        if let Some(fault) = self.contact.iter_mut().find(|fault| fault.status == BEYOND) {
            fault.note = format!(
                "in frame {} its level may be off by {:.2} px and {:.3} N; the tolerance is {} px{}; smaller elements \
                 (`contact.element_mm`) see smaller objects, another `contact.level` a larger strain",
                worst.frame,
                worst.error.px,
                worst.error.force_n,
                tolerance.px,
                tolerance.force_n.map_or(String::new(), |max_n| format!(" and {max_n} N"))
            );
        }
    }
}

/// The status of a contact at whose creases rays of the picture ended beside the membrane.
const RAYS_BESIDE: &str = "rays_beside";

/// The status of a contact whose level may be off by more than the scene's tolerance.
const BEYOND: &str = "beyond_tolerance";

/// The frame whose contact may be furthest off, over the tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorstContact {
    /// Its number.
    pub frame: u32,
    /// How often the tolerance.
    pub over: f64,
    /// How far.
    pub error: ContactErrorTruth,
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
