//! Hardness by contact mechanics: from force, travel and the contact's size, whatever the object's shape.
//!
//! For every smooth round contact, and within a few percent for others, the stiffness of the contact is S = dF/dd = 2 a E*, `a` its
//! radius (G. M. Pharr, W. C. Oliver and F. R. Brotzen, J. Mater. Res. 7, 1992), and
//! 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2 (K. L. Johnson, Contact Mechanics, 1985, eq. 4.20). The dome is no half-space: its bonded
//! base holds back `c F (1 - nu1^2) / (E1 R)` of the approach, a part of its own yield that is known; the object has no such base. With it added,
//! the approach `d` is that of two half-spaces and gains
//!
//! ```text
//! dd = dF / (2 a E*)
//! ```
//!
//! and the slope of `d` over the integral of 1/(2 a) is 1/E*.
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
//! end of the range. An approach that no object of the range has is named: the hand's travel is not what it is taken for.
//!
//! # Example
//! ```
//! use domecast_hardness::physics::{Dome, HardnessStatus, PressRow, Prior, hardness};
//!
//! let at_mm = glam::DVec3::ZERO;
//! let dome = Dome { radius_mm: 10.0, center_mm: at_mm, young_mpa: 0.56, young_sd_mpa: 0.0, poisson: 0.49, at_mm };
//! let prior = Prior { young_mpa: [0.05, 5.0], poisson: 0.47, travel_sd_mm: 0.02, force_sd_part: 0.0 };
//! // nothing was touched in these frames: the whole range is the answer
//! let found = hardness(&[PressRow::default(); 10], &dome, &prior);
//! assert_eq!(found.status, HardnessStatus::NotMeasured);
//! assert!(found.interval[1] - found.interval[0] > 1.7);
//! ```

use serde_json::Value;

use crate::approach::{Pressed, pressed, yields};
pub use crate::press::{Dome, PressRow};

/// Share of the approach that the formula leaves open, as one standard deviation of its logarithm: shapes that are not round, friction, the dome's
/// curvature and its modulus, and the contact's radius as it is read. On the shipped sets' training shapes 0.07 holds nine of ten, on shapes that
/// differ from them 0.10.
const MODEL_PART: f64 = 0.10;
/// A rigid object is not ruled out where the yield is above the dome's own by less than so many standard deviations: 5 of 100.
const RIGID_SD: f64 = 1.645;
/// What is read is none of the range's where it is beyond its ends by so many standard deviations.
const IMPOSSIBLE_SD: f64 = 3.0;
/// Places of the range at which the hardness is weighed.
const PLACES: usize = 801;
/// Two classes may be of any modulus within this factor of theirs.
const BEYOND_CLASSES: f64 = 3.0;
/// Noise of a hand's travel where a set says none, mm.
const USUAL_TRAVEL_SD_MM: f64 = 0.02;

/// What is known before anything is felt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Young's moduli of objects, MPa: even in the logarithm between the two.
    pub young_mpa: [f64; 2],
    /// Poisson's ratio that objects are taken to have.
    pub poisson: f64,
    /// Noise of the hand's travel, mm.
    pub travel_sd_mm: f64,
    /// Standard deviation of the forces' scale, as a part of them; of a data set 0, as for [`Dome::young_sd_mpa`].
    pub force_sd_part: f64,
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
        Some(Self { young_mpa, poisson, travel_sd_mm, force_sd_part: 0.0 })
    }
}

/// How a hardness came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HardnessStatus {
    /// Measured.
    Ok,
    /// The object is too hard for this dome: a rigid one may feel the same. The interval reaches to the range's end.
    Saturated,
    /// No object of the range gives way by so little or by so much: the travel is of another sign, unit or moment, something slipped, or
    /// dome and springs are not as they are taken to be. The numbers are the range's nearest.
    Impossible,
    /// Nothing touched for long enough, or a number is missing: the interval is the range.
    NotMeasured,
}

impl HardnessStatus {
    /// Whether the numbers beside it are of the object, and not of the range alone.
    pub fn is_measured(self) -> bool {
        matches!(self, Self::Ok | Self::Saturated)
    }

    /// The name that files carry.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Saturated => "saturated",
            Self::Impossible => "impossible",
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

/// Hardness of what is pressed on in the frames of a video.
pub fn hardness(rows: &[PressRow], dome: &Dome, prior: &Prior) -> Hardness {
    let places = log_places(prior);
    let pressed: Vec<Pressed> = rows.iter().filter_map(|row| pressed(row, dome)).collect();
    let Some((yields, sd)) = yields(&pressed, prior.travel_sd_mm) else {
        let [low, high] = [places.first(), places.last()].map(|end| end.copied().unwrap_or(f64::NAN));
        let end = |part: f64| low + (high - low) * part;
        return Hardness {
            log10_young: end(0.5),
            interval: [end(0.05), end(0.95)],
            status: HardnessStatus::NotMeasured,
        };
    };
    let own = (1.0 - dome.poisson * dome.poisson) / dome.young_mpa;
    let as_read = yields;
    // What yields less than the dome itself says no more than that the object is hard: the rest is noise, or the formula's.
    let yields = yields.max(own * (-2.0 * MODEL_PART).exp());
    // what the dome's own modulus leaves open counts by its share of the yield
    let spread = |share: f64| {
        let own_part = share * dome.young_sd_mpa / dome.young_mpa;
        MODEL_PART.hypot(sd / yields).hypot(prior.force_sd_part).hypot(own_part)
    };
    let with_object = |log10: f64| own + (1.0 - prior.poisson * prior.poisson) / 10_f64.powf(log10);
    let log_likelihood = |log10: &f64| {
        let total = with_object(*log10);
        let spread = spread(own / total);
        -0.5 * ((yields / total).ln() / spread).powi(2) - spread.ln()
    };
    let logs: Vec<f64> = places.iter().map(log_likelihood).collect();
    let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = logs.iter().map(|log| (log - top).exp()).collect();
    let [low, log10_young, high] = quantiles(&places, &weights, [0.05, 0.5, 0.95]);
    let softest = with_object(places[0]);
    let too_little = as_read < own * (-IMPOSSIBLE_SD * spread(1.0)).exp();
    let too_much = yields > softest * (IMPOSSIBLE_SD * spread(own / softest)).exp();
    let status = if too_little || too_much {
        HardnessStatus::Impossible
    } else if (yields / own).ln() < RIGID_SD * spread(1.0) {
        HardnessStatus::Saturated
    } else {
        HardnessStatus::Ok
    };
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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    use crate::approach::held;

    const DOME: Dome = Dome {
        radius_mm: 10.0,
        center_mm: DVec3::ZERO,
        young_mpa: 0.56,
        young_sd_mpa: 0.0,
        poisson: 0.49,
        at_mm: DVec3::new(0.0, 0.0, -10.0),
    };
    /// What the dome itself yields.
    const OWN: f64 = (1.0 - 0.49 * 0.49) / 0.56;
    const PRIOR: Prior =
        Prior { young_mpa: [0.01, 10.0], poisson: 0.47, travel_sd_mm: 0.005, force_sd_part: 0.0 };

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
                let depth = radius * radius / curved - held(0.0) * force * OWN / 10.0;
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
        assert_eq!(harder.status, HardnessStatus::Impossible, "{harder:?}");
        assert!(harder.interval[1] > 0.8 && harder.interval[0] > 0.0, "{harder:?}");
        // another sign, metres, micrometres: what yields less than the dome, or more than any foam
        for unit in [-1.0, 1e-3, 1e3] {
            let mut other = ball(1.0, 8.0);
            other.iter_mut().for_each(|row| row[12] *= unit);
            assert_eq!(hardness(&other, &DOME, &PRIOR).status, HardnessStatus::Impossible, "{unit}");
        }
        let mut still = ball(1.0, 8.0);
        still.iter_mut().for_each(|row| row[12] = f64::NAN);
        let nothing = hardness(&still, &DOME, &PRIOR);
        assert_eq!(nothing.status, HardnessStatus::NotMeasured);
        assert!(nothing.interval.iter().all(|end| end.is_finite()));
        assert!(hardness(&[], &DOME, &PRIOR).log10_young.is_finite());
        assert!(hardness(&[PressRow::default().map(|_| f64::NAN); 4], &DOME, &PRIOR).log10_young.is_finite());
        assert!(hardness(&[PressRow::default().map(|_| f64::MAX); 4], &DOME, &PRIOR).log10_young.is_finite());
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
                    pressed_by(force, depth - held(0.0) * force * OWN / 10.0, radius)
                };
                let found = hardness(&(0..10).map(frame).collect::<Vec<_>>(), &DOME, &PRIOR);
                assert!((found.log10_young - young_mpa.log10()).abs() < 0.06, "{young_mpa}: {found:?}");
            }
        }
    }
}
