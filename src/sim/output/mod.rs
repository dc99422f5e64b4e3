//! A whole sequence: frames, video and truth into a folder, written whole or not at all.
//!
//! Contact is solved frame by frame, for friction remembers the way. Meanwhile other threads draw and code the frames that
//! are solved, and one thread writes them in their order.

mod coded;
mod error;
mod folder;
mod video;
mod writer;

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError, mpsc};
use std::time::Duration;

use serde::Serialize;

use crate::SimError;
use crate::plan::Plan;
use crate::render::{Around, Renderer, Scratch};
use crate::scene::Scene;
use crate::touch::Touch;
use crate::truth::{ContactTruth, FrameTruth};
use crate::work::Work;

use coded::CodedFrame;
pub use error::RunError;
use error::fault;
use folder::Staging;
use writer::Writer;

/// Frames on their way from contact to file, for each thread.
const AHEAD_PER_THREAD: u32 = 4;

/// How long a thread waits that has nothing to do.
const PAUSE: Duration = Duration::from_micros(200);

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
    /// Takes what a frame's truth says that is not as asked.
    fn note(&mut self, truth: FrameTruth) {
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

/// Draws all frames of a scene with a plan into a folder; `progress` is called as frames are written, with their count.
///
/// The folder is filled beside its place and moved there at the end: it is whole or as it was. Frames are drawn
/// in parallel on rayon's threads; the bytes do not depend on their number.
///
/// # Errors
/// [`RunError`].
pub fn run(
    scene: &Scene,
    plan: &Plan,
    out: &Path,
    progress: &mut dyn FnMut(u32),
) -> Result<Summary, RunError> {
    let staging = Staging::new(out)?;
    let renderer = Renderer::new(scene, plan)?;
    let state = Pending::default();
    let (send, receive) = mpsc::channel();
    let writer = Writer::new(scene, &staging.fresh)?;
    let (solved, written) = std::thread::scope(|threads| {
        let state = &state;
        let written = threads.spawn(move || writer.write_all(&receive, state));
        let solved = draw_all(scene, &renderer, state, send, progress);
        (solved, written.join())
    });
    // A thread that panics has told so itself.
    let mut summary = written.unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
    summary.work.merge(&solved?);
    summary.work.merge(renderer.setup());
    let plan_path = staging.fresh.join(PLAN_NAME);
    // numbers, strings and lists only: nothing here can fail to be written
    let text = serde_json::to_string_pretty(plan).unwrap_or_default() + "\n";
    fs::write(&plan_path, text).map_err(fault("write the plan", &plan_path))?;
    staging.finish(out)?;
    Ok(summary)
}

/// Where the frames are between those who solve, draw and write them.
#[derive(Default)]
struct Pending {
    /// Frames that are solved, and those that are written.
    begun: AtomicU32,
    written: AtomicU32,
    /// No further frame is wanted.
    stopped: AtomicBool,
}

/// A frame's bytes, or why there are none.
type Sent = (u32, Result<CodedFrame, SimError>);

/// Solves contact in order and has each frame drawn and coded as soon as it and its neighbours are solved; what contact
/// took.
fn draw_all(
    scene: &Scene,
    renderer: &Renderer<'_>,
    state: &Pending,
    send: mpsc::Sender<Sent>,
    progress: &mut dyn FnMut(u32),
) -> Result<Work, SimError> {
    let count = scene.frame_count();
    let mut work = Work::default();
    let mut stepper = renderer.stepper()?;
    let rooms: Mutex<Vec<Scratch>> = Mutex::new(Vec::new());
    let most = AHEAD_PER_THREAD * rayon::current_num_threads().max(1) as u32;
    let mut told = 0;
    let mut wait = |until: u32| {
        loop {
            let written = state.written.load(Ordering::Acquire);
            if written > told {
                told = written;
                progress(written);
            }
            if written >= until || state.stopped.load(Ordering::Acquire) {
                return;
            }
            if rayon::yield_now() != Some(rayon::Yield::Executed) {
                std::thread::sleep(PAUSE);
            }
        }
    };
    let solved = rayon::in_place_scope(|scope| {
        // The touched dome, from the frame before the next one on.
        let mut touches: Vec<Touch> = Vec::new();
        for number in 0..count {
            let first = number.saturating_sub(1);
            if let Some(stepper) = &mut stepper {
                touches.drain(..touches.len().min(usize::from(number > 1)));
                for next in first + touches.len() as u32..count.min(number.saturating_add(2)) {
                    touches.push(stepper.next(next, scene.time_s(next), &mut work)?);
                }
            }
            let around = Around::of(&touches, (number - first) as usize);
            wait(number.saturating_sub(most - 1));
            if state.stopped.load(Ordering::Acquire) {
                break;
            }
            state.begun.store(number + 1, Ordering::Release);
            let (rooms, send) = (&rooms, send.clone());
            scope.spawn(move |_| {
                let mut room = lock(rooms).pop().unwrap_or_default();
                let coded = coded(scene, renderer, number, around.as_ref(), &mut room);
                lock(rooms).push(room);
                // The writer that is gone has met a fault of its own.
                let _ = send.send((number, coded));
            });
        }
        Ok(())
    });
    drop(send);
    wait(state.begun.load(Ordering::Acquire));
    solved.map(|()| work)
}

/// What a thread that panicked left is room only.
fn lock(rooms: &Mutex<Vec<Scratch>>) -> std::sync::MutexGuard<'_, Vec<Scratch>> {
    rooms.lock().unwrap_or_else(PoisonError::into_inner)
}

fn coded(
    scene: &Scene,
    renderer: &Renderer<'_>,
    number: u32,
    around: Option<&Around>,
    room: &mut Scratch,
) -> Result<CodedFrame, SimError> {
    let drawn = renderer.frame_around(number, around, room)?;
    let (coded, image) = CodedFrame::new(scene, drawn).map_err(|problem| SimError::Frame {
        frame: number,
        problem: format!("its files cannot be coded: {problem}"),
    })?;
    image.into_iter().for_each(|image| room.give_back(image));
    Ok(coded)
}
