//! Maps between the dome and the flat plate of a pad print.
//!
//! A pad picks the picture up from the plate and lays it on the dome. Seen from above, the plate reads like
//! the dome seen from outside; a map here says where on the dome each point of the plate lands. Three
//! nominal maps are known in closed form, see [`Nominal`]; a measured one is a nominal map with a fitted
//! [`Correction`].
//!
//! Plate coordinates are mm in the *plate* frame: origin under the pole, seen from above, x as the sensor's
//! x, y up as the sensor's y. Points of the dome are mm in the frame of the hit: the sensor frame for a hit
//! from straight above, a tilted one for others; +z is the pad's stroke, reversed.

mod correction;
pub mod fit;
pub mod measured_csv;
mod nominal;
#[cfg(test)]
mod tests;

use std::f64::consts::FRAC_PI_2;
use std::fmt;

use glam::{DVec2, DVec3};

pub use correction::Correction;
pub use nominal::Nominal;

/// How far off the sphere, relative to its radius, a point may lie and still count as being on the dome.
/// It covers the rounding of a traced ray many times over, and refuses a point of another dome.
const ON_DOME_TOLERANCE: f64 = 1e-6;

/// Slack for angles that rounding pushes past the rim, rad.
const ANGLE_EPSILON_RAD: f64 = 1e-12;

/// A map between the dome and the plate.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferMap {
    dome_radius_mm: f64,
    nominal: Nominal,
    correction: Option<Correction>,
}

/// A place on the plate with the map's slope there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlatePoint {
    /// The place, mm in the plate frame.
    pub plate_mm: DVec2,
    /// Rows of d plate / d dome, mm per mm: row 0 is the gradient of X, row 1 of Y. Both rows are tangential
    /// to the dome, so that any small step along the surface can be multiplied with them.
    pub plate_from_dome: [DVec3; 2],
}

impl TransferMap {
    /// A map for a dome of the given radius (mm), with a measured correction or without.
    ///
    /// # Errors
    /// The dome's radius is not a positive number, or the correction holds a number that is not finite,
    /// reaches further than the rim, or folds: two places of the dome would share one of the plate.
    pub fn new(
        dome_radius_mm: f64,
        nominal: Nominal,
        correction: Option<Correction>,
    ) -> Result<Self, TransferError> {
        if !(dome_radius_mm.is_finite() && dome_radius_mm > 0.0) {
            return Err(TransferError {
                field: "dome_radius_mm".into(),
                value: dome_radius_mm.to_string(),
                problem: "the dome has no such radius".into(),
                allowed: "a positive number of mm".into(),
            });
        }
        if let Some(correction) = &correction {
            correction.check(nominal)?;
        }
        Ok(Self { dome_radius_mm, nominal, correction })
    }

    /// The dome's radius, mm.
    pub fn dome_radius_mm(&self) -> f64 {
        self.dome_radius_mm
    }

    /// The map in closed form on which this one rests.
    pub fn nominal(&self) -> Nominal {
        self.nominal
    }

    /// The measured correction, if there is one.
    pub fn correction(&self) -> Option<&Correction> {
        self.correction.as_ref()
    }

    /// The polar angle to which the map holds, rad: the rim, or the end of the measurement.
    pub fn max_polar_rad(&self) -> f64 {
        self.correction.as_ref().map_or(FRAC_PI_2, |correction| correction.max_polar_rad)
    }

    /// Where on the plate the ink for this point of the dome lies.
    ///
    /// # Errors
    /// The point is not finite, does not lie on the dome, or lies beyond the map's domain.
    pub fn plate_from_dome(&self, point_mm: DVec3) -> Result<DVec2, TransferLimit> {
        let at = self.polar(point_mm)?;
        Ok(self.unit_plate(&at).place(&at) * self.dome_radius_mm + self.offset_mm())
    }

    /// Like [`Self::plate_from_dome`], with the map's slope.
    ///
    /// # Errors
    /// As for [`Self::plate_from_dome`].
    pub fn plate_from_dome_with_slope(&self, point_mm: DVec3) -> Result<PlatePoint, TransferLimit> {
        let at = self.polar(point_mm)?;
        let image = self.unit_plate(&at);
        // Unit tangents of the dome: towards the rim, and around.
        let down = DVec3::new(at.cos_polar * at.out.x, at.cos_polar * at.out.y, -at.sin_polar);
        let around = DVec3::new(-at.out.y, at.out.x, 0.0);
        let d_polar = image.d_polar(&at);
        let d_around = image.d_around(&at);
        Ok(PlatePoint {
            plate_mm: image.place(&at) * self.dome_radius_mm + self.offset_mm(),
            plate_from_dome: [down * d_polar.x + around * d_around.x, down * d_polar.y + around * d_around.y],
        })
    }

    /// Where on the dome the ink from this place of the plate lands, mm.
    ///
    /// # Errors
    /// The place is not finite, or no point of the map's domain prints from there.
    pub fn dome_from_plate(&self, plate_mm: DVec2) -> Result<DVec3, TransferLimit> {
        if !plate_mm.is_finite() {
            return Err(TransferLimit::NotFinite);
        }
        let target = (plate_mm - self.offset_mm()) / self.dome_radius_mm;
        let direction = match &self.correction {
            None => self.nominal.direction(target).ok_or(TransferLimit::BeyondDome)?,
            Some(correction) => correction.direction(self.nominal, target)?,
        };
        Ok(direction * self.dome_radius_mm)
    }

    fn offset_mm(&self) -> DVec2 {
        self.correction.as_ref().map_or(DVec2::ZERO, |correction| correction.offset_mm)
    }

    /// The map on the unit sphere, before the offset.
    fn unit_plate(&self, at: &Polar) -> UnitPlate {
        match &self.correction {
            None => {
                UnitPlate::round(self.nominal.radius_over_sin(at.polar_rad), self.nominal.slope(at.polar_rad))
            }
            Some(correction) => correction.unit_plate(self.nominal, at),
        }
    }

    fn polar(&self, point_mm: DVec3) -> Result<Polar, TransferLimit> {
        if !point_mm.is_finite() {
            return Err(TransferLimit::NotFinite);
        }
        let length_mm = point_mm.length();
        let off_mm = length_mm - self.dome_radius_mm;
        if off_mm.abs() > ON_DOME_TOLERANCE * self.dome_radius_mm {
            return Err(TransferLimit::NotOnDome { off_mm });
        }
        let at = Polar::of_direction(point_mm / length_mm);
        if at.polar_rad <= self.max_polar_rad() + ANGLE_EPSILON_RAD {
            Ok(at)
        } else if self.correction.is_some() && at.polar_rad <= FRAC_PI_2 + ANGLE_EPSILON_RAD {
            Err(TransferLimit::BeyondMeasured { polar_rad: at.polar_rad, limit_rad: self.max_polar_rad() })
        } else {
            Err(TransferLimit::BeyondDome)
        }
    }
}

/// A direction in polar form. At the pole, where no azimuth exists, `out` is +x.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Polar {
    polar_rad: f64,
    sin_polar: f64,
    cos_polar: f64,
    /// Unit vector in the base plane: (cos azimuth, sin azimuth).
    out: DVec2,
}

impl Polar {
    fn of_direction(direction: DVec3) -> Self {
        let out = direction.truncate();
        let sin_polar = out.length();
        Self {
            polar_rad: sin_polar.atan2(direction.z),
            sin_polar,
            cos_polar: direction.z,
            out: if sin_polar > 0.0 { out / sin_polar } else { DVec2::X },
        }
    }

    fn new(polar_rad: f64, azimuth_rad: f64) -> Self {
        let (sin_polar, cos_polar) = polar_rad.sin_cos();
        Self { polar_rad, sin_polar, cos_polar, out: DVec2::from_angle(azimuth_rad) }
    }

    fn direction(&self) -> DVec3 {
        (self.out * self.sin_polar).extend(self.cos_polar)
    }
}

/// A place on the plate of a unit dome as it follows from a direction: radially and sideways, each divided by
/// sin(polar angle) so that the pole is an ordinary point, with the slopes. `turn` is the plate's rotation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct UnitPlate {
    radial_over_sin: f64,
    sideways_over_sin: f64,
    d_radial_d_polar: f64,
    d_sideways_d_polar: f64,
    /// d radial / d azimuth, over sin.
    d_radial_around: f64,
    /// d sideways / d azimuth, over sin.
    d_sideways_around: f64,
    turn: DVec2,
}

impl UnitPlate {
    /// A map that is the same for every azimuth.
    fn round(radial_over_sin: f64, slope: f64) -> Self {
        Self {
            radial_over_sin,
            sideways_over_sin: 0.0,
            d_radial_d_polar: slope,
            d_sideways_d_polar: 0.0,
            d_radial_around: 0.0,
            d_sideways_around: 0.0,
            turn: DVec2::X,
        }
    }

    fn place(&self, at: &Polar) -> DVec2 {
        self.on_plate(at, self.radial_over_sin, self.sideways_over_sin) * at.sin_polar
    }

    /// Slope along a step towards the rim, per rad.
    fn d_polar(&self, at: &Polar) -> DVec2 {
        self.on_plate(at, self.d_radial_d_polar, self.d_sideways_d_polar)
    }

    /// Slope along a step around the axis, per rad of arc (already divided by sin(polar angle)).
    fn d_around(&self, at: &Polar) -> DVec2 {
        self.on_plate(
            at,
            self.d_radial_around - self.sideways_over_sin,
            self.radial_over_sin + self.d_sideways_around,
        )
    }

    fn on_plate(&self, at: &Polar, radial: f64, sideways: f64) -> DVec2 {
        self.turn.rotate(at.out * radial + at.out.perp() * sideways)
    }

    /// Area of the plate over area of the dome, with its sign: not positive means that the map folds.
    fn area_ratio(&self) -> f64 {
        self.d_radial_d_polar * (self.radial_over_sin + self.d_sideways_around)
            - self.d_sideways_d_polar * (self.d_radial_around - self.sideways_over_sin)
    }
}

/// A map that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TransferError {
    /// The field at fault, as it is called in a design's `print` section.
    pub field: String,
    /// Its value.
    pub value: String,
    /// What is wrong.
    pub problem: String,
    /// What is allowed.
    pub allowed: String,
}

impl fmt::Display for TransferError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` is {}: {}; allowed: {}", self.field, self.value, self.problem, self.allowed)
    }
}

impl std::error::Error for TransferError {}

/// Why a point has no partner on the other side of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TransferLimit {
    /// A coordinate is not a finite number.
    NotFinite,
    /// The point lies this far outside (or inside, negative) the dome's surface.
    NotOnDome {
        /// Distance from the surface, mm.
        off_mm: f64,
    },
    /// Below the rim, or off the picture of the whole dome.
    BeyondDome,
    /// Further from the pole than the measurement reaches.
    BeyondMeasured {
        /// Where the point lies, rad.
        polar_rad: f64,
        /// How far the measurement reaches, rad.
        limit_rad: f64,
    },
    /// The inverse of a measured map was not found within the allowed number of steps.
    NotConverged {
        /// Steps taken.
        steps: u32,
        /// Distance on the plate that is left, as a share of the dome's radius.
        residual: f64,
    },
}

impl TransferLimit {
    /// The limit's name in files.
    pub fn as_str(&self) -> &'static str {
        match self {
            Self::NotFinite => "not_finite",
            Self::NotOnDome { .. } => "not_on_dome",
            Self::BeyondDome => "beyond_dome",
            Self::BeyondMeasured { .. } => "beyond_measured_map",
            Self::NotConverged { .. } => "not_converged",
        }
    }
}

impl fmt::Display for TransferLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite => write!(f, "a coordinate is not a finite number"),
            Self::NotOnDome { off_mm } => write!(f, "the point is {off_mm} mm off the dome's surface"),
            Self::BeyondDome => write!(f, "the point lies beyond the dome's rim"),
            Self::BeyondMeasured { polar_rad, limit_rad } => write!(
                f,
                "polar angle {:.3} deg is beyond {:.3} deg, where the measured map ends",
                polar_rad.to_degrees(),
                limit_rad.to_degrees()
            ),
            Self::NotConverged { steps, residual } => {
                write!(f, "no inverse after {steps} steps (residual {residual:.3e} of the radius)")
            }
        }
    }
}

impl std::error::Error for TransferLimit {}
