//! The dome under an object, frame by frame: friction remembers the way, so the frames are solved in order.

use std::sync::Arc;

use crate::SimError;
use crate::contact::elastomer::elastomer_of;
use crate::contact::level::largest_px_per_mm;
use crate::contact::record::ContactTruth;
use crate::effect_name::EffectName;
use crate::scene::object::{Hold, SceneObject};
use crate::scene::{Held, Scene, State};
use crate::work::Work;
use domecast_contact::{
    Contact, ContactError, ContactState, Elastomer, GelMemory, Level, PressStatus, Pressed, PressedTogether,
    Push, Relaxation,
};
use domecast_design::DesignError;
use domecast_optics::numeric::Rigid;

/// The dome touched at one time.
#[derive(Debug, Clone)]
pub struct Touch {
    /// Pose and load of the platform.
    pub state: State,
    /// The contact; `None` where nothing touches.
    pub contact: Option<Arc<ContactState>>,
    /// How it was solved.
    pub solved: ContactTruth,
    /// Where each object is that touches or is held near, `rest_from_object`; empty while all are away.
    pub rest_from_objects: Vec<Option<Rigid>>,
}

/// Solves the contact of a scene from frame to frame.
pub struct Stepper<'a> {
    scene: &'a Scene,
    contact: Contact,
    px_per_mm: f64,
    /// Harmonics of the dome that were solved when this was made.
    stored: usize,
    last: Last,
    /// What a slow gel remembers.
    gel: Option<GelMemory>,
    /// Frames that are solved already.
    known: Option<Arc<SolvedFrames>>,
    /// Poses that stand in place of the scene's paths, by object.
    placed: Option<Vec<Option<Rigid>>>,
}

/// What the frame before leaves to the next one.
#[derive(Debug, Clone)]
enum Last {
    /// A dome that nothing has touched yet, or that is left alone again.
    Free,
    /// One object on an elastic dome.
    One(Box<Pressed>),
    /// Several objects, or a slow gel.
    Several(Box<PressedTogether>),
}

/// Some frames of a scene, solved by one level; kept with the scene.
#[derive(Debug)]
pub(crate) struct SolvedFrames {
    level: Level,
    contact: Contact,
    /// By number; with what each took.
    frames: Vec<(u32, Touch, Work)>,
    last: Last,
}

/// Under what a dome's harmonics are kept.
fn stored_key(dome: &str) -> String {
    format!("dome's harmonics {dome}")
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
        stepper.store();
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

/// Time from frame to frame.
fn step_s(scene: &Scene) -> f64 {
    1.0 / scene.file().frames.rate_hz
}

impl<'a> Stepper<'a> {
    /// Makes the level's tables.
    ///
    /// # Errors
    /// An elastomer that the level cannot work with.
    pub fn new(scene: &'a Scene, level: Level) -> Result<Self, SimError> {
        if let Some(known) = scene.kept::<SolvedFrames>().filter(|known| known.level == level) {
            let contact = known.contact.clone();
            return Ok(Self { known: Some(known), ..Self::free(scene, contact, None) });
        }
        let contact = Contact::new(elastomer_of(scene.design()), level).map_err(|error| unfit(&error))?;
        Ok(Self::free(scene, contact, None))
    }

    /// The same on a dome whose tables are there already, at the level that they were made for.
    ///
    /// # Errors
    /// A slow gel that the dome's level cannot work with.
    pub fn on(scene: &'a Scene, dome: &Contact, gel: Option<&(Relaxation, f64)>) -> Result<Self, SimError> {
        let (gel, contact) = match gel {
            None => (None, dome.clone()),
            Some((relaxation, young_mpa)) => {
                let made = GelMemory::on(relaxation.clone(), step_s(scene), dome, *young_mpa);
                let (gel, contact) = made.map_err(|error| unfit(&error))?;
                (Some(gel), contact)
            }
        };
        Ok(Self::free(scene, contact, gel))
    }

    /// The same over a gel whose modulus relaxes, from that instant modulus, MPa; before the first frame nothing touches
    /// it.
    ///
    /// # Errors
    /// As [`Stepper::new`]; a level other than the linear one.
    pub fn slow(
        scene: &'a Scene,
        level: Level,
        (relaxation, young_mpa): &(Relaxation, f64),
    ) -> Result<Self, SimError> {
        let elastomer = Elastomer { young_mpa: *young_mpa, ..elastomer_of(scene.design()) };
        let (gel, contact) = GelMemory::new(relaxation.clone(), step_s(scene), &elastomer, level)
            .map_err(|error| unfit(&error))?;
        Ok(Self::free(scene, contact, Some(gel)))
    }

    /// Before anything touches, with what the scene's cache has of the dome.
    fn free(scene: &'a Scene, contact: Contact, gel: Option<GelMemory>) -> Self {
        let px_per_mm = largest_px_per_mm(scene);
        let mut stored = 0;
        if let (Some(cache), Some(compliance)) = (scene.cache(), contact.compliance()) {
            if compliance.solved() == 0 {
                compliance.take(&cache.get(&stored_key(compliance.key())).unwrap_or_default());
            }
            stored = compliance.solved();
        }
        Self { stored, scene, contact, px_per_mm, last: Last::Free, gel, known: None, placed: None }
    }

    /// Puts what was solved of the dome since it was made into the scene's cache, if there is one.
    pub(crate) fn store(&mut self) {
        if let (Some(cache), Some(compliance)) = (self.scene.cache(), self.contact.compliance())
            && compliance.solved() > self.stored
        {
            cache.put(&stored_key(compliance.key()), &compliance.numbers());
            self.stored = compliance.solved();
        }
    }

    /// From now on holds the objects at these poses, `rest_from_object`, whatever their paths say; `None`: away from the dome.
    pub fn place(&mut self, poses: &[Option<Rigid>]) {
        self.placed = Some(poses.to_vec());
        self.known = None;
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
        let touch = match self.scene.objects() {
            [object] if self.gel.is_none() => self.one(object, frame, time_s, work)?,
            _ => self.several(frame, time_s, work)?,
        };
        match touch {
            Some(touch) => Ok(touch),
            None => {
                self.last = Last::Free;
                let state = self.scene.state_at(frame, time_s)?;
                Ok(Touch {
                    state,
                    contact: None,
                    solved: ContactTruth::away(),
                    rest_from_objects: Vec::new(),
                })
            }
        }
    }

    /// One object on an elastic dome; `None` while it is away.
    fn one(
        &mut self,
        object: &SceneObject,
        frame: u32,
        time_s: f64,
        work: &mut Work,
    ) -> Result<Option<Touch>, SimError> {
        let suspension = self.scene.suspension();
        let before = match &self.last {
            Last::One(pressed) => Some(&**pressed),
            _ => None,
        };
        let solved = match (self.push(0, object, time_s), suspension) {
            (None, _) => return Ok(None),
            (Some(Push::At(pose)), Some(suspension)) => {
                self.contact.press(&object.indenter, suspension, &pose, before)
            }
            (Some(Push::At(pose)), None) => self.contact.press_held(&object.indenter, &pose, before),
            (Some(Push::Pressed { from, way, force_n }), Some(suspension)) => {
                self.contact.press_with_force(&object.indenter, suspension, &from, way, force_n, before)
            }
            (Some(Push::Pressed { from, way, force_n }), None) => {
                self.contact.press_held_with_force(&object.indenter, &from, way, force_n, before)
            }
        };
        let pressed = solved.map_err(|error| self.fault(&error, Some(0), frame))?;
        work.add(EffectName::Contact, pressed.state.work.max(0.0) as u64);
        let held = held_by(pressed.status);
        let state = State { pose: pressed.rest_from_platform, wrench: pressed.wrench, held };
        let contact = (!pressed.state.nodes.is_empty()).then(|| Arc::new(pressed.state.clone()));
        let solved = ContactTruth::of(&pressed, self.px_per_mm);
        let rest_from_objects = vec![Some(pressed.rest_from_object)];
        self.last = Last::One(Box::new(pressed));
        Ok(Some(Touch { state, contact, solved, rest_from_objects }))
    }

    /// Several objects, or a slow gel; `None` while nothing touches and the dome has its shape.
    fn several(&mut self, frame: u32, time_s: f64, work: &mut Work) -> Result<Option<Touch>, SimError> {
        let scene = self.scene;
        let numbered = scene.objects().iter().enumerate();
        let objects: Vec<_> =
            numbered.map(|(k, object)| (&object.indenter, self.push(k, object, time_s))).collect();
        let beside = self.gel.as_ref().map(GelMemory::beside).unwrap_or_default();
        if beside.is_still() && objects.iter().all(|object| object.1.is_none()) {
            return Ok(None);
        }
        let before = match &self.last {
            Last::Several(pressed) => Some(&**pressed),
            _ => None,
        };
        let solved = self.contact.press_together(&objects, scene.suspension(), &beside, before);
        let pressed = solved.map_err(|error| match error {
            ContactError::OfObject { object, error } => self.fault(&error, Some(object), frame),
            error => self.fault(&error, None, frame),
        })?;
        if let Some(gel) = &mut self.gel {
            gel.take(pressed.objects.iter().flatten().map(|object| &object.state));
        }
        work.add(EffectName::Contact, pressed.state.work.max(0.0) as u64);
        let held = held_by(pressed.status);
        let state = State { pose: pressed.rest_from_platform, wrench: pressed.wrench, held };
        let contact = pressed.state.is_moved().then(|| Arc::new(pressed.state.clone()));
        let names = scene.objects().iter().map(|object| object.name.as_str());
        let solved = ContactTruth::of_several(&pressed, names, self.px_per_mm);
        let places =
            pressed.objects.iter().map(|object| object.as_ref().map(|object| object.rest_from_object));
        let rest_from_objects = places.collect();
        self.last = Last::Several(Box::new(pressed));
        Ok(Some(Touch { state, contact, solved, rest_from_objects }))
    }

    /// What an object does at a time; `None` while it cannot touch.
    fn push(&self, index: usize, object: &SceneObject, time_s: f64) -> Option<Push> {
        // What a slow gel remembers stays within the dome at rest.
        let dome = self.scene.optics().dome();
        if let Some(placed) = &self.placed {
            let pose = placed.get(index).copied().flatten();
            return pose.filter(|pose| object.may_touch_at(pose, dome)).map(Push::At);
        }
        match object.hold_at(time_s) {
            Hold::Away(_) => None,
            Hold::At(_) if !object.may_touch(time_s, dome) => None,
            Hold::At(pose) => Some(Push::At(pose)),
            Hold::Pressed(from, way, force_n) => Some(Push::Pressed { from, way, force_n }),
        }
    }

    /// What is wrong with an object, or with all together, in a frame.
    fn fault(&self, error: &ContactError, object: Option<usize>, frame: u32) -> SimError {
        let objects = self.scene.objects();
        let name = |number: usize| objects.get(number).map_or("", |object| object.name.as_str());
        let (field, problem) = match (object, error) {
            (Some(number), _) => {
                (format!("objects[{number}].path"), format!("frame {frame}, `{}`: {error}", name(number)))
            }
            (None, ContactError::ObjectsMeet { objects: [a, b], depth_mm }) => (
                format!("objects[{b}].path"),
                format!(
                    "frame {frame}: `{}` and `{}` lie {depth_mm:.4} mm in each other",
                    name(*a),
                    name(*b)
                ),
            ),
            (None, _) => ("objects".to_owned(), format!("frame {frame}: {error}")),
        };
        let allowed = match error {
            ContactError::ObjectsMeet { .. } => "objects that do not meet each other",
            _ => "an object outside the sheet and no deeper in the dome than the contact's level goes",
        };
        let fault = DesignError::at(field, "", problem, allowed);
        SimError::from(match way_out(error) {
            Some(help) => fault.with_help(help),
            None => fault,
        })
    }
}

/// An elastomer or a gel that the level cannot work with.
fn unfit(error: &ContactError) -> SimError {
    DesignError::at("contact", "", error.to_string(), "an elastomer and a level that fit").into()
}

/// What holds the platform where it is not balanced as it should.
fn held_by(status: PressStatus) -> Option<Held> {
    match status {
        PressStatus::Balanced => None,
        PressStatus::SpringsBind { spring } => {
            Some(Held { limit: "coil_bind", part: format!("spring {spring}"), carried: 1.0 })
        }
        PressStatus::NotBalanced { residual_n } => Some(Held {
            limit: "not_balanced",
            part: format!("a residual of {residual_n:.2e} N"),
            carried: 1.0,
        }),
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
        ContactError::NotConverged { .. } => Some(
            "take more frames on the way, or the linear level (`contact.level`)".into(),
        ),
        ContactError::Unseen { .. } => Some(
            "take smaller elements (`contact.element_mm`), a thicker object, or the geometric level (`contact.level`)"
                .into(),
        ),
        ContactError::TooNear { .. } => Some(
            "take the linear level (`contact.level`), which solves near contacts together, or move them apart".into(),
        ),
        ContactError::BadPose(_) => Some(
            "let `position_mm` start outside the dome and `press.direction` point from there to the dome"
                .into(),
        ),
        _ => None,
    }
}
