//! What a measured print adds to a nominal map.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DVec2, DVec3};

use super::limit::{TransferError, TransferLimit};
use super::nominal::{ANGLE_EPSILON_RAD, Nominal};
use super::polar::{Polar, UnitPlate};

/// A fitted correction to a nominal map. With s = sin(phi), azimuth theta, dome radius R:
///
/// radially r = r_nominal(phi) + R (c1 s + c3 s^3 + c5 s^5 ..) + R s (a cos 2 theta + b sin 2 theta),
/// sideways R s (c cos 2 theta + d sin 2 theta), all turned by the rotation and then moved by the offset.
///
/// It corrects a nominal map rather than replace it, because a series in sin(phi) alone misses an
/// equidistant pad by 0.03 mm at 60 degrees on a dome of 10 mm radius with three terms.
#[derive(Debug, Clone, PartialEq)]
pub struct Correction {
    /// c1, c3, c5, ..; no unit.
    pub radial: Vec<f64>,
    /// a, b; no unit. A pad or a dome that is not round.
    pub two_fold: [f64; 2],
    /// c, d; no unit. With c = b and d = -a the two-fold terms are a pure stretch along one line.
    pub two_fold_sideways: [f64; 2],
    /// Turn of the plate, rad, counter-clockwise seen from above.
    pub rotation_rad: f64,
    /// Shift of the plate, mm.
    pub offset_mm: DVec2,
    /// The polar angle to which the measurement reaches, rad; the map ends there.
    pub max_polar_rad: f64,
}

/// Steps of polar angle and azimuth at which a map is checked for folds. The terms vary over no less than a
/// quarter turn, so that this is dense by a factor of ten or more.
const FOLD_CHECK: (u32, u32) = (128, 72);

/// Smallest slope and area ratio of a usable map: below it 0.01 mm on the plate would be 1 mm on the dome.
const MIN_SLOPE: f64 = 0.01;

/// Bound on the steps of the inverse. A monotone map needs 4 to 8.
const MAX_STEPS: u32 = 60;

/// Residual of the inverse on the plate, as a share of the dome's radius.
const INVERSE_TOLERANCE: f64 = 4e-15;

impl Correction {
    /// Checks the numbers, and that the map on top of `nominal` grows outwards everywhere without folding.
    pub(super) fn check(&self, nominal: Nominal) -> Result<(), TransferError> {
        let wrong = |field: &str, value: String, problem: &str, allowed: &str| {
            Err(TransferError {
                field: field.into(),
                value,
                problem: problem.into(),
                allowed: allowed.into(),
            })
        };
        if !self.radial.iter().all(|c| c.is_finite()) {
            let value = format!("{:?}", self.radial);
            return wrong("measured.radial", value, "not a number", "finite numbers");
        }
        let others = [
            ("measured.two_fold", self.two_fold[0]),
            ("measured.two_fold", self.two_fold[1]),
            ("measured.two_fold_sideways", self.two_fold_sideways[0]),
            ("measured.two_fold_sideways", self.two_fold_sideways[1]),
            ("measured.rotation_deg", self.rotation_rad),
            ("measured.offset_mm", self.offset_mm.x),
            ("measured.offset_mm", self.offset_mm.y),
        ];
        for (field, value) in others {
            if !value.is_finite() {
                return wrong(field, value.to_string(), "not a number", "finite numbers");
            }
        }
        if !(self.max_polar_rad > 0.0 && self.max_polar_rad <= FRAC_PI_2) {
            return wrong(
                "measured.max_polar_deg",
                self.max_polar_rad.to_degrees().to_string(),
                "the dome ends at its rim",
                "above 0, to 90",
            );
        }
        self.check_folds(nominal)
    }

    fn check_folds(&self, nominal: Nominal) -> Result<(), TransferError> {
        let (polar_steps, azimuth_steps) = FOLD_CHECK;
        for i in 0..=polar_steps {
            let polar_rad = self.max_polar_rad * f64::from(i) / f64::from(polar_steps);
            for k in 0..azimuth_steps {
                let at = Polar::new(polar_rad, TAU * f64::from(k) / f64::from(azimuth_steps));
                let image = self.unit_plate(nominal, &at);
                let smallest = image.d_radial_d_polar.min(image.area_ratio());
                if smallest < MIN_SLOPE {
                    return Err(TransferError {
                        field: "measured".into(),
                        value: format!(
                            "a map whose slope is {smallest:.4} at {:.1} deg",
                            polar_rad.to_degrees()
                        ),
                        problem: "the map does not grow outwards there: it folds".into(),
                        allowed: format!("a slope of {MIN_SLOPE} or more up to measured.max_polar_deg"),
                    });
                }
            }
        }
        Ok(())
    }

    pub(super) fn unit_plate(&self, nominal: Nominal, at: &Polar) -> UnitPlate {
        let s = at.sin_polar;
        let s2 = s * s;
        // Horner's rule for c1 + c3 s^2 + .. and for its companion c1 + 3 c3 s^2 + 5 c5 s^4 ..
        let (mut series, mut slope) = (0.0, 0.0);
        for (i, c) in self.radial.iter().enumerate().rev() {
            series = series * s2 + c;
            slope = slope * s2 + c * (2 * i + 1) as f64;
        }
        let (cos_double, sin_double) = (at.out.x * at.out.x - at.out.y * at.out.y, 2.0 * at.out.x * at.out.y);
        let wave = |[a, b]: [f64; 2]| a * cos_double + b * sin_double;
        let wave_slope = |[a, b]: [f64; 2]| 2.0 * (b * cos_double - a * sin_double);
        UnitPlate {
            radial_over_sin: nominal.radius_over_sin(at.polar_rad) + series + wave(self.two_fold),
            sideways_over_sin: wave(self.two_fold_sideways),
            d_radial_d_polar: nominal.slope(at.polar_rad) + at.cos_polar * (slope + wave(self.two_fold)),
            d_sideways_d_polar: at.cos_polar * wave(self.two_fold_sideways),
            d_radial_around: wave_slope(self.two_fold),
            d_sideways_around: wave_slope(self.two_fold_sideways),
            turn: DVec2::from_angle(self.rotation_rad),
        }
    }

    /// The direction that prints from `target` (unit dome, offset removed): a damped Newton iteration in
    /// polar coordinates, where the maps are close to linear.
    pub(super) fn direction(&self, nominal: Nominal, target: DVec2) -> Result<DVec3, TransferLimit> {
        let radius = target.length();
        if radius == 0.0 {
            return Ok(DVec3::Z);
        }
        let unturned = DVec2::from_angle(-self.rotation_rad).rotate(target);
        let start =
            nominal.direction(unturned).map_or(self.max_polar_rad, |d| Polar::of_direction(d).polar_rad);
        let (mut polar_rad, mut azimuth_rad) = (start.min(self.max_polar_rad), unturned.to_angle());
        let tolerance = INVERSE_TOLERANCE * radius.max(1.0);
        let mut at = Polar::new(polar_rad, azimuth_rad);
        let mut image = self.unit_plate(nominal, &at);
        let mut miss = target - image.place(&at);
        for _ in 0..MAX_STEPS {
            if miss.length() <= tolerance {
                break;
            }
            let (d_polar, d_around) = (image.d_polar(&at), image.d_around(&at));
            let area = d_polar.perp_dot(d_around);
            let step_polar = miss.perp_dot(d_around) / area;
            let step_around = d_polar.perp_dot(miss) / area;
            let mut share = 1.0;
            let better = loop {
                let next_polar = (polar_rad + share * step_polar).clamp(0.1 * polar_rad, self.max_polar_rad);
                let next_azimuth = azimuth_rad + share * step_around / at.sin_polar;
                let next = Polar::new(next_polar, next_azimuth);
                let next_image = self.unit_plate(nominal, &next);
                let next_miss = target - next_image.place(&next);
                if next_miss.length() < miss.length() {
                    break Some((next_polar, next_azimuth, next, next_image, next_miss));
                }
                share *= 0.5;
                if share < 1e-3 {
                    break None;
                }
            };
            let Some(next) = better else { break };
            (polar_rad, azimuth_rad, at, image, miss) = next;
        }
        // The rounding of the sums above is a few units in the last place of the radius.
        if miss.length() <= 8.0 * tolerance {
            return Ok(at.direction());
        }
        if polar_rad >= self.max_polar_rad - ANGLE_EPSILON_RAD {
            return Err(TransferLimit::BeyondMeasured { polar_rad, limit_rad: self.max_polar_rad });
        }
        Err(TransferLimit::NotConverged { steps: MAX_STEPS, residual: miss.length() })
    }
}
