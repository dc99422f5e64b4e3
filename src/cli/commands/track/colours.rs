//! Whether raw frames have their colours in the order that `--raw` says: looked at once, beside the frames, which do not wait.

use std::thread::{self, JoinHandle};

use super::super::output::Output;
use domecast_live::decode::Picture;
use domecast_runtime::constants::Constants;
use domecast_runtime::shape::are_colours_judged;
use domecast_runtime::track::Tracker;

/// The look at the first good frame.
pub(super) enum ColourCheck {
    Wanted,
    Running(JoinHandle<Option<String>>),
    Done,
}

impl ColourCheck {
    /// `is_wanted`: of raw frames; a picture in a file says which of its colours is red.
    pub fn new(is_wanted: bool) -> Self {
        if is_wanted { Self::Wanted } else { Self::Done }
    }

    /// After each frame that was tracked: begins where it is good, and says what was found.
    pub fn step(&mut self, output: &Output, constants: &Constants, tracker: &Tracker, picture: &Picture) {
        match self {
            Self::Wanted if tracker.result().problems.is_empty() => {
                let (constants, tracker, picture) = (constants.clone(), tracker.clone(), picture.clone());
                *self = Self::Running(thread::spawn(move || look(&constants, &tracker, &picture)));
            }
            Self::Running(look) if look.is_finished() => self.end(output),
            _ => {}
        }
    }

    /// Waits for what is being looked at.
    pub fn end(&mut self, output: &Output) {
        if let Self::Running(look) = std::mem::replace(self, Self::Done)
            && let Ok(Some(fault)) = look.join()
        {
            output.fault(&fault);
        }
    }
}

fn look(constants: &Constants, tracker: &Tracker, picture: &Picture) -> Option<String> {
    let frame = picture.frame().ok()?;
    let error = are_colours_judged(constants, tracker, &frame).err()?;
    Some(format!("frame {}: {}; {}", tracker.result().frame, error.problem, error.cure))
}
