//! Where a balance is likely to be, by the closed form: a start for the finite-strain level, which takes half a minute for each trial that is far off.

use glam::DVec3;
use nalgebra::DVector;

use super::pressed::Pressed;
use crate::contact::Contact;
use crate::elastomer::Indenter;
use crate::level::Level;
use domecast_optics::numeric::Rigid;
use domecast_springs::{Displacement, Suspension};

/// What is pressed, and to where.
pub(super) struct Predicting<'a> {
    closed_form: Contact,
    indenter: &'a Indenter,
    suspension: &'a Suspension,
    rest_from_object: Rigid,
}

impl<'a> Predicting<'a> {
    /// `None` at the levels that need none.
    pub fn new(
        contact: &Contact,
        indenter: &'a Indenter,
        suspension: &'a Suspension,
        rest_from_object: &Rigid,
    ) -> Option<Self> {
        let closed_form = match contact.level() {
            Level::FiniteStrain { .. } => Contact::new(*contact.elastomer(), Level::ClosedForm).ok()?,
            _ => return None,
        };
        Some(Self { closed_form, indenter, suspension, rest_from_object: *rest_from_object })
    }

    /// The unknowns of a balance: the platform's displacement, and how far the object has gone.
    fn unknowns(&self, pressed: &Pressed, way: DVec3) -> [f64; 7] {
        let of = Displacement::of_pose(&pressed.rest_from_platform, self.suspension.at_mm()).to_array();
        let gone_mm =
            (pressed.rest_from_object.translation_mm - self.rest_from_object.translation_mm).dot(way);
        std::array::from_fn(|i| if i < 6 { of[i] } else { gone_mm })
    }

    /// Adds to a start what the closed form has moved since the frame before, where there was one; in a first frame the start is its. What it has
    /// no answer to leaves the start as it is.
    fn add(
        &self,
        x: &mut DVector<f64>,
        way: DVec3,
        now: Option<Pressed>,
        then: Option<Option<Pressed>>,
    ) -> Option<()> {
        let now = self.unknowns(&now?, way);
        let then = match then {
            Some(then) => Some(self.unknowns(&then?, way)),
            None => None,
        };
        for (i, value) in x.iter_mut().enumerate() {
            *value = then.map_or(now[i], |then| *value + now[i] - then[i]);
        }
        Some(())
    }

    /// Of an object that is held.
    pub fn held(&self, x: &mut DVector<f64>, before: Option<&Pressed>) {
        let press = |at: &Rigid| self.closed_form.press(self.indenter, self.suspension, at, None).ok();
        let then = before.map(|before| press(&before.rest_from_object));
        self.add(x, DVec3::ZERO, press(&self.rest_from_object), then);
    }

    /// Of an object that is pressed with a force along a way.
    pub fn forced(&self, x: &mut DVector<f64>, (way, force_n): (DVec3, f64), before: Option<&Pressed>) {
        let press = |force_n: f64| {
            let (indenter, at) = (self.indenter, &self.rest_from_object);
            self.closed_form.press_with_force(indenter, self.suspension, at, way, force_n, None).ok()
        };
        let then = before.filter(|before| !before.state.nodes.is_empty());
        let then = then.map(|before| press(before.wrench.force_n.dot(way)));
        self.add(x, way, press(force_n), then);
    }
}
