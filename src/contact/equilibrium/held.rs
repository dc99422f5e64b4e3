//! An object pressed on a dome that does not give way: a rigid mount.
//!
//! No spring has to be balanced. What is left to find is the object's way along its approach where a force is asked for:
//! regula falsi in the Illinois form (M. Dowell and P. Jarratt, BIT 11, 1971) on the force to the power 2/3, which
//! Hertz' law makes a straight line.

use glam::DVec3;

use super::approach::{checked_press, gone_before_mm, touch_mm};
use super::pressed::{PressStatus, Pressed};
use crate::contact::Contact;
use crate::elastomer::Indenter;
use crate::error::ContactError;
use crate::finite_strain::Tried;
use crate::state::ContactState;
use domecast_optics::numeric::Rigid;

/// Contact solves that a force may take.
const MAX_SOLVES: u32 = 60;
/// The search ends when the force is missed by less than this part of it; ten times that still counts as found.
const TOLERANCE: f64 = 1e-7;
/// A bracket narrower than this part of the dome's radius holds a step of the force, not the force.
const MIN_BRACKET: f64 = 1e-13;
/// One step without an upper end goes at most this often the depth so far.
const MAX_GROWTH: f64 = 2.5;

/// An end of the bracket: how far the object has gone, and what is left of the force there, in Hertz' measure.
#[derive(Debug, Clone, Copy)]
struct End {
    gone_mm: f64,
    miss: f64,
}

/// Where the force is looked for: ends with too little and with too much of it, or beyond which the level does not go.
struct Bracket {
    low: End,
    high: Option<End>,
    refused_mm: Option<f64>,
    /// Where the object first touches.
    touch_mm: f64,
    /// The side that moved last, for Illinois' halving.
    was_low: Option<bool>,
}

impl Bracket {
    /// Takes in what a trial missed the force by.
    fn take(&mut self, end: End) {
        let is_low = end.miss < 0.0;
        let again = self.was_low == Some(is_low);
        if is_low {
            if again && let Some(high) = &mut self.high {
                high.miss *= 0.5;
            }
            self.low = end;
        } else {
            if again {
                self.low.miss *= 0.5;
            }
            self.high = Some(end);
        }
        self.was_low = Some(is_low);
    }

    /// The next place to try; `None` where nothing is left between the ends.
    fn next_mm(&self, min_width_mm: f64) -> Option<f64> {
        let low = self.low;
        let upper_mm = [self.high.map(|high| high.gone_mm), self.refused_mm].into_iter().flatten();
        let upper_mm = upper_mm.fold(f64::INFINITY, f64::min);
        if upper_mm - low.gone_mm <= min_width_mm {
            return None;
        }
        if let Some(high) = self.high.filter(|high| high.gone_mm <= upper_mm) {
            let at = low.gone_mm - low.miss * (high.gone_mm - low.gone_mm) / (high.miss - low.miss);
            let inside = at > low.gone_mm && at < high.gone_mm;
            return Some(if inside { at } else { 0.5 * (low.gone_mm + high.gone_mm) });
        }
        if upper_mm.is_finite() {
            return Some(0.5 * (low.gone_mm + upper_mm));
        }
        // Hertz' measure rises evenly from -1 where they touch.
        let depth_mm = low.gone_mm - self.touch_mm;
        let growth = (1.0 / (1.0 + low.miss)).clamp(1.02, MAX_GROWTH);
        Some(self.touch_mm + depth_mm * if growth.is_finite() { growth } else { MAX_GROWTH })
    }
}

impl Contact {
    /// The object held at a pose over a dome on a rigid mount, which stays at rest.
    ///
    /// # Errors
    /// As [`Contact::solve`].
    pub fn press_held(
        &self,
        indenter: &Indenter,
        rest_from_object: &Rigid,
        before: Option<&Pressed>,
    ) -> Result<Pressed, ContactError> {
        let state = self.solve(indenter, rest_from_object, before.map(|pressed| &pressed.state))?;
        Ok(held(state, *rest_from_object, 0.0, 1, PressStatus::Balanced))
    }

    /// The object moved along `approach` (rest frame) from a start pose until the contact's force along it is `force_n`,
    /// on a rigid mount. A force that is not found is a [`PressStatus::NotBalanced`] with what is left of it.
    ///
    /// # Errors
    /// As [`Contact::press_with_force`]; [`ContactError::ForceTooLarge`] where the level ends before the force is reached.
    pub fn press_held_with_force(
        &self,
        indenter: &Indenter,
        rest_from_object: &Rigid,
        approach: DVec3,
        force_n: f64,
        before: Option<&Pressed>,
    ) -> Result<Pressed, ContactError> {
        let (way, force_n) = checked_press(rest_from_object, approach, force_n)?;
        let radius_mm = self.elastomer().dome_radius_mm;
        let touch_mm =
            touch_mm(self.elastomer().dome(), indenter, &Rigid::identity(), rest_from_object, way)?;
        let mut bracket = Bracket {
            low: End { gone_mm: touch_mm, miss: -1.0 },
            high: None,
            refused_mm: None,
            touch_mm,
            was_low: None,
        };
        let mut gone_mm = gone_before_mm(before, rest_from_object, way).unwrap_or(touch_mm);
        if gone_mm - touch_mm < 1e-6 * radius_mm {
            gone_mm = touch_mm + self.first_depth_mm(indenter, force_n);
        }
        let mut best: Option<Pressed> = None;
        let mut fault = None;
        for count in 1..=MAX_SOLVES {
            let mut object = *rest_from_object;
            object.translation_mm += way * gone_mm;
            let tried = best.as_ref().and_then(|best| best.state.history.body.as_deref());
            let tried = tried.map(|deformed| Tried { deformed, shares_way: false });
            match self.solve_near(indenter, &object, before.map(|pressed| &pressed.state), tried) {
                Ok(state) => {
                    let found_n = state.wrench.force_n.dot(way);
                    let off_n = (found_n - force_n).abs();
                    if best.as_ref().is_none_or(|best| off_n < best.residual_n) {
                        best = Some(held(state, object, off_n, count, status_of(off_n, force_n)));
                    }
                    if off_n <= TOLERANCE * force_n {
                        break;
                    }
                    let miss = (found_n.max(0.0) / force_n).powf(2.0 / 3.0) - 1.0;
                    bracket.take(End { gone_mm, miss });
                }
                Err(error) => {
                    bracket.refused_mm = Some(gone_mm);
                    fault = Some(error);
                }
            }
            match bracket.next_mm(MIN_BRACKET * radius_mm) {
                Some(next_mm) => gone_mm = next_mm,
                None => break,
            }
        }
        // The level ended before the force did.
        if bracket.high.is_none()
            && best.as_ref().is_none_or(|best| best.status != PressStatus::Balanced)
            && let Some(error) = fault
        {
            return Err(match best {
                Some(best) if fault_is_an_end(&error) => {
                    ContactError::ForceTooLarge { force_n, reached_n: best.wrench.force_n.dot(way) }
                }
                _ => error,
            });
        }
        best.ok_or_else(|| ContactError::BadPose(format!("the object does not meet the dome along {way}")))
    }
}

/// Whether the object can go no deeper.
fn fault_is_an_end(error: &ContactError) -> bool {
    matches!(error, ContactError::InsideSheet { .. } | ContactError::TooDeep { .. })
}

fn status_of(off_n: f64, force_n: f64) -> PressStatus {
    if off_n <= 10.0 * TOLERANCE * force_n {
        PressStatus::Balanced
    } else {
        PressStatus::NotBalanced { residual_n: off_n }
    }
}

fn held(
    state: ContactState,
    rest_from_object: Rigid,
    residual_n: f64,
    iterations: u32,
    status: PressStatus,
) -> Pressed {
    Pressed {
        rest_from_platform: Rigid::identity(),
        rest_from_object,
        wrench: state.wrench,
        state,
        residual_n,
        iterations,
        status,
        learnt: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ContactSolid, Elastomer, Level};

    fn dome(level: Level) -> Contact {
        let elastomer = Elastomer {
            dome_radius_mm: 10.0,
            center_z_mm: 0.0,
            young_mpa: 0.56,
            poisson: 0.49,
            friction: 0.6,
        };
        Contact::new(elastomer, level).unwrap()
    }

    fn ball() -> Indenter {
        Indenter::rigid(ContactSolid::sphere(5.0).unwrap())
    }

    #[test]
    fn a_force_is_found_where_a_held_object_has_it() {
        for level in [Level::Geometric, Level::ClosedForm, Level::Linear { element_mm: 1.0 }] {
            let contact = dome(level);
            for (at, way) in [
                (DVec3::new(0.0, 0.0, 17.0), -DVec3::Z),
                (DVec3::new(6.0, 3.0, 15.0), DVec3::new(-6.0, -3.0, -15.0)),
            ] {
                let start = Rigid::from_translation(at);
                for force_n in [0.01, 0.4, 1.5] {
                    let pressed = contact.press_held_with_force(&ball(), &start, way, force_n, None).unwrap();
                    assert_eq!(pressed.status, PressStatus::Balanced, "{level:?} {force_n}: {pressed:?}");
                    assert_eq!(pressed.rest_from_platform, Rigid::identity());
                    let along = pressed.wrench.force_n.dot(way.normalize());
                    assert!((along - force_n).abs() <= 1e-6 * force_n, "{level:?} {along} for {force_n}");
                    assert!(pressed.iterations < 25, "{level:?} {force_n}: {}", pressed.iterations);
                    let again = contact.press_held(&ball(), &pressed.rest_from_object, None).unwrap();
                    assert_eq!(again.wrench, pressed.wrench);
                    // The next frame starts from this one.
                    let more = contact
                        .press_held_with_force(&ball(), &start, way, 1.2 * force_n, Some(&pressed))
                        .unwrap();
                    assert_eq!(more.status, PressStatus::Balanced);
                    let back = contact
                        .press_held_with_force(&ball(), &start, way, 0.2 * force_n, Some(&pressed))
                        .unwrap();
                    assert_eq!(back.status, PressStatus::Balanced);
                }
            }
        }
    }

    #[test]
    fn what_has_no_answer_is_refused_by_name() {
        let contact = dome(Level::Linear { element_mm: 1.0 });
        let start = Rigid::from_translation(DVec3::Z * 17.0);
        let press = |way, force_n| contact.press_held_with_force(&ball(), &start, way, force_n, None);
        assert!(matches!(press(DVec3::ZERO, 1.0), Err(ContactError::BadPose(_))));
        assert!(matches!(press(DVec3::Z, 1.0), Err(ContactError::BadPose(_))));
        assert!(matches!(press(-DVec3::Z, f64::NAN), Err(ContactError::Dimension { .. })));
        let deep = press(-DVec3::Z, 500.0);
        let Err(ContactError::ForceTooLarge { force_n, reached_n }) = deep else { panic!("{deep:?}") };
        assert!(force_n == 500.0 && reached_n > 1.0 && reached_n < 500.0, "{reached_n}");
    }
}
