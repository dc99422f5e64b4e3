//! Hardness by contact mechanics: from force, travel and the contact's size, whatever the object's shape.
//!
//! For every smooth round contact, and within a few percent for others, the stiffness of the contact is S = dF/dd = 2 a E*, `a` the
//! radius of a disc of its area (G. M. Pharr, W. C. Oliver and F. R. Brotzen, J. Mater. Res. 7, 1992), and
//! 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2 (K. L. Johnson, Contact Mechanics, 1985, eq. 4.20). The dome is no half-space: its bonded
//! base holds back the part `HELD F / (E* R)` of the approach `d`. So the approach gains
//!
//! ```text
//! dd = (1 / (2 a) - HELD / R) dF / E*
//! ```
//!
//! and the slope of `d` over the integral of the bracket is 1/E*. Where the hand's travel is not known there is no `d`, and force and
//! contact alone leave E* over the object's curvature only: then the answer is the whole range. An object much harder than the dome
//! leaves E* as that of the dome: then the interval reaches to the end of the range.
//!
//! # Example
//! ```
//! use domecast_dataset::COLUMNS;
//! use domecast_dataset::physics::{Dome, HardnessStatus, Prior, hardness};
//!
//! let dome = Dome { radius_mm: 10.0, young_mpa: 0.56, poisson: 0.49, at_mm: glam::DVec3::ZERO };
//! let prior = Prior { young_mpa: [0.05, 5.0], poisson: 0.47, travel_sd_mm: 0.02 };
//! // nothing was touched in these frames: the whole range is the answer
//! let found = hardness(&[[0.0; COLUMNS.len()]; 10], &dome, &prior);
//! assert_eq!(found.status, HardnessStatus::NotMeasured);
//! assert!(found.interval[1] - found.interval[0] > 1.7);
//! ```

use glam::DVec3;

use crate::readings::COLUMNS;

/// What the bonded base holds back, in F / (E* R): the middle of what finite elements give for a hemisphere of Poisson's ratio 0.49
/// (`domecast-contact`, closed forms: 0.31 to 0.38).
const HELD: f64 = 0.33;
/// Share of the approach that the formula leaves open, as one standard deviation of its logarithm: shapes that are not round, friction, the dome's
/// curvature and its modulus, and the contact's radius as it is read. Of smooth shapes of the training split it is 0.04 to 0.12; a nut
/// or a block whose rim bears has 0.1 to 0.25.
const MODEL_PART: f64 = 0.2;
/// A frame is in contact where its force is above this many standard deviations of the first frame's scale.
const MIN_FORCE_N: f64 = 0.02;
/// Places of the range at which the hardness is weighed.
const PLACES: usize = 801;

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

/// How a hardness came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HardnessStatus {
    /// Measured.
    Ok,
    /// The upper end of the interval is that of the range: the object is too hard for this dome.
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

/// A row of readings in the order of [`COLUMNS`].
pub type ReadingRow = [f64; COLUMNS.len()];

/// A frame in contact.
struct Pressed {
    force_n: f64,
    depth_mm: f64,
    radius_mm: f64,
}

/// Hardness of what is pressed on in the frames of a video.
pub fn hardness(rows: &[ReadingRow], dome: &Dome, prior: &Prior) -> Hardness {
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
    weighed(&places, &weights)
}

fn log_places(prior: &Prior) -> Vec<f64> {
    let [low, high] = prior.young_mpa.map(f64::log10);
    (0..PLACES).map(|k| low + (high - low) * k as f64 / (PLACES - 1) as f64).collect()
}

/// Median and interval of weighed places.
fn weighed(places: &[f64], weights: &[f64]) -> Hardness {
    let all: f64 = weights.iter().sum();
    let [low, high] = [places.first(), places.last()].map(|end| end.copied().unwrap_or(f64::NAN));
    let at = |part: f64| {
        let mut sum = 0.0;
        for (place, weight) in places.iter().zip(weights) {
            sum += weight;
            if sum >= part * all {
                return *place;
            }
        }
        high
    };
    let interval = [at(0.05), at(0.95)];
    // more of the range lies open above than half of what is left of it
    let open = high - interval[1] < 0.1 * (high - low) && interval[1] - interval[0] > 0.15 * (high - low);
    let status = if open { HardnessStatus::Saturated } else { HardnessStatus::Ok };
    Hardness { log10_young: at(0.5), interval, status }
}

/// Force, approach and contact's radius of a frame; `None` where nothing touches or a number is missing.
fn pressed(row: &ReadingRow, dome: &Dome) -> Option<Pressed> {
    let vector = |at: usize| DVec3::new(row[at], row[at + 1], row[at + 2]);
    let (force, moment, shift, turn) = (vector(1), vector(4), vector(7), vector(10));
    let (travel_mm, radius_mm) = (row[13], row[17]);
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
    let mut at = 0.0;
    let mut points: Vec<(f64, f64)> = Vec::with_capacity(frames.len());
    let mut before: Option<&Pressed> = None;
    for frame in frames {
        if let Some(last) = before {
            let rise = frame.force_n - last.force_n;
            at += rise * (mean_of_inverse(last, frame) - HELD / dome.radius_mm);
        }
        points.push((at, frame.depth_mm));
        before = Some(frame);
    }
    let count = points.len() as f64;
    if points.len() < 3 {
        return None;
    }
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

/// Mean of 1/(2 a) between two frames, `a` a power of the force through both; their middle where the force stands.
fn mean_of_inverse(one: &Pressed, other: &Pressed) -> f64 {
    let [p, q] = [one, other].map(|frame| 0.5 / frame.radius_mm);
    let ratio = (other.force_n / one.force_n).ln();
    // a radius that falls, or leaps, is noise: powers of real contacts lie between a flat end's and a sharp edge's
    let power = (-(q / p).ln() / ratio).clamp(0.0, 0.6);
    if ratio.abs() < 0.02 || !power.is_finite() {
        return 0.5 * (p + q);
    }
    let middle = (p * q).sqrt();
    let half = (0.5 * ratio).exp();
    // integral of (F / Fm)^-power over F / Fm from 1/half to half, over its length
    let end = |value: f64| value.powf(1.0 - power) / (1.0 - power);
    middle * (end(half) - end(1.0 / half)) / (half - 1.0 / half)
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOME: Dome =
        Dome { radius_mm: 10.0, young_mpa: 0.56, poisson: 0.49, at_mm: DVec3::new(0.0, 0.0, -10.0) };
    const PRIOR: Prior = Prior { young_mpa: [0.01, 10.0], poisson: 0.47, travel_sd_mm: 0.005 };

    /// A ball by Hertz, pressed on the pole of a dome on springs of 8.4 N/mm.
    fn ball(young_mpa: f64, radius_mm: f64) -> Vec<ReadingRow> {
        let yields = (1.0 - 0.49_f64.powi(2)) / 0.56 + (1.0 - 0.47_f64.powi(2)) / young_mpa;
        let modulus = 1.0 / yields;
        let curved = 1.0 / (1.0 / radius_mm + 0.1);
        (0..10)
            .map(|k| {
                let force = 0.1 * f64::from(k);
                let radius = (0.75 * force * curved / modulus).cbrt();
                let depth = radius * radius / curved - HELD * force * yields / 10.0;
                let mut row = [0.0; COLUMNS.len()];
                (row[0], row[3], row[9], row[13], row[17]) =
                    (f64::from(k), -force, -force / 8.4, 3.0 + depth + force / 8.4, radius);
                row
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
        harder.iter_mut().for_each(|row| row[13] = 3.0 - 0.2 * row[13]);
        let harder = hardness(&harder, &DOME, &PRIOR);
        assert_eq!(harder.status, HardnessStatus::Saturated, "{harder:?}");
        assert!(harder.interval[1] > 0.8 && harder.interval[0] > 0.0, "{harder:?}");
        let mut still = ball(1.0, 8.0);
        still.iter_mut().for_each(|row| row[13] = f64::NAN);
        let nothing = hardness(&still, &DOME, &PRIOR);
        assert_eq!(nothing.status, HardnessStatus::NotMeasured);
        assert!(nothing.interval.iter().all(|end| end.is_finite()));
        assert!(hardness(&[], &DOME, &PRIOR).log10_young.is_finite());
        assert!(hardness(&[[f64::NAN; COLUMNS.len()]; 4], &DOME, &PRIOR).log10_young.is_finite());
        assert!(hardness(&[[f64::MAX; COLUMNS.len()]; 4], &DOME, &PRIOR).log10_young.is_finite());
    }
}
