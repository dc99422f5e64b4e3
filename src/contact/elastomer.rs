//! What touches: the dome's material and the object.

use crate::error::{ContactError, positive};
use crate::object::ContactSolid;
use domecast_elastic::ElasticDome;
use domecast_optics::DomeShape;

/// Heights of domes over the radius of their sphere: flatter ones have no elements, and higher ones are no domes.
const HEIGHTS: std::ops::RangeInclusive<f64> = 0.05..=3.0;

/// The dome as an elastic body: a solid hemisphere, cap, or hemisphere on a cylinder, bonded to the rigid sheet by its base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elastomer {
    /// Radius of the dome's sphere, mm.
    pub dome_radius_mm: f64,
    /// Height of that sphere's centre above the base, mm: 0 for a hemisphere, negative for a cap, the cylinder's height for a
    /// hemisphere on one.
    pub center_z_mm: f64,
    /// Young's modulus at small strain, MPa.
    pub young_mpa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Coulomb's coefficient of friction between membrane and object.
    pub friction: f64,
}

impl Elastomer {
    /// Whether the constants describe a solid.
    ///
    /// # Errors
    /// [`ContactError::Dimension`]: radius and modulus must be positive, the dome's height from a twentieth of the radius to
    /// three of them, Poisson's ratio from 0 to 0.4999 (beyond, the displacement alone no longer says the pressure),
    /// friction from 0 to 10.
    pub fn check(&self) -> Result<(), ContactError> {
        let radius_mm = positive("elastomer.dome_radius_mm", self.dome_radius_mm)?;
        if !HEIGHTS.contains(&(1.0 + self.center_z_mm / radius_mm)) {
            let (field, allowed) = ("elastomer.center_z_mm", "-0.95 to 2 of the dome's radius");
            return Err(ContactError::Dimension { field, value: self.center_z_mm, allowed });
        }
        positive("elastomer.young_mpa", self.young_mpa)?;
        poisson("elastomer.poisson", self.poisson)?;
        if !(0.0..=10.0).contains(&self.friction) {
            let allowed = "0 to 10";
            return Err(ContactError::Dimension {
                field: "elastomer.friction",
                value: self.friction,
                allowed,
            });
        }
        Ok(())
    }

    /// The dome's face.
    pub fn dome(&self) -> DomeShape {
        DomeShape::new(self.dome_radius_mm, self.center_z_mm)
    }

    /// The dome as a linear elastic body.
    pub fn elastic(&self) -> ElasticDome {
        ElasticDome { dome: self.dome(), young_mpa: self.young_mpa, poisson: self.poisson }
    }

    /// What depths are measured by: the radius, or the height of a cap, mm.
    pub fn depth_scale_mm(&self) -> f64 {
        self.dome_radius_mm + self.center_z_mm.min(0.0)
    }

    /// Shear modulus, MPa.
    pub fn shear_mpa(&self) -> f64 {
        0.5 * self.young_mpa / (1.0 + self.poisson)
    }

    /// Plane-strain modulus E / (1 - nu^2), MPa.
    pub fn plane_strain_mpa(&self) -> f64 {
        self.young_mpa / (1.0 - self.poisson * self.poisson)
    }
}

fn poisson(field: &'static str, value: f64) -> Result<(), ContactError> {
    if (0.0..=0.4999).contains(&value) {
        Ok(())
    } else {
        Err(ContactError::Dimension { field, value, allowed: "0 to 0.4999" })
    }
}

/// An object that is pressed against the dome.
#[derive(Debug, Clone, PartialEq)]
pub struct Indenter {
    /// Its shape.
    pub solid: ContactSolid,
    /// Its Young's modulus, MPa; `None`: rigid.
    pub young_mpa: Option<f64>,
    /// Its Poisson's ratio; without meaning for a rigid object.
    pub poisson: f64,
}

impl Indenter {
    /// A rigid object.
    pub fn rigid(solid: ContactSolid) -> Self {
        Self { solid, young_mpa: None, poisson: 0.3 }
    }

    /// Whether the constants describe a solid.
    ///
    /// # Errors
    /// [`ContactError::Dimension`].
    pub fn check(&self) -> Result<(), ContactError> {
        if let Some(young_mpa) = self.young_mpa {
            positive("object.young_mpa", young_mpa)?;
            poisson("object.poisson", self.poisson)?;
        }
        Ok(())
    }

    /// How much the object yields where the dome yields 1: the ratio of the plane-strain moduli, 0 if rigid.
    ///
    /// Both surfaces bear the same pressure, and near the contact both are half-spaces, so the gap closes by
    /// 1 + this ratio times what the dome alone would yield (Hertz' combined modulus, K. L. Johnson, Contact
    /// Mechanics, 1985, eq. 4.20), and by what the dome's base holds back of its own part alone.
    pub fn yield_ratio(&self, elastomer: &Elastomer) -> f64 {
        self.young_mpa.map_or(0.0, |young_mpa| {
            elastomer.plane_strain_mpa() * (1.0 - self.poisson * self.poisson) / young_mpa
        })
    }
}
