//! The lights as circuits: current, series resistor, power and temperature of each, and the sensor's sum.
//!
//! A light of forward voltage `V_f` gets `I = (V - V_f) / R` through its resistor (Ohm's law) and sends `eta I` of light.
//! What it takes, `V_f I`, less that light, warms its board and junction; all of `V_f I` stays in the sensor and warms the
//! platform. The forward voltage is taken as constant: 0.1 V more or less moves the current by `0.1 V / (V - V_f)`.
//!
//! ```
//! use domecast_design::Design;
//! use domecast_design::electrical::Electrical;
//!
//! let design: Design = include_str!("../../../designs/thumb24.json").parse()?;
//! let electrical = Electrical::of(&design)?.expect("thumb24 has lights with resistors");
//! let red = &electrical.lights[0];
//! assert_eq!(red.resistor_ohm, Some(130.0));
//! assert!((red.current_ma - 1000.0 * (5.0 - 1.8) / 130.0).abs() < 1e-12);
//! # Ok::<(), domecast_design::DesignError>(())
//! ```

mod board;
mod circuit;
mod e24;
mod faults;
#[cfg(test)]
mod tests;

pub use board::{BoardPad, BoardRect, LedBoard};
pub use circuit::{Electrical, LedCircuit};
pub use e24::{RANGE_OHM, nearest_ohm, rating_w};

use crate::spec::sections::{LedDrive, LedsSection};
use crate::spec::{Design, DesignError, DesignWarning};

impl Electrical {
    /// The circuits of a design; `None` without lights, or where they have drivers of their own.
    ///
    /// # Errors
    /// What cannot be, by field: a supply below a forward voltage, a current or temperature above its limit, a resistor
    /// that nobody sells, more light than power.
    pub fn of(design: &Design) -> Result<Option<Self>, DesignError> {
        Self::of_leds(&design.sections().leds)
    }

    /// The same from the section alone.
    ///
    /// # Errors
    /// As [`Electrical::of`].
    pub fn of_leds(leds: &LedsSection) -> Result<Option<Self>, DesignError> {
        let section = &leds.electrical;
        if leds.list.is_empty() || section.drive == LedDrive::OwnDriver {
            return Ok(None);
        }
        DesignError::all(faults::of_inputs(leds))?;
        let mut lights: Vec<LedCircuit> =
            leds.list.iter().enumerate().map(|(i, led)| circuit::circuit(leds, i, led)).collect();
        let sum = |of: &dyn Fn(&LedCircuit) -> f64| lights.iter().map(of).sum::<f64>();
        let power_in_sensor_mw = sum(&|light| light.light_power_mw);
        let total_current_ma = sum(&|light| light.current_ma);
        let platform_c = section.ambient_c + 1e-3 * section.platform_to_air_k_per_w * power_in_sensor_mw;
        for light in &mut lights {
            let heat_w = 1e-3 * (light.light_power_mw - light.flux_mw);
            light.board_c = platform_c + section.board_to_platform_k_per_w * heat_w;
            light.junction_c = light.board_c + section.junction_to_board_k_per_w * heat_w;
        }
        let found = Self {
            supply_voltage_v: section.supply_voltage_v,
            lights,
            total_current_ma,
            total_power_mw: total_current_ma * section.supply_voltage_v,
            power_in_sensor_mw,
            platform_c,
        };
        DesignError::all(faults::of_circuits(leds, &found))?;
        Ok(Some(found))
    }

    /// What the maker should know.
    pub fn warnings(&self, leds: &LedsSection) -> Vec<DesignWarning> {
        faults::warnings(leds, self)
    }
}
