//! A whole sequence: frames, video and truth into a folder, written whole or not at all.
//!
//! Contact is solved frame by frame, for friction remembers the way. Meanwhile other threads draw and code the frames that
//! are solved, and one thread writes them in their order.

mod coded;
mod depth;
mod develop;
pub(crate) mod drawn;
mod error;
mod in_order;
mod parts;
pub(crate) mod render;
mod sequence;
mod timing;
pub(crate) mod truth;
mod video;
mod writer;

use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError, mpsc};
use std::time::Duration;

use domecast_files::{OutputRules, StagedFolder};

use crate::SimError;
use crate::contact::between::Around;
use crate::contact::stepper::{Stepper, Touch};
use crate::output::drawn::{Drawn, Scratch};
use crate::output::in_order::{InOrder, Ready};
use crate::output::render::Renderer;
use crate::plan::Plan;
use crate::scene::Scene;
use crate::work::Work;

use coded::CodedFrame;
pub use depth::{BearingMaps, DepthMaps, DepthTruth};
pub use error::RunError;
pub use parts::{ContactFault, PLAN_NAME, Summary, TRUTH_NAME, VIDEO_NAME, WorstContact};
use parts::{Pending, Sent};
pub use sequence::{LiveScene, each_frame};
use writer::Writer;

/// Frames on their way from contact to file, for each thread.
const AHEAD_PER_THREAD: u32 = 4;

/// How long a thread waits that has nothing to do.
const PAUSE: Duration = Duration::from_micros(200);

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
    let staged = StagedFolder::new(out, "simulate", &OutputRules::default())?;
    let summary = fill(scene, plan, &staged, progress)?;
    staged.commit()?;
    Ok(summary)
}

/// [`run`] into a folder that was staged before, and is committed by the caller.
///
/// # Errors
/// [`RunError`].
pub fn fill(
    scene: &Scene,
    plan: &Plan,
    staged: &StagedFolder,
    progress: &mut dyn FnMut(u32),
) -> Result<Summary, RunError> {
    let renderer = Renderer::new(scene, plan)?;
    let state = Pending::default();
    let (send, receive) = mpsc::channel();
    let writer = Writer::new(scene, staged.path())?;
    let (solved, written) = std::thread::scope(|threads| {
        let state = &state;
        let written = threads.spawn(move || writer.write_all(&receive, state));
        let solved = draw_all(scene, &renderer, state, send, progress);
        (solved, written.join())
    });
    // A thread that panics has reported so itself.
    let mut summary = written.unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
    summary.work.merge(&solved?);
    summary.work.merge(renderer.setup());
    // numbers, strings and lists only: nothing here can fail to be written
    let text = serde_json::to_string_pretty(plan).unwrap_or_default() + "\n";
    staged.write(PLAN_NAME, text.as_bytes())?;
    Ok(summary)
}

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
    let buffers: Mutex<Vec<Scratch>> = Mutex::new(Vec::new());
    let order = Mutex::new(InOrder::new(&renderer.pipeline().metering));
    let max_ahead = AHEAD_PER_THREAD * rayon::current_num_threads().max(1) as u32;
    let mut reported = 0;
    let mut wait = |until: u32| {
        loop {
            let written = state.written.load(Ordering::Acquire);
            if written > reported {
                reported = written;
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
            wait(number.saturating_sub(max_ahead - 1));
            if state.stopped.load(Ordering::Acquire) {
                break;
            }
            state.begun.store(number + 1, Ordering::Release);
            let (buffers, order, send) = (&buffers, &order, send.clone());
            scope.spawn(move |_| {
                let mut scratch = lock(buffers).pop().unwrap_or_default();
                let ready: Vec<Result<Ready, (u32, SimError)>> =
                    match renderer.expose(number, around.as_ref(), &mut scratch) {
                        Ok(exposed) => lock(order).ready(number, exposed).into_iter().map(Ok).collect(),
                        Err(error) => vec![Err((number, error))],
                    };
                for exposed in ready {
                    // The writer that is gone has met a fault of its own.
                    let _ = match exposed {
                        Ok((number, exposed, gains)) => {
                            let drawn = renderer.develop(exposed, &gains, &mut scratch);
                            send.send((number, coded(scene, drawn, &mut scratch)))
                        }
                        Err((number, error)) => send.send((number, Err(error))),
                    };
                }
                lock(buffers).push(scratch);
            });
        }
        Ok(())
    });
    drop(send);
    stepper.iter_mut().for_each(Stepper::store);
    wait(state.begun.load(Ordering::Acquire));
    solved.map(|()| work)
}

/// What a thread left in a panic is memory to reuse, or frames that nobody waits for any more.
fn lock<T>(shared: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

fn coded(scene: &Scene, drawn: Drawn, scratch: &mut Scratch) -> Result<CodedFrame, SimError> {
    let number = drawn.truth.frame;
    let (coded, image) = CodedFrame::new(scene, drawn).map_err(|problem| SimError::Frame {
        frame: number,
        problem: format!("its files cannot be coded: {problem}"),
    })?;
    image.into_iter().for_each(|image| scratch.give_back(image));
    Ok(coded)
}
