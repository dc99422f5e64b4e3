//! Hardness by contact mechanics: from force, travel and the contact's size, whatever the object's shape.
//!
//! For every smooth round contact, and within a few percent for others, the stiffness of the contact is S = dF/dd = 2 a E*, `a` its
//! radius (G. M. Pharr, W. C. Oliver and F. R. Brotzen, J. Mater. Res. 7, 1992), and
//! 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2 (K. L. Johnson, Contact Mechanics, 1985, eq. 4.20). The dome is no half-space: its bonded
//! base holds back the part `HELD F / (E* R)` of the approach `d`. So the approach gains
//!
//! ```text
//! dd = (1 / (2 a) - HELD / R) dF / E*
//! ```
//!
//! and the slope of `d` over the integral of the bracket is 1/E*.
//!
//! The radius is read from the pressure, as that of the half ellipsoid with its second moments: `rho^2 = 5/2 <r^2>`. That is `a` under a ball
//! only; under a flat end or a ring the rim bears more. What a growing force adds is the pressure of a flat punch of the radius `a` that the
//! contact has then (the same paper), with `<r^2> = 2/3 a^2`. So for every round contact
//!
//! ```text
//! a^2 = 3/5 d(F rho^2)/dF,   and with rho as F^p:   a = rho sqrt(3/5 (1 + 2 p))
//! ```
//!
//! with p = 1/3 under a ball, 0 under a flat end, 1/2 under a cone.
//!
//! Where the hand's travel is not known there is no `d`, and force and contact alone leave E* over the object's curvature only: then the
//! answer is the whole range. An object much harder than the dome leaves E* as that of the dome: then the interval reaches to the
//! end of the range.
//!
//! # Example
//! ```
//! use domecast_hardness::physics::{Dome, HardnessStatus, PressRow, Prior, hardness};
//!
//! let dome = Dome { radius_mm: 10.0, young_mpa: 0.56, poisson: 0.49, at_mm: glam::DVec3::ZERO };
//! let prior = Prior { young_mpa: [0.05, 5.0], poisson: 0.47, travel_sd_mm: 0.02 };
//! // nothing was touched in these frames: the whole range is the answer
//! let found = hardness(&[PressRow::default(); 10], &dome, &prior);
//! assert_eq!(found.status, HardnessStatus::NotMeasured);
//! assert!(found.interval[1] - found.interval[0] > 1.7);
//! ```

use glam::DVec3;
use serde_json::Value;

/// What the bonded base holds back, in F / (E* R): the middle of what finite elements give for a hemisphere of Poisson's ratio 0.49
/// (`domecast-contact`, closed forms: 0.31 to 0.38).
const HELD: f64 = 0.33;
/// Share of the approach that the formula leaves open, as one standard deviation of its logarithm: shapes that are not round, friction, the dome's
/// curvature and its modulus, and the contact's radius as it is read. On the shipped sets' training shapes 0.10 holds nine of ten; others differ
/// from them.
const MODEL_PART: f64 = 0.12;
/// A frame is in contact where its force is above this.
const MIN_FORCE_N: f64 = 0.02;
/// A rigid object is not ruled out where the yield is above the dome's own by less than so many standard deviations: 5 of 100.
const RIGID_SD: f64 = 1.645;
/// Places of the range at which the hardness is weighed.
const PLACES: usize = 801;
/// Powers of the force by which a contact's radius grows, before it is read: of a ball, and how far others are from it.
const USUAL_POWER: [f64; 2] = [1.0 / 3.0, 0.15];
/// From a flat end to a cone.
const POWERS: [f64; 2] = [0.0, 0.5];
/// Noise of a contact's radius as it is read, mm: what sets have it with.
const RADIUS_SD_MM: f64 = 0.05;
/// Two classes may be of any modulus within this factor of theirs.
const BEYOND_CLASSES: f64 = 3.0;
/// Noise of a hand's travel where a set says none, mm.
const USUAL_TRAVEL_SD_MM: f64 = 0.02;

/// The readings of a frame that the formula needs, in the order of a [`PressRow`], by their names in data sets.
pub const READINGS: [&str; 14] = [
    "fx_n",
    "fy_n",
    "fz_n",
    "mx_nmm",
    "my_nmm",
    "mz_nmm",
    "tx_mm",
    "ty_mm",
    "tz_mm",
    "rx_rad",
    "ry_rad",
    "rz_rad",
    "robot_travel_mm",
    "contact_radius_mm",
];

/// The readings of a frame: wrench, displacement of the platform, travel of the hand, radius of the contact.
pub type PressRow = [f64; READINGS.len()];

/// The dome that feels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dome {
    /// Radius, mm.
    pub radius_mm: f64,
    /// Young's modulus, MPa.
    pub young_mpa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Point about which wrench and displacement are stated, mm.
    pub at_mm: DVec3,
}

impl Dome {
    /// The nominal dome of a data set by its `dataset.json`; `None` where a number is missing.
    pub fn of_set(index: &Value) -> Option<Self> {
        let number = |path: &str| index.pointer(path).and_then(Value::as_f64);
        let at = |k: usize| number(&format!("/dome/reference_mm/{k}"));
        Some(Self {
            radius_mm: number("/dome/radius_mm")?,
            young_mpa: number("/dome/youngs_modulus_mpa")?,
            poisson: number("/dome/poisson")?,
            at_mm: DVec3::new(at(0)?, at(1)?, at(2)?),
        })
    }
}

/// What is known before anything is felt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Young's moduli of objects, MPa: even in the logarithm between the two.
    pub young_mpa: [f64; 2],
    /// Poisson's ratio that objects are taken to have.
    pub poisson: f64,
    /// Noise of the hand's travel, mm.
    pub travel_sd_mm: f64,
}

impl Prior {
    /// What a data set's `dataset.json` says of its objects: their range, of two classes one that reaches beyond both.
    pub fn of_set(index: &Value) -> Option<Self> {
        let number = |path: &str| index.pointer(path).and_then(Value::as_f64);
        let poisson = 0.5 * (number("/spec/poisson/0")? + number("/spec/poisson/1")?);
        let travel_sd_mm = number("/spec/readings/robot_travel_sd_mm").unwrap_or(USUAL_TRAVEL_SD_MM);
        let range = number("/label_range_mpa/0").zip(number("/label_range_mpa/1"));
        let young_mpa = match range {
            Some((low, high)) => [low, high],
            None => {
                let class = |k: usize| number(&format!("/spec/hardness/classes/{k}/young_mpa"));
                let (one, other) = (class(0)?, class(1)?);
                [one.min(other) / BEYOND_CLASSES, one.max(other) * BEYOND_CLASSES]
            }
        };
        Some(Self { young_mpa, poisson, travel_sd_mm })
    }
}

/// How a hardness came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HardnessStatus {
    /// Measured.
    Ok,
    /// The object is too hard for this dome: a rigid one may feel the same. The interval reaches to the range's end.
    Saturated,
    /// Nothing touched for long enough, or a number is missing: the interval is the range.
    NotMeasured,
}

impl HardnessStatus {
    /// The name that files carry.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Saturated => "saturated",
            Self::NotMeasured => "not_measured",
        }
    }
}

/// Logarithm (base 10) of an object's Young's modulus in MPa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hardness {
    /// Median: of an object much harder than the dome the range above is all alike, and a mean would be half of that range.
    pub log10_young: f64,
    /// The 5th and the 95th of 100.
    pub interval: [f64; 2],
    /// How it came about.
    pub status: HardnessStatus,
}

/// A frame in contact.
struct Pressed {
    force_n: f64,
    depth_mm: f64,
    radius_mm: f64,
}

/// Hardness of what is pressed on in the frames of a video.
pub fn hardness(rows: &[PressRow], dome: &Dome, prior: &Prior) -> Hardness {
    let places = log_places(prior);
    let pressed: Vec<Pressed> = rows.iter().filter_map(|row| pressed(row, dome)).collect();
    let Some((yields, sd)) = yields(&pressed, dome, prior.travel_sd_mm) else {
        let [low, high] = [places.first(), places.last()].map(|end| end.copied().unwrap_or(f64::NAN));
        let end = |part: f64| low + (high - low) * part;
        return Hardness {
            log10_young: end(0.5),
            interval: [end(0.05), end(0.95)],
            status: HardnessStatus::NotMeasured,
        };
    };
    let own = (1.0 - dome.poisson * dome.poisson) / dome.young_mpa;
    // What yields less than the dome itself says no more than that the object is hard: the rest is noise, or the formula's.
    let yields = yields.max(own * (-2.0 * MODEL_PART).exp());
    let spread = MODEL_PART.hypot(sd / yields);
    let log_likelihood = |log10: &f64| {
        let object = (1.0 - prior.poisson * prior.poisson) / 10_f64.powf(*log10);
        -0.5 * ((yields / (own + object)).ln() / spread).powi(2)
    };
    let logs: Vec<f64> = places.iter().map(log_likelihood).collect();
    let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = logs.iter().map(|log| (log - top).exp()).collect();
    let [low, log10_young, high] = quantiles(&places, &weights, [0.05, 0.5, 0.95]);
    let rigid = (yields / own).ln() < RIGID_SD * spread;
    let status = if rigid { HardnessStatus::Saturated } else { HardnessStatus::Ok };
    Hardness { log10_young, interval: [low, high], status }
}

fn log_places(prior: &Prior) -> Vec<f64> {
    let [low, high] = prior.young_mpa.map(f64::log10);
    (0..PLACES).map(|k| low + (high - low) * k as f64 / (PLACES - 1) as f64).collect()
}

/// Places below which so large parts of the weights lie.
fn quantiles<const N: usize>(places: &[f64], weights: &[f64], parts: [f64; N]) -> [f64; N] {
    let all: f64 = weights.iter().sum();
    let below = weights.iter().scan(0.0, |sum, weight| {
        *sum += weight;
        Some(*sum)
    });
    let sums: Vec<f64> = below.collect();
    parts.map(|part| {
        let at = sums.partition_point(|sum| *sum < part * all);
        places.get(at).or(places.last()).copied().unwrap_or(f64::NAN)
    })
}

/// Force, approach and contact's radius of a frame; `None` where nothing touches or a number is missing.
fn pressed(row: &PressRow, dome: &Dome) -> Option<Pressed> {
    let vector = |at: usize| DVec3::new(row[at], row[at + 1], row[at + 2]);
    let (force, moment, shift, turn) = (vector(0), vector(3), vector(6), vector(9));
    let [travel_mm, radius_mm] = [row[12], row[13]];
    let force_n = force.length();
    let known = force_n > MIN_FORCE_N && travel_mm.is_finite() && radius_mm > 0.0;
    if !(known && moment.is_finite() && shift.is_finite() && turn.is_finite()) {
        return None;
    }
    // The force's line: its nearest point to where moments are about, and from there back to the dome.
    let way = force / force_n;
    let near = dome.at_mm + force.cross(moment) / (force_n * force_n);
    let behind = near.dot(way);
    let room = behind * behind - near.length_squared() + dome.radius_mm * dome.radius_mm;
    let at_mm = near - way * (behind + room.max(0.0).sqrt());
    let platform = shift + turn.cross(at_mm - dome.at_mm);
    Some(Pressed { force_n, depth_mm: travel_mm - platform.dot(way), radius_mm })
}

/// 1/E* and its standard deviation by noise: the slope of the approach over the integral of 1/(2 a) - HELD/R over the force.
fn yields(frames: &[Pressed], dome: &Dome, travel_sd_mm: f64) -> Option<(f64, f64)> {
    let count = frames.len() as f64;
    if frames.len() < 3 {
        return None;
    }
    let (scale, power) = growth(frames);
    let integral = |frame: &Pressed| {
        frame.force_n.powf(1.0 - power) / ((1.0 - power) * 2.0 * scale)
            - HELD * frame.force_n / dome.radius_mm
    };
    let points: Vec<(f64, f64)> = frames.iter().map(|frame| (integral(frame), frame.depth_mm)).collect();
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let xx: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    let xy: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let slope = xy / xx;
    let left: f64 = points.iter().map(|p| (p.1 - y - slope * (p.0 - x)).powi(2)).sum();
    // what the line leaves counts where it is more than the noise
    let sd_mm = travel_sd_mm.max((left / (count - 2.0)).sqrt());
    let sd = sd_mm / xx.sqrt();
    (slope.is_finite() && sd.is_finite()).then_some((slope, sd))
}

/// Radius of the contact, `a = scale F^power`, from the radii by the pressure's moments.
fn growth(frames: &[Pressed]) -> (f64, f64) {
    // a radius is read to a part of a millimetre, its logarithm the better the larger it is
    let weight = |frame: &Pressed| (frame.radius_mm / RADIUS_SD_MM).powi(2);
    let all: f64 = frames.iter().map(weight).sum();
    let mean = |of: &dyn Fn(&Pressed) -> f64| frames.iter().map(|f| weight(f) * of(f)).sum::<f64>() / all;
    let (force, radius) = (mean(&|f| f.force_n.ln()), mean(&|f| f.radius_mm.ln()));
    let [usual, sd] = USUAL_POWER;
    let known = 1.0 / (sd * sd);
    let along = all * mean(&|f| (f.force_n.ln() - force) * (f.radius_mm.ln() - radius));
    let square = all * mean(&|f| (f.force_n.ln() - force).powi(2));
    let [low, high] = POWERS;
    let power = ((along + known * usual) / (square + known)).clamp(low, high);
    ((radius - power * force).exp() * (0.6 * (1.0 + 2.0 * power)).sqrt(), power)
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOME: Dome =
        Dome { radius_mm: 10.0, young_mpa: 0.56, poisson: 0.49, at_mm: DVec3::new(0.0, 0.0, -10.0) };
    const PRIOR: Prior = Prior { young_mpa: [0.01, 10.0], poisson: 0.47, travel_sd_mm: 0.005 };

    /// A frame on the pole of a dome on springs of 8.4 N/mm.
    fn pressed_by(force_n: f64, depth_mm: f64, radius_mm: f64) -> PressRow {
        let mut row = PressRow::default();
        (row[2], row[8], row[12], row[13]) =
            (-force_n, -force_n / 8.4, 3.0 + depth_mm + force_n / 8.4, radius_mm);
        row
    }

    /// A ball by Hertz, pressed on the pole of a dome on springs of 8.4 N/mm.
    fn ball(young_mpa: f64, radius_mm: f64) -> Vec<PressRow> {
        let yields = (1.0 - 0.49_f64.powi(2)) / 0.56 + (1.0 - 0.47_f64.powi(2)) / young_mpa;
        let modulus = 1.0 / yields;
        let curved = 1.0 / (1.0 / radius_mm + 0.1);
        (0..10)
            .map(|k| {
                let force = 0.1 * f64::from(k);
                let radius = (0.75 * force * curved / modulus).cbrt();
                let depth = radius * radius / curved - HELD * force * yields / 10.0;
                pressed_by(force, depth, radius)
            })
            .collect()
    }

    #[test]
    fn balls_of_any_size_have_the_modulus_that_they_were_made_of() {
        for young_mpa in [0.05, 0.3, 1.0] {
            for radius_mm in [3.0, 8.0, 30.0] {
                let found = hardness(&ball(young_mpa, radius_mm), &DOME, &PRIOR);
                let [low, high] = found.interval;
                assert!((low..=high).contains(&young_mpa.log10()), "{young_mpa} {radius_mm}: {found:?}");
                assert!((found.log10_young - young_mpa.log10()).abs() < 0.12, "{young_mpa}: {found:?}");
            }
        }
    }

    #[test]
    fn steel_is_saturated_and_nothing_is_not_measured() {
        let steel = hardness(&ball(2e5, 8.0), &DOME, &PRIOR);
        assert_eq!(steel.status, HardnessStatus::Saturated, "{steel:?}");
        assert!(steel.interval[1] > 0.8 && steel.interval[0] < 0.7, "{steel:?}");
        // the hand goes back while the force grows: no object is as hard as that
        let mut harder = ball(2e5, 8.0);
        harder.iter_mut().for_each(|row| row[12] = 3.0 - 0.2 * row[12]);
        let harder = hardness(&harder, &DOME, &PRIOR);
        assert_eq!(harder.status, HardnessStatus::Saturated, "{harder:?}");
        assert!(harder.interval[1] > 0.8 && harder.interval[0] > 0.0, "{harder:?}");
        let mut still = ball(1.0, 8.0);
        still.iter_mut().for_each(|row| row[12] = f64::NAN);
        let nothing = hardness(&still, &DOME, &PRIOR);
        assert_eq!(nothing.status, HardnessStatus::NotMeasured);
        assert!(nothing.interval.iter().all(|end| end.is_finite()));
        assert!(hardness(&[], &DOME, &PRIOR).log10_young.is_finite());
        assert!(hardness(&[[f64::NAN; READINGS.len()]; 4], &DOME, &PRIOR).log10_young.is_finite());
        assert!(hardness(&[[f64::MAX; READINGS.len()]; 4], &DOME, &PRIOR).log10_young.is_finite());
    }

    #[test]
    fn flat_ends_and_cones_have_the_modulus_that_they_were_made_of() {
        for young_mpa in [0.05, 0.3, 1.0] {
            let yields = (1.0 - 0.49_f64.powi(2)) / 0.56 + (1.0 - 0.47_f64.powi(2)) / young_mpa;
            // second moments 2/3 and 1/3 of the radius squared (I. N. Sneddon, Int. J. Eng. Sci. 3, 1965)
            let flat = |force: f64| (0.5 * force * yields / 3.0, 3.0 * (5.0_f64 / 3.0).sqrt());
            let cone = |force: f64| {
                // F = pi a^2 E* / (2 tan), d = pi a / (2 tan), with a slope that is small
                let slope: f64 = 0.2;
                let a = (2.0 * force * yields / (std::f64::consts::PI * slope)).sqrt();
                (0.5 * std::f64::consts::PI * a * slope, a * (5.0_f64 / 6.0).sqrt())
            };
            for of in [&flat as &dyn Fn(f64) -> (f64, f64), &cone] {
                let frame = |k: i32| {
                    let force = 0.1 * f64::from(k);
                    let (depth, radius) = of(force);
                    pressed_by(force, depth - HELD * force * yields / 10.0, radius)
                };
                let found = hardness(&(0..10).map(frame).collect::<Vec<_>>(), &DOME, &PRIOR);
                assert!((found.log10_young - young_mpa.log10()).abs() < 0.06, "{young_mpa}: {found:?}");
            }
        }
    }
}
