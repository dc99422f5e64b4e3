//! `track --travel`: how hard what is touched is, by contact mechanics, from what is tracked and how far the hand has moved.

use glam::DVec3;
use serde_json::Value;

use super::arguments::TrackArguments;
use super::number_lines::NumberLines;
use crate::commands::input::input_fault;
use crate::commands::output::{Failure, Output};
use crate::commands::rest_frame::RestFrame;
use domecast_hardness::physics::{Hardness, HardnessStatus};
use domecast_hardness::{ContactHardness, TrackedRest};
use domecast_runtime::constants::Constants;
use domecast_runtime::shape::ShapeMap;
use domecast_runtime::track::Tracked;
use domecast_runtime::traction::LocalForces;

/// The touch that goes on, with its lines of travel.
pub(super) struct ContactHardnessLines {
    travel: NumberLines<1>,
    touch: ContactHardness,
    /// Frames in which no object can give way as the travel has it.
    impossible: u64,
}

impl ContactHardnessLines {
    /// `None` where no travel is given.
    pub fn open(
        arguments: &TrackArguments,
        constants: &Constants,
        at_rest: Option<&RestFrame>,
        at_mm: DVec3,
    ) -> Result<Option<Self>, Failure> {
        let (Some(path), Some(at_rest)) = (&arguments.travel, at_rest) else { return Ok(None) };
        arguments.need_jsonl(path)?;
        // on a rigid mount the dots say the force
        let rest = match constants.springs {
            Some(_) => at_rest.counted_from(at_mm)?,
            None => TrackedRest::new(&at_rest.tracked, at_mm),
        };
        let touch = ContactHardness::new(constants, rest, arguments.travel_sd).ok_or_else(|| {
            let problem = "holds no `elastomer`, which --travel reads hardness by";
            input_fault(&arguments.constants, problem, "constants of a new build")
        })?;
        Ok(Some(Self { travel: NumberLines::open(Some(path), "millimetres")?, touch, impossible: 0 }))
    }

    /// Takes the frame in, with its line of the travel; what the touch so far says, and the member of the frame's line.
    pub fn take(
        &mut self,
        tracked: &Tracked,
        forces: &LocalForces,
        skin: Option<&ShapeMap>,
    ) -> Result<(Option<Hardness>, Value), Failure> {
        let travel_mm = self.travel.read_next()?.map_or(f64::NAN, |[mm]| mm);
        let found = self.touch.update(tracked, forces, skin, travel_mm);
        self.impossible += u64::from(found.is_some_and(|found| found.status == HardnessStatus::Impossible));
        Ok((found, self.touch.to_json(found.as_ref())))
    }

    /// Names travel that is not what it is taken for.
    pub fn warn(&self, output: &Output) {
        if self.impossible > 0 {
            output.warn(&format!(
                "--travel: frames in which the hand came nearer by less than a rigid object lets it, or by more than any foam: {}; is it in mm, \
                 growing towards the sensor, a line for each frame, of the hand and not of what slips in it?",
                self.impossible
            ));
        }
    }
}
