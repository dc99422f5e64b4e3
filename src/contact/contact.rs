//! A dome made ready for a level, and the contact with an object at a pose.

use std::sync::Arc;

use crate::deviation::deviation;
use crate::elastomer::{Elastomer, Indenter};
use crate::error::ContactError;
use crate::estimate::{Estimate, estimate};
use crate::finite_strain::Tried;
use crate::level::{DEEPEST, Level, elements_of};
use crate::levels;
use crate::linear;
use crate::outcome::Status;
use crate::state::ContactState;
use domecast_elastic::Compliance;
use domecast_optics::numeric::Rigid;

/// A dome that can be touched.
#[derive(Debug, Clone)]
pub struct Contact {
    elastomer: Elastomer,
    level: Level,
    pub(crate) prepared: Prepared,
}

/// What a level computes once for a dome.
#[derive(Debug, Clone)]
pub(crate) enum Prepared {
    Nothing,
    Compliance(Arc<Compliance>),
    /// Of the finite-strain level, for what a soft object moves beyond its share: coarse, factored where it is asked for.
    Held(Arc<Compliance>),
}

/// Elements along the meridian for [`Prepared::Held`].
const HELD_ELEMENTS: usize = 32;

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
            Level::FiniteStrain { across } if (4..=16).contains(&across) => {
                Prepared::Held(Arc::new(Compliance::new(&elastomer.elastic(), HELD_ELEMENTS)?))
            }
            Level::FiniteStrain { across } => {
                let (field, allowed) = ("level.across", "4 to 16");
                return Err(ContactError::Dimension { field, value: across as f64, allowed });
            }
            Level::Linear { element_mm } => {
                let elements = elements_of(&elastomer, element_mm)?;
                Prepared::Compliance(Arc::new(Compliance::new(&elastomer.elastic(), elements)?))
            }
        };
        Ok(Self { elastomer, level, prepared })
    }

    /// The same dome with another friction and Young's modulus, MPa: its tables are kept, for friction is not in them and a
    /// modulus only scales them.
    ///
    /// # Errors
    /// As [`Contact::new`].
    pub fn with_material(&self, friction: f64, young_mpa: f64) -> Result<Self, ContactError> {
        let elastomer = Elastomer { friction, young_mpa, ..self.elastomer };
        elastomer.check()?;
        let factor = self.elastomer.young_mpa / young_mpa;
        let prepared = match &self.prepared {
            Prepared::Compliance(compliance) if factor != 1.0 => {
                Prepared::Compliance(Arc::new(compliance.scaled(factor)))
            }
            Prepared::Held(compliance) if factor != 1.0 => {
                Prepared::Held(Arc::new(compliance.scaled(factor)))
            }
            prepared => prepared.clone(),
        };
        Ok(Self { elastomer, prepared, ..self.clone() })
    }

    /// What its level computes once, of the linear one.
    pub fn compliance(&self) -> Option<&Compliance> {
        match &self.prepared {
            Prepared::Compliance(compliance) => Some(compliance),
            _ => None,
        }
    }

    /// The same dome with other tables.
    pub(crate) fn with_prepared(&self, prepared: Prepared) -> Self {
        Self { prepared, ..self.clone() }
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
    /// than the model goes, and for a dome that is no hemisphere at another level than the linear one. Iterations that reach their bound are not an error: see [`ContactState::status`].
    pub fn solve(
        &self,
        indenter: &Indenter,
        sensor_from_object: &Rigid,
        before: Option<&ContactState>,
    ) -> Result<ContactState, ContactError> {
        self.solve_near(indenter, sensor_from_object, before, None)
    }

    /// The same with what was found at a place near by, from the same frame before: the finite-strain level begins there.
    pub(crate) fn solve_near(
        &self,
        indenter: &Indenter,
        sensor_from_object: &Rigid,
        before: Option<&ContactState>,
        tried: Option<Tried<'_>>,
    ) -> Result<ContactState, ContactError> {
        let history = before.map(|state| &state.history);
        let elastomer = &self.elastomer;
        if !elastomer.dome().is_hemisphere() && !matches!(self.prepared, Prepared::Compliance(_)) {
            let (level, kind) = (self.level.name(), elastomer.dome().kind());
            return Err(ContactError::HemisphereOnly { level, kind });
        }
        self.checked(indenter, sensor_from_object, || match (&self.prepared, self.level) {
            (Prepared::Compliance(compliance), _) => {
                linear::linear(elastomer, compliance, indenter, sensor_from_object, before)
            }
            (Prepared::Held(held), Level::FiniteStrain { across }) => {
                levels::finite_strain((elastomer, held), across, indenter, sensor_from_object, before, tried)
            }
            (_, Level::Geometric) => levels::geometric(elastomer, indenter, sensor_from_object, history),
            _ => levels::closed_form(elastomer, indenter, sensor_from_object, history),
        })
    }

    /// Solves between the checks of the input and of the answer.
    pub(crate) fn checked(
        &self,
        indenter: &Indenter,
        sensor_from_object: &Rigid,
        solve: impl FnOnce() -> Result<ContactState, ContactError>,
    ) -> Result<ContactState, ContactError> {
        indenter.check()?;
        sensor_from_object.check().map_err(|error| ContactError::BadPose(error.to_string()))?;
        self.above_sheet(indenter, sensor_from_object)?;
        let mut state = solve()?;
        // Nothing touches the surface: then the object is outside, or all of it within.
        let any = sensor_from_object.point(indenter.solid.support(glam::DVec3::Z));
        let inside_mm = -self.elastomer.dome().distance_mm(any);
        if state.status == Status::Free && inside_mm > 1e-9 * self.elastomer.dome_radius_mm {
            let limit_mm = DEEPEST * self.elastomer.depth_scale_mm();
            return Err(ContactError::TooDeep { depth_mm: inside_mm, limit_mm });
        }
        state.deviation = deviation(self.level, &self.elastomer, indenter, sensor_from_object, &state);
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
