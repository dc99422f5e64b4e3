//! By contact mechanics: from what is tracked, the forces on the skin, its shape, and how far the hand has moved.

use std::f64::consts::PI;

use glam::DVec3;
use serde_json::{Value, json};

use super::rest::TrackedRest;
use crate::physics::{Dome, Hardness, PressRow, Prior};
use crate::touch::TouchHardness;
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
#[derive(Debug, Clone)]
pub struct ContactHardness {
    touch: TouchHardness,
    rest: TrackedRest,
    has_springs: bool,
}

impl ContactHardness {
    /// For the hand's travel with noise of this deviation, mm; `None` where the constants hold no elastomer. On springs the rest must be
    /// known ([`TrackedRest::is_known`]).
    pub fn new(constants: &Constants, rest: TrackedRest, travel_sd_mm: f64) -> Option<Self> {
        let elastomer = constants.elastomer.as_ref()?;
        let shape = constants.optics.dome();
        let dome = Dome {
            radius_mm: shape.radius_mm(),
            center_mm: shape.center_mm(),
            young_mpa: elastomer.young_modulus_mpa,
            young_sd_mpa: elastomer.young_modulus_sd_mpa,
            poisson: elastomer.poisson_ratio,
            at_mm: rest.at_mm(),
        };
        let prior = Prior { young_mpa: YOUNG_MPA, poisson: POISSON, travel_sd_mm, force_sd_part: 0.0 };
        let touch = TouchHardness::new(dome, prior);
        Some(Self { touch, rest, has_springs: constants.springs.is_some() })
    }

    /// Takes the frame in, with how far the hand has brought sensor and object together, mm from anywhere; what the touch so far says, `None`
    /// where nothing touches or the frame is not `ok`. Without the frame's shape nothing is measured.
    pub fn update(
        &mut self,
        tracked: &Tracked,
        forces: &LocalForces,
        skin: Option<&ShapeMap>,
        travel_mm: f64,
    ) -> Option<Hardness> {
        if tracked.status() != "ok" || forces.status != TractionStatus::Ok {
            return None;
        }
        let Some(contact) = &forces.contact else {
            self.touch.end();
            return None;
        };
        let (mut row, force_sd_part) = self.row(tracked, contact, travel_mm);
        // a light touch is not seen, or its forces lie all over the dome
        let wide = skin.and_then(|map| map.contact.as_ref()).map(|seen| contact.area_mm2 / seen.area_mm2);
        if !wide.is_some_and(|wide| (1.0 / MAX_WIDER..=MAX_WIDER).contains(&wide)) {
            row[13] = f64::NAN;
        }
        Some(self.touch.push(&row, force_sd_part))
    }

    /// Frames of the touch so far.
    pub fn frames(&self) -> u64 {
        self.touch.frames()
    }

    /// What a frame has said, as `track` writes it.
    pub fn to_json(&self, found: Option<&Hardness>) -> Value {
        let Some(found) = found else { return Value::Null };
        let is_measured = found.status.is_measured();
        json!({
            "status": found.status.as_str(),
            "log10_youngs_modulus_mpa": is_measured.then_some(found.log10_young),
            "interval_90": is_measured.then_some(found.interval),
            "frames": self.frames(),
        })
    }

    /// The frame's numbers, and how unsure the scale of its force is.
    fn row(&self, tracked: &Tracked, contact: &ContactEstimate, travel_mm: f64) -> (PressRow, f64) {
        let ([wrench, platform], sd_n) = if self.has_springs {
            (self.rest.rigid(tracked), self.rest.load_sd_n(tracked))
        } else {
            // nothing yields but the dome, whose dots say the force
            let moment_nmm = (contact.point_mm - self.rest.at_mm()).cross(contact.force_n);
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
}
