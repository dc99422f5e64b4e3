//! A map between the dome and the plate: nominal, or nominal with a measured correction.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, DVec3};

use super::correction::Correction;
use super::limit::{TransferError, TransferLimit};
use super::nominal::{ANGLE_EPSILON_RAD, Nominal};
use super::polar::{Polar, UnitPlate};

/// How far off the sphere, relative to its radius, a point may lie and still count as being on the dome.
/// It covers the rounding of a traced ray many times over, and refuses a point of another dome.
const ON_DOME_TOLERANCE: f64 = 1e-6;

/// A map between the dome and the plate. Points of the dome are about the centre of its sphere.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferMap {
    dome_radius_mm: f64,
    nominal: Nominal,
    correction: Option<Correction>,
    end_rad: f64,
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
        Ok(Self { dome_radius_mm, nominal, correction, end_rad: FRAC_PI_2 })
    }

    /// The same map for a dome whose sphere ends at a polar angle of its own.
    pub fn up_to(self, end_rad: f64) -> Self {
        Self { end_rad: end_rad.min(FRAC_PI_2), ..self }
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
        self.correction.as_ref().map_or(self.end_rad, |correction| correction.max_polar_rad.min(self.end_rad))
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
        } else if self.correction.is_some() && at.polar_rad <= self.end_rad + ANGLE_EPSILON_RAD {
            Err(TransferLimit::BeyondMeasured { polar_rad: at.polar_rad, limit_rad: self.max_polar_rad() })
        } else {
            Err(TransferLimit::BeyondDome)
        }
    }
}
