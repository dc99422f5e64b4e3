//! The dome under an object, frame by frame: friction remembers the way, so the frames are solved in order.

use std::sync::Arc;

use crate::SimError;
use crate::contact::elastomer::elastomer_of;
use crate::contact::record::ContactTruth;
use crate::effect_name::EffectName;
use crate::scene::object::Hold;
use crate::scene::{Held, Scene, State};
use crate::work::Work;
use domecast_contact::{Contact, ContactError, ContactState, Level, PressStatus, Pressed};
use domecast_design::DesignError;

/// The dome touched at one time.
#[derive(Debug, Clone)]
pub struct Touch {
    /// Pose and load of the platform.
    pub state: State,
    /// The contact; `None` where nothing touches.
    pub contact: Option<Arc<ContactState>>,
    /// How it was solved.
    pub solved: ContactTruth,
}

/// Solves the contact of a scene from frame to frame.
pub struct Stepper<'a> {
    scene: &'a Scene,
    contact: Contact,
    last: Option<Pressed>,
    /// Frames that are solved already.
    known: Option<Arc<SolvedFrames>>,
}

/// Some frames of a scene, solved by one level; kept with the scene.
#[derive(Debug)]
pub(crate) struct SolvedFrames {
    level: Level,
    contact: Contact,
    /// By number; with what each took.
    frames: Vec<(u32, Touch, Work)>,
    last: Option<Pressed>,
}

impl SolvedFrames {
    /// Solves some frames, in order.
    ///
    /// # Errors
    /// As [`Stepper::next`].
    pub fn new(scene: &Scene, level: Level, numbers: &[u32]) -> Result<Self, SimError> {
        let mut stepper = Stepper::new(scene, level)?;
        let mut frames = Vec::with_capacity(numbers.len());
        for number in numbers {
            let mut work = Work::default();
            let touch = stepper.next(*number, scene.time_s(*number), &mut work)?;
            frames.push((*number, touch, work));
        }
        Ok(Self { level, contact: stepper.contact, frames, last: stepper.last })
    }

    /// The frames with their numbers.
    pub fn touches(&self) -> impl Iterator<Item = (u32, &Touch)> {
        self.frames.iter().map(|(number, touch, _)| (*number, touch))
    }

    /// A frame, where all frames up to it are known: friction remembers the way.
    fn frame(&self, number: u32) -> Option<&(u32, Touch, Work)> {
        self.frames.get(number as usize).filter(|(known, ..)| *known == number)
    }
}

impl<'a> Stepper<'a> {
    /// Makes the level's tables.
    ///
    /// # Errors
    /// An elastomer that the level cannot work with.
    pub fn new(scene: &'a Scene, level: Level) -> Result<Self, SimError> {
        if let Some(known) = scene.kept::<SolvedFrames>().filter(|known| known.level == level) {
            let contact = known.contact.clone();
            return Ok(Self { scene, contact, last: None, known: Some(known) });
        }
        let contact = Contact::new(elastomer_of(scene.design()), level).map_err(|error| {
            DesignError::at("contact", "", error.to_string(), "an elastomer and a level that fit")
        })?;
        Ok(Self { scene, contact, last: None, known: None })
    }

    /// Solves the next frame.
    ///
    /// # Errors
    /// An object inside the sheet, or deeper in the dome than the level goes; named with the frame.
    pub fn next(&mut self, frame: u32, time_s: f64, work: &mut Work) -> Result<Touch, SimError> {
        if let Some(known) = &self.known
            && let Some((_, touch, spent)) = known.frame(frame)
        {
            work.merge(spent);
            self.last.clone_from(&known.last);
            return Ok(touch.clone());
        }
        let free = |rest: &Scene| -> Result<Touch, SimError> {
            let state = rest.state_at(frame, time_s)?;
            Ok(Touch { state, contact: None, solved: ContactTruth::away() })
        };
        let Some(object) = self.scene.objects().first() else { return free(self.scene) };
        let suspension = self.scene.suspension();
        let radius_mm = self.scene.optics().dome_radius_mm();
        let before = self.last.as_ref();
        let solved = match object.hold_at(time_s) {
            Hold::Away(_) => {
                self.last = None;
                return free(self.scene);
            }
            Hold::At(_) if !object.may_touch(time_s, radius_mm) => {
                self.last = None;
                return free(self.scene);
            }
            Hold::At(pose) => match suspension {
                Some(suspension) => self.contact.press(&object.indenter, suspension, &pose, before),
                None => self.contact.press_held(&object.indenter, &pose, before),
            },
            Hold::Pressed(pose, way, force_n) => match suspension {
                Some(suspension) => {
                    self.contact.press_with_force(&object.indenter, suspension, &pose, way, force_n, before)
                }
                None => self.contact.press_held_with_force(&object.indenter, &pose, way, force_n, before),
            },
        };
        let pressed = solved.map_err(|error| {
            let fault = DesignError::at(
                "objects[0].path",
                "",
                format!("frame {frame}, `{}`: {error}", object.name),
                "an object outside the sheet and no deeper in the dome than the contact's level goes",
            );
            SimError::from(match way_out(&error) {
                Some(help) => fault.with_help(help),
                None => fault,
            })
        })?;
        work.add(EffectName::Contact, pressed.state.work.max(0.0) as u64);
        let held = match pressed.status {
            PressStatus::Balanced => None,
            PressStatus::SpringsBind { spring } => {
                Some(Held { limit: "coil_bind", part: format!("spring {spring}"), carried: 1.0 })
            }
            PressStatus::NotBalanced { residual_n } => Some(Held {
                limit: "not_balanced",
                part: format!("a residual of {residual_n:.2e} N"),
                carried: 1.0,
            }),
        };
        let state = State { pose: pressed.rest_from_platform, wrench: pressed.wrench, held };
        let contact = (!pressed.state.nodes.is_empty()).then(|| Arc::new(pressed.state.clone()));
        let solved = ContactTruth::of(&pressed);
        self.last = Some(pressed);
        Ok(Touch { state, contact, solved })
    }
}

/// What can be done about an object that cannot be where it is.
fn way_out(error: &ContactError) -> Option<String> {
    match error {
        ContactError::InsideSheet { depth_mm } => Some(format!(
            "keep all of it at z >= 0: raise `position_mm` by at least {depth_mm:.3} mm, or turn it; at z = 0 lies the sheet that \
             the dome stands on"
        )),
        ContactError::TooDeep { depth_mm, limit_mm } => Some(format!(
            "move `position_mm` away from the dome by at least {:.3} mm, or leave the depth to a force (`press`)",
            (depth_mm - limit_mm).max(0.0)
        )),
        ContactError::ForceTooLarge { reached_n, .. } => {
            Some(format!("ask for less force (`press.force`), at most {:.2} N", (100.0 * reached_n).floor() / 100.0))
        }
        ContactError::Unseen { .. } => Some(
            "take smaller elements (`contact.element_mm`), a thicker object, or the geometric level (`contact.level`)"
                .into(),
        ),
        ContactError::BadPose(_) => Some(
            "let `position_mm` start outside the dome and `press.direction` point from there to the dome"
                .into(),
        ),
        _ => None,
    }
}
