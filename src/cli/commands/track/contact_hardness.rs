//! `track --travel`: how hard what is touched is, by contact mechanics, from what is tracked and how far the hand has moved.

use std::f64::consts::PI;

use glam::DVec3;
use serde_json::{Value, json};

use super::arguments::TrackArguments;
use super::number_lines::NumberLines;
use super::rest_frame::RestFrame;
use crate::commands::input::input_fault;
use crate::commands::output::{Failure, Output};
use domecast_dataset::TrackedRest;
use domecast_hardness::physics::{Dome, Hardness, HardnessStatus, PressRow, Prior};
use domecast_hardness::touch::TouchHardness;
use domecast_runtime::constants::Constants;
use domecast_runtime::shape::ShapeMap;
use domecast_runtime::track::Tracked;
use domecast_runtime::traction::{ContactEstimate, LocalForces, TractionStatus};
use domecast_springs::Wrench;

/// Young's moduli that objects may have, MPa: from the softest foams to ten times what a dome of silicone tells from a rigid object.
const YOUNG_MPA: [f64; 2] = [0.01, 10.0];
/// Poisson's ratio that objects are taken to have: of rubbers, as the shipped sets draw it (0.45 to 0.49).
const POISSON: f64 = 0.47;

/// The area by the forces' moments is taken where it is within this factor of that where the skin is seen to be touched: a rim that bears
/// alone makes it 5/3, what is not seen well more.
const MAX_WIDER: f64 = 2.0;

/// The touch that goes on, frame by frame.
pub(super) struct ContactHardness {
    travel: NumberLines,
    touch: TouchHardness,
    /// Where springs say the force.
    rest: Option<TrackedRest>,
    rest_sd: Option<Wrench>,
    at_mm: DVec3,
    /// Frames in which no object can give way as the travel has it.
    impossible: u64,
}

impl ContactHardness {
    /// `None` where no travel is given.
    pub fn open(
        arguments: &TrackArguments,
        constants: &Constants,
        at_rest: Option<&RestFrame>,
        at_mm: DVec3,
    ) -> Result<Option<Self>, Failure> {
        let (Some(path), Some(at_rest)) = (&arguments.travel, at_rest) else { return Ok(None) };
        arguments.need_jsonl(path)?;
        let Some(elastomer) = &constants.elastomer else {
            let problem = "holds no `elastomer`, which --travel reads hardness by";
            return Err(input_fault(&arguments.constants, problem, "constants of a new build"));
        };
        let rest = constants.springs.as_ref().map(|_| at_rest.counted_from(at_mm)).transpose()?;
        let shape = constants.optics.dome();
        let dome = Dome {
            radius_mm: shape.radius_mm(),
            center_mm: shape.center_mm(),
            young_mpa: elastomer.young_modulus_mpa,
            young_sd_mpa: elastomer.young_modulus_sd_mpa,
            poisson: elastomer.poisson_ratio,
            at_mm,
        };
        let prior = Prior {
            young_mpa: YOUNG_MPA,
            poisson: POISSON,
            travel_sd_mm: arguments.travel_sd,
            force_sd_part: 0.0,
        };
        Ok(Some(Self {
            travel: NumberLines::open(Some(path), "millimetres")?,
            touch: TouchHardness::new(dome, prior),
            rest,
            rest_sd: at_rest.tracked.wrench_sd,
            at_mm,
            impossible: 0,
        }))
    }

    /// Takes the frame in, with its line of the travel; what the touch so far says, `None` where there is none or the frame is not `ok`.
    pub fn take(
        &mut self,
        tracked: &Tracked,
        forces: &LocalForces,
        skin: Option<&ShapeMap>,
    ) -> Result<Option<Hardness>, Failure> {
        let travel_mm = self.travel.read_next()?.unwrap_or(f64::NAN);
        if tracked.status() != "ok" || forces.status != TractionStatus::Ok {
            return Ok(None);
        }
        let Some(contact) = &forces.contact else {
            self.touch.end();
            return Ok(None);
        };
        let (mut row, force_sd_part) = self.row(tracked, contact, travel_mm);
        // a light touch is not seen, or its forces lie all over the dome
        let wide = skin.and_then(|map| map.contact.as_ref()).map(|seen| contact.area_mm2 / seen.area_mm2);
        if !wide.is_some_and(|wide| (1.0 / MAX_WIDER..=MAX_WIDER).contains(&wide)) {
            row[13] = f64::NAN;
        }
        let found = self.touch.push(&row, force_sd_part);
        self.impossible += u64::from(found.status == HardnessStatus::Impossible);
        Ok(Some(found))
    }

    /// The member of the frame's line.
    pub fn member(&self, found: Option<&Hardness>) -> Value {
        let Some(found) = found else { return Value::Null };
        let is_measured = found.status.is_measured();
        json!({
            "status": found.status.as_str(),
            "log10_youngs_modulus_mpa": is_measured.then_some(found.log10_young),
            "interval_90": is_measured.then_some(found.interval),
            "frames": self.touch.frames(),
        })
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

    /// The frame's numbers, and how unsure the scale of its force is.
    fn row(&self, tracked: &Tracked, contact: &ContactEstimate, travel_mm: f64) -> (PressRow, f64) {
        let ([wrench, platform], sd_n) = if let Some(rest) = &self.rest {
            (rest.rigid(tracked), self.scale_sd_n(tracked))
        } else {
            // nothing yields but the dome, whose dots say the force
            let moment_nmm = (contact.point_mm - self.at_mm).cross(contact.force_n);
            let wrench = Wrench { force_n: contact.force_n, moment_nmm };
            ([wrench.to_array(), [0.0; 6]], contact.force_sd_n)
        };
        let force = DVec3::from_slice(&wrench[..3]);
        let force_sd_part = (force.normalize_or_zero() * sd_n).length() / force.length();
        let mut row = PressRow::default();
        row[..6].copy_from_slice(&wrench);
        row[6..12].copy_from_slice(&platform);
        row[12] = travel_mm;
        row[13] = (contact.area_mm2 / PI).sqrt();
        (row, if force_sd_part.is_finite() { force_sd_part } else { 0.0 })
    }

    /// Deviations of the wrench that the load has brought, N: what stays from frame to frame is in the rest as well.
    fn scale_sd_n(&self, tracked: &Tracked) -> DVec3 {
        let Some((now, rest)) = tracked.wrench_sd.zip(self.rest_sd) else { return DVec3::ZERO };
        let square = now.force_n * now.force_n - rest.force_n * rest.force_n;
        square.max(DVec3::ZERO).map(f64::sqrt)
    }
}
