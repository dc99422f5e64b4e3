//! Known loads: how they are said, what they do, and which of those that can be hung helps most.

use glam::DVec3;
use nalgebra::{Matrix6, Vector6};

use domecast_optics::numeric::Rigid;
use domecast_runtime::calibrate::force::{KnownLoad, SpringKnowledge};
use domecast_runtime::constants::Constants;
use domecast_springs::{Displacement, Limits, STANDARD_GRAVITY_MPS2 as GRAVITY, Wrench, try_load};

/// Weights that are at hand, g.
const MASSES_G: [f64; 6] = [10.0, 20.0, 50.0, 100.0, 200.0, 500.0];
/// A load may use this part of every limit of the springs, and of the air between lens and sheet.
const MAX_USED: f64 = 0.7;
/// Polar angle of the places beside the pole, rad, or this part of the rim's where that is nearer.
const SIDE_RAD: f64 = 1.047;
const SIDE_SHARE: f64 = 0.8;
/// A wrong load is named where it would be this little beyond what is known (six squares; 1 in 1,000 is beyond 22.5).
const EXPLAINED: f64 = 22.5;

/// Ways that a load pulls or presses, by name; those before `up` can be hung or laid on.
const DIRECTIONS: [(&str, DVec3); 6] = [
    ("down", DVec3::NEG_Z),
    ("+x", DVec3::X),
    ("-x", DVec3::NEG_X),
    ("+y", DVec3::Y),
    ("-y", DVec3::NEG_Y),
    ("up", DVec3::Z),
];
/// How many of them are before `up`.
const HUNG: usize = 5;

/// How far a load may be off what is said of it, one standard deviation each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadNoise {
    /// Of the weight, part of it.
    pub part: f64,
    /// Of the direction about each axis across, rad.
    pub turn_rad: f64,
    /// Of the place on each axis, mm.
    pub place_mm: f64,
}

/// A load as it is said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    pub force_n: f64,
    /// Which way it pulls or presses, sensor frame at rest.
    pub direction: DVec3,
    /// Where, sensor frame.
    pub point_mm: DVec3,
}

/// `50 g +x at pole`, `0.5 N down at 8.66,0,5`.
pub fn parse(words: &[&str], constants: &Constants) -> Result<Load, String> {
    let form = "weight MASS UNIT DIRECTION at PLACE, such as: weight 50 g +x at pole, or weight 0.5 N down at 8.66,0,5";
    let wrong = |what: &str| format!("{what}; the form is {form}");
    let joined = words.join(" ");
    let at = joined.find(|c: char| c.is_ascii_alphabetic()).ok_or_else(|| wrong("the unit is missing"))?;
    let (number, rest) = joined.split_at(at);
    let amount: f64 = number
        .trim()
        .parse()
        .ok()
        .filter(|v: &f64| *v > 0.0 && *v < 1e6)
        .ok_or_else(|| wrong(&format!("\"{}\" is no weight", number.trim())))?;
    let mut rest = rest.split_whitespace();
    let per = match rest.next() {
        Some("g") => 1e-3 * GRAVITY,
        Some("kg") => GRAVITY,
        Some("N") => 1.0,
        Some("mN") => 1e-3,
        other => return Err(wrong(&format!("\"{}\" is none of g, kg, N, mN", other.unwrap_or_default()))),
    };
    let given = match rest.next().unwrap_or_default() {
        "-z" => "down",
        "+z" => "up",
        given => given,
    };
    let direction = DIRECTIONS.iter().find(|(name, _)| *name == given).map(|(_, direction)| *direction);
    let direction =
        direction.ok_or_else(|| wrong(&format!("\"{given}\" is none of down, up, +x, -x, +y, -y")))?;
    let place = match (rest.next(), rest.next(), rest.next()) {
        (Some("at"), Some(place), None) => place,
        _ => return Err(wrong("after the direction stands `at` and a place, without spaces in it")),
    };
    let dome = constants.optics.dome();
    let point_mm = if place == "pole" {
        DVec3::new(0.0, 0.0, dome.height_mm())
    } else {
        let parts: Option<Vec<f64>> = place.split(',').map(|v| v.parse().ok()).collect();
        match parts.as_deref() {
            Some([x, y, z]) if [x, y, z].iter().all(|v| v.abs() < 1e3) => DVec3::new(*x, *y, *z),
            _ => return Err(wrong(&format!("\"{place}\" is neither pole nor X,Y,Z in mm"))),
        }
    };
    Ok(Load { force_n: amount * per, direction, point_mm })
}

impl Load {
    /// Its wrench about a point of the rest frame, once the platform has moved with it.
    fn wrench(&self, at_mm: DVec3, pose: &Rigid) -> Wrench {
        Wrench::of_load(self.direction * self.force_n, DVec3::ZERO, pose.point(self.point_mm), at_mm)
    }

    /// What is not known of its wrench.
    fn covariance(&self, at_mm: DVec3, noise: &LoadNoise) -> Matrix6<f64> {
        let whole = self.wrench(at_mm, &Rigid::identity()).to_vector() * noise.part;
        let mut sum = whole * whole.transpose();
        let mut add = |force: DVec3, moment: DVec3| {
            let change = Vector6::from([force.x, force.y, force.z, moment.x, moment.y, moment.z]);
            sum += change * change.transpose();
        };
        let arm = self.point_mm - at_mm;
        let force = self.direction * self.force_n;
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let turned = axis.cross(force) * noise.turn_rad;
            add(turned, arm.cross(turned));
            add(DVec3::ZERO, (axis * noise.place_mm).cross(force));
        }
        sum
    }

    /// The load beside the motion that it made.
    pub fn known(
        &self,
        at_mm: DVec3,
        pose: &Rigid,
        displacement_covariance: Matrix6<f64>,
        noise: &LoadNoise,
    ) -> KnownLoad {
        KnownLoad {
            displacement: Displacement::of_pose(pose, at_mm).to_array(),
            displacement_covariance,
            wrench: self.wrench(at_mm, pose).to_array(),
            wrench_covariance: self.covariance(at_mm, noise),
        }
    }

    /// As an answer of the wizard.
    pub fn answer(&self) -> String {
        let direction = DIRECTIONS
            .iter()
            .find(|(_, axis)| axis.dot(self.direction) > 0.99)
            .map_or("down", |(name, _)| name);
        let p = self.point_mm;
        let place = if p.x == 0.0 && p.y == 0.0 {
            "pole".to_owned()
        } else {
            let short = |v: f64| format!("{v:.2}").trim_end_matches('0').trim_end_matches('.').to_owned();
            format!("{},{},{}", short(p.x), short(p.y), short(p.z))
        };
        let grams = (1e3 * self.force_n / GRAVITY * 1e3).round() / 1e3;
        format!("weight {grams} g {direction} at {place}")
    }
}

/// Places that loads are hung at: the pole, and four round it.
fn places(constants: &Constants) -> Vec<DVec3> {
    let dome = constants.optics.dome();
    let (radius, center) = (constants.optics.dome_radius_mm, constants.optics.dome_center_z_mm);
    let rim = (-center / radius).clamp(-1.0, 1.0).acos();
    let polar = SIDE_RAD.min(SIDE_SHARE * rim);
    // hundredths of a millimetre, as they are said
    let round = |v: f64| (100.0 * v).round() / 100.0;
    let (r, z) = (round(radius * polar.sin()), round(center + radius * polar.cos()));
    let mut all = vec![DVec3::new(0.0, 0.0, dome.height_mm())];
    all.extend([(r, 0.0), (0.0, r), (-r, 0.0), (0.0, -r)].map(|(x, y)| DVec3::new(x, y, z)));
    all
}

/// Loads that the springs bear well: at each place each direction, with the largest weight that they allow and the next smaller one.
fn candidates(constants: &Constants, knowledge: &SpringKnowledge) -> Vec<(Load, [f64; 6])> {
    let Some(springs) = &constants.springs else { return Vec::new() };
    let at_mm = DVec3::from_array(springs.at_mm);
    let grip_force_n = springs.law.as_ref().and_then(|law| law.grip_force_n);
    let limits = Limits { grip_force_n, stops: Vec::new() };
    let air_mm = constants.optics.layers.first().and_then(|air| air.thickness_mm).unwrap_or(f64::INFINITY);
    let softness = knowledge.stiffness().try_inverse();
    let borne = |load: &Load| {
        let wrench = load.wrench(at_mm, &Rigid::identity());
        let d = match knowledge.law() {
            Some(law) => {
                let case = try_load(law, &limits, &wrench);
                if case.checks.iter().any(|check| check.used() > MAX_USED) {
                    return None;
                }
                case.equilibrium.ok()?.displacement.to_array()
            }
            None => (softness? * wrench.to_vector()).into(),
        };
        (-d[2] < MAX_USED * air_mm).then_some(d)
    };
    let mut all = Vec::new();
    for point_mm in places(constants) {
        for (_, direction) in DIRECTIONS.into_iter().take(HUNG) {
            let of_mass = |mass: &f64| {
                let load = Load { force_n: 1e-3 * GRAVITY * mass, direction, point_mm };
                Some((load, borne(&load)?))
            };
            all.extend(MASSES_G.iter().rev().filter_map(of_mass).take(2));
        }
    }
    all
}

/// The load that lowers the covariance most, and by how much (the logarithm of its determinant).
pub fn best(
    constants: &Constants,
    knowledge: &SpringKnowledge,
    motion: &Matrix6<f64>,
    noise: &LoadNoise,
) -> Option<(Load, f64)> {
    let at_mm = DVec3::from_array(constants.springs.as_ref()?.at_mm);
    let gain = |(load, d): (Load, [f64; 6])| {
        let pose = Displacement::from_array(d).to_pose(at_mm);
        let known = load.known(at_mm, &pose, *motion, noise);
        Some((load, knowledge.gain(&known)?))
    };
    // of equal ones the first
    candidates(constants, knowledge).into_iter().filter_map(gain).fold(
        None,
        |best, (load, gain)| match best {
            Some((_, so_far)) if gain <= so_far + 1e-9 => best,
            _ => Some((load, gain)),
        },
    )
}

/// What a load that cannot be looks like: the same weight in another unit, direction or place.
pub fn looks_like(
    load: &Load,
    constants: &Constants,
    knowledge: &SpringKnowledge,
    surprise: impl Fn(&SpringKnowledge, &Load) -> Option<f64>,
) -> Option<String> {
    // before all: of a small load every unit that makes it smaller would do
    let none = Load { force_n: 1e-6 * load.force_n, ..*load };
    if surprise(knowledge, &none).is_some_and(|surprise| surprise < EXPLAINED) {
        return Some("no load at all: does it hang free?".into());
    }
    let mut others: Vec<(Load, String)> = Vec::new();
    let times = [
        (1e3, "kg instead of g"),
        (1e-3, "g instead of kg"),
        (1e3 / GRAVITY, "N instead of g"),
        (GRAVITY, "kg instead of N"),
        (1.0 / GRAVITY, "N instead of kg"),
        (1e-3 * GRAVITY, "g instead of N"),
        (28.35, "ounces instead of g"),
        (10.0, "ten times the weight"),
        (0.1, "a tenth of the weight"),
        (2.0, "twice the weight"),
        (0.5, "half the weight"),
    ];
    others
        .extend(times.map(|(factor, name)| (Load { force_n: load.force_n * factor, ..*load }, name.into())));
    for (name, direction) in DIRECTIONS.into_iter().take(HUNG) {
        others.push((Load { direction, ..*load }, format!("a load along {name}")));
    }
    for point_mm in places(constants) {
        let other = Load { point_mm, ..*load };
        let place = other.answer();
        let place = place.rsplit(' ').next().unwrap_or("pole");
        others.push((other, format!("a load at {place}")));
    }
    let judged = others.into_iter().filter(|(other, _)| other != load);
    let judged = judged.filter_map(|(other, name)| Some((surprise(knowledge, &other)?, name)));
    let (surprise, name) = judged.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (surprise < EXPLAINED).then_some(name)
}
