//! Several objects at once, in balance with the springs.
//!
//! Each contact moves the dome under the others ([`Contact::solve_beside`]); in every trial they are solved in turn until
//! none changes. The springs carry the sum of all wrenches, and each object that is pressed on has its own way to go
//! until its own force is the one asked for.

use glam::DVec3;
use nalgebra::DVector;

use super::approach::{checked_press, gone_on_mm, touch_mm};
use super::meeting::common_depth_mm;
use super::pressed::PressStatus;
use super::roots::{Equations, Root, root};
use crate::beside::Beside;
use crate::contact::Contact;
use crate::elastomer::Indenter;
use crate::error::ContactError;
use crate::object::Placed;
use crate::state::ContactState;
use domecast_optics::numeric::Rigid;
use domecast_springs::{Displacement, Suspension, Wrench};

/// The balance is found when it is off by less than this part of the load; ten times that still counts.
const TOLERANCE: f64 = 1e-7;
/// Loads below this one are balanced as closely as it is, N.
const MIN_SCALE_N: f64 = 0.05;
/// How much closer than the balance the contacts agree with each other in a trial.
const CLOSER: f64 = 1e-2;
/// How much worse an object without force counts than its whole force.
const LOST: f64 = 4.0;
/// Starts are deepened by this part of the dome's radius until every object that is pressed on bears a force, so often at
/// most.
const DEEPER: f64 = 0.02;
const MAX_DEEPER: u32 = 12;
/// Turns in which contacts of one trial are solved until they agree.
const MAX_TURNS: u32 = 60;

/// What an object does in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Push {
    /// Held at a pose, `rest_from_object`.
    At(Rigid),
    /// Moved from a pose along a direction (rest frame) until the contact's force along it is `force_n`.
    Pressed {
        /// Where it starts, `rest_from_object`.
        from: Rigid,
        /// The direction.
        way: DVec3,
        /// The force, N.
        force_n: f64,
    },
}

/// One of several objects that are pressed on the sprung dome.
#[derive(Debug, Clone, PartialEq)]
pub struct PressedObject {
    /// Where it is.
    pub rest_from_object: Rigid,
    /// Its own contact, in the moved sensor frame; its field is what its own forces move.
    pub state: ContactState,
    /// What it puts on the platform: rest frame, about the springs' reference point.
    pub wrench: Wrench,
}

/// Several objects pressed on the sprung dome, in balance.
#[derive(Debug, Clone, PartialEq)]
pub struct PressedTogether {
    /// Where the platform is.
    pub rest_from_platform: Rigid,
    /// The objects, in order; `None` for those that are away.
    pub objects: Vec<Option<PressedObject>>,
    /// Sum of the objects' wrenches: rest frame, about the springs' reference point.
    pub wrench: Wrench,
    /// What the balance is off, N (moments counted over the springs' reach), and what the contacts differ by from one turn to
    /// the next.
    pub residual_n: f64,
    /// Contact solves of each object.
    pub iterations: u32,
    /// How the balance ended.
    pub status: PressStatus,
    /// The dome under all of them: forces, wrench and field are the sums.
    pub state: ContactState,
}

/// The frame's task.
struct Task<'a> {
    contact: &'a Contact,
    indenters: &'a [&'a Indenter],
    pushes: &'a [Option<Push>],
    suspension: Option<&'a Suspension>,
    beside: &'a Beside,
    before: Option<&'a PressedTogether>,
}

/// One trial's contacts.
#[derive(Clone)]
struct Trial {
    platform: Rigid,
    objects: Vec<Option<PressedObject>>,
    wrench: Wrench,
    /// What the contacts' forces changed by in the last turn, N.
    change_n: f64,
}

impl Task<'_> {
    /// Unknowns of the platform: none on a rigid mount.
    fn of_platform(&self) -> usize {
        if self.suspension.is_some() { 6 } else { 0 }
    }

    fn about_mm(&self) -> DVec3 {
        self.suspension.map_or(DVec3::ZERO, Suspension::at_mm)
    }

    /// The pressed objects: number, start, unit way and force.
    fn pressed(&self) -> impl Iterator<Item = (usize, Rigid, DVec3, f64)> + '_ {
        self.pushes.iter().enumerate().filter_map(|(number, push)| match push {
            Some(Push::Pressed { from, way, force_n }) => Some((number, *from, *way, *force_n)),
            _ => None,
        })
    }

    fn poses(&self, x: &DVector<f64>) -> (Rigid, Vec<Option<Rigid>>) {
        let platform = match self.suspension {
            Some(suspension) => {
                Displacement::from_array(std::array::from_fn(|i| x[i])).to_pose(suspension.at_mm())
            }
            None => Rigid::identity(),
        };
        let mut gone_mm = x.iter().skip(self.of_platform());
        let objects = self.pushes.iter().map(|push| {
            push.map(|push| match push {
                Push::At(pose) => pose,
                Push::Pressed { mut from, way, .. } => {
                    from.translation_mm += way * gone_mm.next().copied().unwrap_or(0.0);
                    from
                }
            })
        });
        let objects = objects.collect();
        (platform, objects)
    }

    /// The contacts at a place, in turn until they agree to `wanted_n`, from those of another one.
    fn contacts(
        &self,
        x: &DVector<f64>,
        near: Option<&Trial>,
        wanted_n: f64,
        count: &mut u32,
    ) -> Result<Trial, ContactError> {
        let (platform, poses) = self.poses(x);
        let sensor_from_rest = platform.inverse();
        let mut objects: Vec<Option<PressedObject>> =
            near.map_or_else(|| vec![None; poses.len()], |near| near.objects.clone());
        let present = poses.iter().flatten().count();
        let mut change_n = f64::INFINITY;
        for turn in 0..MAX_TURNS {
            change_n = 0.0;
            for (number, pose) in poses.iter().enumerate() {
                let Some(pose) = pose else { continue };
                let others = objects.iter().enumerate().filter(|(other, _)| *other != number);
                let beside = self.beside.with(others.filter_map(|(_, other)| Some(&other.as_ref()?.state)));
                let at_fault = |error| ContactError::OfObject { object: number, error: Box::new(error) };
                let before = self.before.and_then(|before| before.objects.get(number)?.as_ref());
                let state = self
                    .contact
                    .solve_beside(
                        self.indenters[number],
                        &sensor_from_rest.compose(pose),
                        before.map(|before| &before.state),
                        &beside,
                    )
                    .map_err(at_fault)?;
                *count += 1;
                if let Some(Some(last)) = objects.get(number) {
                    change_n += last.state.wrench.force_n.distance(state.wrench.force_n);
                } else {
                    change_n += state.wrench.force_n.length();
                }
                let wrench = Wrench::of_load(
                    platform.vector(state.wrench.force_n),
                    platform.vector(state.wrench.moment_nmm),
                    platform.translation_mm,
                    self.about_mm(),
                );
                objects[number] = Some(PressedObject { rest_from_object: *pose, state, wrench });
            }
            if present < 2 {
                change_n = 0.0;
            }
            if change_n <= wanted_n && (turn > 0 || present < 2) {
                break;
            }
        }
        let wrench = objects.iter().flatten().fold(Wrench::default(), |sum, object| sum + object.wrench);
        Ok(Trial { platform, objects, wrench, change_n })
    }

    /// The load that residuals are measured by, N.
    fn scale(&self, trial: &Trial) -> f64 {
        let found = trial.objects.iter().flatten().map(|object| object.wrench.force_n.length());
        found.chain(self.pressed().map(|pressed| pressed.3)).fold(MIN_SCALE_N, f64::max)
    }

    /// Where the search starts: the frame before, or where objects touch.
    fn start(&self) -> Result<DVector<f64>, ContactError> {
        let mut x = DVector::zeros(self.of_platform() + self.pressed().count());
        let platform = self.before.map_or(Rigid::identity(), |before| before.rest_from_platform);
        if self.suspension.is_some() {
            let then = Displacement::of_pose(&platform, self.about_mm());
            x.rows_mut(0, 6).copy_from_slice(&then.to_array());
        }
        let dome = self.contact.elastomer().dome();
        for (at, (number, from, way, force_n)) in self.pressed().enumerate() {
            let last = self.before.and_then(|before| before.objects.get(number)?.as_ref());
            let gone = last.and_then(|last| gone_on_mm(&last.state, &last.rest_from_object, &from, way));
            x[self.of_platform() + at] = match gone {
                Some(gone_mm) => gone_mm,
                None => {
                    let indenter = self.indenters[number];
                    touch_mm(dome, indenter, &platform, &from, way)
                        .map_err(|error| ContactError::OfObject { object: number, error: Box::new(error) })?
                        + self.contact.first_depth_mm(indenter, force_n)
                }
            };
        }
        Ok(x)
    }

    /// The start, so deep that each object that is pressed on bears a force.
    fn touching_start(&self) -> Result<DVector<f64>, ContactError> {
        let mut x = self.start()?;
        for _ in 0..MAX_DEEPER {
            let Ok(trial) = self.contacts(&x, None, f64::INFINITY, &mut 0) else { break };
            let mut is_touching = true;
            for (at, (number, ..)) in self.pressed().enumerate() {
                let lost = trial.objects[number].as_ref().is_none_or(|object| object.state.nodes.is_empty());
                if lost {
                    x[self.of_platform() + at] += DEEPER * self.contact.elastomer().dome_radius_mm;
                    is_touching = false;
                }
            }
            if is_touching {
                break;
            }
        }
        Ok(x)
    }

    /// Objects that lie in each other have no contact that could be.
    fn check_apart(&self, trial: &Trial) -> Result<(), ContactError> {
        let sensor_from_rest = trial.platform.inverse();
        let placed: Vec<Option<Placed>> = trial
            .objects
            .iter()
            .zip(self.indenters)
            .map(|(object, indenter)| {
                let pose = sensor_from_rest.compose(&object.as_ref()?.rest_from_object);
                Some(Placed::new(indenter.solid.clone(), pose))
            })
            .collect();
        for (b, second) in placed.iter().enumerate() {
            for (a, first) in placed.iter().enumerate().take(b) {
                let (Some(first), Some(second)) = (first, second) else { continue };
                let touched: Vec<DVec3> = [a, b]
                    .iter()
                    .filter_map(|number| {
                        trial.objects[*number].as_ref()?.state.nodes.first().map(|node| node.at_mm)
                    })
                    .collect();
                let radius_mm = self.contact.elastomer().dome_radius_mm;
                if let Some(depth_mm) = common_depth_mm(first, second, &touched, radius_mm) {
                    return Err(ContactError::ObjectsMeet { objects: [a, b], depth_mm });
                }
            }
        }
        Ok(())
    }
}

impl Equations for Task<'_> {
    type Found = (Trial, u32);

    fn at(
        &self,
        x: &DVector<f64>,
        near: Option<&Self::Found>,
        off_n: f64,
    ) -> Result<(Self::Found, DVector<f64>), ContactError> {
        let mut count = near.map_or(0, |near| near.1);
        let trial = self.contacts(x, near.map(|near| &near.0), CLOSER * off_n, &mut count)?;
        let mut residual = DVector::zeros(x.len());
        if let Some(suspension) = self.suspension {
            let reach = suspension.reach_mm();
            let displacement = Displacement::from_array(std::array::from_fn(|i| x[i]));
            let springs = suspension.wrench_at(&displacement)?.to_array();
            for (i, (spring, contact)) in springs.into_iter().zip(trial.wrench.to_array()).enumerate() {
                residual[i] = (spring - contact) / if i < 3 { 1.0 } else { reach };
            }
        }
        for (at, (number, _, way, force_n)) in self.pressed().enumerate() {
            let found_n = trial.objects[number].as_ref().map_or(0.0, |object| object.wrench.force_n.dot(way));
            // Where it does not touch no tangent leads back: such trials are to be worse than any other.
            residual[self.of_platform() + at] =
                if found_n > 0.0 { found_n - force_n } else { -LOST * force_n };
        }
        Ok(((trial, count), residual))
    }

    fn wanted_n(&self, found: &Self::Found) -> f64 {
        TOLERANCE * self.scale(&found.0)
    }

    fn longest_step(&self, step: &DVector<f64>) -> f64 {
        // A tenth of the dome, or of a radian, at once.
        let radius_mm = self.contact.elastomer().dome_radius_mm;
        let turns = if self.suspension.is_some() { 3..6 } else { 0..0 };
        let size = |(i, value): (usize, &f64)| {
            if turns.contains(&i) { value.abs() / 0.1 } else { value.abs() / (0.1 * radius_mm) }
        };
        step.iter().enumerate().map(size).fold(0.0, f64::max)
    }

    fn probe(&self, unknown: usize) -> f64 {
        // Half a micrometre for each millimetre of the dome; turns that move its pole as far.
        let radius_mm = self.contact.elastomer().dome_radius_mm;
        if self.suspension.is_some() && (3..6).contains(&unknown) { 5e-5 } else { 5e-5 * radius_mm }
    }
}

impl Contact {
    /// Several objects at once: each held or pressed on as its push says, `None` for one that is away; where the platform comes
    /// to rest on its springs, or on a rigid mount (`suspension` is `None`) where each object's force is found. `beside` is
    /// what moves the dome already.
    ///
    /// # Errors
    /// As [`Contact::solve_beside`] and [`Contact::press_with_force`]; [`ContactError::ObjectsMeet`] for objects that lie in
    /// each other; [`ContactError::BadPose`] where objects and pushes are not as many. A balance that is not found is a
    /// [`PressStatus`].
    pub fn press_together(
        &self,
        objects: &[(&Indenter, Option<Push>)],
        suspension: Option<&Suspension>,
        beside: &Beside,
        before: Option<&PressedTogether>,
    ) -> Result<PressedTogether, ContactError> {
        let indenters: Vec<&Indenter> = objects.iter().map(|object| object.0).collect();
        let pushes: Vec<Option<Push>> =
            objects.iter().map(|object| object.1.map(checked).transpose()).collect::<Result<_, _>>()?;
        let task = Task { contact: self, indenters: &indenters, pushes: &pushes, suspension, beside, before };
        let Root { x, found: (trial, count), size } = root(&task, task.touching_start()?)?;
        task.check_apart(&trial)?;
        let scale = task.scale(&trial);
        let residual_n = size.max(trial.change_n);
        let status = if residual_n > 10.0 * TOLERANCE * scale || !residual_n.is_finite() {
            PressStatus::NotBalanced { residual_n }
        } else {
            bound_spring(suspension, &x)
                .map_or(PressStatus::Balanced, |spring| PressStatus::SpringsBind { spring })
        };
        let states = trial.objects.iter().flatten().map(|object| &object.state);
        let state = ContactState::of_all(states, &beside.0);
        Ok(PressedTogether {
            rest_from_platform: trial.platform,
            wrench: trial.wrench,
            residual_n,
            iterations: count,
            status,
            state,
            objects: trial.objects,
        })
    }
}

fn checked(push: Push) -> Result<Push, ContactError> {
    Ok(match push {
        Push::At(pose) => Push::At(pose),
        Push::Pressed { from, way, force_n } => {
            let (way, force_n) = checked_press(&from, way, force_n)?;
            Push::Pressed { from, way, force_n }
        }
    })
}

/// The spring that is pressed deepest beyond its coils, by number.
fn bound_spring(suspension: Option<&Suspension>, x: &DVector<f64>) -> Option<usize> {
    let suspension = suspension?;
    let displacement = Displacement::from_array(std::array::from_fn(|i| x[i]));
    let solid_mm = suspension.spec().spring.solid_compression_mm();
    let springs = suspension.springs_at(&displacement).ok()?;
    let bound = springs.iter().enumerate().filter(|(_, spring)| spring.compression_mm > solid_mm);
    bound.max_by(|a, b| a.1.compression_mm.total_cmp(&b.1.compression_mm)).map(|(number, _)| number)
}
