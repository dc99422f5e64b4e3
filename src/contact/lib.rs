//! An object against the dome: pressure, friction, displacement of the membrane, in three levels.
//!
//! | level | what it is | where it ends |
//! |---|---|---|
//! | [`Level::Geometric`] | what lies inside the object is pushed out of it; force of an elastic foundation | any shape; nothing outside the object moves |
//! | [`Level::ClosedForm`] | Hertz' ellipse, Sneddon's cone, Mindlin's friction, with the bonded base's correction | smooth faces and apices, contacts well inside the face and the dome |
//! | [`Level::Linear`] | linear elasticity of the whole dome bonded to the sheet, unilateral contact with Coulomb friction on the object's true surface; where that is finer than the elements, on its faces as they come down | small strain; walls of half an element and more |
//!
//! Everything is in the *sensor* frame: origin at the centre of the dome's base, +z through the pole; lengths mm,
//! forces N, moduli and pressures MPa. A contact wrench is what the object puts on the dome, about the base's
//! centre.

mod elastomer;
mod error;
mod estimate;
mod fem;
mod field;
mod finer;
mod finite_body;
mod geometric;
mod hertz;
mod linear;
mod local;
mod mesh_distance;
mod on_pole;
mod press;
mod solid;
mod state;
mod sweeps;
mod tangential;
mod touch;
mod trials;

pub use elastomer::{Elastomer, Indenter};
pub use error::ContactError;
pub use estimate::{Estimate, estimate, most_force_n};
pub use on_pole::OnPole;
pub use press::{PressStatus, Pressed};
pub use solid::{Distance, Solid};
pub use state::{ContactState, Extent, Status, TouchedNode};

use std::sync::Arc;

use domecast_optics::numeric::Rigid;
use fem::Compliance;

#[cfg(test)]
mod finer_tests;
#[cfg(test)]
mod tests;

/// How closely a contact is modelled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Level {
    /// The surface is pushed out of the object.
    Geometric,
    /// Hertz and kin.
    ClosedForm,
    /// Linear finite elements.
    Linear {
        /// Length of an element on the dome's surface, mm.
        element_mm: f64,
    },
}

impl Level {
    /// The linear level at the element size that resolves a fingertip contact in some ten milliseconds: R/20. At R/10 a
    /// balance takes one.
    pub fn default_linear(elastomer: &Elastomer) -> Self {
        Self::Linear { element_mm: 0.05 * elastomer.dome_radius_mm }
    }

    /// Its name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Geometric => "geometric",
            Self::ClosedForm => "closed_form",
            Self::Linear { .. } => "linear",
        }
    }
}

/// Elements along the meridian for a length: 4 times a power of two, no element longer than asked for.
fn elements_of(elastomer: &Elastomer, element_mm: f64) -> Result<usize, ContactError> {
    let element_mm = error::positive("level.element_mm", element_mm)?;
    let arc_mm = std::f64::consts::FRAC_PI_2 * elastomer.dome_radius_mm;
    let mut elements = 8;
    // A millionth of slack for lengths that were computed from a count.
    while arc_mm / elements as f64 > element_mm * (1.0 + 1e-6) {
        elements *= 2;
        if elements > MOST_ELEMENTS {
            let least_mm = arc_mm / MOST_ELEMENTS as f64;
            return Err(ContactError::TooFine { element_mm, least_mm });
        }
    }
    Ok(elements)
}

/// Elements along the meridian that memory allows: the tables grow with their cube.
const MOST_ELEMENTS: usize = 64;

/// A dome that can be touched.
#[derive(Debug, Clone)]
pub struct Contact {
    elastomer: Elastomer,
    level: Level,
    prepared: Prepared,
}

/// What a level computes once for a dome.
#[derive(Debug, Clone)]
enum Prepared {
    Nothing,
    Compliance(Arc<Compliance>),
}

impl Contact {
    /// Makes a dome ready for a level.
    ///
    /// # Errors
    /// [`ContactError::Dimension`] for constants that are no elastomer, [`ContactError::TooFine`] for elements
    /// beyond the level's memory.
    pub fn new(elastomer: Elastomer, level: Level) -> Result<Self, ContactError> {
        elastomer.check()?;
        let prepared = match level {
            Level::Geometric | Level::ClosedForm => Prepared::Nothing,
            Level::Linear { element_mm } => {
                let elements = elements_of(&elastomer, element_mm)?;
                Prepared::Compliance(Arc::new(Compliance::new(&elastomer, elements)?))
            }
        };
        Ok(Self { elastomer, level, prepared })
    }

    /// The elastomer.
    pub fn elastomer(&self) -> &Elastomer {
        &self.elastomer
    }

    /// The level.
    pub fn level(&self) -> Level {
        self.level
    }

    /// How far the level may be off for an object that lies `depth_mm` inside the undeformed dome, and its cost.
    pub fn estimate(&self, indenter: &Indenter, depth_mm: f64) -> Estimate {
        estimate(self.level, &self.elastomer, indenter, depth_mm)
    }

    /// The contact with an object at a pose. `before` is the state of the frame before, for the friction that
    /// depends on the way; without it the object is taken to have come along the contact's normal.
    ///
    /// # Errors
    /// [`ContactError`] for constants or poses without meaning, an object that reaches into the sheet, or deeper
    /// than the model goes. Iterations that reach their bound are not an error: see [`ContactState::status`].
    pub fn solve(
        &self,
        indenter: &Indenter,
        sensor_from_object: &Rigid,
        before: Option<&ContactState>,
    ) -> Result<ContactState, ContactError> {
        let history = before.map(|state| &state.history);
        let elastomer = &self.elastomer;
        self.checked(indenter, sensor_from_object, || match &self.prepared {
            Prepared::Compliance(compliance) => {
                linear::linear(elastomer, compliance, indenter, sensor_from_object, before)
            }
            Prepared::Nothing if self.level == Level::Geometric => {
                local::geometric(elastomer, indenter, sensor_from_object, history)
            }
            Prepared::Nothing => local::closed_form(elastomer, indenter, sensor_from_object, history),
        })
    }

    /// Solves between the checks of the input and of the answer.
    fn checked(
        &self,
        indenter: &Indenter,
        sensor_from_object: &Rigid,
        solve: impl FnOnce() -> Result<ContactState, ContactError>,
    ) -> Result<ContactState, ContactError> {
        indenter.check()?;
        sensor_from_object.check().map_err(|error| ContactError::BadPose(error.to_string()))?;
        self.above_sheet(indenter, sensor_from_object)?;
        let state = solve()?;
        // Nothing touches the surface: then the object is outside, or all of it within.
        let any = sensor_from_object.point(indenter.solid.support(glam::DVec3::Z));
        let inside_mm = self.elastomer.dome_radius_mm - any.length();
        if state.status == Status::Free && inside_mm > 1e-9 * self.elastomer.dome_radius_mm {
            let limit_mm = local::DEEPEST * self.elastomer.dome_radius_mm;
            return Err(ContactError::TooDeep { depth_mm: inside_mm, limit_mm });
        }
        Ok(state)
    }

    /// The object may not reach below the base plane: there is the sheet.
    fn above_sheet(&self, indenter: &Indenter, sensor_from_object: &Rigid) -> Result<(), ContactError> {
        let down = sensor_from_object.inverse().vector(-glam::DVec3::Z);
        let lowest = sensor_from_object.point(indenter.solid.support(down)).z;
        // Rounding of the pose, not a tolerance.
        if lowest < -1e-9 * self.elastomer.dome_radius_mm {
            return Err(ContactError::InsideSheet { depth_mm: -lowest });
        }
        Ok(())
    }
}
