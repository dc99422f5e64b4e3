//! What contact mechanics needs to know: the dome, and the readings of a frame.

use glam::DVec3;
use serde_json::Value;

use crate::columns::PRESS_COLUMNS;

/// The readings of a frame that the formula needs: wrench, displacement of the platform, travel of the hand, radius of the contact
/// ([`PRESS_COLUMNS`]).
pub type PressRow = [f64; PRESS_COLUMNS.len()];

/// The dome that feels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dome {
    /// Radius, mm.
    pub radius_mm: f64,
    /// Centre of its sphere, mm.
    pub center_mm: DVec3,
    /// Young's modulus, MPa.
    pub young_mpa: f64,
    /// Its standard deviation, MPa; of a data set 0: what its sensors differ by is in what the formula leaves open.
    pub young_sd_mpa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Point about which wrench and displacement are stated, mm.
    pub at_mm: DVec3,
}

impl Dome {
    /// The nominal dome of a data set by its `dataset.json`; `None` where a number is missing.
    pub fn of_set(index: &Value) -> Option<Self> {
        let number = |path: &str| index.pointer(path).and_then(Value::as_f64);
        let at = |k: usize| number(&format!("/dome/reference_mm/{k}"));
        Some(Self {
            radius_mm: number("/dome/radius_mm")?,
            // sets of earlier versions do not have it: those of a hemisphere need none
            center_mm: DVec3::Z * number("/dome/center_z_mm").unwrap_or(0.0),
            young_mpa: number("/dome/youngs_modulus_mpa")?,
            young_sd_mpa: 0.0,
            poisson: number("/dome/poisson")?,
            at_mm: DVec3::new(at(0)?, at(1)?, at(2)?),
        })
    }
}
