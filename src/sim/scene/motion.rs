//! Pose and load of the platform over time.

use glam::DVec3;

use super::file::{MotionSection, PoseKey, WrenchKey};
use domecast_design::limits_of;
use domecast_optics::numeric::Rigid;
use domecast_springs::{Check, Displacement, Limit, Limits, MechanicsError, Suspension, Wrench, try_load};

/// Pose and load of the platform at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// `rest_from_platform`.
    pub pose: Rigid,
    /// What the world puts on dome and platform, about the suspension's reference point.
    pub wrench: Wrench,
    /// What stops the platform, if something does.
    pub held: Option<Held>,
}

/// A load that the springs do not carry alone: their coils lie on each other and take the rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// Name of the limit that holds the platform.
    pub limit: &'static str,
    /// The part of the sensor that meets it.
    pub part: String,
    /// Part of the load at which it is met, 0 to 1; the pose is that of this part.
    pub carried: f64,
}

impl Held {
    /// What it means, for people.
    pub fn note(&self) -> String {
        match self.limit {
            "not_balanced" => format!("{} is left between springs and contact", self.part),
            _ if self.carried < 1.0 => {
                format!("{} stops the platform at {:.2} % of the load", self.part, 100.0 * self.carried)
            }
            _ => format!("{} does not bear the load as the springs' law says", self.part),
        }
    }
}

/// What moves the platform.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    course: Course,
    limits: Limits,
}

#[derive(Debug, Clone, PartialEq)]
enum Course {
    Still,
    Wrench(Vec<(f64, Wrench)>),
    Pose(Vec<(f64, Displacement)>),
}

/// Bisections of the load down to the part that is just carried: 2^-40 of it.
const HALVINGS: u32 = 40;
/// Part of the travel from which a platform that goes no further is held by its coils, not by the end of the law.
const NEARLY_BOUND: f64 = 1.0 - 1e-6;

impl Motion {
    /// The motion of a scene; keys are in order of time.
    pub(super) fn new(
        section: Option<&MotionSection>,
        design: &domecast_design::Design,
        suspension: Option<&Suspension>,
    ) -> Self {
        let at_mm = suspension.map_or(DVec3::ZERO, Suspension::at_mm);
        let course = match section {
            None => Course::Still,
            Some(MotionSection::Wrench(motion)) => {
                Course::Wrench(motion.wrench.iter().map(|key| wrench_key(key, at_mm)).collect())
            }
            Some(MotionSection::Pose(motion)) => Course::Pose(motion.pose.iter().map(pose_key).collect()),
        };
        Self { course, limits: limits_of(design) }
    }

    /// Whether the platform moves at all.
    pub fn moves(&self) -> bool {
        match &self.course {
            Course::Still => false,
            Course::Wrench(keys) => keys.iter().any(|(_, w)| w.to_array().iter().any(|v| *v != 0.0)),
            Course::Pose(keys) => keys.iter().any(|(_, d)| d.to_array().iter().any(|v| *v != 0.0)),
        }
    }

    /// The load that the scene puts on besides objects, and where the scene prescribes the pose, that pose.
    pub fn load_at(&self, time_s: f64) -> (Wrench, Option<Displacement>) {
        match &self.course {
            Course::Still => (Wrench::default(), None),
            Course::Wrench(keys) => {
                let mix = |a: &Wrench, b: &Wrench, part: f64| Wrench {
                    force_n: a.force_n.lerp(b.force_n, part),
                    moment_nmm: a.moment_nmm.lerp(b.moment_nmm, part),
                };
                (interpolate(keys, time_s, mix), None)
            }
            Course::Pose(keys) => {
                let mix = |a: &Displacement, b: &Displacement, part: f64| Displacement {
                    translation_mm: a.translation_mm.lerp(b.translation_mm, part),
                    rotation_rad: a.rotation_rad.lerp(b.rotation_rad, part),
                };
                (Wrench::default(), Some(interpolate(keys, time_s, mix)))
            }
        }
    }

    /// Pose and load at a time, without objects; without springs (a rigid mount) the platform rests.
    ///
    /// # Errors
    /// A load that has no balance, or a pose beyond the springs' model.
    pub fn at(&self, suspension: Option<&Suspension>, time_s: f64) -> Result<State, MechanicsError> {
        let Some(suspension) = suspension else {
            return Ok(State { pose: Rigid::identity(), wrench: Wrench::default(), held: None });
        };
        let (wrench, pose) = self.load_at(time_s);
        if let Some(displacement) = pose {
            let wrench = suspension.wrench_at(&displacement)?;
            return Ok(State { pose: displacement.to_pose(suspension.at_mm()), wrench, held: None });
        }
        if wrench == Wrench::default() {
            return Ok(State { pose: Rigid::identity(), wrench, held: None });
        }
        self.balance(suspension, &wrench)
    }

    /// The balance of a load; where coils bind, the pose at which they just do.
    fn balance(&self, suspension: &Suspension, wrench: &Wrench) -> Result<State, MechanicsError> {
        // Far beyond the bound the law may have no balance at all: then the part of the load tells which limit is first.
        let whole = suspension.equilibrium(wrench);
        if let Ok(balance) = &whole
            && bound_spring(suspension, &balance.pose).is_none()
        {
            return Ok(State { pose: balance.pose, wrench: *wrench, held: None });
        }
        let (mut low, mut high) = (0.0, 1.0);
        let mut pose = Rigid::identity();
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            match suspension.equilibrium(&wrench.scaled(middle)) {
                Ok(balance) if bound_spring(suspension, &balance.pose).is_none() => {
                    low = middle;
                    pose = balance.pose;
                }
                _ => high = middle,
            }
        }
        let Some(spring) = bound_spring_within(suspension, &pose, NEARLY_BOUND) else {
            whole?;
            return Ok(State { pose, wrench: *wrench, held: None });
        };
        let held = Held { limit: Limit::CoilBind.as_str(), part: format!("spring {spring}"), carried: low };
        Ok(State { pose, wrench: *wrench, held: Some(held) })
    }

    /// The limit other than bound coils that the load at a time passes, if it does.
    pub(super) fn passed_at(&self, suspension: &Suspension, time_s: f64) -> Option<Check> {
        let (wrench, _) = self.load_at(time_s);
        let state = self.balance(suspension, &wrench).ok();
        // Where coils bind, the platform goes no further: the limits are those of that pose.
        let carried = state.and_then(|state| state.held).map_or(1.0, |held| held.carried);
        let case = try_load(suspension, &self.limits, &wrench.scaled(carried));
        case.passed().find(|check| check.limit != Limit::CoilBind).cloned()
    }

    /// The limits of a load.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }
}

/// The spring whose coils lie deepest on each other, by number; `None` where none do.
fn bound_spring(suspension: &Suspension, pose: &Rigid) -> Option<usize> {
    // Rounding beyond the bound is not binding; the same slack as the envelope's.
    bound_spring_within(suspension, pose, 1.0 + 1e-12)
}

/// The same for a part of the springs' travel.
fn bound_spring_within(suspension: &Suspension, pose: &Rigid, part: f64) -> Option<usize> {
    let spec = suspension.spec();
    let room_mm = spec.spring.solid_compression_mm() - suspension.rest_compression_mm();
    let pressed = spec.upper_ends_mm.iter().map(|end| end.z - pose.point(*end).z).enumerate();
    let (number, pressed_mm) = pressed.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (pressed_mm > room_mm * part).then_some(number)
}

fn wrench_key(key: &WrenchKey, at_mm: DVec3) -> (f64, Wrench) {
    let [force, moment, point] = [key.force_n, key.moment_nmm, key.point_mm].map(DVec3::from_array);
    (key.time_s, Wrench::of_load(force, moment, point, at_mm))
}

fn pose_key(key: &PoseKey) -> (f64, Displacement) {
    let displacement = Displacement {
        translation_mm: DVec3::from_array(key.translation_mm),
        rotation_rad: DVec3::from_array(key.rotation_deg.map(f64::to_radians)),
    };
    (key.time_s, displacement)
}

/// Linear between the keys around a time, the end keys beyond them.
pub(super) fn interpolate<T: Clone + Default>(
    keys: &[(f64, T)],
    time_s: f64,
    mix: impl Fn(&T, &T, f64) -> T,
) -> T {
    let above = keys.partition_point(|(time, _)| *time <= time_s);
    match (above.checked_sub(1).and_then(|i| keys.get(i)), keys.get(above)) {
        (Some((t0, a)), Some((t1, b))) => mix(a, b, (time_s - t0) / (t1 - t0)),
        (Some((_, end)), None) | (None, Some((_, end))) => end.clone(),
        (None, None) => T::default(),
    }
}
